"""A scene baked and compared with Cycles at random points of its receivers."""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from time import process_time

import bpy
import numpy as np

from ...addon.oracle import true_radiance
from ...addon.scene_reader import pick_receivers, read_scene
from ...core.bake import bake
from ...core.comparison import SurfacePoints, figures, radiance_at, reference_noise, scatter, visible
from ...core.result import Effect
from ...core.scene import Float64, Scene
from ...core.settings import Settings
from .catalogue import EffectScene, built

#: What a scene may be off by beyond the noise of its reference: the root mean square without the worst 2 % of the
#: points, and the mean, both relative to the mean radiance.
TYPICAL, BIAS = 0.02, 0.01
_SEED = 11


@dataclass(frozen=True)
class Scale:
    """points of comparison, Cycles' paths for each of their three estimates, and what is asked of the bake."""

    points: int
    samples: int
    settings: Settings


FULL = Scale(points=1000, samples=512, settings=Settings(triangles=12_000, error=0.01))
#: For tests: what is wrong by much still shows.
QUICK = Scale(points=200, samples=64, settings=Settings(triangles=3_000, error=0.03))


@dataclass(frozen=True)
class Measured:
    """Errors relative to the mean radiance; bias_error: standard error of the bias, since points and paths are few.
    seconds: of the processor, all threads together."""

    scene: EffectScene
    effects: tuple[Effect, ...]
    typical: float
    surface: float
    bias: float
    bias_error: float
    noise: float
    seconds: float
    rays: dict[str, int]

    @property
    def active(self) -> tuple[str, ...]:
        return tuple(effect.name for effect in self.effects if effect.active)

    def complaints(self, slack: float = 0.0) -> list[str]:
        """What is wrong. slack: standard errors that the bias may be off by for the few points' sake."""
        wrong = []
        if missing := set(self.scene.shows) - set(self.active):
            wrong.append(f"the plan left out {', '.join(sorted(missing))}")
        if self.typical > TYPICAL + self.noise:
            wrong.append(f"typical error {self.typical:.1%}")
        if abs(self.bias) > BIAS + slack * self.bias_error:
            wrong.append(f"bias {self.bias:+.1%}")
        return wrong


def measure(scene: EffectScene, scale: Scale, cache: Path) -> Measured:
    """Build, bake and compare. References are kept in the folder `cache` until the scene is built in another way."""
    built(scene)
    context = bpy.context
    receivers = pick_receivers(context.scene, context.view_layer, scene.receivers)
    read, _ = read_scene(context.evaluated_depsgraph_get(), receivers, tessellate=True)
    points = scatter(read, scale.points, _SEED)
    begun = process_time()
    result = bake(read, scale.settings)
    seconds = process_time() - begun
    reference = _reference(scene, scale, read, points, cache)
    seen = visible(read, points, reference)
    values, truth = radiance_at(result.objects, points)[seen], reference[seen]
    off = figures(values, truth)
    difference = values.mean(axis=1) - truth.mean(axis=(1, 2))
    return Measured(
        scene,
        tuple(result.report.effects),
        off.typical,
        off.surface,
        off.bias,
        float(difference.std() / np.sqrt(len(difference)) / truth.mean()),
        reference_noise(truth),
        seconds,
        result.report.rays,
    )


def _reference(effect_scene: EffectScene, scale: Scale, scene: Scene, points: SurfacePoints, cache: Path) -> Float64:
    """(p, 3, 3), see core.comparison."""
    asked = (*_sources(effect_scene.build), repr((scale.points, scale.samples, _SEED, bpy.app.version[:2])))
    key = hashlib.sha256("\n".join(asked).encode()).hexdigest()[:16]
    path = cache / f"{effect_scene.name.replace(' ', '_')}-{key}.npy"
    if path.exists():
        return np.load(path)
    radiance = true_radiance(bpy.context, scene, points, samples=scale.samples, seed=_SEED, threads=0)
    cache.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_suffix(".part.npy")
    np.save(unfinished, radiance)
    unfinished.replace(path)
    return radiance


def _sources(function: Callable[..., object], seen: frozenset[str] = frozenset()) -> Iterator[str]:
    """The text of a function and of all that it calls in these modules, with the constants they name."""
    yield inspect.getsource(function)
    for name in function.__code__.co_names:
        other = function.__globals__.get(name)
        if isinstance(other, int | float | str | tuple):
            yield f"{name} = {other!r}"
        elif inspect.isfunction(other) and other.__name__ not in seen:
            yield from _sources(other, seen | {other.__name__})
