"""What a bake will simulate, why, and what that will cost."""

from __future__ import annotations

from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np

from .direct.emitters import emitting_pieces
from .direct.illumination import MOST_ASKED
from .effects import LAMPS, choose_effects, emitters_by_rays, goes_on
from .parallel import Workers, thread_count
from .patches import Space, make_patches, split_objects, unit_space
from .progress import Progress
from .result import Effect
from .sampling import stream
from .scene import Scene
from .settings import Settings
from .tessellation import edge_for_count, predicted_count
from .textures import varies
from .visibility import Visibility

#: Effects that need rays over the hemisphere.
LOOKING = ("bounces", "sky")
#: What no single effect costs: points, fit and layers.
REST = "the rest"
#: With how many times fewer triangles than asked for the receivers start, to get finer where light calls for it.
_COARSEST = 16.0
#: Triangles and patches below which a bake shows next to nothing.
_FEWEST = 1500
#: Rays that measure how fast this machine traces this scene.
_CALIBRATION_RAYS = 1 << 16
#: What a ray that looks around, a shadow ray, a cell and a patch side cost, in rays that only meet something: measured
#: on the sample scenes, as ratios, which machines share better than seconds.
_RAY_COST, _SHADOW_COST, _CELL_COST, _SIDE_COST = 1.7, 1.5, 180.0, 300.0
#: Choosing among many emitting triangles costs as much as this many lamps.
_TREE_COST = 8
_BYTES_PER_CELL, _BYTES_PER_SIDE, _BYTES_AT_REST = 4000.0, 6000.0, 200e6


@dataclass(frozen=True)
class Effort:
    """How hard a bake works.

    error: relative, to aim at; triangles: at most, where no size is asked for; coarsest: with how many times fewer
    adaptation starts; growth: how many times as many it may add where a size is asked for; patches: wanted number;
    transport_rays: of a patch side; shadow_rays: to a lamp with size; gather_rays: of a sample point; passes over all
    cells before the error is first estimated, boundary_passes over the cells where shadow boundaries leave the light
    uncertain; tolerance: of the solve; threshold: form factor under which pairs are culled; emitters_by_rays: emitting
    triangles are too many to be lamps.
    """

    error: float
    triangles: int
    coarsest: float
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
    """scene: with nothing in it but the effects that are simulated; effects with their reasons; how hard to work; the
    cost predicted from a short calibration of this machine: costs, seconds by effect and of all together (REST)."""

    scene: Scene
    effects: tuple[Effect, ...]
    effort: Effort
    cells: int
    costs: dict[str, float]
    seconds: float
    memory_mb: float

    @property
    def looks_around(self) -> bool:
        """Whether any effect needs rays over the hemisphere."""
        return self.effort.emitters_by_rays or any(self.active(name) for name in LOOKING)

    def active(self, name: str) -> bool:
        """Whether an effect is simulated."""
        return next(effect.active for effect in self.effects if effect.name == name)


def plan(scene: Scene, settings: Settings, effort: Effort | None = None) -> Plan:
    """Decide and predict. Traces a few thousand rays to know this machine; changes nothing.

    effort: to work just so hard, instead of as hard as the settings call for.
    """
    effects, scene = choose_effects(scene, settings)
    if effort is not None:
        return _priced(scene, settings, effects, effort)
    effort = choose_effort(scene, settings)
    planned = _priced(scene, settings, effects, effort)
    if settings.seconds is None or planned.seconds <= settings.seconds:
        return planned
    # Too little time for all: fewer triangles and patches, down to where they would show nothing any more.
    share = max(settings.seconds / planned.seconds, 0.02)
    patches = max(int(effort.patches * share), min(effort.patches, _FEWEST))
    triangles = max(int(effort.triangles * share), _FEWEST)
    fewer = replace(effort, triangles=triangles, coarsest=1.0, growth=0.3, patches=patches)
    return replace(_priced(scene, settings, effects, fewer), seconds=settings.seconds)


def _priced(scene: Scene, settings: Settings, effects: tuple[Effect, ...], effort: Effort) -> Plan:
    receivers = scene.receivers()
    vertices, triangles = [o.vertices for o in receivers], [o.triangles for o in receivers]
    edge = settings.size or edge_for_count(vertices, triangles, effort.triangles)
    unpriced = Plan(scene, effects, effort, predicted_count(vertices, triangles, edge), {}, 0.0, 0.0)
    costs, memory = predict(scene, settings, unpriced)
    return replace(unpriced, costs=costs, seconds=sum(costs.values()), memory_mb=memory)


def choose_effort(scene: Scene, settings: Settings) -> Effort:
    """Finer patches and more rays for a smaller error; the quadratic estimators get fewer patches."""
    asked = settings.error or (0.02 if settings.seconds is None else 0.01)
    finer = min(max(0.02 / asked, 0.25), 4.0)
    estimator = "hemisphere" if settings.estimator == "auto" or goes_on(scene) else settings.estimator
    patches = int(4096 * finer) if estimator == "hemisphere" else int(1500 * finer)
    # Where light bends is no guide to where a texture has its detail.
    textured = any(varies(scene, o) for o in scene.receivers())
    return Effort(
        error=asked,
        triangles=settings.triangles,
        coarsest=_COARSEST if settings.tessellate and settings.size is None and not textured else 1.0,
        growth=2.0,
        estimator=estimator,
        patches=patches,
        transport_rays=64,
        shadow_rays=4,
        gather_rays=gather_rays(asked),
        passes=2,
        boundary_passes=8,
        tolerance=min(asked / 20, 1e-3),
        threshold=1e-5,
        emitters_by_rays=emitters_by_rays(scene),
    )


def gather_rays(error: float) -> int:
    """Rays of a sample point: as many as bring its noise in proportion to the asked error. A power of two."""
    return int(2 ** np.clip(np.rint(np.log2(32 * (0.02 / error) ** 2)), 3, 6))


def predict(scene: Scene, settings: Settings, unpriced: Plan) -> tuple[dict[str, float], float]:
    """Seconds by effect (those of REST serve all), and peak MB of the bake, from how long a few rays take here."""
    effort, cells = unpriced.effort, unpriced.cells
    sides = 1.2 * effort.patches if unpriced.looks_around else 0
    work = dict.fromkeys((*(kind for kind in LAMPS), "emitting surfaces"), 0.0)
    per_light = _SHADOW_COST * effort.shadow_rays * (cells * (effort.passes + 3) + 16 * sides)
    pieces = len(emitting_pieces(scene))
    if unpriced.active("emitting surfaces") and not pieces and not effort.emitters_by_rays:
        pieces = _TREE_COST
    asked = min(1.0, MOST_ASKED / max(len(scene.lamps) + pieces, 1))
    for name, kind in LAMPS.items():
        work[name] = asked * per_light * sum(isinstance(lamp, kind) for lamp in scene.lamps)
    work["emitting surfaces"] = asked * per_light * pieces
    if unpriced.looks_around:
        around = 2 * sides * effort.transport_rays + cells * effort.passes * effort.gather_rays
        # One look serves all that it may meet: it counts for the first of them.
        first = next((name for name in LOOKING if unpriced.active(name)), "emitting surfaces")
        work[first] = work.get(first, 0.0) + around * _RAY_COST + sides * _SIDE_COST
    work[REST] = cells * _CELL_COST
    per_ray = _seconds_per_ray(scene, unit_space(scene), thread_count(settings.threads))
    memory = (_BYTES_AT_REST + cells * _BYTES_PER_CELL + sides * _BYTES_PER_SIDE) / 1e6
    return {name: amount * per_ray for name, amount in work.items() if amount > 0}, memory


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
