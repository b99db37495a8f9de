"""The Bake operator as a script calls it; tests/gui drives the same operator in a window."""

import threading

import bpy
import pytest

import radiosity_baker
from radiosity_baker.addon import bake_scene, job, panels
from radiosity_baker.addon.job import BakeJob
from radiosity_baker.core.progress import Cancelled
from radiosity_baker.core.scene import Scene, SceneError
from radiosity_baker.core.settings import Settings

pytestmark = pytest.mark.usefixtures("registered")


@pytest.fixture
def room(add_mesh, add_lamp):
    add_lamp("POINT", {"energy": 10.0}, location=(0.3, 0.3, 1.0))
    return add_mesh("Floor")


@pytest.fixture
def stand_in(monkeypatch, bake_positions):
    """The core's place is taken by a bake that paints positions, or by what a test wants to happen."""

    def put(happen=None):
        def bake(scene, settings, progress=None, _effort=None, **_):
            if happen is not None:
                happen(progress)
            result = bake_positions(scene, layers=settings.layers)
            result.report.seconds["total"] = 0.5
            result.report.estimated_error.update(total=0.018, sampling=0.01, transport=0.01, resolution=0.01)
            return result

        monkeypatch.setattr(bake_scene, "bake", bake)
        monkeypatch.setattr(job.pipeline, "bake", bake)

    return put


def content():
    return (
        sorted(obj.name for obj in bpy.data.objects),
        sorted((mesh.name, *mesh.attributes.keys()) for mesh in bpy.data.meshes),
        [obj.hide_render for obj in bpy.data.objects],
        bpy.context.scene.radiosity_baker.report,
    )


def test_bakes_into_a_new_object(room, stand_in):
    stand_in()
    assert bpy.ops.object.radiosity_bake() == {"FINISHED"}
    report = bpy.context.scene.radiosity_baker.last_report()
    baked = bpy.data.objects[report["objects"][0]["name"]]
    assert baked != room
    assert "Radiosity" in baked.data.color_attributes
    assert room.data.color_attributes.keys() == []


def test_bakes_what_was_asked_for(room, stand_in):
    stand_in()
    asked = bpy.context.scene.radiosity_baker
    asked.result, asked.attribute, asked.layers = "KEEP", "Glow", {"direct"}
    bpy.ops.object.radiosity_bake()
    assert set(room.data.color_attributes.keys()) == {"Glow", "Glow Direct"}


@pytest.mark.parametrize("mode", ["NEW", "KEEP"])
def test_clear_leaves_nothing_of_a_bake(room, stand_in, mode):
    stand_in()
    asked = bpy.context.scene.radiosity_baker
    asked.result, asked.layers = mode, {"direct"}

    def everything():
        # Before 5.0 Blender keeps the object's own settings among its custom properties, once they were looked at.
        noted = set(room.keys()) - {"radiosity_baker"}
        return content(), noted, list(room.data.keys()), bpy.data.collections.keys(), room.hide_get()

    before = everything()
    bpy.ops.object.radiosity_bake()
    assert everything() != before
    assert bpy.ops.object.radiosity_clear() == {"FINISHED"}
    assert everything() == before


@pytest.mark.usefixtures("room")
def test_refine_asks_for_half_of_the_error_that_was_reached(stand_in):
    stand_in()
    asked = bpy.context.scene.radiosity_baker
    bpy.ops.object.radiosity_bake()
    bpy.ops.object.radiosity_refine()
    assert asked.error == pytest.approx(0.9)


@pytest.mark.usefixtures("room")
def test_plan_tells_effects_and_cost_and_bakes_nothing():
    objects = bpy.data.objects.keys()
    assert bpy.ops.object.radiosity_plan() == {"FINISHED"}
    plan = bpy.context.scene.radiosity_baker.last_plan()
    assert plan["seconds"] > 0.0
    assert plan["memory_mb"] > 0.0
    assert {effect["name"]: effect["active"] for effect in plan["effects"]}["point lamps"]
    assert bpy.data.objects.keys() == objects
    assert bpy.context.scene.radiosity_baker.last_report() is None


@pytest.mark.usefixtures("room")
def test_invoked_without_a_window_it_blocks(stand_in):
    stand_in()
    assert bpy.ops.object.radiosity_bake("INVOKE_DEFAULT") == {"FINISHED"}
    assert bpy.context.scene.radiosity_baker.last_report() is not None


