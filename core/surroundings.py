"""What rays from the receivers can bring, once the patches are solved, and which points they tell nothing of."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .gather import Points, gather_indirect
from .hemisphere import Hemispheres
from .parallel import Workers
from .patches import Patches
from .plan import Effort
from .sampling import stream
from .scene import Bool, Float32, Float64
from .sky import Sky
from .transport import Transport
from .visibility import Visibility

#: A point that gets less than this share of the mean light is dark; where something is nearer than this share of its
#: cell's size, one that gets less than half.
_DARK, _DIM, GAP = 0.05, 0.5, 0.25
#: Where what is seen is this lit in the mean, or more, nobody is inside a solid, whichever way its surface faces.
_LIT = 0.25


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What rays from the receivers can bring.

    tables: for each half of the transport (codes, columns) radiosity by ray code. The columns are reflected light, in
    one or three channels; if the scene calls for it the sky (as many as Sky.light) and, in as many channels as the
    first, emitting surfaces that are not sampled as lamps; and last the mean of the reflected light again, from coarser
    patches. to_grey (columns - 1,): weights that turn the columns into the mean irradiance of the three channels.
    lit (codes, 1): how lit is what a ray meets, however dark its colour: the share of it that the sources reach, or its
    irradiance as a share of the mean, up to 1, if that is more; in both halves, for one may not have looked there.
    level_doubts: by what share of itself each half may misjudge all reflected light, by its rays and by larger patches.
    """

    hemispheres: Hemispheres
    tables: tuple[Float32, ...]
    reflected: slice
    sky: slice
    emitted: slice
    to_grey: Float64
    lit: Float32
    level_doubts: tuple[tuple[float, float], ...]

    def with_rays(self, rays: int, rng: np.random.Generator) -> Surroundings:
        """The same, looked at with another number of rays."""
        return replace(self, hemispheres=self.hemispheres.with_rays(rays, rng))

    def from_cells(self, cells: int, effort: Effort, seed: int) -> Surroundings:
        """The same, looked at from so many cells with as many rays of each point as that takes."""
        rays = effort.rays_of_point(cells)
        return self if rays == self.hemispheres.rays else self.with_rays(rays, stream(seed, "gather patterns"))

    def look(self, points: Points, seed: int, number: int, workers: Workers) -> tuple[Float64, Bool, Counter[str]]:
        """Irradiance (n,) at the points that does not come straight from the sources, the mean of the channels; whether
        nearly only backs surround them; and the rays it took."""
        table = self.tables[0][:, : len(self.to_grey)]
        arriving, _, enclosed, rays = gather_indirect(points, self.hemispheres, table, seed, number, workers)
        return arriving @ self.to_grey, enclosed, rays

    def light_in_sight(self, points: Points, seed: int, number: int, workers: Workers) -> tuple[Float64, Counter[str]]:
        """How lit (n,) is what is seen from the points, in the mean, and the rays it took."""
        seen, _, _, rays = gather_indirect(points, self.hemispheres, self.lit, seed, number, workers)
        return seen[:, 0], rays


def look_up(
    patches: Patches,
    visibility: Visibility,
    halves: tuple[Transport, ...],
    sky: Sky,
    effort: Effort,
    seed: int,
) -> Surroundings | None:
    """Tables of what the solved halves send to a ray, by what it meets; None when nothing was solved."""
    if not halves:
        return None
    sky = sky.in_colour(patches.coloured)
    seen, channels = sky.light.shape[1], effort.channels
    by_rays = channels * effort.emitters_by_rays
    return Surroundings(
        hemispheres=Hemispheres(patches, visibility, effort.gather_rays, stream(seed, "gather patterns"), sky),
        tables=_completed([_table(half, sky, effort) for half in halves], halves, len(sky.light)),
        reflected=slice(0, channels),
        sky=slice(channels, channels + seen),
        emitted=slice(channels + seen, channels + seen + by_rays),
        to_grey=np.concatenate(
            [np.full(channels, 1 / channels), sky.irradiance.mean(axis=1), np.full(by_rays, 1 / channels)]
        ),
        lit=np.minimum.reduce([_lit(half, sky) for half in halves]),
        level_doubts=tuple(half.level_doubts() for half in halves),
    )


