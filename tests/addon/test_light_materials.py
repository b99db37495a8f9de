"""Materials that show the light are what Cycles then renders, and leave no trace when they go."""

import bpy
import numpy as np
import pytest

from radiosity_baker.addon import light_materials
from radiosity_baker.addon.attribute_writer import OURS_KEY
from radiosity_baker.addon.colour_storage import EXPOSURE_KEY
from radiosity_baker.addon.scene_reader import read_scene

pytestmark = pytest.mark.usefixtures("registered")

LIGHT, DIRECT, COLOUR = (0.5, 2.0, 4.0), (0.25, 0.5, 0.125), (0.8, 0.4, 0.2)


@pytest.fixture
def plane(add_mesh):
    """As after a bake with the layers Combined (twice LIGHT, as it is stored), Light and Direct."""
    obj = add_mesh("Plane", vertices=((0, 0, 0), (1, 0, 0), (0, 1, 0)), faces=((0, 1, 2),))
    mesh = obj.data
    for name, value in {"Radiosity": LIGHT, "Radiosity Light": LIGHT, "Radiosity Direct": DIRECT}.items():
        stored = mesh.color_attributes.new(name, "FLOAT_COLOR", "CORNER")
        stored.data.foreach_set("color", np.tile([*(2.0 * np.array(value)), 1.0], 3).astype(np.float32))
    mesh[OURS_KEY] = {"Radiosity": "combined", "Radiosity Light": "light", "Radiosity Direct": "direct"}
    mesh[EXPOSURE_KEY] = dict.fromkeys(mesh[OURS_KEY].keys(), 2.0)
    mesh.color_attributes.active_color_name = "Radiosity"
    report = {"objects": [{"name": "Plane", "attribute": "Radiosity"}], "seconds": {"total": 1.0}}
    bpy.context.scene.radiosity_baker.remember(report)
    return obj


def slots(obj):
    return [(slot.link, slot.material) for slot in obj.material_slots], list(obj.data.materials)


def rendered(cycles_bake, obj):
    """What Cycles sees of the object, without any lamp."""
    values = cycles_bake(obj, 1).reshape(-1, 3)
    obj.data.color_attributes.remove(obj.data.color_attributes["Cycles"])
    np.testing.assert_allclose(values - values[0], 0.0, atol=1e-5)
    return values[0]


@pytest.mark.parametrize("slot", ["none", "empty", "data", "object"])
def test_the_material_gives_off_the_active_layer_and_goes_without_a_trace(plane, add_material, cycles_bake, slot):
    if slot != "none":
        plane.data.materials.append(add_material("ShaderNodeBsdfDiffuse") if slot == "data" else None)
    if slot == "object":
        plane.material_slots[0].link = "OBJECT"
        plane.material_slots[0].material = add_material("ShaderNodeBsdfDiffuse")
    before, materials = slots(plane), set(bpy.data.materials)

    bpy.ops.object.radiosity_show_light()
    np.testing.assert_allclose(rendered(cycles_bake, plane), LIGHT, rtol=1e-4)
    plane.data.color_attributes.active_color_name = "Radiosity"
    bpy.context.scene.radiosity_baker.layer = "direct"
    np.testing.assert_allclose(rendered(cycles_bake, plane), DIRECT, rtol=1e-4)

    bpy.ops.object.radiosity_put_back()
    assert slots(plane) == before
    assert set(bpy.data.materials) == materials
    assert not bpy.ops.object.radiosity_put_back.poll()


