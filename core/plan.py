"""What a bake will simulate, why, and what that will cost."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil, log
from time import perf_counter

import numpy as np

from .parallel import Workers, thread_count
from .patches import Space, make_patches, split_objects, triangle_geometry, unit_space
from .progress import Progress
from .result import Effect
from .sampling import stream
from .scene import AreaLamp, PointLamp, Scene, SpotLamp, SunLamp
from .settings import Settings
from .tessellation import edge_for_count, predicted_count
from .visibility import Visibility

#: Emitting triangles up to this many are sampled one by one, as lamps are; more are found by the rays that look around.
MOST_PANELS = 64
#: Effects that need rays over the hemisphere.
LOOKING = ("bounces", "sky", "emitting surfaces")
#: Triangles and patches below which a bake shows next to nothing.
_FEWEST = 1500
#: Rays that measure how fast this machine traces this scene.
_CALIBRATION_RAYS = 1 << 16
#: What a ray that looks around, a shadow ray, a cell and a patch side cost, in rays that only meet something: measured
#: on the sample scenes, as ratios, which machines share better than seconds.
_RAY_COST, _SHADOW_COST, _CELL_COST, _SIDE_COST = 1.7, 1.5, 180.0, 300.0
_BYTES_PER_CELL, _BYTES_PER_SIDE, _BYTES_AT_REST = 4000.0, 6000.0, 200e6


@dataclass(frozen=True)
class Effort:
    """How hard a bake works.

    error: relative, to aim at; triangles: that would cover the receivers, where no size is asked for; growth: how many
    times as many adaptation may add; patches: wanted number; transport_rays: of a patch side; shadow_rays: to
    a lamp with size; gather_rays: of a sample point; passes over all cells before the error is first estimated,
    boundary_passes over the cells where shadow boundaries leave the light uncertain; tolerance: of the solve;
    threshold: form factor under which pairs are culled; emitters_by_rays: emitting triangles are too many to be lamps.
    """

    error: float
    triangles: int
    growth: float
    estimator: str
    patches: int
    transport_rays: int
    shadow_rays: int
    gather_rays: int
    passes: int
    boundary_passes: int
    tolerance: float
    threshold: float
    emitters_by_rays: bool


@dataclass(frozen=True)
class Plan:
    """effects with their reasons; how hard to work; and the cost predicted from a short calibration of this machine."""

    effects: tuple[Effect, ...]
    effort: Effort
    cells: int
    seconds: float
    memory_mb: float

    @property
    def looks_around(self) -> bool:
        """Whether any effect needs rays over the hemisphere."""
        return any(e.active for e in self.effects if e.name in LOOKING)


def plan(scene: Scene, settings: Settings, effort: Effort | None = None) -> Plan:
    """Decide and predict. Traces a few thousand rays to know this machine; changes nothing.

    effort: to work just so hard, instead of as hard as the settings call for.
    """
    effects = choose_effects(scene, settings)
    if effort is not None:
        return _priced(scene, settings, effects, effort)
    effort = choose_effort(scene, settings)
    planned = _priced(scene, settings, effects, effort)
    if settings.seconds is None or planned.seconds <= settings.seconds:
        return planned
    # Too little time for all: fewer triangles and patches, down to where they would show nothing any more.
    share = max(settings.seconds / planned.seconds, 0.02)
    patches = max(int(effort.patches * share), min(effort.patches, _FEWEST))
    fewer = replace(effort, triangles=max(int(effort.triangles * share), _FEWEST), growth=0.3, patches=patches)
    return replace(_priced(scene, settings, effects, fewer), seconds=settings.seconds)


def _priced(scene: Scene, settings: Settings, effects: tuple[Effect, ...], effort: Effort) -> Plan:
    receivers = scene.receivers()
    vertices, triangles = [o.vertices for o in receivers], [o.triangles for o in receivers]
    edge = settings.size or edge_for_count(vertices, triangles, effort.triangles)
    unpriced = Plan(effects, effort, predicted_count(vertices, triangles, edge), 0.0, 0.0)
    seconds, memory = predict(scene, settings, unpriced)
    return replace(unpriced, seconds=seconds, memory_mb=memory)


def choose_effort(scene: Scene, settings: Settings) -> Effort:
    """Finer patches and more rays for a smaller error; the quadratic estimators get fewer patches."""
    asked = settings.error or (0.02 if settings.seconds is None else 0.01)
    finer = min(max(0.02 / asked, 0.25), 4.0)
    estimator = "hemisphere" if settings.estimator == "auto" else settings.estimator
    patches = int(8192 * finer) if estimator == "hemisphere" else int(1500 * finer)
    return Effort(
        error=asked,
        triangles=settings.triangles,
        growth=2.0,
        estimator=estimator,
        patches=patches,
        transport_rays=64,
        shadow_rays=4,
        gather_rays=32,
        passes=2,
        boundary_passes=8,
        tolerance=min(asked / 20, 1e-3),
        threshold=1e-5,
        emitters_by_rays=emitting_triangles(scene) > MOST_PANELS,
    )


def choose_effects(scene: Scene, settings: Settings) -> tuple[Effect, ...]:
    """Each effect, whether this scene calls for it, and why."""
    lamps = scene.lamps
    kinds = (("point lamps", PointLamp), ("spot lamps", SpotLamp), ("sun", SunLamp), ("area lamps", AreaLamp))
    effects = [_counted(name, [lamp.name for lamp in lamps if isinstance(lamp, kind)]) for name, kind in kinds]
    soft = [lamp.name for lamp in lamps if isinstance(lamp, AreaLamp) or getattr(lamp, "radius", 0.0) > 0]
    soft += [lamp.name for lamp in lamps if isinstance(lamp, SunLamp) and lamp.angle > 0]
    effects.append(
        Effect("soft shadows", bool(soft), f"{_names(soft)} {'has' if len(soft) == 1 else 'have'} a size")
        if soft
        else Effect("soft shadows", False, "no lamp has a size")
    )
    emitting = emitting_triangles(scene)
    how = "as lamps" if emitting <= MOST_PANELS else "by the rays that look around"
    effects.append(
        Effect("emitting surfaces", True, f"{emitting} triangles emit; sampled {how}")
        if emitting
        else Effect("emitting surfaces", False, "no surface emits")
    )
    sky = max(scene.sky) > 0
    effects.append(Effect("sky", sky, "the world emits light" if sky else "the world is black"))
    used = {int(i) for o in scene.objects for i in np.unique(o.surface)}
    albedo = max((max(scene.surfaces[i].albedo) for i in used), default=0.0)
    mean = _mean_albedo(scene)
    if albedo <= 0:
        effects.append(Effect("bounces", False, "every surface is black"))
    elif settings.estimator == "centroid":
        effects.append(Effect("bounces", True, "as the original program did: centroid form factors, plain shooting"))
    else:
        matter = max(1, ceil(log(0.002) / log(mean))) if 0 < mean < 1 else 1
        effects.append(Effect("bounces", True, f"surfaces reflect {mean:.0%}: about {matter} bounces matter"))
    return tuple(effects)


def emitting_triangles(scene: Scene) -> int:
    """How many triangles emit light."""
    emits = np.array([max(s.emission) > 0 for s in scene.surfaces])
    return sum(int(np.count_nonzero(emits[o.surface])) for o in scene.objects)


def predict(scene: Scene, settings: Settings, unpriced: Plan) -> tuple[float, float]:
    """Seconds and peak MB of the bake, from how long a few rays take here and now."""
    effort, cells = unpriced.effort, unpriced.cells
    sides = 1.2 * effort.patches if unpriced.looks_around else 0
    lights = len(scene.lamps) + min(emitting_triangles(scene), MOST_PANELS)
    around = 2 * sides * effort.transport_rays
    if unpriced.looks_around:
        around += cells * effort.passes * effort.gather_rays
    shadow = lights * effort.shadow_rays * (cells * (effort.passes + 3) + 16 * sides)
    work = around * _RAY_COST + shadow * _SHADOW_COST + cells * _CELL_COST + sides * _SIDE_COST
    seconds = work * _seconds_per_ray(scene, unit_space(scene), thread_count(settings.threads))
    memory = (_BYTES_AT_REST + cells * _BYTES_PER_CELL + sides * _BYTES_PER_SIDE) / 1e6
    return seconds, memory


def _seconds_per_ray(scene: Scene, space: Space, threads: int) -> float:
    """Seconds that all threads together need for a ray that looks around."""
    patches = make_patches(scene, space, split_objects(scene, 2048))
    visibility = Visibility(patches.corners)
    rng = stream(0, "calibration")
    chosen = rng.integers(len(patches.area), size=_CALIBRATION_RAYS)
    directions = rng.normal(size=(_CALIBRATION_RAYS, 3)) + 1.5 * patches.normals[chosen]
    origins = patches.corners[chosen].mean(axis=1) + 1e-4 * patches.normals[chosen]
    rays = origins.astype(np.float32), directions.astype(np.float32)
    with Workers(threads, Progress()) as workers:
        begun = perf_counter()
        for _ in workers.map(lambda *_: visibility.nearest(*rays), threads, 1):
            pass
        return (perf_counter() - begun) / (threads * _CALIBRATION_RAYS)


def _mean_albedo(scene: Scene) -> float:
    """Mean over the surface and the channels."""
    albedo = np.array([np.mean(s.albedo) for s in scene.surfaces])
    total = area = 0.0
    for scene_object in scene.objects:
        areas = triangle_geometry(scene_object.vertices[scene_object.triangles])[1]
        total += float(areas @ albedo[scene_object.surface])
        area += float(areas.sum())
    return total / area if area else 0.0


def _counted(name: str, names: list[str]) -> Effect:
    return Effect(name, bool(names), _names(names) if names else "none in the scene")


def _names(names: list[str]) -> str:
    return ", ".join(names[:3]) + (f" and {len(names) - 3} more" if len(names) > 3 else "")
