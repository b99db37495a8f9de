"""Showing the baked light, and getting the old look back."""

import bpy
import pytest

from radiosity_baker.addon import viewport

pytestmark = pytest.mark.usefixtures("registered")


@pytest.fixture
def view():
    return next(area for area in bpy.data.screens["Layout"].areas if area.type == "VIEW_3D")


def look(view):
    shading = view.spaces.active.shading
    return {name: getattr(shading, name) for name in viewport.BAKED_LOOK}


@pytest.mark.parametrize("kind", ["SOLID", "WIREFRAME", "RENDERED"])
def test_restore_brings_the_old_look_back(view, kind):
    shading = view.spaces.active.shading
    shading.type = "SOLID"
    shading.light, shading.color_type, shading.show_cavity = "MATCAP", "TEXTURE", True
    shading.type = kind
    viewport.show(view)
    assert look(view) == viewport.BAKED_LOOK
    viewport.show(view)  # Shown twice, the look before the first is the one to restore.
    viewport.restore(view)
    assert shading.type == kind
    shading.type = "SOLID"
    assert (shading.light, shading.color_type, shading.show_cavity) == ("MATCAP", "TEXTURE", True)


def test_each_view_has_its_own_look(view):
    other = next(area for area in view.id_data.areas if area != view)
    other.type = "VIEW_3D"
    looks = look(view), look(other)
    viewport.show(view)
    assert look(other) == looks[1]
    viewport.show(other)
    viewport.restore(view)
    assert (look(view), look(other)) == (looks[0], viewport.BAKED_LOOK)
    viewport.restore(other)
    assert look(other) == looks[1]


def test_layer_switch_leaves_the_exported_layer_alone(add_mesh):
    mesh = add_mesh("Room").data
    for name in ("Other", "Radiosity", "Radiosity Direct"):
        mesh.color_attributes.new(name, "FLOAT_COLOR", "CORNER")
    mesh.color_attributes.render_color_index = mesh.color_attributes.find("Radiosity")
    entry = {"name": "Room", "attribute": "Radiosity"}
    report = {"objects": [entry, {"name": "Deleted since", "attribute": "Radiosity"}], "seconds": {"total": 1.0}}
    asked = bpy.context.scene.radiosity_baker
    asked.remember(report)
    assert mesh.color_attributes.active_color_name == "Radiosity"
    asked.layer = "direct"
    assert mesh.color_attributes.active_color_name == "Radiosity Direct"
    asked.layer = "sky"  # Not baked: nothing to switch to.
    assert mesh.color_attributes.active_color_name == "Radiosity Direct"
    assert mesh.color_attributes[mesh.color_attributes.render_color_index].name == "Radiosity"
    assert viewport.baked_layers(bpy.context.scene, report) == ["combined", "direct"]
