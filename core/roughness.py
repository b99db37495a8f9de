"""How many triangles the light of the lamps calls for, where nothing is in its way.

Linear elements are off by the second derivatives of the light, times their area. Where triangles get as small as light
calls for, an error e takes a number of them in proportion to (integral of |D2 L|^(2/3) dA)^(3/2) / e: minimise the sum
of |D2 L|^2 h^4 for a given sum of h^-2.
"""

from __future__ import annotations

import numpy as np

from .direct.lamps import place
from .pilot import Pilot
from .sampling import stream
from .scene import Float64

#: Points where light is looked at, and how many cells there are of the size over which.
_POINTS, _CELLS = 1024, 750


def roughness(pilot: Pilot, other: float) -> float:
    """(Integral of |D2 L|^(2/3) dA)^(3/2) over the receivers of the light L of all lamps, relative to the mean of that
    and other light, W/m^2; 0 where there is none."""
    rng, space = stream(0, "roughness"), pilot.patches.space
    lights = [place(lamp, space) for lamp in pilot.scene.lamps]
    points, normals = pilot.on_receivers(_POINTS, rng)
    along = np.cross(normals, rng.standard_normal(normals.shape))
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), np.finfo(float).tiny)
    step = np.sqrt(pilot.receiving_area / _CELLS / 2.0) * along

    def irradiance(at: Float64) -> Float64:
        return np.asarray(sum((light.share(at, normals) * light.color.mean() for light in lights), np.zeros(len(at))))

    before, here, after = (irradiance(points + turn * step) for turn in (-1.0, 0.0, 1.0))
    bends, mean = np.abs(before + after - 2.0 * here), float(here.mean())
    return _CELLS * float(np.mean(bends ** (2 / 3))) ** 1.5 / (mean + other) if mean > 0.0 else 0.0
