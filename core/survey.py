"""Pass by pass, the samples of light on the receivers that the fit is made from.

Every pass puts one new point into each cell, looks around from it, and adds what arrives. Even passes see the patches
as one half of the transport rays solved them, odd passes as the other half did: two independent answers to everything.
"""

from __future__ import annotations

from collections import Counter
from functools import partial

import numpy as np
from numpy.typing import NDArray

from .direct.illumination import DirectLight, Illumination
from .gather import Points, gather_direct, gather_indirect, shadow_boundary
from .keys import same_cells
from .parallel import Workers
from .plan import Effort
from .receivers import Receivers
from .reconstruction import Samples
from .sampling import stream
from .scene import Bool, Float64
from .surroundings import Surroundings, dark, doubted, out_of_sight
from .visibility import Visibility

#: Samples that are added at a time, and points beside shadow boundaries that are looked at together: many calls for few
#: points each take longer than the light does.
_CHUNK, _BESIDE = 8192, 65536
#: Rays that tell whether hardly any light gets somewhere.
_GLANCE = 16
#: Of n rays of which none has met something, up to this over n may: at 95 % (rule of three: Hanley, Lippman-Hand 1983).
_NONE_OF_N = 3.0
#: Where a triangle must be out of sight besides to count as buried: a hair inside its corners and the middles of its
#: sides, for what shows of it beside a straight outline has a corner.
_BESIDES = np.concatenate([0.997 * np.eye(3) + 1e-3, 0.4985 * (1.0 - np.eye(3)) + 1e-3])


def _halves(cells: int, to_grey: Float64) -> list[Samples]:
    first = Samples(cells, to_grey)
    return [first, Samples(cells, to_grey, first)]


