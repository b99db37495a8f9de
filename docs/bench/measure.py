"""What is measured of one bake, and of Cycles on the same mesh."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from time import perf_counter, process_time, thread_time
from typing import Any, TypeVar

import bpy
import numpy as np

from ...addon.accuracy import Reference, with_corners
from ...addon.bake_scene import bake_objects
from ...addon.oracle import corner_bake, true_radiance
from ...addon.scene_reader import ReceiverSource, read_scene
from ...core.comparison import figures, radiance_at, scatter, visible
from ...core.plan import Effort, plan
from ...core.report import peak_memory_mb
from ...core.result import BakedObject
from ...core.scene import Float64
from ...core.settings import Settings
from ...core.visibility import Visibility
from .scenes import build, subdivide

Measured = TypeVar("Measured")

#: Of the points and of Cycles' paths; the bakes have others.
_SEED = 7
#: Seconds from which on a bake is long.
_SHORT = 5.0
#: Where Linux takes the wish to forget how much memory this process has held at most (5).
_FORGET = Path("/proc/self/clear_refs")


@dataclass(frozen=True)
class Run:
    """One bake, ours or Cycles'. Errors and noise are relative to the mean radiance; seconds include reading from and
    writing to Blender.

    processor: seconds of all threads together. embree: seconds of all threads together inside Embree alone. noise: root
    mean square distance from its own converged result. stated: the error by the bake's own estimate. predicted, and
    predicted_mb: what the plan said before. peak_mb: what the process held at most, added_mb: by how much the bake made
    it grow.
    """

    name: str
    triangles: int
    seconds: float
    processor: float
    surface: float
    typical: float
    bias: float
    noise: float = float("nan")
    stated: float = float("nan")
    embree: float = float("nan")
    predicted: float = float("nan")
    predicted_mb: float = float("nan")
    peak_mb: float = float("nan")
    added_mb: float = float("nan")
    patches: int = 0
    iterations: int = 0
    rays: dict[str, int] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Baked:
    """A run, the values (p, 3) it shows at the reference's points, and what Cycles needs to bake the same mesh."""

    run: Run
    values: Float64
    objects: tuple[BakedObject, ...]
    sources: list[ReceiverSource]
    copies: list[bpy.types.Object]


def make_reference(name: str, points: int, samples: int, cache: Path, triangles: int = 0) -> Reference:
    """By Cycles, or from the folder `cache` if it was made before with the same arguments. triangles: about how many of
    one size the meshes are made of, if they are not as they were modelled."""
    objects = build(name)
    if triangles:
        subdivide(objects, triangles)
    scene, _ = read_scene(bpy.context.evaluated_depsgraph_get(), objects, tessellate=not triangles)
    at = scatter(scene, points, _SEED)
    path = cache / f"{name}-{triangles or 'modelled'}-{points}-{samples}.npz"
    if path.exists() and np.array_equal(np.load(path)["position"], at.position):
        radiance = np.load(path)["radiance"]
    else:
        radiance = true_radiance(bpy.context, scene, at, samples=samples, seed=_SEED, threads=0)
        cache.mkdir(parents=True, exist_ok=True)
        np.savez_compressed(path, radiance=radiance, position=at.position)
    return Reference(scene, at, radiance, visible(scene, at, radiance))


def bake_often(
    name: str, label: str, settings: Settings, reference: Reference | None, times: int, effort: Effort | None = None
) -> Baked:
    """As `bake_once`, but a short bake so many times: what it took is the median of that. A long one needs no more,
    for what disturbs it now and then evens out."""

    def once() -> tuple[float, Baked]:
        baked = bake_once(name, label, settings, reference, effort)
        return baked.run.seconds, baked

    bakes = _often(once, times)
    # Blender holds the meshes of the last one only.
    return replace(bakes[-1][1], run=_middle(bakes)[1].run)


def bake_once(
    name: str, label: str, settings: Settings, reference: Reference | None, effort: Effort | None = None
) -> Baked:
    """Build the scene anew and bake it, from Blender's meshes to Blender's attributes. Without a reference no error is
    known, and meshes that settings keep have as nearly settings.triangles as they can; else within a factor of two."""
    objects = build(name)
    if not settings.tessellate:
        subdivide(objects, settings.triangles, nearly=reference is None)
    scene, sources = read_scene(bpy.context.evaluated_depsgraph_get(), objects, tessellate=settings.tessellate)
    planned = plan(scene, settings, effort)
    held = _forget_peak_memory()
    with _embree() as inside:
        begun, busy = perf_counter(), process_time()
        result, copies = bake_objects(
            bpy.context,
            objects,
            settings,
            result_mode="new" if settings.tessellate else "keep",
            attribute="Radiosity",
            effort=effort,
        )
        seconds, busy = perf_counter() - begun, process_time() - busy
    report = result.report
    run = Run(
        label,
        triangles=sum(len(o.triangles) for o in result.objects),
        seconds=seconds,
        processor=busy,
        **_errors(result.objects, reference),
        stated=report.estimated_error.get("total", float("nan")),
        embree=sum(inside),
        predicted=planned.seconds,
        predicted_mb=planned.memory_mb,
        peak_mb=report.peak_memory_mb,
        added_mb=report.peak_memory_mb - held,
        patches=report.patches,
        iterations=report.iterations,
        rays=report.rays,
    )
    values = radiance_at(result.objects, reference.points) if reference else np.zeros((0, 3))
    return Baked(run, values, result.objects, sources, copies)


