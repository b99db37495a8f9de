"""How harsh light is: by how much what comes straight from its sources differs within the triangles of a start.

Sunlight through leaves falls in patches that are a hundred times as bright as the room around them. No number of coarse
triangles shows those, so such a scene takes all that there are to be had, where an evenly lit one takes few.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .direct.illumination import DirectLight, Source
from .pilot import Pilot
from .sampling import stream

#: Pairs of points that are looked at: at most, at least, and those of all sources together.
_MOST, _FEWEST, _TOGETHER = 1024, 256, 1 << 14
#: How many cells there are of the size over which light is compared.
_CELLS = 750
#: Shadow rays to a source with size.
_RAYS = 4


@dataclass(frozen=True)
class Contrast:
    """light: the standard deviation of irradiance within cells, relative to the mean of that and other light; crossed:
    the share of cells in which not all points have the same sources in sight."""

    light: float
    crossed: float


def contrast(pilot: Pilot, lights: Sequence[Source], asked: int, other: float) -> Contrast:
    """Of the direct light on the receivers, beside other irradiance, W/m^2; of many sources `asked` are asked at each
    point.

    Half the mean square of the difference between two points of a cell is the variance within it (the variogram of
    Matheron 1963), from which the variance of what rays tell is taken.
    """
    if not lights or not float(pilot.receiving_areas.sum()) > 0.0:
        return Contrast(0.0, 0.0)
    rng = stream(0, "contrast")
    one, another, normals = pilot.pairs_on_receivers(
        int(np.clip(_TOGETHER // len(lights), _FEWEST, _MOST)), _CELLS, rng
    )
    direct = DirectLight(lights, pilot.visibility, 0, asked)
    facing = np.tile(normals, (2, 1))
    light = direct.at(np.concatenate([one, another]), facing, facing, _RAYS, rng)
    grey = light.grey.reshape(2, -1)
    # All channels have the same noise.
    noise = float(np.mean(np.sqrt(light.variance).mean(axis=1) ** 2))
    variance = float(np.mean((grey[0] - grey[1]) ** 2)) / 2.0 - noise
    mean = float(grey.mean()) + other
    sees = light.signature.reshape(2, -1)
    crossed = float(np.mean(sees[0] != sees[1]))
    return Contrast(float(np.sqrt(max(variance, 0.0))) / mean if mean > 0.0 else 0.0, crossed)
