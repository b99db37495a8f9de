"""The ladder on a Blender file: a reference by Cycles, every rung baked from the file as it is, Cycles beside it."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter, process_time

import bpy
import numpy as np

from ..core.comparison import SurfacePoints, figures, radiance_at, reference_noise, scatter, visible
from ..core.ladder import Rung, Scale, Step, rungs
from ..core.progress import Progress
from ..core.result import BakedObject
from ..core.scene import Bool, Float64, Scene, SceneError
from ..core.settings import Settings
from .bake_scene import bake_objects
from .oracle import corner_bake, true_radiance
from .receiver_source import ReceiverSource
from .scene_reader import read_scene

#: Of the points and of Cycles' paths. Not the bake's: another seed of the bake is judged by the same reference.
_SEED = 7


@dataclass(frozen=True)
class Asked:
    """What to measure. points of the reference and samples (paths) of each of their three estimates."""

    path: Path
    folder: Path
    scale: Scale
    settings: Settings
    points: int
    samples: int


@dataclass(frozen=True, eq=False)
class Reference:
    """Points (p,) on the receivers, three estimates (p, 3, 3) of the true radiance there, which (p,) are visible."""

    scene: Scene
    points: SurfacePoints
    radiance: Float64
    visible: Bool

    @property
    def noise(self) -> float:
        return reference_noise(self.radiance)


def measure(
    asked: Asked,
    open_receivers: Callable[[], list[bpy.types.Object]],
    progress: Progress,
    say: Callable[[str], None],
) -> tuple[Reference, list[Step]]:
    """Climb the whole ladder. open_receivers: opens the file anew and picks what to bake. say: is told of each step.

    Raises SceneError for what cannot be baked or compared, Cancelled when progress says so.
    """
    context = bpy.context
    receivers = open_receivers()
    scene, sources = read_scene(context.evaluated_depsgraph_get(), receivers, tessellate=True)
    reference = _reference(asked, context, scene, say)
    ladder = rungs(scene, asked.scale, asked.settings)
    middle = next(rung for rung in ladder if rung.settings.triangles == asked.scale.triangles)
    steps: dict[Rung, Step] = {}
    # The middle comes last, since its mesh is what Cycles bakes next.
    for rung in sorted(ladder, key=lambda r: r is middle):
        steps[rung], baked, copies = _climb(rung, reference, open_receivers(), _Within(progress))
        say(_line(steps[rung]))
    rivals = []
    for samples in asked.scale.cycles:
        progress.check()
        rivals.append(_cycles(samples, reference, baked, sources, copies, asked.settings.threads))
        say(_line(rivals[-1]))
    return reference, [*(steps[rung] for rung in ladder), *rivals]


def _climb(
    rung: Rung, reference: Reference, receivers: list[bpy.types.Object], progress: Progress
) -> tuple[Step, Sequence[BakedObject], list[bpy.types.Object]]:
    begun, busy = perf_counter(), process_time()
    result, copies = bake_objects(
        bpy.context,
        receivers,
        rung.settings,
        result_mode="new",
        attribute="Radiosity",
        progress=progress,
        effort=rung.effort(reference.scene),
    )
    seconds, busy = perf_counter() - begun, process_time() - busy
    report = result.report
    step = _step(rung.series, rung.label, reference, result.objects, seconds, busy)
    step = replace(
        step,
        patches=report.patches,
        rays=report.rays["total"],
        estimated_error=report.estimated_error["total"],
    )
    return step, result.objects, copies


def _cycles(
    samples: int,
    reference: Reference,
    baked: Sequence[BakedObject],
    sources: Sequence[ReceiverSource],
    copies: list[bpy.types.Object],
    threads: int,
) -> Step:
    """Cycles' own bake to the corners of the meshes that a bake of ours has made."""
    begun, busy = perf_counter(), process_time()
    corners = corner_bake(bpy.context, copies, samples=samples, seed=_SEED + 1, threads=threads)
    seconds, busy = perf_counter() - begun, process_time() - busy
    objects = with_corners(baked, sources, corners)
    return _step("Cycles", f"{samples:,} samples", reference, objects, seconds, busy)


def with_corners(
    baked: Sequence[BakedObject], sources: Sequence[ReceiverSource], corners: Sequence[Float64]
) -> list[BakedObject]:
    """The baked meshes with other values: those that their corners have in Blender, (corners, 3) for each source."""
    ours = {own.name: own for own in baked}
    objects = []
    for source, values in zip(sources, corners, strict=True):
        turn = [0, 2, 1] if source.flipped else [0, 1, 2]
        layer = values.reshape(-1, 3, 3)[:, turn].astype(np.float32)
        objects.append(replace(ours[source.name], layers={"combined": layer}))
    return objects


def _step(
    series: str, label: str, reference: Reference, objects: Sequence[BakedObject], seconds: float, busy: float
) -> Step:
    values = radiance_at(objects, reference.points)
    everywhere = figures(values, reference.radiance)
    seen = figures(values[reference.visible], reference.radiance[reference.visible])
    return Step(
        series,
        label,
        triangles=sum(len(o.triangles) for o in objects),
        patches=0,
        rays=0,
        seconds=seconds,
        processor_seconds=busy,
        surface_error=seen.surface,
        uncertainty=seen.uncertainty,
        typical_error=seen.typical,
        bias=seen.bias,
        everywhere_surface_error=everywhere.surface,
        everywhere_typical_error=everywhere.typical,
        estimated_error=None,
    )


def _reference(asked: Asked, context: bpy.types.Context, scene: Scene, say: Callable[[str], None]) -> Reference:
    """From the output folder if the file and all that matters are the same as then, since nothing costs more."""
    points = scatter(scene, asked.points, _SEED)
    path = asked.folder / f"reference-{_key(asked, scene)}.npz"
    if path.exists():
        with np.load(path) as stored:
            radiance = stored["radiance"]
        say(f"Reference: taken from {path.name}.")
    else:
        begun = perf_counter()
        threads = asked.settings.threads
        radiance = true_radiance(context, scene, points, samples=asked.samples, seed=_SEED, threads=threads)
        if not radiance.any():
            raise SceneError("Cycles finds no light on these objects: check the lamps, the world and the materials.")
        unfinished = path.with_suffix(".part.npz")
        np.savez_compressed(unfinished, radiance=radiance, position=points.position)
        unfinished.replace(path)
        say(f"Reference: {asked.points:,} points by Cycles in {perf_counter() - begun:.1f} s.")
    return Reference(scene, points, radiance, visible(scene, points, radiance))


def _key(asked: Asked, scene: Scene) -> str:
    names = [receiver.name for receiver in scene.receivers()]
    settings = repr((names, asked.points, asked.samples, _SEED, bpy.app.version_string))
    return hashlib.sha256(asked.path.read_bytes() + settings.encode()).hexdigest()[:16]


def _line(step: Step) -> str:
    stated = "" if step.estimated_error is None else f" (stated {step.estimated_error:.2%})"
    return (
        f"{step.series}, {step.label}: {step.seconds:.2f} s, surface error {step.surface_error:.2%}{stated}, "
        f"typical {step.typical_error:.2%}"
    )


class _Within(Progress):
    """The progress of one bake of many: silent, and cancelled with the whole."""

    def __init__(self, whole: Progress) -> None:
        super().__init__()
        self._whole = whole

    def check(self) -> None:
        self._whole.check()