class Survey:
    """The samples so far: two independent halves of each of indirect and direct light.

    indirect: a channel for each column of the surroundings but the last; direct: red, green and blue, or grey, and once
    more for sky_light, if that is to be told from the rest. coarser: for each half (c,) the change that coarser patches
    make to the mean irradiance, by one pass each: that is sure enough.
    """

    def __init__(
        self,
        receivers: Receivers,
        direct_light: DirectLight,
        surroundings: Surroundings | None,
        effort: Effort,
        seed: int,
        workers: Workers,
        sky_light: DirectLight | None = None,
    ) -> None:
        count = len(receivers.cells)
        self.receivers = receivers
        self.surroundings = surroundings
        to_grey = surroundings.to_grey if surroundings else np.zeros(0)
        self.indirect = _halves(count, to_grey)
        channels = np.full(effort.channels * (2 if sky_light else 1), 1 / effort.channels)
        self.direct = _halves(count, channels)
        self.coarser = [np.zeros(count), np.zeros(count)]
        self.invalid = np.zeros(count, dtype=bool)
        self.passes = 0
        self.rays: Counter[str] = Counter()
        glance = min(_GLANCE, effort.gather_rays)
        self._glance = surroundings and surroundings.with_rays(glance, stream(seed, "glance patterns"))
        self._light = direct_light
        self._sky_light = sky_light
        self._effort = effort
        self.seed = seed
        self.workers = workers
        self._shift = stream(seed, "cells").random((count, 2))
        self.signatures: list[NDArray[np.int64]] = []
        #: How often there were more points for direct light, and for indirect light.
        self._extra, self._longer = 0, 0
        self.mean = 0.0
        #: The cells that were not recalled, how many passes are for these alone, and the recalled cells (c,) that have
        #: more points than that.
        self._fresh, self._recalled = np.arange(count), 0
        self._refined = np.zeros(count, dtype=bool)

    def recall(self, earlier: Survey) -> None:
        """Before the first pass: take the samples of the cells that an earlier survey had as well; as many passes as it
        had will look at the others only."""
        here, there = same_cells(self.receivers.cells, earlier.receivers.cells)
        # A half that no pass has come to yet holds nothing, and takes no memory until then.
        for half in range(min(earlier.passes, 2)):
            self.indirect[half].recall(earlier.indirect[half], here, there)
            self.direct[half].recall(earlier.direct[half], here, there)
        for coarser, other in zip(self.coarser, earlier.coarser, strict=True):
            coarser[here] = other[there]
        self.invalid[here] = earlier.invalid[there]
        for signature in earlier.signatures:
            self.signatures.append(np.zeros(len(self.invalid), dtype=np.int64))
            self.signatures[-1][here] = signature[there]
        self.mean = earlier.mean
        self._shift[here] = earlier._shift[there]
        self._fresh, self._recalled = np.setdiff1d(self._fresh, here), earlier.passes
        self._refined[here] = (earlier.direct[0].tried + earlier.direct[1].tried)[there] > earlier.passes
        self._extra, self._longer = earlier._extra, earlier._longer

    def _index(self, number: int) -> NDArray[np.int64] | slice:
        """The cells that a pass looks at; a slice where they are all, for sums over that take no copies."""
        return self._fresh if number < self._recalled else slice(None)

    @property
    def error(self) -> float:
        """What is asked for, relative."""
        return self._effort.error

    @property
    def missed_sky(self) -> float:
        """Irradiance W/m^2 that the sky may bring all the same where no ray has met it; 0 where one has, or it is
        black."""
        around = self.surroundings
        if around is None or around.sky.start == around.sky.stop:
            return 0.0
        if any(half.high[:, around.sky].max(initial=0.0) > 0.0 for half in self.indirect):
            return 0.0
        brings = around.hemispheres.sky.light.mean(axis=0) @ around.to_grey[around.sky]
        return float(brings) * min(_NONE_OF_N / max(self.rays["gather"], 1), 1.0)

    @property
    def sampled(self) -> list[list[Samples]]:
        """The halves of direct light and, if there are surroundings, of indirect light."""
        return [self.direct, self.indirect] if self.surroundings else [self.direct]

    @property
    def tells_sky_apart(self) -> bool:
        """Whether the direct light has channels of its own for the sky's."""
        return self._sky_light is not None

    @property
    def valid_samples(self) -> Float64:
        """(c,) samples of each cell that are in sight."""
        return np.asarray(self.direct[0].count + self.direct[1].count, dtype=np.float64)

    @property
    def share_in_sight(self) -> Float64:
        """(c,) share of each cell's samples that are in sight."""
        return self.valid_samples / np.maximum(self.direct[0].tried + self.direct[1].tried, 1.0)

    @property
    def lumped(self) -> Float64:
        """(c, 3) how much these weigh at the corners of the cell's output triangle."""
        return self.direct[0].lumped + self.direct[1].lumped

    def run_pass(self) -> None:
        """One more point in every cell, but in those for which an earlier pass was recalled."""
        number = self.passes
        index = self._index(number)
        fresh = np.arange(len(self.invalid))[index]
        self.passes += 1
        if number == len(self.signatures):
            self.signatures.append(np.zeros(len(self.invalid), dtype=np.int64))
        if not len(fresh):
            return
        points = Points.of_pass(self.receivers.cells, fresh, number, self._shift)
        if self.surroundings is None:
            light, valid = self._direct(points, number), np.ones(len(fresh), dtype=bool)
        else:
            light, arriving = self.workers.beside(
                partial(self._direct, points, number), partial(self._arriving, self.surroundings, points, number)
            )
            valid = self._add_indirect(self.surroundings, number, index, points, light.grey, *arriving)
        self.invalid[index] |= ~valid
        self._add_direct(number, index, points, light, valid)
        self.signatures[number][index] = light.signature

    def _arriving(
        self, around: Surroundings, points: Points, number: int
    ) -> tuple[Float64, Float64, Bool, Counter[str]]:
        """What rays from the points of a pass bring, as gather_indirect has it."""
        table = around.tables[number % 2]
        table = table if number < 2 else table[:, : len(around.to_grey)]
        return gather_indirect(points, around.hemispheres, table, self.seed, number, self.workers)

    def _add_indirect(
        self,
        around: Surroundings,
        number: int,
        index: NDArray[np.int64] | slice,
        points: Points,
        direct: Float64,
        arriving: Float64,
        deviation: Float64,
        enclosed: Bool,
        rays: Counter[str],
    ) -> Bool:
        """Add the indirect light at the points of a pass; which of them (n,) are in sight."""
        half, columns = number % 2, len(around.to_grey)
        self.rays += rays
        values = arriving[:, :columns]
        if number < 2:
            self.coarser[half][index] = arriving[:, columns] - values[:, around.reflected].mean(axis=1)
        total = values @ around.to_grey + direct
        if len(total) == len(self.invalid):
            self.mean = float(total.mean())

        valid = self._in_sight(around, number, points, total, direct, enclosed)
        noise = (deviation[:, :columns] @ around.to_grey) ** 2
        self._add(self.indirect[half], index, points, values, noise, valid)
        return valid

    def _in_sight(
        self, around: Surroundings, number: int, points: Points, total: Float64, direct: Float64, enclosed: Bool
    ) -> Bool:
        """Which points (n,) are in sight; see `out_of_sight`."""

        def look(some: Points) -> Float64:
            seen, cast = (self._glance or around).light_in_sight(some, self.seed, 4_000_000 + number, self.workers)
            self.rays += cast
            return seen

        return ~out_of_sight(points, around, enclosed, total, direct, self.mean, look)

    def catch_up(self, passes: int) -> None:
        """So many passes in all, and the first turn at shadow boundaries."""
        while self.passes < passes:
            self.run_pass()
        self.refine_boundaries(self._effort.boundary_passes)

    def refine_boundaries(self, passes: int) -> None:
        """More points, for direct light only, in the cells where shadow boundaries leave it uncertain. Those that were
        recalled with more of them have had the first turn."""
        chosen = np.flatnonzero(self._uncertain() & ~self.invalid & ~self._refined)
        self._refined[:] = False
        if not len(chosen):
            return
        together = max(_BESIDE // len(chosen), 1)
        for first in range(0, passes, together):
            self._refine(chosen, min(together, passes - first))

    def _refine(self, chosen: NDArray[np.int64], passes: int) -> None:
        """More points, so many in each of the chosen cells, for direct light only."""
        # Numbers far from those of the full passes: the streams must differ, the points go on evenly.
        numbers = np.repeat(self.passes + self._extra + np.arange(passes), len(chosen))
        points = Points.of_pass(self.receivers.cells, np.tile(chosen, passes), numbers, self._shift)
        light = self._direct(points, 1_000_000 + self._extra)
        everywhere = np.ones(len(chosen), dtype=bool)
        for one in np.split(np.arange(len(numbers)), passes):
            self._add_direct(self._extra, chosen, points.only(one), light.only(one), everywhere)
            self._extra += 1

    def top_up(self, wanted: NDArray[np.int64]) -> None:
        """More points, for indirect light only, in the cells in sight that have fewer than they should, an even number
        (c,)."""
        had = self.indirect[0].tried + self.indirect[1].tried
        lacking = np.where(self.invalid, 0, np.maximum(wanted - had, 0)) // 2
        if self.surroundings is None or not lacking.any():
            return
        direct = (self.direct[0].grey() + self.direct[1].grey()).mean_grey
        while lacking.any():
            chosen = np.flatnonzero(lacking)
            samples = np.minimum(lacking[chosen], max(_BESIDE // len(chosen), 1))
            for half in range(2):
                self._look_longer(self.surroundings, half, chosen, samples, direct[chosen])
            lacking[chosen] -= samples

    def _look_longer(
        self,
        around: Surroundings,
        half: int,
        cells: NDArray[np.int64],
        samples: NDArray[np.int64],
        straight: Float64,
    ) -> None:
        """So many more samples (n,) of some cells (n,) for one half of the indirect light. straight (n,): what they get
        straight from the sources, in the mean."""
        chosen, direct = np.repeat(cells, samples), np.repeat(straight, samples)
        turn = np.arange(len(chosen)) - np.repeat(np.cumsum(samples) - samples, samples)
        # The sequence of points goes on before its beginning: those of the passes to come are further on.
        earlier = self.indirect[half].tried[chosen] - self.passes // 2 + turn
        points = Points.of_pass(self.receivers.cells, chosen, -1 - 2 * earlier - half, self._shift)
        number = 5_000_000 + self._longer
        self._longer += 1
        table = around.tables[half][:, : len(around.to_grey)]
        looks = points, around.hemispheres, table, self.seed, number, self.workers
        values, deviation, enclosed, rays = gather_indirect(*looks)
        self.rays += rays
        arriving = values @ around.to_grey
        # Where one sample of a cell is lit and another hidden, their mean tells nothing of this one.
        lit = np.flatnonzero(direct > 0.0)
        doubtful = lit[doubted(points.only(lit), around, enclosed[lit], arriving[lit], self.mean)]
        if len(doubtful):
            direct[doubtful] = self._direct(points.only(doubtful), number).grey
        valid = self._in_sight(around, number, points, arriving + direct, direct, enclosed)
        noise = (deviation @ around.to_grey) ** 2
        for one in range(int(samples.max())):
            now = np.flatnonzero(turn == one)
            self._add(self.indirect[half], chosen[now], points.only(now), values[now], noise[now], valid[now])

    def buried(self) -> Bool:
        """Output triangles (e,) that lie inside a solid as a whole.

        Of a triangle that is seen in part all samples may happen to be hidden, so it is looked at where that part would
        be.
        """
        element, around = self.receivers.cells.element, self._glance
        hidden = self.invalid & (self.valid_samples == 0)
        buried = np.ones(self.receivers.elements, dtype=bool)
        buried[element[~hidden]] = False
        for k, weights in enumerate(_BESIDES):
            chosen = np.flatnonzero(buried[element])
            if around is None or not len(chosen):
                break
            points = Points(self.receivers.cells, chosen, np.broadcast_to(weights, (len(chosen), 3)))
            light = self._direct(points, 3_000_000 + k)
            arriving, enclosed, rays = around.look(points, self.seed, 3_000_000 + k, self.workers)
            self.rays += rays
            direct = light.grey
            buried[element[chosen[~(enclosed & dark(arriving + direct, direct, self.mean))]]] = False
        return buried

    def _uncertain(self) -> Bool:
        """Cells (c,) that a shadow boundary crosses, and whose direct light varies by more than their fair share of the
        error that is asked for."""
        cells, vertices = self.receivers.cells, self.receivers.vertices
        corner = self.receivers.corner_vertex[cells.element]
        boundary = shadow_boundary(corner, vertices, self.signatures)
        samples = self.direct[0].grey() + self.direct[1].grey()
        count, mean = np.maximum(samples.count, 1.0), samples.mean_grey
        variance = np.maximum(samples.squares / count - mean**2, 0.0) / count
        # Two equal samples prove little, so a cell is as uncertain as those around it.
        around = np.bincount(corner.ravel(), np.repeat(variance, 3), vertices) / np.bincount(
            corner.ravel(), minlength=vertices
        ).clip(1)
        fair = (self._effort.error * float(cells.area @ mean)) ** 2 / float(cells.area.sum()) / len(cells)
        return boundary & (around[corner].max(axis=1) * cells.area > fair)

    @property
    def visibility(self) -> Visibility:
        """What stands between the receivers and the light."""
        return self._light.visibility

    def _direct(self, points: Points, number: int) -> Illumination:
        light = gather_direct(points, self._light, self._effort.shadow_rays, self.seed, number, self.workers)
        if self._sky_light:
            apart = 4_000_000 + number
            light = light.beside(
                gather_direct(points, self._sky_light, self._effort.shadow_rays, self.seed, apart, self.workers)
            )
        self.rays += light.rays
        return light

    def _add_direct(
        self, half: int, index: NDArray[np.int64] | slice, points: Points, light: Illumination, valid: Bool
    ) -> None:
        deviation = np.sqrt(light.variance).reshape(len(light.variance), -1, 3).mean(axis=2)
        noise = (deviation**2).sum(axis=1)
        values = light.irradiance[:, :: 3 // self._effort.channels]
        self._add(self.direct[half % 2], index, points, values, noise, valid)

    def _add(
        self,
        samples: Samples,
        index: NDArray[np.int64] | slice,
        points: Points,
        values: Float64,
        noise: Float64,
        valid: Bool,
    ) -> None:
        """Add a sample for each cell of index, so many cells at a time that they stay in the processor's caches."""

        def work(_: int, part: slice) -> None:
            some = part if isinstance(index, slice) else index[part]
            samples.add(some, points.barycentric[part], values[part], noise[part], valid[part])

        for _ in self.workers.map(work, len(valid), _CHUNK):
            pass