def _completed(tables: list[Float32], halves: tuple[Transport, ...], texels: int) -> tuple[Float32, ...]:
    """The tables of both halves. A side that only rays of one have met brings in the other what it does there, for a
    receiver's rays may meet it too, also off mirrors where both tables say what it brings then. texels: of the sky."""
    codes = 2 * len(halves[0].sides.patches) + 1 + texels
    met = [np.isin(np.arange(2 * len(half.sides.patches)), half.sides.side) for half in halves]
    completed = [table.copy() for table in tables]
    for own, other in ((0, 1), (1, 0)):
        only = np.flatnonzero(met[other] & ~met[own])
        for first in range(0, min(map(len, tables)), codes):
            completed[own][first + only] = tables[other][first + only]
    return tuple(completed)


def _lit(half: Transport, sky: Sky) -> Float32:
    arriving = half.solution.irradiance.mean(axis=1)
    mean = half.sides.area @ arriving / half.sides.area.sum()
    share = np.clip(arriving, 0.0, mean) / mean if mean > 0.0 else np.zeros_like(arriving)
    # What the sources reach is lit however bright others are: a room may lie beside a street in the sun.
    met = half.by_code(np.maximum(share, half.reached)[:, None])
    return np.concatenate([met, np.zeros((len(sky.light), 1), dtype=np.float32)])


def _table(half: Transport, sky: Sky, effort: Effort) -> Float32:
    emitters, channels = effort.emitters_by_rays, effort.channels
    emission = [np.pi * half.sides.emission[:, :channels]] if emitters else []
    coarser = half.over_coarser_patches(half.reflected.mean(axis=1, keepdims=True))
    no_sky = np.zeros((len(coarser), sky.light.shape[1]))
    met = half.by_code(np.concatenate([half.reflected[:, :channels], no_sky, *emission, coarser], axis=1))
    left = np.zeros((len(sky.light), met.shape[1]), dtype=np.float32)
    left[:, channels : channels + no_sky.shape[1]] = sky.light
    table = np.concatenate([met, left])
    if emitters or not half.mirrored_emission:
        return table
    # Shadow rays do not find lamps in mirrors, so rays off mirrors bring what emitting surfaces send out.
    emitted = half.by_code(np.pi * half.sides.emission)
    off_mirrors = table.copy()
    off_mirrors[: len(emitted), :3] += emitted
    off_mirrors[: len(emitted), -1] += emitted.mean(axis=1)
    return np.concatenate([table, off_mirrors])


def out_of_sight(
    points: Points,
    around: Surroundings,
    enclosed: Bool,
    total: Float64,
    direct: Float64,
    mean: float,
    look: Callable[[Points], Float64],
) -> Bool:
    """Points (n,) that nobody sees, whose dark says nothing of the surface around: inside a solid, or in a gap that is
    much narrower than their cell, under what lies on the surface or nearly so.

    A room whose normals face outward is all backs too, and a bright gap is seen into: only points that hardly any light
    reaches count, and from which nothing is seen that light reaches, for a shadow in a dark room is in sight.
    total, direct (n,): irradiance, and the part straight from the sources; mean: that of the total. look: how lit
    (n,) is what is seen from some points.
    """
    hidden = enclosed & dark(total, direct, mean)
    doubtful = np.flatnonzero(hidden)
    if len(doubtful):
        hidden[doubtful] = look(points.only(doubtful)) <= _LIT
    dim = np.flatnonzero(~hidden & (total <= _DIM * mean) & (direct <= 0))
    if len(dim):
        hidden[dim] = _in_gap(points, around, dim)
    return np.asarray(hidden)


def doubted(points: Points, around: Surroundings, enclosed: Bool, arriving: Float64, mean: float) -> Bool:
    """Points (n,) that are out of sight if they get nothing straight from the sources; see `out_of_sight`. arriving
    (n,): all other irradiance."""
    doubtful = enclosed.copy()
    dim = np.flatnonzero(~enclosed & (arriving <= _DIM * mean))
    if len(dim):
        doubtful[dim] = _in_gap(points, around, dim)
    return doubtful


def _in_gap(points: Points, around: Surroundings, some: NDArray[np.int64]) -> Bool:
    """Whether something lies so near above some of the points (n,) that their cell is too large for the gap."""
    reach = GAP * points.size[some]
    return around.hemispheres.covered(points.positions[some], points.normals[some], reach)


def dark(total: Float64, direct: Float64, mean: float) -> Bool:
    """Points (n,) that get next to nothing of the mean light, and nothing straight from the sources."""
    return np.asarray((total <= _DARK * mean) & (direct <= 0))
