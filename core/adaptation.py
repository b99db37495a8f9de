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
from .surroundings import GAP, Surroundings, out_of_sight
from .survey import Survey
from .tessellation import Int64

#: How often a cell is split into four at most.
LEVELS = 4
#: The same inside a triangle that is kept. A linear element leaves a sixteenth of a jump, squared; the two of its four
#: pieces that it crosses leave a twelfth each, with two samples 2 / 4**2 / 12 / 2 in all: a twelfth of that.
KEPT_LEVELS = 1
#: How far light may jump inside a cell before anyone looks more closely, relative to the mean and to the error asked
#: for: few cells are crossed, and what the fit leaves of a jump is a fraction of it.
_BOUNDARY_STEP = 12.0
#: Share of a jump, squared, that samples of a cell leave uncertain; and of the asked error, squared, that may be left.
_LEFT_OF_STEP, _SHARE = 1 / 12, 1 / 4
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
        self.rays: Counter[str] = Counter()

    def refine_receivers(self, survey: Survey, limit: int, error: float) -> Receivers:
        """The receivers of a survey's first pass with at most `limit` cells, finer along boundaries, which then bring
        about `error` in all."""
        receivers, hidden, direct = survey.receivers, survey.invalid, survey.direct[0].mean_grey
        area = receivers.cells.area
        mean = float(area @ direct / area.sum())
        allowed = (error * mean) ** 2 * float(area.sum())
        fair = _BOUNDARY_STEP**2 * allowed / len(area)
        fresh = _on_borders(receivers, survey.signatures[0], direct, hidden, fair)
        allowed *= _SHARE / _LEFT_OF_STEP
        for level in range(LEVELS if receivers.tessellated else KEPT_LEVELS):
            near = _touching(receivers, hidden)
            split, contact = self._worst(receivers.cells, fresh, level, mean, survey.mean, allowed, limit, near)
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
        self,
        cells: Cells,
        fresh: Int64,
        level: int,
        direct: float,
        mean: float,
        allowed: float,
        limit: int,
        near: Bool,
    ) -> tuple[Bool, Bool]:
        """Which cells (c,) to split: of the fresh ones those with the largest squared jumps, until what is left is
        allowed or there is no room; and which of them a contact crosses. direct, mean: mean irradiance straight from
        the sources, and in all; near (c,): cells where there may be a contact."""
        split, contact = np.zeros((2, len(cells)), dtype=bool)
        if len(fresh):
            probe = self._probe(cells, fresh, level, mean, near[fresh])
            weight = np.where(probe.crossed(), probe.step(direct) ** 2 * cells.area[fresh], 0.0)
            split[fresh[until_allowed(weight, allowed, limit - len(cells))]] = True
            contact[fresh[probe.contact()]] = True
        return split, split & contact

    def _probe(self, cells: Cells, chosen: Int64, level: int, mean: float, near: Bool) -> _Probe:
        """What points of each chosen cell see; near (n,): where they may be inside a solid."""
        shift = stream(self._seed, f"adaptation {level}").random((len(cells), 2))
        cell, place, near = np.tile(chosen, _POINTS), np.repeat(np.arange(_POINTS), len(chosen)), np.tile(near, _POINTS)
        points = Points.of_pass(cells, cell, place, shift)
        streams = _FIRST_STREAM + level
        light = gather_direct(points, self._light, _SHADOW_RAYS, self._seed, streams, self._workers)
        self.rays += light.rays
        direct = light.grey
        hidden = np.zeros(len(cell), dtype=bool)
        if self._around is not None:
            # Where the sources shine nothing is hidden.
            unlit = np.flatnonzero(near & (direct <= 0))
            unlit = unlit[self._beneath(self._around, points.only(unlit))]
            if len(unlit):
                there = Points.of_pass(cells, cell[unlit], place[unlit], shift)
                total, enclosed = self._look(self._around, streams, there)
                seen_light = partial(self._seen, self._around, 100_000_000 + streams)
                hidden[unlit] = out_of_sight(there, self._around, enclosed, total, direct[unlit], mean, seen_light)
        variance = np.sqrt(light.variance).mean(axis=1) ** 2
        of_cells = _POINTS, len(chosen)
        return _Probe(
            light.signature.reshape(of_cells), direct.reshape(of_cells), variance.reshape(of_cells),
            hidden.reshape(of_cells),
        )  # fmt: skip

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
        """How lit (n,) is what is seen from the points."""
        seen, rays = around.light_in_sight(points, self._seed, number, self._workers)
        self.rays += rays
        return seen


def _touching(receivers: Receivers, chosen: Bool) -> Bool:
    """Cells (c,) that share a vertex with a chosen one."""
    corner = receivers.cell_vertex
    touched = np.zeros(int(corner.max()) + 1, dtype=bool)
    touched[corner[chosen]] = True
    return np.asarray(touched[corner].any(axis=1))


def _on_borders(receivers: Receivers, signature: Int64, direct: Float64, hidden: Bool, fair: float) -> Int64:
    """Cells (n,) that share a vertex with hidden and open cells, or with cells that see other lights or see them in
    part, if light differs among them by enough to matter; from what one point of each cell (c,) sees, as in _Probe."""
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

    least, most = extremes(hidden.astype(np.int8))
    contact = (least != most)[corner].any(axis=1)
    low, high = extremes(signature)
    crossed = ((low < 0) | (low != high))[corner].any(axis=1)
    dark, bright = extremes(direct)
    step = (bright - dark)[corner].max(axis=1)
    return np.flatnonzero(contact | (crossed & (step**2 * receivers.cells.area > fair)))
