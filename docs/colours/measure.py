"""Errors of vertex colours with infinitely many samples, on meshes that follow the light and on meshes that do not.

Two bakes with different seeds differ from the truth by the same error of interpolation, and by noise that has nothing
to do with each other: the mean product of the two differences is the squared error that would be left of infinitely
many samples. So what Cycles converges to takes only two short bakes of it.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import permutations
from pathlib import Path
from unittest.mock import patch

import bpy
import numpy as np

from ...addon.accuracy import Reference, with_corners
from ...addon.oracle import corner_bake
from ...addon.scene_reader import read_scene
from ...core import accuracy, contours
from ...core.comparison import radiance_at
from ...core.plan import choose_effort
from ...core.reconstruction import Fit, Samples
from ...core.scene import Float64
from ...core.settings import Settings
from ..bench.measure import Baked, bake_once, make_reference
from ..bench.scenes import build

_SEEDS = (1, 2)
#: More light than there is.
_ENDLESS = 1e9


@dataclass(frozen=True)
class Scale:
    """points and paths of the reference; triangles at most and asked error of the mesh that follows the light; passes
    of bakes on even meshes, and of the best fit; samples of Cycles; how many times as many triangles the finer mesh
    has."""

    points: int = 2_000
    paths: int = 256
    triangles: int = 12_000
    error: float = 0.02
    passes: int = 8
    best_passes: int = 32
    samples: int = 64
    finer: int = 5


@dataclass(frozen=True)
class Error:
    """Relative to the mean radiance, and how well it is known from so few points: `squared` and its standard error."""

    squared: float
    deviation: float

    def __str__(self) -> str:
        if self.squared < 2.0 * self.deviation:
            return f"< {np.sqrt(max(self.squared, 0.0) + 2.0 * self.deviation):.1%}"
        value = np.sqrt(self.squared)
        return f"{value:.1%} ± {self.deviation / (2.0 * value):.1%}"


@dataclass(frozen=True)
class Measured:
    """Errors relative to the mean radiance, with infinitely many samples but for `single`, a bake as it comes.

    On the mesh that follows the light: triangles, single, followed. On an even mesh of about as many: even_triangles,
    even, best (the least squares fit, unlimited and unsmoothed), cycles. On a finer one: finer_triangles, finer.
    """

    scene: str
    triangles: int
    single: float
    followed: Error
    even_triangles: int
    even: Error
    best: Error
    cycles: Error
    finer_triangles: int
    finer: Error


def measure(name: str, scale: Scale, cache: Path) -> Measured:
    reference = make_reference(name, scale.points, scale.paths, cache)
    settings = Settings(triangles=scale.triangles, error=scale.error)
    follows = [bake_once(name, "", replace(settings, seed=seed), reference) for seed in _SEEDS]
    count = follows[0].run.triangles
    even, rivals = _even(name, reference, count, scale.passes), []
    for seed in _SEEDS:
        corners = corner_bake(bpy.context, even[-1].copies, samples=scale.samples, seed=seed, threads=0)
        rivals.append(radiance_at(with_corners(even[-1].objects, even[-1].sources, corners), reference.points))
    with _plain_least_squares():
        best = _even(name, reference, count, scale.best_passes)
    finer = _even(name, reference, scale.finer * count, scale.passes)
    return Measured(
        name,
        triangles=count,
        single=follows[0].run.surface,
        followed=_converged([baked.values for baked in follows], reference),
        even_triangles=even[0].run.triangles,
        even=_converged([baked.values for baked in even], reference),
        best=_converged([baked.values for baked in best], reference),
        cycles=_converged(rivals, reference),
        finer_triangles=finer[0].run.triangles,
        finer=_converged([baked.values for baked in finer], reference),
    )


def _even(name: str, reference: Reference, triangles: int, passes: int) -> list[Baked]:
    return [even_bake(name, triangles, passes, seed, reference) for seed in _SEEDS]


def even_bake(name: str, triangles: int, passes: int, seed: int, reference: Reference | None = None) -> Baked:
    """A bake on triangles of one size, which follow nothing."""
    settings = Settings(triangles=triangles, error=None, seed=seed)
    objects = build(name)
    scene, _ = read_scene(bpy.context.evaluated_depsgraph_get(), objects, tessellate=True)
    effort = replace(choose_effort(scene, settings), coarsest=1.0, growth=0.0, passes=passes)
    with patch.object(contours.Contours, "cut", lambda _, receivers: contours.Cut.none(receivers)):
        return bake_once(name, "", settings, reference, effort)


@contextmanager
def _plain_least_squares() -> Iterator[None]:
    """Neither smooth nor limited: the linear elements that are nearest to the samples."""

    def none(fit: Fit, *samples: Samples) -> tuple[Float64, Float64]:
        most = np.full((len(fit.measured), len(samples[0].to_grey)), _ENDLESS)
        return -most, most

    with patch.object(Fit, "limits", none), patch.object(accuracy, "ALPHAS", (1e-3,)):
        yield


def _converged(values: list[Float64], reference: Reference) -> Error:
    """Root mean square over the visible points, without the noise of values (p, 3) or reference."""
    truth, seen = reference.radiance[reference.visible], reference.visible
    one, other = (v[seen][:, None] - truth for v in values)
    pairs = list(permutations(range(truth.shape[1]), 2))
    squared = np.mean([(one[:, i] * other[:, j]).mean(axis=1) for i, j in pairs], axis=0)
    scale = float(truth.mean()) ** 2
    return Error(float(squared.mean()) / scale, float(squared.std()) / np.sqrt(len(squared)) / scale)
