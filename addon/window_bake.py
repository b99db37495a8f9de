"""A bake in the window, from the click to the light in the meshes, in short ticks of Blender's main thread."""

from __future__ import annotations

import time
from typing import ClassVar

import bpy

from ..core.result import BakeResult
from . import attribute_writer, scene_reader, viewport, wording
from .job import BakeJob
from .live_light import LiveLight, Picture
from .slices import Slices

#: How often the bake is looked after, and how long it may hold up Blender then.
TICK_SECONDS, SLICE_SECONDS = 0.03, 0.02
#: How long the click waits for the first light. A hand doesn't feel it, and the first that is drawn is light.
FIRST_LIGHT_SECONDS = 0.1


class WindowBake:
    """Reads the scene when made, then goes on with `advance`; `close` ends it wherever it is.

    What was asked at the start counts, whatever is changed in the panel meanwhile. Raises SceneError.
    """

    running: ClassVar[WindowBake | None] = None

    def __init__(self, context: bpy.types.Context) -> None:
        asked = context.scene.radiosity_baker
        settings = asked.to_core()
        self._mode, self._attribute = asked.result_mode(), asked.attribute
        self._storage = asked.storage()
        self._scene_uid = context.scene.session_uid
        receivers = scene_reader.pick_receivers(context.scene, context.view_layer, None)
        attribute_writer.check_writable(receivers, settings.layers, result_mode=self._mode, attribute=self._attribute)
        begun = time.perf_counter()
        scene, self._sources = scene_reader.read_scene(
            context.evaluated_depsgraph_get(), receivers, tessellate=settings.tessellate
        )
        self._read_seconds = time.perf_counter() - begun
        self.job = BakeJob(Picture.of)
        self.job.start(scene, settings)
        self._live = LiveLight(context.scene) if asked.show_while_baking else None
        self._shown: Picture | None = None
        self._told: tuple[str, str] | None = None
        self._slices: Slices[list[bpy.types.Object]] | None = None
        self._result: BakeResult | None = None
        self._timer = context.window_manager.event_timer_add(TICK_SECONDS, window=context.window)
        WindowBake.running = self
        if self._live is not None:
            self.job.wait_for_picture(FIRST_LIGHT_SECONDS)
            self._show(context)

    def advance(self, context: bpy.types.Context) -> BakeResult | None:
        """Do what there is to do at a tick; the result, once it is written. Raises what the bake raises."""
        if self.job.cancelling:
            return self.job.result()
        if self._slices is None:
            self._show(context)
            if self.job.poll() and self._may_write(context):
                self._result = self.job.result()
                BakeJob.running = self.job  # The desk is taken until all is written.
                self.job.writing = True
                self._write_begun = time.perf_counter()
                self._slices = Slices(
                    attribute_writer.writing(
                        context.view_layer,
                        self._result,
                        self._sources,
                        result_mode=self._mode,
                        attribute=self._attribute,
                        storage=self._storage,
                    )
                )
            return None
        if not self._slices.advance(SLICE_SECONDS) or self._result is None:
            return None
        seconds = self._result.report.seconds
        seconds.update(read=self._read_seconds, write=time.perf_counter() - self._write_begun)
        seconds["total"] += seconds["read"] + seconds["write"]
        return self._result

    def has_news(self) -> bool:
        """Is there more to tell than at the last call? To draw what has not changed would only slow the bake down."""
        before, self._told = self._told, (wording.stage(self.job), wording.time_line(self.job))
        return self._told != before

    def close(self) -> None:
        """Leave nothing behind but what has been written to its end."""
        if BakeJob.running is self.job:
            BakeJob.running = None
        if self._slices is not None:
            self._slices.stop()
        if self._live is not None:
            self._live.remove()
            viewport.redraw(bpy.context)
        bpy.context.window_manager.event_timer_remove(self._timer)
        WindowBake.running = None

    def _show(self, context: bpy.types.Context) -> None:
        if self._live is None:
            return
        if self.job.picture is not self._shown:
            self._shown = self.job.picture
            self._live.show(self._shown)
        if self._live.load():
            viewport.redraw(context)

    def _may_write(self, context: bpy.types.Context) -> bool:
        """Other modes keep meshes and an undo history of their own, other scenes other objects: the light waits."""
        return context.mode == "OBJECT" and context.scene.session_uid == self._scene_uid
