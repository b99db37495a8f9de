"""The operators: one bake with two drivers, its cancel button, and its plan.

From a script or in background `execute` blocks until the light is baked. In a window `invoke` reads the scene, leaves
the bake to a worker thread and looks in ten times a second; all that the bake writes is written in the last of these
ticks, so a cancelled bake has touched nothing, and one undo step takes a finished one back.
"""

import json
import time
import traceback
from collections.abc import Callable
from dataclasses import asdict
from typing import ClassVar

import bpy
from bpy.app.handlers import persistent

from ..core.plan import plan
from ..core.progress import Cancelled, Progress
from ..core.result import BakeResult
from ..core.scene import SceneError
from . import attribute_writer, bake_scene, panels, scene_reader, viewport, wording
from .job import BakeJob

TICK_SECONDS = 0.1


class OBJECT_OT_radiosity_bake(bpy.types.Operator):
    bl_idname = "object.radiosity_bake"
    bl_label = "Bake Radiosity"
    bl_description = (
        "Bake the light of the whole scene into colour attributes of the selected mesh objects, "
        "or of all mesh objects when none is selected"
    )
    bl_options: ClassVar[set[str]] = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return _can_bake(cls, context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        return _attempt(self, lambda: self._bake_at_once(context))

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        return _attempt(self, lambda: self._start(context))

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if event.type == "ESC" and event.value == "PRESS":
            self._job.cancel()
            panels.redraw(context)
            return {"RUNNING_MODAL"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        panels.redraw(context)
        if not self._job.poll() or not (self._job.cancelling or _can_write(context)):
            return {"PASS_THROUGH"}
        outcome = _attempt(self, lambda: self._finish(context))
        self._leave()
        return outcome

    def cancel(self, _context: bpy.types.Context) -> None:
        """Blender takes the operator away: the window closes, or another file is loaded."""
        self._job.stop()
        self._leave()

    def _bake_at_once(self, context: bpy.types.Context) -> None:
        asked = context.scene.radiosity_baker
        receivers = scene_reader.pick_receivers(context.scene, context.view_layer, None)
        result, _ = bake_scene.bake_objects(
            context,
            receivers,
            asked.to_core(),
            result_mode=asked.result_mode(),
            attribute=asked.attribute,
            progress=Progress(),
        )
        self._conclude(context, result)

    def _start(self, context: bpy.types.Context) -> set[str]:
        asked = context.scene.radiosity_baker
        settings = asked.to_core()
        # What was asked at the start counts, whatever is changed in the panel meanwhile.
        self._result_mode, self._attribute, self._scene_name = asked.result_mode(), asked.attribute, context.scene.name
        receivers = scene_reader.pick_receivers(context.scene, context.view_layer, None)
        attribute_writer.check_writable(
            receivers, settings.layers, result_mode=self._result_mode, attribute=self._attribute
        )
        begun = time.perf_counter()
        scene, self._sources = scene_reader.read_scene(
            context.evaluated_depsgraph_get(), receivers, tessellate=settings.tessellate
        )
        self._read_seconds = time.perf_counter() - begun
        self._job = BakeJob()
        self._job.start(scene, settings)
        _start_ticking(context)
        context.window_manager.modal_handler_add(self)
        panels.redraw(context)
        return {"RUNNING_MODAL"}

    def _leave(self) -> None:
        _stop_ticking()
        # Blender keeps finished operators for its history; what they hold would stay in memory with them.
        del self._job, self._sources

    def _finish(self, context: bpy.types.Context) -> None:
        result = self._job.result()
        if context.scene.name != self._scene_name:
            raise SceneError(
                f"The scene '{self._scene_name}' was left during the bake, so its light was not written: "
                "stay in the scene until the bake is done."
            )
        begun = time.perf_counter()
        attribute_writer.write(context, result, self._sources, result_mode=self._result_mode, attribute=self._attribute)
        seconds = result.report.seconds
        seconds.update(read=self._read_seconds, write=time.perf_counter() - begun)
        seconds["total"] += seconds["read"] + seconds["write"]
        self._conclude(context, result)

    def _conclude(self, context: bpy.types.Context, result: BakeResult) -> None:
        asked = context.scene.radiosity_baker
        asked.remember(result.report.as_dict())
        view = viewport.find_view(context)
        if asked.show_when_done and view is not None:
            viewport.show(view)
        for warning in result.report.warnings:
            self.report({"WARNING"}, warning)
        self.report({"INFO"}, wording.summary(result.report.as_dict()))


class OBJECT_OT_radiosity_plan(bpy.types.Operator):
    bl_idname = "object.radiosity_plan"
    bl_label = "Plan Bake"
    bl_description = "Find out which effects of light this scene calls for, and what the bake would cost"
    bl_options: ClassVar[set[str]] = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return _can_bake(cls, context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        return _attempt(self, lambda: self._plan(context))

    def _plan(self, context: bpy.types.Context) -> None:
        asked = context.scene.radiosity_baker
        settings = asked.to_core()
        receivers = scene_reader.pick_receivers(context.scene, context.view_layer, None)
        scene, _ = scene_reader.read_scene(context.evaluated_depsgraph_get(), receivers, tessellate=settings.tessellate)
        planned = plan(scene, settings)
        asked.plan = json.dumps(
            {
                "seconds": planned.seconds,
                "memory_mb": planned.memory_mb,
                "effects": [asdict(effect) for effect in planned.effects],
            }
        )


def _attempt(operator: bpy.types.Operator, action: Callable[[], set[str] | None]) -> set[str]:
    """Do it; whatever goes wrong reaches the person, and what is not their doing reaches the console too."""
    try:
        return action() or {"FINISHED"}
    except Cancelled:
        operator.report({"INFO"}, "Bake cancelled, nothing was changed")
    except SceneError as problem:
        operator.report({"ERROR"}, str(problem))
    except Exception as problem:  # noqa: BLE001 - nothing a bake throws may vanish
        traceback.print_exc()
        operator.report({"ERROR"}, f"The bake failed, see the console for details. {type(problem).__name__}: {problem}")
    return {"CANCELLED"}


def _can_bake(operator: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
    if BakeJob.running is not None:
        operator.poll_message_set("A bake is already running")
        return False
    if not _can_write(context):
        operator.poll_message_set("Switch to Object Mode to bake")
        return False
    return True


_timers: list[bpy.types.Timer] = []


def _start_ticking(context: bpy.types.Context) -> None:
    _timers.append(context.window_manager.event_timer_add(TICK_SECONDS, window=context.window))


def _stop_ticking() -> None:
    while _timers:
        bpy.context.window_manager.event_timer_remove(_timers.pop())
    panels.redraw(bpy.context)


def _can_write(context: bpy.types.Context) -> bool:
    """Other modes keep meshes and an undo history of their own: the result waits until they are left."""
    return context.mode == "OBJECT"


class OBJECT_OT_radiosity_cancel(bpy.types.Operator):
    bl_idname = "object.radiosity_cancel"
    bl_label = "Cancel Bake"
    bl_description = "Stop the bake and leave everything as it was"
    bl_options: ClassVar[set[str]] = {"INTERNAL"}

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        return BakeJob.running is not None

    def execute(self, _context: bpy.types.Context) -> set[str]:
        BakeJob.running.cancel()
        return {"FINISHED"}


def _draw_menu(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
    menu.layout.separator()
    menu.layout.operator(OBJECT_OT_radiosity_bake.bl_idname)


@persistent
def _stop_bake(*_: object) -> None:
    # Blender drops a running operator without a word when its class is unregistered, so the ticks are stopped here.
    if BakeJob.running is not None:
        BakeJob.running.stop()
        _stop_ticking()


def register() -> None:
    bpy.utils.register_class(OBJECT_OT_radiosity_bake)
    bpy.utils.register_class(OBJECT_OT_radiosity_cancel)
    bpy.utils.register_class(OBJECT_OT_radiosity_plan)
    bpy.types.VIEW3D_MT_object.append(_draw_menu)
    bpy.app.handlers.load_pre.append(_stop_bake)


def unregister() -> None:
    _stop_bake()
    bpy.app.handlers.load_pre.remove(_stop_bake)
    bpy.types.VIEW3D_MT_object.remove(_draw_menu)
    bpy.utils.unregister_class(OBJECT_OT_radiosity_plan)
    bpy.utils.unregister_class(OBJECT_OT_radiosity_cancel)
    bpy.utils.unregister_class(OBJECT_OT_radiosity_bake)
