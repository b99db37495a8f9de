"""The operators: one bake with two drivers, its cancel button, and its plan.

From a script or in background `execute` blocks until the light is baked. In a window `invoke` reads the scene, leaves
the bake to a worker thread and looks in twenty times a second; what the bake writes takes its place in the last of
these ticks, so a cancelled bake has touched nothing, and one undo step takes a finished one back.
"""

import traceback
from collections.abc import Callable
from typing import ClassVar

import bpy
from bpy.app.handlers import persistent

from ..core.progress import Cancelled, Progress
from ..core.result import BakeResult
from ..core.scene import SceneError
from . import (
    attribute_writer,
    bake_scene,
    checklist,
    copies,
    light_materials,
    panels,
    planning,
    scene_reader,
    viewport,
    wording,
)
from .job import BakeJob
from .translations import told
from .window_bake import WindowBake


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
        bake = WindowBake.running
        if bake is None:
            return {"CANCELLED"}  # The add-on has ended it already: another file is being loaded.
        escaped = event.type == "ESC" and event.value == "PRESS"
        if escaped:
            bake.job.cancel()
        elif event.type != "TIMER":
            # What is being written must not be changed or undone meanwhile; it takes a moment only.
            return {"RUNNING_MODAL" if bake.job.writing else "PASS_THROUGH"}
        outcome = _attempt(self, lambda: self._advance(context, bake))
        if outcome == {"RUNNING_MODAL"}:
            return {"PASS_THROUGH"}
        _end_bake()
        return outcome

    def cancel(self, _context: bpy.types.Context) -> None:
        """Blender takes the operator away: the window closes, or another file is loaded."""
        _end_bake()

    def _bake_at_once(self, context: bpy.types.Context) -> None:
        asked = context.scene.radiosity_baker
        receivers = scene_reader.pick_receivers(context.scene, context.view_layer, None)
        result, _ = bake_scene.bake_objects(
            context,
            receivers,
            asked.to_core(),
            result_mode=asked.result_mode(),
            attribute=asked.attribute,
            storage=asked.storage(),
            progress=Progress(),
        )
        self._conclude(context, result)

    def _start(self, context: bpy.types.Context) -> set[str]:
        if bpy.app.background:
            self._bake_at_once(context)
            return {"FINISHED"}
        WindowBake(context)
        context.window_manager.modal_handler_add(self)
        panels.redraw(context)
        return {"RUNNING_MODAL"}

    def _advance(self, context: bpy.types.Context, bake: WindowBake) -> set[str]:
        result = bake.advance(context)
        if bake.has_news():
            panels.redraw(context)
        if result is None:
            return {"RUNNING_MODAL"}
        self._conclude(context, result)
        return {"FINISHED"}

    def _conclude(self, context: bpy.types.Context, result: BakeResult) -> None:
        asked = context.scene.radiosity_baker
        asked.remember(result.report.as_dict())
        view = viewport.find_view(context)
        if asked.show_when_done and view is not None:
            viewport.show(view)
        for warning in result.report.warnings:
            self.report({"WARNING"}, told(warning))
        self.report({"INFO"}, wording.summary(result.report.as_dict()))


