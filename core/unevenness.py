"""How uneven the light of the lamps is where nothing is in its way: pools of it call for small triangles.

Linear elements are off by the second derivatives D2 of the light L, times their area. Where triangles are as small as
light calls for, a mean squared error e^2 takes a number of them in proportion to (mean of |D2 L|^(2/3))^(3/2) A / e, on
an area A: minimise the sum of |D2 L|^2 h^6 over triangles as wide as h for a given sum of h^-2 over the area.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from .direct.lamps import Light, place
from .pilot import Pilot
from .sampling import stream
from .scene import Float64, Lamp, SunLamp

#: Points where light is looked at: at most, at least, and those of all lamps together.
_MOST, _FEWEST, _TOGETHER = 1024, 64, 1 << 15
#: How many cells there are of the size over which it is looked at.
_CELLS = 750


def unevenness(pilot: Pilot, lamps: Iterable[Lamp], other: float) -> float:
    """(mean of |D2 L|^(2/3))^(3/2) A / 2 over the receivers of the light L of lamps but suns, relative to the mean
    of that and other light, W/m^2: a number. 0 where there is none.

    D2 L is taken along one direction at random at each of a thousand points, on triangles as flat as they are.
    """
    lights = [place(lamp, pilot.space) for lamp in lamps if not isinstance(lamp, SunLamp)]
    area = float(pilot.receiving_areas.sum())
    if not lights or area == 0.0:
        return 0.0
    rng = stream(0, "unevenness")
    points, normals = pilot.on_receivers(int(np.clip(_TOGETHER // len(lights), _FEWEST, _MOST)), rng)
    along = np.cross(normals, rng.standard_normal(normals.shape))
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), np.finfo(float).tiny)
    step = np.sqrt(area / _CELLS / 2.0) * along
    three, facing = np.concatenate([points - step, points, points + step]), np.tile(normals, (3, 1))
    total = np.sum([_irradiance(light, three, facing) for light in lights], axis=0)
    before, here, after = np.split(total, 3)
    bends, mean = np.abs(before + after - 2.0 * here), float(here.mean())
    return _CELLS * float(np.mean(bends ** (2 / 3))) ** 1.5 / (mean + other) if mean > 0.0 else 0.0


def _irradiance(light: Light, points: Float64, normals: Float64) -> Float64:
    """(n,) W/m^2 at points (n, 3) with normals (n, 3) if nothing is in the way, as dim all over the lamp as a place in
    the middle of it is."""
    evenly = light.share(points, normals) * light.color.mean()
    single = points.T.astype(np.float32)
    gain = light.gain(single, light.aim(single, np.full((2, 1, len(points)), 0.5, dtype=np.float32)))
    return np.asarray(evenly if gain is None else evenly * gain.reshape(-1, len(points)).mean(axis=0))
