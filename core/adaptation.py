"""Finer cells where the light breaks: at shadow edges, and where one object stands on another.

A linear element shows a smooth change of light for nothing, but a step only by being small. So cells that a shadow
boundary or a contact crosses are split into four, those with the largest squared error first, until the rest no longer
matters or there are as many as allowed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .direct.illumination import DirectLight
from .gather import Points, gather_direct, gather_indirect
from .parallel import Workers
from .receivers import Receivers, split_cells
from .sampling import stream
from .scene import Bool, Float64
from .survey import Surroundings, inside_solid
from .tessellation import Int64

#: How often a cell is split into four at most.
LEVELS = 3
#: Points of a cell that tell whether a boundary crosses it; rays of each to tell whether it is inside a solid, and to a
#: lamp with size.
_POINTS, _RAYS, _SHADOW_RAYS = 4, 8, 4
#: Standard deviations by which the largest and the smallest of some points must differ to mean a jump.
_SIGNIFICANT = 4.0
#: Numbers of streams that no pass of the survey uses.
_FIRST_STREAM = 2_000_000


@dataclass(frozen=True, eq=False)
class _Probe:
    """What some points of some cells see, (points, n): the set of lights, grey irradiance and its variance, and whether
    the point is hidden."""

    signature: Int64
    direct: Float64
    variance: Float64
    hidden: Bool

    def crossed(self) -> Bool:
        """(n,) cells whose points do not all see the same."""
        differs = (self.signature < 0).any(axis=0) | (np.ptp(self.signature, axis=0) > 0)
        return np.asarray(differs | (np.ptp(self.hidden.astype(np.int8), axis=0) > 0))

    def step(self, mean: float) -> Float64:
        """(n,) how far the light jumps inside each cell, beyond what noise does; at a contact by as much as is common."""
        contact = np.ptp(self.hidden.astype(np.int8), axis=0) > 0
        jump = np.ptp(self.direct, axis=0) - _SIGNIFICANT * np.sqrt(self.variance.mean(axis=0))
        return np.maximum(jump, np.where(contact, mean, 0.0))


class Adaptation:
    """Splits the cells of receivers; limit: how many there may be; error: relative, that the boundaries may bring."""

    def __init__(
        self,
        direct_light: DirectLight,
        around: Surroundings | None,
        limit: int,
        error: float,
        seed: int,
        workers: Workers,
    ) -> None:
        self._light = direct_light
        self._around = around and replace(
            around, hemispheres=around.hemispheres.with_rays(_RAYS, stream(seed, "contact patterns"))
        )
        self._limit = limit
        self._error = error
        self._seed = seed
        self._workers = workers

    def refine(self, receivers: Receivers) -> Receivers:
        """The receivers with finer cells along the boundaries."""
        every = np.arange(len(receivers.cells))
        first = self._probe(receivers, every, 0, 1)
        mean = float(receivers.cells.area @ first.direct[0] / receivers.cells.area.sum())
        # Boundaries may be short: what a cell contributes to the squared error of all is compared with its fair share.
        fair = (7.0 * self._error * mean) ** 2 * receivers.cells.area.sum() / len(every)
        fresh = _on_borders(receivers, first)
        for level in range(LEVELS):
            if not len(fresh):
                break
            probe = self._probe(receivers, fresh, 1 + level, _POINTS)
            weight = np.where(probe.crossed(), probe.step(mean) ** 2 * receivers.cells.area[fresh], 0.0)
            # A split cell becomes four, and makes its neighbours become two or three.
            most = max((self._limit - len(receivers.cells)) // 5, 0)
            chosen = fresh[np.argsort(-weight, kind="stable")[: min(most, int(np.count_nonzero(weight > fair)))]]
            if not len(chosen):
                break
            split = np.zeros(len(receivers.cells), dtype=bool)
            split[chosen] = True
            receivers, source = split_cells(receivers, split)
            fresh = np.flatnonzero(split[source])
        return receivers

    def _probe(self, receivers: Receivers, chosen: Int64, number: int, count: int) -> _Probe:
        shift = stream(self._seed, f"adaptation {number}").random((len(receivers.cells), 2))
        seen = []
        for k in range(count):
            points = Points(receivers.cells, chosen, k, shift)
            streams = _FIRST_STREAM + 100 * number + k
            light = gather_direct(points, self._light, _SHADOW_RAYS, self._seed, streams, self._workers)
            direct = light.irradiance.mean(axis=1)
            hidden = np.zeros(len(chosen), dtype=bool)
            if self._around is not None:
                arriving, _, enclosed = gather_indirect(
                    points, self._around.hemispheres, self._around.tables[0], self._seed, streams, self._workers
                )
                hidden = inside_solid(enclosed, arriving[:, :-1] @ self._around.to_grey, direct)
            variance = np.sqrt(light.variance).mean(axis=1) ** 2
            seen.append((light.signature, direct, variance, hidden))
        return _Probe(*(np.stack(s) for s in zip(*seen, strict=True)))


def _on_borders(receivers: Receivers, probe: _Probe) -> Int64:
    """Cells (n,) that see some light in part, or share a vertex with a cell that sees other lights or is hidden."""
    corner = receivers.corner_vertex[receivers.cells.element]
    # Hidden cells are dark as well, so a number of their own tells them from cells in shadow.
    seen = np.where(probe.hidden[0], np.iinfo(np.int64).max, probe.signature[0])
    low = np.full(receivers.vertices, np.iinfo(np.int64).max)
    high = np.full(receivers.vertices, np.iinfo(np.int64).min)
    for k in range(3):
        np.minimum.at(low, corner[:, k], seen)
        np.maximum.at(high, corner[:, k], seen)
    return np.flatnonzero(((low < 0) | (low != high))[corner].any(axis=1))
