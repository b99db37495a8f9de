"""Which cells to split into four: those of the largest error, while there is room."""

from __future__ import annotations

import numpy as np

from .scene import Float64
from .tessellation import Int64

#: A split cell becomes four, and makes its neighbours become two or three.
MORE = 5


def over_fair_share(weight: Float64, fair: float, room: int) -> Int64:
    """Those of largest weight (n,) that weigh more than a fair share each, and add about `room` cells at most."""
    return _largest(weight, room)[: np.count_nonzero(weight > fair)]


def until_allowed(weight: Float64, allowed: float, room: int) -> Int64:
    """Those of largest weight (n,) without which the others weigh no more in all than is allowed; they add about `room`
    cells at most."""
    if weight.sum() <= allowed:
        return np.zeros(0, dtype=np.int64)
    largest = _largest(weight, room)
    left = np.maximum(weight, 0.0).sum() - np.cumsum(weight[largest])
    return largest[: np.count_nonzero(left > allowed) + 1]


def _largest(weight: Float64, room: int) -> Int64:
    """Those of positive weight, the largest first, as many as there is room for."""
    count = min(max(room // MORE, 0), int(np.count_nonzero(weight > 0.0)))
    return np.argsort(-weight, kind="stable")[:count]
