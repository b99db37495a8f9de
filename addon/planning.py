"""What is said before a bake: the check list, the plan, and the price of accuracy.

A button makes them. From then on they follow what is edited, as long as nobody has to wait for that: the scene is read
in a moment, and the rest is left to a thread, which touches numpy and Embree only.
"""

from __future__ import annotations

import json
import traceback
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import asdict, dataclass
from time import perf_counter
from typing import ClassVar

import bpy
from bpy.app.handlers import persistent

from ..core.lint import Finding, findings
from ..core.plan import Plan, plan_with_prices
from ..core.scene import Scene, SceneError
from ..core.settings import Settings
from . import checklist, scene_reader
from .checklist import Problem
from .job import BakeJob
from .places import redraw_panel

#: How long nothing must have changed, and how often a thread is looked after.
_REST_SECONDS, _POLL_SECONDS = 0.3, 0.05
#: A scene that takes longer to read than this is read when a person asks for it, and not behind their back.
_READING_SECONDS = 0.1
#: What the plan depends on. Scenes are told apart by their selection: the plan itself is kept in one.
_WATCHED = (bpy.types.Object, bpy.types.Mesh, bpy.types.Light, bpy.types.Material, bpy.types.World)
_WATCHED += (bpy.types.NodeTree, bpy.types.Collection, bpy.types.Image, bpy.types.Curve)


@dataclass(frozen=True, eq=False)
class Look:
    """What the main thread has read. problems: that need no arrays to be seen; scene: None where nothing shines."""

    settings: Settings
    mode: str
    problems: list[Problem]
    scene: Scene | None


@dataclass(frozen=True, eq=False)
class Verdict:
    """What the arrays say. costs: seconds by error."""

    found: list[Finding]
    plan: Plan
    costs: dict[float, float]


def make(context: bpy.types.Context) -> None:
    """Look at the scene and keep what there is to say of it in the settings, where drawing it costs nothing.

    Raises SceneError where there is nothing to bake.
    """
    Following.forget()
    look = _look_at_scene(context)
    _tell(context.scene, look, weigh(look))


def read(context: bpy.types.Context) -> Look:
    """What can be said at once, and the arrays for the rest. Raises SceneError where there is nothing to bake."""
    asked = context.scene.radiosity_baker
    settings, mode = asked.to_core(), asked.result_mode()
    receivers = scene_reader.pick_receivers(context.scene, context.view_layer, None)
    depsgraph = context.evaluated_depsgraph_get()
    problems = checklist.of_objects(receivers, mode, depsgraph)
    try:
        # What refuses the asked result is named already, and not to hide the rest.
        scene, _ = scene_reader.read_scene(depsgraph, receivers, tessellate=settings.tessellate or bool(problems))
    except scene_reader.NoLightError:
        return Look(settings, mode, [*problems, checklist.no_light()], None)
    return Look(settings, mode, problems, scene)


def _look_at_scene(context: bpy.types.Context) -> Look:
    """Read it, and remember how long that took and what was selected. Raises SceneError as `read`."""
    begun = perf_counter()
    Following.reading = True
    try:
        look = read(context)
        # What reading has switched on and off again must not count as an edit.
        context.view_layer.update()
    finally:
        Following.reading = False
    Following.seconds, Following.selected = perf_counter() - begun, _selected(context)
    return look


def weigh(look: Look) -> Verdict | None:
    """For any thread."""
    if look.scene is None:
        return None
    planned, costs = plan_with_prices(look.scene, look.settings)
    return Verdict(
        findings(look.scene, kept=look.mode == "keep"),
        planned,
        {error: priced.seconds for error, priced in costs.items()},
    )


def _tell(scene: bpy.types.Scene, look: Look, verdict: Verdict | None) -> None:
    problems, told = look.problems, {}
    if verdict is not None:
        problems = [*problems, *checklist.of_findings(verdict.found), *checklist.of_plan(verdict.plan)]
        told = {
            "seconds": verdict.plan.seconds,
            "memory_mb": verdict.plan.memory_mb,
            "effects": [asdict(effect) for effect in verdict.plan.effects],
            "costs": list(verdict.costs.items()),
        }
    scene.radiosity_baker.plan = json.dumps(told | {"problems": [asdict(problem) for problem in problems]})


