"""Light from a round source: a sphere, or a disc that faces the receiver, is a cap on the receiver's sky.

J. M. Snyder, Area light sources for real-time graphics (1996); S. Lagarde and C. de Rousiers, Moving Frostbite to
physically based rendering (2014), listing 10. Rewritten without quotients, so that neither a tiny cap nor one that
fills half the sky needs a case of its own.
"""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Real = TypeVar("Real", np.float32, np.float64)


def cap_irradiance(cos_center: NDArray[Real], sin_half_angle: NDArray[Real]) -> NDArray[Real]:
    """Form factor from surface elements to spherical caps: irradiance / (pi * radiance), 0 to 1.

    cos_center (n,): cosine between the receiver's normal and the way to the cap's centre. sin_half_angle (n,): radius
    over distance for a sphere; over 1 the receiver is inside the sphere and sees nothing else: 1. What the horizon
    hides of the cap is left out exactly. Same dtype as given; the cut cap, whose terms cancel to the third order of
    its size, is computed in float64.
    """
    cosine, sine = np.broadcast_arrays(cos_center, sin_half_angle)
    result = np.where(cosine > 0, sine * sine * cosine, np.zeros_like(cosine))
    cut = (np.abs(cosine) < sine) & (sine <= 1)
    c, s = cosine[cut].astype(np.float64), sine[cut].astype(np.float64)
    rise = np.sqrt((s - c) * (s + c))
    half_cosine = np.sqrt((1.0 - s) * (1.0 + s))
    above = s * s * c * np.arctan2(rise, -half_cosine * c) - half_cosine * rise + np.arctan2(rise, half_cosine)
    result[cut] = np.maximum(above / np.pi, 0.0)
    result[sine > 1] = 1
    return result
