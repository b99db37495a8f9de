"""What a bake will simulate, why, and what that will cost."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil, log
from time import perf_counter

import numpy as np

from .parallel import thread_count
from .patches import Space, make_patches, split_objects, triangle_geometry, unit_space
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
#: Rays that measure how fast this machine traces this scene.
_CALIBRATION_RAYS = 1 << 16
#: Seconds that a ray, a cell and a patch side cost besides tracing, relative to tracing one ray: measured once on the
#: sample scenes, as ratios, which other machines share better than seconds.
_RAY_OVERHEAD, _CELL_OVERHEAD, _SIDE_OVERHEAD = 1.5, 60.0, 300.0
_BYTES_PER_CELL, _BYTES_PER_SIDE, _BYTES_AT_REST = 4000.0, 6000.0, 200e6


@dataclass(frozen=True)
class Effort:
    """How hard a bake works. error: relative, to aim at;
    patches: wanted number; transport_rays: of a patch side; shadow_rays: to a lamp with size;
    gather_rays: of a sample point; passes over all cells before the error is first estimated, boundary_passes over the
    cells that shadow boundaries cross; tolerance: of the solve; threshold: form factor under which pairs are culled;
    emitters_by_rays: emitting triangles are too many to be lamps."""

    error: float
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


def plan(scene: Scene, settings: Settings) -> Plan:
    """Decide and predict. Traces a few thousand rays to know this machine; changes nothing."""
    effort = choose_effort(scene, settings)
    effects = choose_effects(scene, settings)
    receivers = scene.receivers()
    vertices, triangles = [o.vertices for o in receivers], [o.triangles for o in receivers]
    edge = settings.size or edge_for_count(vertices, triangles, settings.triangles)
    cells = predicted_count(vertices, triangles, edge)
    unpriced = Plan(effects, effort, cells, 0.0, 0.0)
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
    effort, cells, looks_around = unpriced.effort, unpriced.cells, unpriced.looks_around
    ray = _seconds_per_ray(scene, unit_space(scene))
    sides = 1.2 * effort.patches if looks_around else 0
    lights = len(scene.lamps) + min(emitting_triangles(scene), MOST_PANELS)
    rays = 2 * sides * effort.transport_rays + (cells * effort.passes * effort.gather_rays if looks_around else 0)
    rays += lights * effort.shadow_rays * (cells * (effort.passes + 0.3 * effort.boundary_passes) + 8 * sides)
    work = rays * _RAY_OVERHEAD + cells * _CELL_OVERHEAD + sides * _SIDE_OVERHEAD
    seconds = work * ray / thread_count(settings.threads)
    if settings.seconds is not None:
        seconds = min(seconds, settings.seconds) if settings.error is not None else settings.seconds
    memory = (_BYTES_AT_REST + cells * _BYTES_PER_CELL + sides * _BYTES_PER_SIDE) / 1e6
    return seconds, memory


def _seconds_per_ray(scene: Scene, space: Space) -> float:
    patches = make_patches(scene, space, split_objects(scene, 2048))
    visibility = Visibility(patches.corners)
    rng = stream(0, "calibration")
    chosen = rng.integers(len(patches.area), size=_CALIBRATION_RAYS)
    directions = rng.normal(size=(_CALIBRATION_RAYS, 3)) + 1.5 * patches.normals[chosen]
    origins = patches.corners[chosen].mean(axis=1) + 1e-4 * patches.normals[chosen]
    begun = perf_counter()
    visibility.nearest(origins.astype(np.float32), directions.astype(np.float32))
    return (perf_counter() - begun) / _CALIBRATION_RAYS


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
