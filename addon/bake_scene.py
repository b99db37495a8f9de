"""The whole way in one blocking call: read the scene, bake, write the attributes."""

from __future__ import annotations

from collections.abc import Sequence
from time import perf_counter

import bpy

from ..core.bake import bake
from ..core.plan import Effort
from ..core.progress import Progress
from ..core.result import BakeResult
from ..core.settings import Settings
from .attribute_writer import ResultMode, check_writable, write
from .scene_reader import read_scene


def bake_objects(
    context: bpy.types.Context,
    objects: Sequence[bpy.types.Object],
    settings: Settings,
    *,
    result_mode: ResultMode,
    attribute: str,
    progress: Progress | None = None,
    effort: Effort | None = None,
) -> tuple[BakeResult, list[bpy.types.Object]]:
    """Bake the objects and return the result and the objects that carry it now.

    settings.tessellate must be False for the result `keep`; effort is that of core.bake. The seconds for reading and
    writing join the report.
    Raises SceneError for what cannot be baked or written, Cancelled when stopped; nothing is changed then.
    """
    check_writable(objects, settings.layers, result_mode=result_mode, attribute=attribute)
    begun = perf_counter()
    scene, sources = read_scene(context.evaluated_depsgraph_get(), objects, tessellate=settings.tessellate)
    read = perf_counter()
    result = bake(scene, settings, progress, effort)
    baked = perf_counter()
    written = write(context, result, sources, result_mode=result_mode, attribute=attribute)
    done = perf_counter()
    result.report.seconds.update(read=read - begun, write=done - baked, total=done - begun)
    return result, written
