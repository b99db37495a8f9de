"""Where noise would show, and how many samples of indirect light hide it.

An error counts by its square all over the surface, but an eye sees it against the light around it: blotches that nobody
notices on a lit wall are the first thing to be seen on a dark one. What a display shows goes about as the square root
of the light, so a step dL shows as dL / sqrt(L), and noise is even to the eye where its variance is in proportion to
the light.
"""

from __future__ import annotations

import numpy as np

from .reconstruction import Fit
from .scene import Float64
from .tessellation import Int64

#: How many times as many samples as usual a cell gets at most; and all cells together, beside those they have.
_MOST, _MOST_TOGETHER = 16.0, 0.5
#: By how much fewer are tried, if those were too many.
_STEP = 1.25


def samples_wanted(fit: Fit, usual: int, area: Float64, noise: Float64, light: Float64) -> Int64:
    """How many samples (c,), an even number, each cell should have where the usual number leaves some noise, so that it
    shows no more there than elsewhere.

    area (c,) of the cells; noise (c,): squared error of the fitted light; light (c,): how bright it is.
    """
    shown = fit.at_corners(fit.nearby(area * noise)).mean(axis=1) * float(area @ light)
    fair = fit.at_corners(fit.nearby(area * light)).mean(axis=1) * float(area @ noise)
    share = np.divide(shown, fair, out=np.zeros_like(shown), where=fair > 0.0)
    while True:
        wanted = 2 * np.rint(usual * np.clip(share, 1.0, _MOST) / 2.0).astype(np.int64)
        if float(wanted.mean()) <= (1.0 + _MOST_TOGETHER) * usual:
            return wanted
        share = share / _STEP