@pytest.mark.usefixtures("room")
def test_cancelled_bake_changes_nothing(stand_in):
    def cancel(progress):
        progress.report("direct", 0.5)
        progress.cancel()
        progress.check()

    stand_in(cancel)
    before = content()
    assert bpy.ops.object.radiosity_bake() == {"CANCELLED"}
    assert content() == before


def test_unusable_scene_is_reported_as_it_is(stand_in):
    stand_in()
    with pytest.raises(RuntimeError, match="no mesh object"):
        bpy.ops.object.radiosity_bake()


@pytest.mark.usefixtures("room")
def test_whatever_goes_wrong_is_reported_with_its_traceback(stand_in, capsys):
    def fail(_):
        raise ZeroDivisionError("no area")

    stand_in(fail)
    before = content()
    with pytest.raises(RuntimeError, match=r"The bake failed.*ZeroDivisionError: no area"):
        bpy.ops.object.radiosity_bake()
    assert content() == before
    assert "Traceback" in capsys.readouterr().err


def test_not_in_edit_mode(room, stand_in):
    stand_in()
    bpy.context.view_layer.objects.active = room
    bpy.ops.object.mode_set(mode="EDIT")
    with pytest.raises(RuntimeError, match="Object Mode"):
        bpy.ops.object.radiosity_bake()


@pytest.fixture
def running(stand_in):
    def wait(progress):
        while True:
            progress.report("wait", 0.5)

    stand_in(wait)
    job = BakeJob()
    job.start(Scene((), ()), Settings())
    yield job
    job.stop()


def threads():
    return [thread for thread in threading.enumerate() if thread.name == "radiosity bake"]


@pytest.mark.usefixtures("room")
def test_two_bakes_at_once_are_refused(running):
    with pytest.raises(RuntimeError, match="already running"):
        bpy.ops.object.radiosity_bake()
    assert not running.cancelling


def test_cancel_operator_stops_the_running_bake(running):
    assert bpy.ops.object.radiosity_cancel() == {"FINISHED"}
    with pytest.raises(Cancelled):
        running.result()
    assert not bpy.ops.object.radiosity_cancel.poll()


@pytest.mark.usefixtures("running")
def test_loading_a_file_stops_the_running_bake():
    assert threads()
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    assert not threads()
    assert BakeJob.running is None


@pytest.mark.usefixtures("running")
def test_unregistering_stops_the_running_bake():
    assert threads()
    radiosity_baker.unregister()
    assert not threads()
    radiosity_baker.register()


def test_nothing_is_left_behind():
    for _ in range(2):
        radiosity_baker.unregister()
        assert not hasattr(bpy.types.Scene, "radiosity_baker")
        assert not hasattr(bpy.types.Screen, "radiosity_baker_looks")
        assert not hasattr(bpy.types, "OBJECT_OT_radiosity_bake")
        assert not [name for name in dir(bpy.types) if "PT_radiosity" in name]
        handlers = [*bpy.app.handlers.load_pre, *bpy.app.handlers.undo_post, *bpy.app.handlers.redo_pre]
        assert not [handler for handler in handlers if handler.__module__.startswith("radiosity_baker")]
        radiosity_baker.register()


def test_every_operator_has_a_tooltip():
    for name in (
        "object.radiosity_bake",
        "object.radiosity_cancel",
        "view3d.radiosity_show",
        "view3d.radiosity_restore",
    ):
        group, operator = name.split(".")
        assert getattr(getattr(bpy.ops, group), operator).get_rna_type().description


def test_panel_stands_in_both_places():
    places = {(panel.bl_space_type, panel.bl_region_type, getattr(panel, "bl_category", "")) for panel in panels.PANELS}
    assert places == {("PROPERTIES", "WINDOW", ""), ("VIEW_3D", "UI", "Radiosity")}


@pytest.mark.usefixtures("room")
def test_scene_error_of_the_core_keeps_its_words(stand_in):
    def refuse(_):
        raise SceneError("'Floor' is bad: mend it.")

    stand_in(refuse)
    with pytest.raises(RuntimeError, match=r"^Error: 'Floor' is bad: mend it\.$"):
        bpy.ops.object.radiosity_bake()
