"""Finer cells where one object stands on another, so that what is hidden does not blur what is seen beside it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .direct.illumination import DirectLight
from .gather import Points, gather_direct, gather_indirect
from .parallel import Workers
from .receivers import Receivers, split_cells
from .sampling import stream
from .scene import Bool
from .survey import Surroundings, inside_solid
from .tessellation import Int64

#: How often cells at a contact are split into four.
LEVELS = 3
#: Rays that tell whether a point is inside a solid.
_RAYS = 8
#: Numbers of streams that no pass of the survey uses.
_FIRST_STREAM = 2_000_000


def refine_contacts(
    receivers: Receivers, around: Surroundings | None, direct_light: DirectLight, seed: int, workers: Workers
) -> Receivers:
    """Split the cells in which, or next to which, the open surface ends and the inside of a solid begins."""
    if around is None:
        return receivers
    around = replace(around, hemispheres=around.hemispheres.with_rays(_RAYS, stream(seed, "contact patterns")))
    hidden = np.zeros(len(receivers.cells), dtype=bool)
    fresh = np.arange(len(hidden))
    for level in range(LEVELS):
        hidden[fresh] = _hidden(receivers, fresh, around, direct_light, seed, _FIRST_STREAM + level, workers)
        border = _border(receivers, hidden)
        if not border.any():
            break
        receivers, source = split_cells(receivers, border)
        hidden = hidden[source]
        fresh = np.flatnonzero(border[source])
    return receivers


def _hidden(
    receivers: Receivers,
    chosen: Int64,
    around: Surroundings,
    direct_light: DirectLight,
    seed: int,
    number: int,
    workers: Workers,
) -> Bool:
    """Whether a point of each chosen cell lies inside a solid."""
    shift = stream(seed, f"contacts {number}").random((len(receivers.cells), 2))
    points = Points(receivers.cells, chosen, 0, shift)
    arriving, _, enclosed = gather_indirect(points, around.hemispheres, around.tables[0], seed, number, workers)
    direct = np.zeros(len(chosen))
    suspects = np.flatnonzero(enclosed)
    if len(suspects):
        near = Points(receivers.cells, chosen[suspects], 0, shift)
        direct[suspects] = gather_direct(near, direct_light, 2, seed, number, workers).irradiance.mean(axis=1)
    return inside_solid(enclosed, arriving[:, :-1] @ around.to_grey, direct)


def _border(receivers: Receivers, hidden: Bool) -> Bool:
    """Cells (c,) that share a vertex with both hidden and open cells."""
    corner = receivers.corner_vertex[receivers.cells.element].ravel()
    around = np.bincount(corner, minlength=receivers.vertices)
    inside = np.bincount(corner, np.repeat(hidden, 3), receivers.vertices)
    mixed = (inside > 0) & (inside < around)
    return np.asarray(mixed[corner.reshape(-1, 3)].any(axis=1))