class OBJECT_OT_radiosity_plan(bpy.types.Operator):
    bl_idname = "object.radiosity_plan"
    bl_label = "Check and Plan"
    bl_description = (
        "Find out what stands in the way of a good bake, which effects of light this scene calls for, and what the "
        "bake would cost"
    )
    bl_options: ClassVar[set[str]] = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return _can_bake(cls, context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        return _attempt(self, lambda: planning.make(context))


class OBJECT_OT_radiosity_switch_effect(bpy.types.Operator):
    bl_idname = "object.radiosity_switch_effect"
    bl_label = "Switch Effect"
    bl_description = "Simulate this effect, or do not, whatever the scene calls for. Again leaves it to the scene"
    bl_options: ClassVar[set[str]] = {"INTERNAL", "UNDO"}

    effect: bpy.props.StringProperty(options={"HIDDEN"})
    active: bpy.props.BoolProperty(options={"HIDDEN"})

    def execute(self, context: bpy.types.Context) -> set[str]:
        context.scene.radiosity_baker.switch_effect(self.effect, self.active)
        return _attempt(self, lambda: planning.make(context))


class OBJECT_OT_radiosity_fix(bpy.types.Operator):
    bl_idname = "object.radiosity_fix"
    bl_label = "Fix"
    bl_description = "Mend this, as an ordinary edit that can be undone"
    bl_options: ClassVar[set[str]] = {"REGISTER", "UNDO", "INTERNAL"}

    number: bpy.props.IntProperty(options={"HIDDEN"})

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return _can_bake(cls, context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        problems = context.scene.radiosity_baker.problems()
        if not 0 <= self.number < len(problems):
            return {"CANCELLED"}
        checklist.fix(context, problems[self.number])
        return _attempt(self, lambda: planning.make(context))


class OBJECT_OT_radiosity_accuracy(bpy.types.Operator):
    bl_idname = "object.radiosity_accuracy"
    bl_label = "Choose Accuracy"
    bl_description = "Bake for this error"
    bl_options: ClassVar[set[str]] = {"INTERNAL", "UNDO"}

    percent: bpy.props.FloatProperty(options={"HIDDEN"})

    def execute(self, context: bpy.types.Context) -> set[str]:
        asked = context.scene.radiosity_baker
        asked.goal, asked.error = "ERROR", self.percent
        return {"FINISHED"}


class OBJECT_OT_radiosity_refine(bpy.types.Operator):
    bl_idname = "object.radiosity_refine"
    bl_label = "Refine"
    bl_description = "Ask for half the error, and bake again"
    bl_options: ClassVar[set[str]] = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return _can_bake(cls, context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        asked = context.scene.radiosity_baker
        reached = (asked.last_report() or {}).get("estimated_error", {}).get("total", asked.error / 100.0)
        asked.goal, asked.error = "ERROR", max(50.0 * reached, 0.1)
        return bpy.ops.object.radiosity_bake("INVOKE_DEFAULT")


class OBJECT_OT_radiosity_clear(bpy.types.Operator):
    bl_idname = "object.radiosity_clear"
    bl_label = "Clear Baked Light"
    bl_description = (
        "Remove all baked light of this scene: the copies and their collection, and the colour attributes that were "
        "made. The originals are shown again as they were"
    )
    bl_options: ClassVar[set[str]] = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return _can_bake(cls, context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        light_materials.put_back(obj for obj in context.scene.objects if obj.type == "MESH")
        copies.remove_copies(context.view_layer, list(context.view_layer.objects))
        for obj in context.scene.objects:
            if obj.type == "MESH" and obj.data.library is None:
                attribute_writer.remove_layers(obj.data)
        asked = context.scene.radiosity_baker
        asked.report = asked.plan = ""
        if viewport.is_shown(context):
            viewport.restore(viewport.find_view(context))
        return {"FINISHED"}


def _attempt(operator: bpy.types.Operator, action: Callable[[], set[str] | None]) -> set[str]:
    """Do it; whatever goes wrong reaches the person, and what is not their doing reaches the console too."""
    try:
        return action() or {"FINISHED"}
    except Cancelled:
        operator.report({"INFO"}, told("Bake cancelled, nothing was changed"))
    except SceneError as problem:
        operator.report({"ERROR"}, told(str(problem)))
    except Exception as problem:  # noqa: BLE001 - nothing a bake throws may vanish
        traceback.print_exc()
        failed = f"The bake failed, see the console for details. {type(problem).__name__}: {problem}"
        operator.report({"ERROR"}, told(failed))
    return {"CANCELLED"}


def _can_bake(operator: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
    if BakeJob.running is not None:
        operator.poll_message_set(told("A bake is already running"))
        return False
    if context.mode != "OBJECT":
        operator.poll_message_set(told("Switch to Object Mode to bake"))
        return False
    return True


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


class OBJECT_OT_radiosity_keep(bpy.types.Operator):
    bl_idname = "object.radiosity_keep"
    bl_label = "Stop and Keep"
    bl_description = "Stop the bake, and keep the light as far as it has come"
    bl_options: ClassVar[set[str]] = {"INTERNAL"}

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        return BakeJob.running is not None and BakeJob.running.latest is not None

    def execute(self, _context: bpy.types.Context) -> set[str]:
        BakeJob.running.keep()
        return {"FINISHED"}


@persistent
def _end_bake(*_: object) -> None:
    """However a bake ends. Blender drops a running operator without a word when its class is unregistered."""
    if BakeJob.running is not None:
        BakeJob.running.stop()
    if WindowBake.running is not None:
        WindowBake.running.close()
        panels.redraw(bpy.context)


@persistent
def _clear_desk(*_: object) -> None:
    """Another file is about to be loaded, or the add-on to be disabled: no thread and no memory may outlive that."""
    _end_bake()
    BakeJob.wait_for_leaving()
    BakeJob.memory.forget()


OPERATORS = (
    OBJECT_OT_radiosity_bake,
    OBJECT_OT_radiosity_cancel,
    OBJECT_OT_radiosity_keep,
    OBJECT_OT_radiosity_plan,
    OBJECT_OT_radiosity_switch_effect,
    OBJECT_OT_radiosity_fix,
    OBJECT_OT_radiosity_accuracy,
    OBJECT_OT_radiosity_refine,
    OBJECT_OT_radiosity_clear,
)


def register() -> None:
    for operator in OPERATORS:
        bpy.utils.register_class(operator)
    bpy.types.VIEW3D_MT_object.append(_draw_menu)
    bpy.app.handlers.load_pre.append(_clear_desk)


def unregister() -> None:
    _clear_desk()
    bpy.app.handlers.load_pre.remove(_clear_desk)
    bpy.types.VIEW3D_MT_object.remove(_draw_menu)
    for operator in reversed(OPERATORS):
        bpy.utils.unregister_class(operator)
