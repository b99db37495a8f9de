"""Finer cells where one object stands on another, so that what is hidden does not blur what is seen beside it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .direct.illumination import DirectLight
from .gather import Points, gather_direct, gather_indirect
from .parallel import Workers
from .receivers import Receivers, split_cells
from .sampling import stream
from .scene import Bool, Float64
from .survey import Surroundings, inside_solid
from .tessellation import Int64

#: How often cells at a contact are split into four.
LEVELS = 3
#: Points of a cell that tell whether it is partly hidden.
_POINTS = 6
#: Rays that tell whether a point is inside a solid.
_RAYS = 8
#: Numbers of streams that no pass of the survey uses.
_FIRST_STREAM = 2_000_000


def refine_contacts(
    receivers: Receivers, around: Surroundings | None, direct_light: DirectLight, seed: int, workers: Workers
) -> Receivers:
    """Split the cells in which the open surface ends and the inside of a solid begins."""
    if around is None:
        return receivers
    around = replace(around, hemispheres=around.hemispheres.with_rays(_RAYS, stream(seed, "contact patterns")))

    def hidden_share(chosen: Int64, number: int, points: int) -> Float64:
        """Share (n,) of some points of each chosen cell that lie inside a solid."""
        shift = stream(seed, f"contacts {number}").random((len(receivers.cells), 2))
        streams = _FIRST_STREAM + 100 * number
        hidden = [
            _hidden(Points(receivers.cells, chosen, k, shift), around, direct_light, seed, streams + k, workers)
            for k in range(points)
        ]
        return np.mean(hidden, axis=0)

    fresh = _border(receivers, hidden_share(np.arange(len(receivers.cells)), 0, 1) > 0)
    for level in range(LEVELS):
        share = hidden_share(fresh, 1 + level, _POINTS)
        crossed = np.zeros(len(receivers.cells), dtype=bool)
        crossed[fresh[(share > 0) & (share < 1)]] = True
        if not crossed.any():
            break
        receivers, source = split_cells(receivers, crossed)
        fresh = np.flatnonzero(crossed[source])
    return receivers


def _hidden(
    points: Points, around: Surroundings, direct_light: DirectLight, seed: int, number: int, workers: Workers
) -> Bool:
    """Points (n,) inside a solid; direct light is looked at only where the rays leave a doubt."""
    arriving, _, enclosed = gather_indirect(points, around.hemispheres, around.tables[0], seed, number, workers)
    direct = np.zeros(len(enclosed))
    suspects = np.flatnonzero(enclosed)
    if len(suspects):
        direct[suspects] = gather_direct(points.at(suspects), direct_light, 2, seed, number, workers).irradiance.mean(
            axis=1
        )
    return inside_solid(enclosed, arriving[:, :-1] @ around.to_grey, direct)


def _border(receivers: Receivers, hidden: Bool) -> Int64:
    """Cells (n,) that share a vertex with both hidden and open cells (c,)."""
    corner = receivers.corner_vertex[receivers.cells.element].ravel()
    around = np.bincount(corner, minlength=receivers.vertices)
    inside = np.bincount(corner, np.repeat(hidden, 3), receivers.vertices)
    mixed = (inside > 0) & (inside < around)
    return np.flatnonzero(mixed[corner.reshape(-1, 3)].any(axis=1))