@pytest.mark.parametrize("kind", ["ShaderNodeBsdfDiffuse", "ShaderNodeBsdfPrincipled"])
def test_light_times_colour(plane, add_material, cycles_bake, kind):
    name = "Color" if kind == "ShaderNodeBsdfDiffuse" else "Base_Color"
    material = add_material(kind, **{name: (*COLOUR, 1.0)})
    plane.data.materials.append(material)
    expected = np.array(LIGHT) * COLOUR
    if kind == "ShaderNodeBsdfPrincipled":
        node = next(n for n in material.node_tree.nodes if n.bl_idname == kind and n.outputs[0].is_linked)
        node.inputs["Emission Color"].default_value = (1.0, 0.5, 0.0, 1.0)
        node.inputs["Emission Strength"].default_value = 3.0
        expected += [3.0, 1.5, 0.0]
    nodes = len(material.node_tree.nodes)

    bpy.ops.object.radiosity_show_lit()

    np.testing.assert_allclose(rendered(cycles_bake, plane), expected, rtol=1e-4)
    bpy.ops.object.radiosity_put_back()
    assert slots(plane) == ([("DATA", material)], [material])
    assert len(material.node_tree.nodes) == nodes


def test_what_is_linked_to_the_colour_is_multiplied(plane, add_material, cycles_bake):
    material = add_material("ShaderNodeBsdfDiffuse")
    tree = material.node_tree
    colour = tree.nodes.new("ShaderNodeRGB")
    colour.outputs[0].default_value = (*COLOUR, 1.0)
    tree.links.new(colour.outputs[0], next(n for n in tree.nodes if "Diffuse" in n.bl_idname).inputs["Color"])
    plane.data.materials.append(material)
    light_materials.show_lit([plane])
    np.testing.assert_allclose(rendered(cycles_bake, plane), np.array(LIGHT) * COLOUR, rtol=1e-4)


@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # of the switch, in Blenders that have nodes always
def test_a_material_without_nodes_has_its_viewport_colour(plane, cycles_bake, monkeypatch):
    """As Blender 4 knew them."""
    monkeypatch.setattr(light_materials, "shader_tree", lambda _: None)
    material = bpy.data.materials.new("Plain")
    material.diffuse_color = (*COLOUR, 1.0)
    plane.data.materials.append(material)
    light_materials.show_lit([plane])
    np.testing.assert_allclose(rendered(cycles_bake, plane), np.array(LIGHT) * COLOUR, rtol=1e-4)


def test_without_a_material_light_is_times_blenders_default(plane, cycles_bake):
    light_materials.show_lit([plane])
    np.testing.assert_allclose(rendered(cycles_bake, plane), 0.8 * np.array(LIGHT), rtol=1e-4)
    light_materials.put_back([plane])
    assert slots(plane) == ([], [])


def test_emitters_stay_as_they_are(plane, add_material):
    lamp = add_material("ShaderNodeEmission")
    plane.data.materials.append(lamp)
    light_materials.show_lit([plane])
    assert slots(plane) == ([("DATA", lamp)], [lamp])


def test_light_times_colour_needs_the_layer_light(plane):
    plane.data.color_attributes.remove(plane.data.color_attributes["Radiosity Light"])
    assert not bpy.ops.object.radiosity_show_lit.poll()
    assert bpy.ops.object.radiosity_show_light.poll()


def test_a_bake_reads_the_materials_behind(plane, add_material, add_lamp):
    add_lamp("POINT", {"energy": 10.0}, location=(0, 0, 1))
    plane.data.materials.append(add_material("ShaderNodeBsdfDiffuse", Color=(*COLOUR, 1.0)))
    for show in (light_materials.show_light, light_materials.show_lit):
        show([plane])
        scene, _ = read_scene(bpy.context.evaluated_depsgraph_get(), [plane], tessellate=True)
        (used,) = {scene.surfaces[number] for number in np.unique(scene.objects[0].surface)}
        assert used.albedo == pytest.approx(COLOUR)
        assert used.emission == (0.0, 0.0, 0.0)


def test_clear_takes_the_materials_along(plane, add_material):
    material = add_material("ShaderNodeBsdfDiffuse")
    plane.data.materials.append(material)
    bpy.ops.object.radiosity_show_light()
    bpy.ops.object.radiosity_clear()
    assert slots(plane) == ([("DATA", material)], [material])
    assert list(bpy.data.materials) == [material]
