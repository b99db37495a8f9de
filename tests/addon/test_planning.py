"""The plan on show keeps up with what is edited, and holds nobody up."""

import threading

import bpy
import pytest

import radiosity_baker
from radiosity_baker.addon import planning
from radiosity_baker.addon.planning import Following

pytestmark = pytest.mark.usefixtures("registered")


@pytest.fixture
def asked(add_mesh, add_lamp):
    add_lamp("POINT", {"energy": 10.0}, location=(0.3, 0.3, 1.0))
    add_mesh("Floor")
    add_mesh("Shelf", location=(0, 0, 0.5))
    bpy.ops.object.radiosity_plan()
    come_to_rest()
    return bpy.context.scene.radiosity_baker


def come_to_rest():
    """What Blender's timer does once nothing has changed for a while; whether there was anything to do."""
    bpy.context.view_layer.update()
    before = bpy.context.scene.radiosity_baker.plan
    again = planning._follow()
    while again is not None:
        again = planning._follow()
    return bpy.context.scene.radiosity_baker.plan != before


def kinds(asked):
    return [problem.kind for problem in asked.problems()]


def effects(asked):
    return {effect["name"] for effect in asked.last_plan()["effects"] if effect["active"]}


def test_the_price_of_what_is_asked_for_is_what_the_plan_says(asked):
    plan = asked.last_plan()
    assert dict(plan["costs"])[0.02] == plan["seconds"]


def test_a_lamp_that_goes_is_missed_at_once(asked):
    assert kinds(asked) == []
    bpy.data.objects.remove(bpy.data.objects["Lamp"])
    assert come_to_rest()
    assert kinds(asked) == ["no light"]


def test_other_settings_of_a_lamp_change_the_plan(asked):
    lamp = bpy.data.lights["Lamp"]
    lamp.shadow_soft_size = 0.0
    come_to_rest()
    assert "soft shadows" not in effects(asked)
    lamp.shadow_soft_size = 0.1
    lamp.update_tag()
    come_to_rest()
    assert "soft shadows" in effects(asked)


def test_an_edited_mesh_is_checked_again(asked):
    floor = bpy.data.objects["Floor"].data
    floor.vertices[3].co = floor.vertices[2].co
    floor.update()
    floor.update_tag()
    come_to_rest()
    assert kinds(asked) == ["zero area"]


@pytest.fixture
def both(asked):
    """The memory that baking both objects takes, finely split."""
    asked.density, asked.size = "SIZE", 0.01
    come_to_rest()
    return asked.last_plan()["memory_mb"]


def test_another_selection_is_another_plan(asked, both):
    bpy.data.objects["Shelf"].select_set(True)
    assert come_to_rest()
    assert asked.last_plan()["memory_mb"] < both


def test_what_an_object_is_allowed_changes_the_plan(asked, both):
    bpy.data.objects["Shelf"].radiosity_baker.receives = False
    assert come_to_rest()
    assert asked.last_plan()["memory_mb"] < both


def test_reading_the_scene_does_not_count_as_an_edit(asked):
    bpy.data.objects["Shelf"].hide_viewport = True
    come_to_rest()
    bpy.context.view_layer.update()
    assert not Following.edited
    assert not come_to_rest()
    assert kinds(asked) == []


def test_a_scene_that_takes_long_to_read_waits_for_the_button(asked):
    Following.seconds = 1.0
    bpy.data.objects.remove(bpy.data.objects["Lamp"])
    assert not come_to_rest()
    assert Following.behind
    assert kinds(asked) == []
    bpy.ops.object.radiosity_plan()
    assert not Following.behind
    assert kinds(asked) == ["no light"]


def test_nothing_left_to_bake_leaves_the_plan_behind(asked):
    for name in ("Floor", "Shelf"):
        bpy.data.objects.remove(bpy.data.objects[name])
    assert not come_to_rest()
    assert Following.behind
    assert kinds(asked) == []


def test_who_has_not_asked_for_a_plan_gets_none(asked):
    asked.plan = ""
    bpy.data.objects.remove(bpy.data.objects["Lamp"])
    assert not come_to_rest()
    assert not Following.edited
    assert asked.plan == ""


def test_nothing_is_left_of_it(asked):
    asked.error = 5.0
    come_to_rest()
    assert [thread for thread in threading.enumerate() if thread.name.startswith("radiosity plan")]
    radiosity_baker.unregister()
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("radiosity plan")]
    radiosity_baker.register()
