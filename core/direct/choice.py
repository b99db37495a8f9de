"""Which of many lights to ask for at a point: the brightest surely, the others by chance in proportion to their light.

P. Shirley, C. Wang, K. Zimmerman, Monte Carlo techniques for direct lighting calculations (1996), section 4; drawn by
systematic sampling (W. Madow 1949), which fixes how many are asked.
"""

from __future__ import annotations

import numpy as np

from ..scene import Bool, Float64


def chances(light: Float64, count: int) -> Float64:
    """Chance (l, n) that each of l lights is asked at each of n points, so that `count` are: 1 for those that bring
    more than their share of what is left, and in proportion to light (l, n) >= 0 for the others."""
    sure = (light > 0) & (np.count_nonzero(light, axis=0) <= count)
    while True:
        left = count - sure.sum(axis=0)
        rest = np.where(sure, 0.0, light).sum(axis=0)
        # A hair of slack: what is proportional to all of one should be all of it, whatever the rounding.
        more = ~sure & (light * left >= rest * (1 - 1e-9)) & (light > 0)
        if not more.any():
            break
        sure |= more
    return np.where(sure, 1.0, light * np.divide(left, rest, out=np.zeros_like(rest), where=rest > 0))


def draw(chance: Float64, start: Float64) -> Bool:
    """Which lights (h, l, n) are asked h times over, by their chances (l, n): evenly spread over the sum of these,
    beginning at start (h, n) in 0..1."""
    steps = np.floor(np.cumsum(chance, axis=0) + start[:, None])
    drawn = np.empty(steps.shape, dtype=bool)
    drawn[:, 0] = steps[:, 0] > 0
    np.greater(steps[:, 1:], steps[:, :-1], out=drawn[:, 1:])
    return drawn
