"""Pass by pass, the samples of light on the receivers that the fit is made from.

Every pass puts one new point into each cell, looks around from it, and adds what arrives. Even passes see the patches as
one half of the transport rays solved them, odd passes as the other half did: two independent answers to everything.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .direct.illumination import DirectLight, Illumination
from .gather import Points, gather_direct, gather_indirect, shadow_boundary
from .hemisphere import Hemispheres
from .parallel import Workers
from .patches import Patches
from .plan import Effort
from .receivers import Receivers
from .reconstruction import Samples
from .sampling import stream
from .scene import Bool, Float32, Float64
from .transport import Transport
from .visibility import Visibility

#: A point that sees only backs, and less than this share of the mean light, is inside a solid.
_DARK = 0.05
#: Columns of the tables of what a ray brings, and of the indirect samples: reflected light (3), open sky, light of
#: emitting surfaces that are not sampled as lamps (3), and last the same reflected light from coarser patches (mean).
REFLECTED, SKY, EMITTED, COARSER = slice(0, 3), 3, slice(4, 7), 7
COLUMNS = 8


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What rays from the receivers can bring: tables (codes, COLUMNS) of radiosity by ray code, one for each half."""

    hemispheres: Hemispheres
    tables: tuple[Float32, Float32]


def look_up(
    patches: Patches, visibility: Visibility, halves: tuple[Transport, ...], effort: Effort, seed: int
) -> Surroundings | None:
    """Tables of what the solved halves send to a ray, by what it meets; None when nothing was solved."""
    if not halves:
        return None
    hemispheres = Hemispheres(patches, visibility, effort.gather_rays, stream(seed, "gather patterns"))
    return Surroundings(hemispheres, (_table(halves[0], patches, effort), _table(halves[1], patches, effort)))


def _table(half: Transport, patches: Patches, effort: Effort) -> Float32:
    table = np.zeros((2 * len(patches.area) + 2, COLUMNS), dtype=np.float32)
    reflected = half.by_code(half.reflected)
    table[:, REFLECTED] = reflected
    table[2 * len(patches.area), SKY] = 1.0
    if effort.emitters_by_rays:
        table[:, EMITTED] = half.by_code(np.pi * half.sides.emission)
    table[:, COARSER] = half.by_code(half.over_coarser_patches(half.reflected.mean(axis=1, keepdims=True)))[:, 0]
    return table


class Survey:
    """The samples so far: two independent halves of each of indirect and direct light.

    indirect: channels red, green, blue of reflected light, open sky, emitting surfaces (3), and the mean of it all;
    direct: red, green, blue and their mean. coarser (c,): sum over passes of the difference that coarser patches make.
    """

    def __init__(
        self,
        receivers: Receivers,
        direct_light: DirectLight,
        surroundings: Surroundings | None,
        sky: Float64,
        effort: Effort,
        seed: int,
        workers: Workers,
    ) -> None:
        count = len(receivers.cells)
        self.receivers = receivers
        self.indirect = [Samples(count, 8), Samples(count, 8)]
        self.direct = [Samples(count, 4), Samples(count, 4)]
        self.coarser = np.zeros(count)
        self.invalid = np.zeros(count, dtype=bool)
        self.passes = 0
        self.rays = {"gather": 0, "shadow": 0}
        self._light = direct_light
        self._surroundings = surroundings
        self._sky = np.pi * sky
        self._effort = effort
        self._seed = seed
        self._workers = workers
        self._shift = stream(seed, "cells").random((count, 2))
        self._signatures: list[np.ndarray] = []
        self._extra = 0

    @property
    def valid_samples(self) -> Float64:
        """(c,) samples of each cell that are not inside a solid."""
        return self.direct[0].count + self.direct[1].count

    def run_pass(self) -> None:
        """One more point in every cell."""
        number = self.passes
        every = np.arange(len(self.receivers.cells))
        points = Points(self.receivers.cells, every, number, self._shift)
        light = self._direct(points, number)
        valid = np.ones(len(every), dtype=bool)
        if self._surroundings is not None:
            hemispheres = self._surroundings.hemispheres
            table = self._surroundings.tables[number % 2]
            arriving, variance, enclosed = gather_indirect(
                points, hemispheres, table, self._seed, number, self._workers
            )
            self.rays["gather"] += len(every) * hemispheres.rays
            self.coarser += arriving[:, COARSER] - arriving[:, REFLECTED].mean(axis=1)
            total = arriving[:, :COARSER] @ self._to_grey()
            spread = variance[:, :COARSER] @ self._to_grey() ** 2 * 3.0
            dark = total + light.irradiance.mean(axis=1) <= _DARK * (total + light.irradiance.mean(axis=1)).mean()
            valid = ~(enclosed & dark & (light.irradiance.max(axis=1) <= 0))
            values = np.column_stack([arriving[:, :COARSER], total])
            noise = np.column_stack([variance[:, :COARSER], spread])
            self.indirect[number % 2].add(slice(None), points.barycentric, values, noise, valid)
        self.invalid |= ~valid
        self._add_direct(number, slice(None), points, light, valid)
        self._signatures.append(light.signature)
        self.passes += 1

    def refine_boundaries(self, passes: int) -> None:
        """More points, for direct light only, in the cells that shadow boundaries cross."""
        corner_vertex = self.receivers.corner_vertex[self.receivers.cells.element]
        boundary = shadow_boundary(corner_vertex, self.receivers.vertices, self._signatures)
        chosen = np.flatnonzero(boundary & ~self.invalid)
        if not len(chosen):
            return
        everywhere = np.ones(len(chosen), dtype=bool)
        for _ in range(passes):
            # A number far from those of the full passes: the streams must differ, the points go on evenly.
            number = self.passes + self._extra
            points = Points(self.receivers.cells, chosen, number, self._shift)
            light = self._direct(points, 1_000_000 + self._extra)
            self._add_direct(self._extra, chosen, points, light, everywhere)
            self._extra += 1

    def _direct(self, points: Points, number: int) -> Illumination:
        light = gather_direct(points, self._light, self._effort.shadow_rays, self._seed, number, self._workers)
        self.rays["shadow"] += light.rays
        return light

    def _add_direct(
        self, half: int, index: np.ndarray | slice, points: Points, light: Illumination, valid: Bool
    ) -> None:
        values = np.column_stack([light.irradiance, light.irradiance.mean(axis=1)])
        noise = np.column_stack([light.variance, light.variance.mean(axis=1)])
        self.direct[half % 2].add(index, points.barycentric, values, noise, valid)

    def _to_grey(self) -> Float64:
        """Weights (COARSER,) that turn the columns of what arrives into the mean of the three channels."""
        weights = np.full(COARSER, 1.0 / 3.0)
        weights[SKY] = self._sky.mean()
        return weights
