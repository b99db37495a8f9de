"""How many more samples of indirect light, and where, hide its noise best.

An error counts by its square all over the surface, but an eye sees it against the light around it: blotches that nobody
notices on a lit wall are the first thing to be seen on a dark one. What a display shows goes about as the square root
of the light, so a step dL shows as dL / sqrt(L), and a variance as itself over the light.
"""

from __future__ import annotations

import numpy as np

from .reconstruction import Fit
from .scene import Float64
from .tessellation import Int64

#: How many times as many samples as usual a cell gets at most.
_MOST = 16.0
#: What gets less than this share of the mean light is no darker to the eye.
_BLACK = 1e-3
#: How often the number of samples is halved in on: even from a factor of 1e20 to one of 1.0001.
_BISECTIONS = 20


def samples_wanted(fit: Fit, usual: int, more: float, area: Float64, noise: Float64, light: Float64) -> Int64:
    """How many samples (c,), an even number, each cell should have where the usual number leaves some noise, if there
    are so many times as many as usual more to be had in all.

    Noise shows least in all where the number of samples goes as the root of area times noise over light (Neyman 1934):
    a large triangle needs more than a small one. area (c,) of the cells, as far as they are in sight; noise (c,):
    squared error of the fitted irradiance; light (c,): the irradiance. What colour a surface has is left aside.
    """
    around = _nearby(fit, area, np.ones_like(area))
    bright = np.maximum(_nearby(fit, area, light), _BLACK * around * float(area @ light) / (float(area.sum()) or 1.0))
    shown = np.divide(_nearby(fit, area, noise), bright, out=np.zeros_like(area), where=bright > 0.0)
    share = np.sqrt(area * shown)
    if not share.any():
        return np.full(len(area), usual)
    least, most = 1.0 / share.max(), _MOST / share[share > 0.0].min()
    for _ in range(_BISECTIONS):
        middle = np.sqrt(least * most)
        if float(np.clip(middle * share, 1.0, _MOST).mean()) > 1.0 + more:
            most = middle
        else:
            least = middle
    # Rounded so that the parts that are left over are samples of every so many cells.
    pairs = np.cumsum(usual / 2.0 * np.clip(least * share, 1.0, _MOST))
    return 2 * np.diff(np.floor(pairs + 0.5), prepend=0.0).astype(np.int64)


def _nearby(fit: Fit, area: Float64, values: Float64) -> Float64:
    """Sums (c,) of values (c,) times area around each cell."""
    return np.asarray(fit.at_corners(fit.nearby(area * values)).mean(axis=1))