class Following:
    """How the plan on show keeps up with what is edited.

    reading: what changes now is our own doing. seconds: that the last look took; selected: what was, then; edited:
    whether anything was since then. behind: the plan is out of date, and a person has to ask for a new one.
    """

    reading: ClassVar[bool] = False
    seconds: ClassVar[float] = 0.0
    selected: ClassVar[frozenset[str]] = frozenset()
    edited: ClassVar[bool] = False
    behind: ClassVar[bool] = False
    _thread: ClassVar[ThreadPoolExecutor | None] = None
    _pending: ClassVar[tuple[int, Look, Future[Verdict | None]] | None] = None

    @classmethod
    def soon(cls) -> None:
        """Look again as soon as everything has come to rest."""
        if bpy.app.timers.is_registered(_follow):
            bpy.app.timers.unregister(_follow)
        bpy.app.timers.register(_follow, first_interval=_REST_SECONDS)

    @classmethod
    def forget(cls) -> None:
        """Whatever was under way is out of date."""
        cls.edited = cls.behind = False
        cls._pending = None
        if bpy.app.timers.is_registered(_follow):
            bpy.app.timers.unregister(_follow)

    @classmethod
    def close(cls) -> None:
        """And no thread outlives the add-on."""
        cls.forget()
        if cls._thread is not None:
            cls._thread.shutdown()
            cls._thread = None

    @classmethod
    def go_on(cls, context: bpy.types.Context) -> float | None:
        """One step, and the seconds until the next; None when there is none."""
        if cls.edited or cls.selected != _selected(context):
            cls.edited, cls._pending = False, None
            cls.behind = cls.seconds > _READING_SECONDS
            if not cls.behind:
                look = _look_at_scene(context)
                cls._thread = cls._thread or ThreadPoolExecutor(1, "radiosity plan")
                cls._pending = context.scene.session_uid, look, cls._thread.submit(weigh, look)
        if cls._pending is None:
            return None
        scene, look, verdict = cls._pending
        if not verdict.done():
            return _POLL_SECONDS
        cls._pending = None
        if scene == context.scene.session_uid:
            _tell(context.scene, look, verdict.result())
        return None


def _follow() -> float | None:
    context = bpy.context
    if BakeJob.running is not None or context.mode != "OBJECT" or not context.scene.radiosity_baker.plan:
        return None
    try:
        again = Following.go_on(context)
    except SceneError:
        Following.behind, again = True, None
    except Exception:  # noqa: BLE001 - nobody asked for this look, so nobody is to be bothered but in the console
        traceback.print_exc()
        Following.behind, again = True, None
    if again is None:
        redraw_panel(context)
    return again


def settings_changed(_settings: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    """For the `update` of a setting, of the scene or of an object, that the plan depends on."""
    if context.scene.radiosity_baker.plan:
        Following.edited = True
        Following.soon()


@persistent
def _scene_changed(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    if Following.reading or not scene.radiosity_baker.plan:
        return
    Following.edited |= any(isinstance(update.id, _WATCHED) for update in depsgraph.updates)
    Following.soon()


@persistent
def _file_changed(*_: object) -> None:
    Following.forget()


def _selected(context: bpy.types.Context) -> frozenset[str]:
    return frozenset(obj.name for obj in context.view_layer.objects.selected if obj.type == "MESH")


def register() -> None:
    bpy.app.handlers.depsgraph_update_post.append(_scene_changed)
    bpy.app.handlers.load_pre.append(_file_changed)


def unregister() -> None:
    bpy.app.handlers.load_pre.remove(_file_changed)
    bpy.app.handlers.depsgraph_update_post.remove(_scene_changed)
    Following.close()
