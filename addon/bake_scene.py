"""The whole way in one blocking call: read the scene, bake, write the attributes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from time import perf_counter

import bpy

from ..core.bake import bake
from ..core.memory import Memory
from ..core.plan import Effort
from ..core.progress import Progress
from ..core.result import BakeResult
from ..core.settings import Settings
from .attribute_writer import FLOATS, ResultMode, check_writable, write
from .colour_storage import Storage
from .copies import ORIGINAL_KEY
from .scene_reader import read_scene


def bake_objects(
    context: bpy.types.Context,
    objects: Sequence[bpy.types.Object],
    settings: Settings,
    *,
    result_mode: ResultMode,
    attribute: str,
    storage: Storage = FLOATS,
    progress: Progress | None = None,
    effort: Effort | None = None,
    memory: Memory | None = None,
) -> tuple[BakeResult, list[bpy.types.Object]]:
    """Bake the objects and return the result and the objects that carry it now.

    settings.tessellate must be False for the result `keep`; effort and memory are those of core.bake. The seconds for
    reading and writing join the report.
    Raises SceneError for what cannot be baked or written, Cancelled when stopped; nothing is changed then.
    """
    check_writable(objects, settings.layers, result_mode=result_mode, attribute=attribute)
    begun = perf_counter()
    scene, sources = read_scene(context.evaluated_depsgraph_get(), objects, tessellate=settings.tessellate)
    read = perf_counter()
    result = bake(scene, settings, progress, effort, memory=memory)
    baked = perf_counter()
    written = write(context, result, sources, result_mode=result_mode, attribute=attribute, storage=storage)
    done = perf_counter()
    result.report.seconds.update(read=read - begun, write=done - baked, total=done - begun)
    return result, written


def bake_frames(
    context: bpy.types.Context,
    objects: Sequence[bpy.types.Object],
    settings: Settings,
    frames: Sequence[int],
    *,
    result_mode: ResultMode,
    attribute: str,
    storage: Storage = FLOATS,
    progress: Progress | None = None,
) -> tuple[BakeResult, list[bpy.types.Object]]:
    """Bake the light of each frame into layers of its own: `<attribute> 0001` and so on.

    Lamps may move and change; the shape is that of the first frame, which all layers share. The report is that of the
    first frame, with the objects and the seconds of all. Raises as `bake_objects`; frames that are done stay.
    """
    scene = context.scene
    before = scene.frame_current
    try:
        scene.frame_set(frames[0])
        first, written = bake_objects(
            context,
            objects,
            settings,
            result_mode=result_mode,
            attribute=frame_attribute(attribute, frames[0]),
            storage=storage,
            progress=progress,
        )
        memory = Memory()
        with _as_originals(written):
            for frame in frames[1:]:
                scene.frame_set(frame)
                result, _ = bake_objects(
                    context,
                    written,
                    replace(settings, tessellate=False),
                    result_mode="keep",
                    attribute=frame_attribute(attribute, frame),
                    storage=storage,
                    progress=progress,
                    memory=memory,
                )
                first.report.objects += result.report.objects
                told = first.report.warnings
                told += [warning for warning in result.report.warnings if warning not in told]
                for stage, seconds in result.report.seconds.items():
                    first.report.seconds[stage] = first.report.seconds.get(stage, 0.0) + seconds
    finally:
        scene.frame_set(before)
    return first, written


def frame_attribute(attribute: str, frame: int) -> str:
    """The name of a frame's combined layer."""
    return f"{attribute} {frame:04d}"


@contextmanager
def _as_originals(copies: Sequence[bpy.types.Object]) -> Iterator[None]:
    """Within, copies count as objects of their own, so that more light can be written to them as they are."""
    originals = [(copy, copy[ORIGINAL_KEY]) for copy in copies if copy.get(ORIGINAL_KEY) is not None]
    for copy, _ in originals:
        del copy[ORIGINAL_KEY]
    try:
        yield
    finally:
        for copy, original in originals:
            copy[ORIGINAL_KEY] = original
