"""Finer cells where the light breaks: at shadow edges, and where one object stands on another.

A linear element shows a smooth change of light for nothing, but a step only by being small. So cells that a shadow
boundary or a contact crosses are split into four, those with the largest squared error first, until the rest no longer
matters or there are as many as allowed.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .direct.illumination import DirectLight
from .gather import Points, gather_direct
from .parallel import Workers
from .patches import Cells
from .receivers import Receivers, split_cells
from .sampling import stream
from .scene import Bool, Float64
from .splitting import until_allowed
from .survey import GAP, Surroundings, out_of_sight
from .tessellation import Int64

#: How often a cell is split into four at most.
LEVELS = 4
#: How far light may jump inside a cell before anyone looks more closely, relative to the mean and to the error asked
#: for: few cells are crossed, and what the fit leaves of a jump is a fraction of it.
_BOUNDARY_STEP = 12.0
#: Share of a jump, squared, that samples of a cell leave uncertain; and of the asked error, squared, that may be left.
_LEFT_OF_STEP, _SHARE = 1 / 12, 1 / 4
#: Points of a cell that tell whether a boundary crosses it; rays of each to tell whether it is inside a solid, and to a
#: lamp with size.
_POINTS, _RAYS, _SHADOW_RAYS = 4, 8, 4
#: About how many points tell the mean light.
_MEAN_POINTS = 4096
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
        return np.asarray(differs | self.contact())

    def contact(self) -> Bool:
        """(n,) cells that are partly hidden."""
        return np.asarray(self.hidden.any(axis=0) & ~self.hidden.all(axis=0))

    def step(self, mean: float) -> Float64:
        """(n,) how far light jumps inside each cell, beyond what noise does; at a contact by as much as is common."""
        jump = np.ptp(self.direct, axis=0) - _SIGNIFICANT * np.sqrt(self.variance.mean(axis=0))
        return np.maximum(jump, np.where(self.contact(), mean, 0.0))


class Adaptation:
    """Splits triangles along the boundaries of light; without surroundings only shadows are looked for. rays: cast so
    far, by purpose."""

    def __init__(self, direct_light: DirectLight, around: Surroundings | None, seed: int, workers: Workers) -> None:
        self._light = direct_light
        self._around = around and around.with_rays(_RAYS, stream(seed, "contact patterns"))
        self._seed = seed
        self._workers = workers
        self._mean = 0.0
        self.rays: Counter[str] = Counter()

    def refine_receivers(self, receivers: Receivers, limit: int, error: float) -> Receivers:
        """The receivers with at most `limit` cells, finer along boundaries, which then bring about `error` in all."""
        every = np.arange(len(receivers.cells))
        area = receivers.cells.area
        first = self._probe(receivers.cells, every, 0, 1, every >= 0)
        mean = float(area @ first.direct[0] / area.sum())
        allowed = (error * mean) ** 2 * float(area.sum())
        fresh = _on_borders(receivers, first, _BOUNDARY_STEP**2 * allowed / len(area))
        hidden, allowed = first.hidden[0], allowed * _SHARE / _LEFT_OF_STEP
        for level in range(LEVELS):
            near = _touching(receivers, hidden)
            split, contact = self._worst(receivers.cells, fresh, level + 1, mean, allowed, limit, near)
            if not split.any():
                break
            # What is hidden beside a contact must not be coarse either: light would reach far into it.
            split |= hidden & _touching(receivers, contact)
            # A boundary that points have missed in one cell shows in its neighbours, so these are looked at again.
            doubtful = _touching(receivers, split)
            receivers, source = split_cells(receivers, split)
            fresh, hidden = np.flatnonzero(doubtful[source]), hidden[source]
        return receivers

    def _worst(
        self, cells: Cells, fresh: Int64, number: int, mean: float, allowed: float, limit: int, near: Bool
    ) -> tuple[Bool, Bool]:
        """Which cells (c,) to split: of the fresh ones those with the largest squared jumps, until what is left is
        allowed or there is no room; and which of them a contact crosses. near (c,): cells where there may be one."""
        split, contact = np.zeros((2, len(cells)), dtype=bool)
        if len(fresh):
            probe = self._probe(cells, fresh, number, _POINTS, near[fresh])
            weight = np.where(probe.crossed(), probe.step(mean) ** 2 * cells.area[fresh], 0.0)
            split[fresh[until_allowed(weight, allowed, limit - len(cells))]] = True
            contact[fresh[probe.contact()]] = True
        return split, split & contact

    def _probe(self, cells: Cells, chosen: Int64, number: int, count: int, near: Bool) -> _Probe:
        """What `count` points of each chosen cell see; near (n,): where they may be inside a solid."""
        shift = stream(self._seed, f"adaptation {number}").random((len(cells), 2))
        seen = []
        for k in range(count):
            points = Points.of_pass(cells, chosen, k, shift)
            streams = _FIRST_STREAM + 100 * number + k
            light = gather_direct(points, self._light, _SHADOW_RAYS, self._seed, streams, self._workers)
            self.rays += light.rays
            direct = light.grey
            hidden = np.zeros(len(chosen), dtype=bool)
            if self._around is not None:
                if number == 0:
                    some = slice(None, None, max(len(chosen) // _MEAN_POINTS, 1))
                    total, _ = self._look(self._around, streams, Points.of_pass(cells, chosen[some], k, shift))
                    self._mean = float(direct.mean() + total.mean())
                # Where the sources shine nothing is hidden.
                unlit = np.flatnonzero(near & (direct <= 0))
                unlit = unlit[self._beneath(self._around, points.only(unlit))]
                if len(unlit):
                    there = Points.of_pass(cells, chosen[unlit], k, shift)
                    total, enclosed = self._look(self._around, streams, there)
                    seen_light = partial(self._seen, self._around, 100_000_000 + streams)
                    hidden[unlit] = out_of_sight(
                        there, self._around, enclosed, total, direct[unlit], self._mean, seen_light
                    )
            variance = np.sqrt(light.variance).mean(axis=1) ** 2
            seen.append((light.signature, direct, variance, hidden))
        return _Probe(*(np.stack(s) for s in zip(*seen, strict=True)))

    def _beneath(self, around: Surroundings, points: Points) -> Bool:
        """Which of the points (n,) may be inside a solid or a gap: from the others nobody need look around."""
        self.rays["contact"] += 2 * len(points.size)
        return around.hemispheres.beneath(points.positions, points.normals, GAP * points.size)

    def _look(self, around: Surroundings, number: int, points: Points) -> tuple[Float64, Bool]:
        """Irradiance (n,) at the points that does not come straight from the sources, the mean of the channels; and
        whether nearly only backs surround them."""
        arriving, enclosed, rays = around.look(points, self._seed, number, self._workers)
        self.rays += rays
        return arriving, enclosed

    def _seen(self, around: Surroundings, number: int, points: Points) -> Float64:
        """Mean irradiance (n,) of what is seen from the points."""
        seen, rays = around.light_in_sight(points, self._seed, number, self._workers)
        self.rays += rays
        return seen


def _touching(receivers: Receivers, chosen: Bool) -> Bool:
    """Cells (c,) that share a vertex with a chosen one."""
    corner = receivers.cell_vertex
    touched = np.zeros(int(corner.max()) + 1, dtype=bool)
    touched[corner[chosen]] = True
    return np.asarray(touched[corner].any(axis=1))


def _on_borders(receivers: Receivers, probe: _Probe, fair: float) -> Int64:
    """Cells (n,) that share a vertex with hidden and open cells, or with cells that see other lights or see them in
    part, if light differs among them by enough to matter."""
    corner = receivers.cell_vertex
    vertices = int(corner.max()) + 1

    def extremes(values: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
        """Smallest and largest value (c,) among the cells around each vertex."""
        low, high = np.full((2, vertices), values[0])
        for k in range(3):
            low[corner[:, k]] = high[corner[:, k]] = values
        for k in range(3):
            np.minimum.at(low, corner[:, k], values)
            np.maximum.at(high, corner[:, k], values)
        return low, high

    least, most = extremes(probe.hidden[0].astype(np.int8))
    contact = (least != most)[corner].any(axis=1)
    low, high = extremes(probe.signature[0])
    crossed = ((low < 0) | (low != high))[corner].any(axis=1)
    dark, bright = extremes(probe.direct[0])
    step = (bright - dark)[corner].max(axis=1)
    return np.flatnonzero(contact | (crossed & (step**2 * receivers.cells.area > fair)))