def bake_with_noise(name: str, label: str, settings: Settings, reference: Reference, times: int) -> Baked:
    """As `bake_often`, with the noise: two bakes with different seeds differ by sqrt 2 of what each is off by."""
    other = bake_once(name, label, replace(settings, seed=settings.seed + 1), reference).values
    baked = bake_often(name, label, settings, reference, times)
    truth, seen = reference.radiance, reference.visible
    noise = np.sqrt(np.mean((baked.values - other)[seen] ** 2) / 2.0) / truth[seen].mean()
    return replace(baked, run=replace(baked.run, noise=float(noise)))


def cycles_runs(baked: Baked, samples: tuple[int, ...], reference: Reference, threads: int, times: int) -> list[Run]:
    """Cycles' bakes to the corners of the mesh of `baked`, with rising numbers of samples; short ones so many times.

    The variance of its corners is v / samples, so two independent runs of m and n samples differ by v / m + v / n.
    """
    runs, values = [], []
    for count in samples:
        seconds, (busy, corners) = _middle(_often(partial(_cycles_once, baked, count, threads), times))
        objects = with_corners(baked.objects, baked.sources, corners)
        values.append(radiance_at(objects, reference.points)[reference.visible])
        triangles = sum(len(o.triangles) for o in objects)
        runs.append(Run(f"{count} samples", triangles, seconds, busy, **_errors(objects, reference)))
    mean = reference.radiance[reference.visible].mean()
    last = np.mean((values[-1] - values[-2]) ** 2) / (1.0 / samples[-1] + 1.0 / samples[-2])
    return [replace(run, noise=float(np.sqrt(last / n)) / float(mean)) for run, n in zip(runs, samples, strict=True)]


def _cycles_once(baked: Baked, samples: int, threads: int) -> tuple[float, tuple[float, list[Float64]]]:
    """Seconds by the clock and of the processor, and the corners' light."""
    begun, busy = perf_counter(), process_time()
    corners = corner_bake(bpy.context, baked.copies, samples=samples, seed=_SEED + samples, threads=threads)
    return perf_counter() - begun, (process_time() - busy, corners)


def _often(once: Callable[[], tuple[float, Measured]], times: int) -> list[tuple[float, Measured]]:
    """Seconds and what else came of it, of so many calls, or of one that is long."""
    found = [once()]
    while len(found) < times and found[0][0] < _SHORT:
        found.append(once())
    return found


def _middle(found: list[tuple[float, Measured]]) -> tuple[float, Measured]:
    """The one with the median seconds."""
    return sorted(found, key=lambda one: one[0])[len(found) // 2]


def _errors(objects: Any, reference: Reference | None) -> dict[str, float]:
    if reference is None:
        return dict.fromkeys(("surface", "typical", "bias"), float("nan"))
    values, seen = radiance_at(objects, reference.points), reference.visible
    found = figures(values[seen], reference.radiance[seen])
    return {"surface": found.surface, "typical": found.typical, "bias": found.bias}


def _forget_peak_memory() -> float:
    """What the process holds now, MB, from which on its peak counts; nan where the system forgets no peaks, as only
    Linux does."""
    if not _FORGET.exists():
        return float("nan")
    _FORGET.write_text("5", encoding="ascii")
    return peak_memory_mb()


@contextmanager
def _embree() -> Iterator[list[float]]:
    """Collect the seconds that each call into Embree keeps its own thread busy."""
    spent: list[float] = []
    lock = threading.Lock()

    def timed(method: Callable[..., Any]) -> Callable[..., Any]:
        def call(*arguments: Any) -> Any:
            begun = thread_time()
            try:
                return method(*arguments)
            finally:
                with lock:
                    spent.append(thread_time() - begun)

        return call

    kept = {name: getattr(Visibility, name) for name in ("nearest", "unblocked_along")}
    for name, method in kept.items():
        setattr(Visibility, name, timed(method))
    try:
        yield spent
    finally:
        for name, method in kept.items():
            setattr(Visibility, name, method)
