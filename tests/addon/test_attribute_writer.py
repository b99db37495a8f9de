"""What the light is written to, what it leaves as it was, and what is refused before anything is changed."""

import bpy
import numpy as np
import pytest

from radiosity_baker.addon.attribute_writer import OURS_KEY, check_writable, write, writing
from radiosity_baker.addon.copies import COPIES_COLLECTION, ORIGINAL_KEY, remove_copies
from radiosity_baker.addon.scene_reader import read_scene
from radiosity_baker.core.scene import SceneError

CUBE = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
CUBE_FACES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


@pytest.fixture(autouse=True)
def lamp(add_lamp):
    return add_lamp("POINT", {"energy": 10.0}, location=(0, 0, 50))


@pytest.fixture
def cube(add_mesh):
    return add_mesh(
        "Cube", vertices=CUBE, faces=CUBE_FACES, location=(1, 2, 3), scale=(2, 1, 1), rotation_euler=(0.1, 0.2, 0.3)
    )


@pytest.fixture
def bake(bake_positions):
    """Read, paint every corner with its position in the world, write."""

    def run(*objects, mode, levels=2, attribute="Radiosity", layers=("combined",), meanwhile=lambda: None):
        depsgraph = bpy.context.evaluated_depsgraph_get()
        scene, sources = read_scene(depsgraph, objects, tessellate=mode != "keep")
        result = bake_positions(scene, levels if mode != "keep" else 0, layers)
        meanwhile()
        written = write(bpy.context, result, sources, result_mode=mode, attribute=attribute)
        run.report = result.report
        return written

    return run


def floats(collection, name, width):
    values = np.empty(len(collection) * width, np.float32)
    collection.foreach_get(name, values)
    return values.reshape(-1, width)


def corner_positions(obj):
    """World position of each mesh corner, by Blender's own data."""
    matrix = np.array(obj.matrix_world, dtype=np.float64)
    vertices = floats(obj.data.vertices, "co", 3) @ matrix[:3, :3].T + matrix[:3, 3]
    return vertices[[loop.vertex_index for loop in obj.data.loops]]


def snapshot(obj):
    mesh = obj.data
    return (
        mesh.name,
        floats(mesh.vertices, "co", 3).tobytes(),
        [tuple(face.vertices) for face in mesh.polygons],
        sorted(attribute.name for attribute in mesh.attributes),
        [modifier.type for modifier in obj.modifiers],
    )


@pytest.mark.parametrize("scale", [(1, 1, 1), (-1, 2, 1)])
@pytest.mark.parametrize("mode", ["keep", "replace", "new"])
def test_every_corner_gets_the_light_of_its_place(cube, bake, colours, mode, scale):
    cube.scale = scale
    bpy.context.view_layer.update()

    (written,) = bake(cube, mode=mode)

    np.testing.assert_allclose(colours(written.data, "Radiosity"), corner_positions(written), atol=1e-6)
    attribute = written.data.attributes["Radiosity"]
    assert (attribute.domain, attribute.data_type) == ("CORNER", "FLOAT_COLOR")
    assert all(item.color[3] == 1.0 for item in attribute.data)
    assert written.data.color_attributes.active_color_name == "Radiosity"
    assert written.data.color_attributes[written.data.color_attributes.render_color_index].name == "Radiosity"
    assert dict(written.data[OURS_KEY]) == {"Radiosity": "combined"}
    assert not written.data.validate()


def test_the_report_names_what_was_written(cube, bake):
    bake(cube, mode="new", levels=1)

    assert bake.report.objects == [
        {"name": "Cube Radiosity", "attribute": "Radiosity", "triangles": 48, "corners": 144}
    ]


def test_layers_have_attributes_of_their_own(cube, bake):
    (written,) = bake(cube, mode="keep", attribute="Glow", layers=("direct", "combined", "error"))

    names = {attribute.name for attribute in written.data.color_attributes}
    assert names == {"Glow", "Glow Direct", "Glow Error"}
    assert written.data.color_attributes.active_color_name == "Glow"


def test_keep_changes_nothing_else_and_may_be_repeated(cube, bake):
    before = snapshot(cube)

    for _ in range(2):
        assert bake(cube, mode="keep") == [cube]

    after = snapshot(cube)
    assert after[:3] == before[:3]
    assert set(after[3]) - set(before[3]) == {"Radiosity"}


def test_keep_averages_the_triangles_that_meet_in_a_corner(add_mesh, bake_positions, colours):
    quad = add_mesh("Quad")
    scene, sources = read_scene(bpy.context.evaluated_depsgraph_get(), [quad], tessellate=False)
    result = bake_positions(scene)
    values = result.objects[0].layers["combined"]
    values[0], values[1] = 1.0, 3.0

    write(bpy.context, result, sources, result_mode="keep")

    shared = np.isin(np.arange(4), sources[0].corners[0]) & np.isin(np.arange(4), sources[0].corners[1])
    assert shared.sum() == 2
    np.testing.assert_array_equal(colours(quad.data, "Radiosity")[shared], 2.0)
    assert sorted(colours(quad.data, "Radiosity")[~shared, 0]) == [1.0, 3.0]


@pytest.mark.parametrize("mode", ["replace", "new"])
def test_a_tessellated_mesh_keeps_the_shape(cube, bake, mode):
    before = floats(cube.data.vertices, "co", 3)

    (written,) = bake(cube, mode=mode, levels=2)

    after = floats(written.data.vertices, "co", 3)
    np.testing.assert_array_equal(after[: len(before)], before)
    assert len(written.data.polygons) == 12 * 4**2
    np.testing.assert_array_equal(after * 4, np.round(after * 4))  # Twice halved: quarters, exactly.
    area = sum(face.area for face in written.data.polygons)
    assert area == pytest.approx(6.0, rel=1e-6)
    centre = after.mean(axis=0)
    assert all(np.dot(face.normal, np.array(face.center) - centre) > 0 for face in written.data.polygons)
    assert written.matrix_world == cube.matrix_world


def dress(obj, add_material):
    """Everything a mesh may carry, each as a linear function of place, so that a split must reproduce it."""
    mesh = obj.data
    for name in ("Red", "Blue"):
        mesh.materials.append(add_material("ShaderNodeBsdfDiffuse", name=name))
    corner = np.array([mesh.vertices[loop.vertex_index].co for loop in mesh.loops], np.float32)
    for index, name in enumerate(("First", "Second")):
        layer = mesh.uv_layers.new(name=name)
        layer.uv.foreach_set("vector", np.ascontiguousarray(corner[:, index : index + 2]).ravel())
    mesh.uv_layers.active_index = 1
    mesh.uv_layers["First"].active_render = True
    paint = mesh.color_attributes.new("Paint", "FLOAT_COLOR", "POINT")
    points = np.ones((len(mesh.vertices), 4), np.float32)
    points[:, :3] = floats(mesh.vertices, "co", 3)
    paint.data.foreach_set("color", points.ravel())
    mesh.attributes.new("Number", "INT", "FACE").data.foreach_set("value", np.arange(6, dtype=np.int32))
    group = obj.vertex_groups.new(name="Height")
    for vertex in mesh.vertices:
        group.add([vertex.index], vertex.co.z, "REPLACE")
    mesh.edges[0].use_seam = mesh.edges[-1].use_edge_sharp = True
    for face in mesh.polygons:
        face.material_index = face.index % 2
        face.use_smooth = face.index < 3
    mesh["Made by"] = "me"


@pytest.mark.parametrize("mode", ["replace", "new"])
@pytest.mark.parametrize("scale", [(1, 1, 1), (-1, 2, 1)])
def test_a_tessellated_mesh_carries_all_that_the_old_one_did(cube, bake, add_material, mode, scale):
    cube.scale = scale
    bpy.context.view_layer.update()
    dress(cube, add_material)
    old_edges = {name: [e for e in cube.data.edges if getattr(e, name)] for name in ("use_seam", "use_edge_sharp")}
    ends = {
        name: np.array([[cube.data.vertices[v].co for v in e.vertices] for e in old_edges[name]]) for name in old_edges
    }

    (written,) = bake(cube, mode=mode, levels=1)

    mesh = written.data
    place = np.array([mesh.vertices[loop.vertex_index].co for loop in mesh.loops])
    vertices = floats(mesh.vertices, "co", 3)
    assert [material.name for material in mesh.materials] == ["Red", "Blue"]
    assert mesh.uv_layers.active.name == "Second"
    assert mesh.uv_layers["First"].active_render
    np.testing.assert_allclose(floats(mesh.uv_layers["First"].uv, "vector", 2), place[:, 0:2], atol=1e-6)
    np.testing.assert_allclose(floats(mesh.uv_layers["Second"].uv, "vector", 2), place[:, 1:3], atol=1e-6)
    np.testing.assert_allclose(floats(mesh.attributes["Paint"].data, "color", 4)[:, :3], vertices, atol=1e-6)
    weights = [written.vertex_groups["Height"].weight(v.index) if v.groups else 0.0 for v in mesh.vertices]
    np.testing.assert_allclose(weights, vertices[:, 2], atol=1e-6)
    number = [item.value for item in mesh.attributes["Number"].data]
    assert sorted(number) == sorted(list(range(6)) * 8)
    assert [face.material_index for face in mesh.polygons] == [n % 2 for n in number]
    assert [face.use_smooth for face in mesh.polygons] == [n < 3 for n in number]
    assert mesh["Made by"] == "me"
    for name, (span,) in ends.items():
        marked = np.array([[mesh.vertices[v].co for v in e.vertices] for e in mesh.edges if getattr(e, name)])
        assert len(marked) == 2, name
        np.testing.assert_allclose(
            sorted(marked.reshape(-1, 3).tolist()), sorted([*span.tolist(), *[span.mean(0).tolist()] * 2])
        )
    assert len(bpy.data.objects) == (2 if mode == "replace" else 3)


def test_smooth_shading_looks_as_before(cube, bake):
    cube.data.shade_smooth()

    (written,) = bake(cube, mode="new", levels=2)

    mesh = written.data
    place = np.array([mesh.vertices[loop.vertex_index].co for loop in mesh.loops])
    # At a cube's vertices the normals point along 2 p - 1, which is linear, so interpolation keeps it everywhere.
    expected = (2.0 * place - 1.0) / np.linalg.norm(2.0 * place - 1.0, axis=1, keepdims=True)
    # Blender stores a custom normal as two angles of 16 bits.
    np.testing.assert_allclose(floats(mesh.corner_normals, "vector", 3), expected, atol=1e-3)


def test_new_leaves_the_original_alone_and_shows_the_copy_in_its_place(cube, bake):
    cube.modifiers.new("Subdivision", "SUBSURF").levels = 1
    cube.select_set(True)
    bpy.context.view_layer.objects.active = cube
    before = snapshot(cube)

    (copy,) = bake(cube, mode="new", levels=0)

    assert snapshot(cube) == before
    assert cube.hide_get()
    assert cube.hide_render
    assert copy.name == copy.data.name == "Cube Radiosity"
    assert not copy.modifiers
    assert len(copy.data.polygons) == 6 * 4 * 2
    assert copy.visible_get()
    assert not copy.hide_render
    assert bpy.context.view_layer.objects.active == copy
    assert [obj for obj in bpy.data.objects if obj.select_get()] == [copy]
    assert [group.name for group in copy.users_collection] == [COPIES_COLLECTION]
    assert copy[ORIGINAL_KEY] == cube


def test_new_selects_nothing_where_nothing_was_selected(cube, bake):
    cube.select_set(False)

    bake(cube, mode="new", levels=0)

    assert not [obj for obj in bpy.data.objects if obj.select_get()]


def test_baking_the_original_again_renews_its_copy(cube, bake):
    (first,) = bake(cube, mode="new", levels=1)
    cube.hide_render = False
    cube.hide_set(False)
    cube.location.x = 7.0
    bpy.context.view_layer.update()

    (second,) = bake(cube, mode="new", levels=2)

    assert second == first
    assert len(second.data.polygons) == 12 * 16
    np.testing.assert_allclose(second.matrix_world, cube.matrix_world, atol=1e-6)
    assert len([mesh for mesh in bpy.data.meshes if mesh.name.startswith("Cube")]) == 2


def test_baking_again_after_the_copy_was_moved_takes_the_original_there(cube, bake):
    (copy,) = bake(cube, mode="new", levels=0)
    copy.location.z = 5.0
    bpy.context.view_layer.update()

    bake(cube, mode="new", levels=0)

    assert cube.matrix_world.translation.z == pytest.approx(5.0)
    np.testing.assert_allclose(copy.matrix_world, cube.matrix_world, atol=1e-6)


def test_a_copy_goes_when_the_light_is_written_to_its_original(cube, bake):
    bake(cube, mode="new", levels=0)

    bake(cube, mode="keep", levels=0)

    assert [obj.name for obj in bpy.data.objects if obj.type == "MESH"] == ["Cube"]
    assert [mesh.name for mesh in bpy.data.meshes] == ["Cube"]
    assert not cube.hide_render
    assert not cube.hide_get()
    assert COPIES_COLLECTION not in bpy.data.collections


def test_an_object_that_was_hidden_in_the_viewport_is_so_again_when_its_copy_goes(cube, bake):
    cube.hide_set(True)
    bake(cube, mode="new", levels=0)

    remove_copies(bpy.context.view_layer, [cube])

    assert cube.hide_get()
    assert not cube.hide_render


def test_a_copy_that_outlives_its_original_is_renewed(cube, bake):
    (first,) = bake(cube, mode="new", levels=1)
    bpy.data.objects.remove(cube)

    (second,) = bake(first, mode="new", levels=0)

    assert second == first
    assert len(second.data.polygons) == 48
    assert not second.hide_get()


@pytest.mark.parametrize("mode", ["keep", "replace", "new"])
def test_layers_of_an_earlier_bake_go(cube, bake, mode):
    bake(cube, mode=mode, levels=0, layers=("combined", "direct"))

    (written,) = bake(cube, mode=mode, levels=0, layers=("combined",))

    assert written.data.color_attributes.keys() == ["Radiosity"]


def test_stopped_while_it_writes_it_leaves_no_mesh_behind(cube, bake_positions):
    scene, sources = read_scene(bpy.context.evaluated_depsgraph_get(), [cube], tessellate=True)
    result = bake_positions(scene, 1)
    before = (snapshot(cube), bpy.data.meshes.keys(), bpy.data.objects.keys())
    steps = writing(bpy.context.view_layer, result, sources, result_mode="new")
    answer = None
    while len(bpy.data.meshes) == len(before[1]):
        answer = steps.send(answer)()

    steps.close()

    assert (snapshot(cube), bpy.data.meshes.keys(), bpy.data.objects.keys()) == before


def test_new_in_edit_mode_takes_what_is_being_edited(cube, bake):
    bpy.context.view_layer.objects.active = cube
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.subdivide(number_cuts=1)

    (copy,) = bake(cube, mode="new", levels=0)

    assert len(copy.data.polygons) == 48


def test_replace_gives_each_user_of_a_mesh_its_own(cube, bake, colours):
    twin = bpy.data.objects.new("Twin", cube.data)
    twin.location = (10, 0, 0)
    bpy.context.scene.collection.objects.link(twin)
    bpy.context.view_layer.update()

    written = bake(cube, twin, mode="replace", levels=1)

    assert written == [cube, twin]
    assert cube.data != twin.data
    for obj in written:
        np.testing.assert_allclose(colours(obj.data, "Radiosity"), corner_positions(obj), atol=1e-6)


def test_replace_keeps_the_meshs_name_and_the_objects_modifiers(cube, bake):
    cube.modifiers.new("Displace", "DISPLACE").strength = 1.0
    name, before = cube.data.name, floats(cube.data.vertices, "co", 3)

    bake(cube, mode="replace", levels=1)

    assert cube.data.name == name
    assert [modifier.type for modifier in cube.modifiers] == ["DISPLACE"]
    np.testing.assert_array_equal(floats(cube.data.vertices, "co", 3)[:8], before)


@pytest.mark.parametrize("mode", ["replace", "new"])
def test_materials_of_the_object_stay_with_it(cube, bake, add_material, mode):
    cube.data.materials.append(add_material("ShaderNodeBsdfDiffuse", name="Of mesh"))
    cube.material_slots[0].link = "OBJECT"
    cube.material_slots[0].material = add_material("ShaderNodeBsdfDiffuse", name="Of object")

    (written,) = bake(cube, mode=mode, levels=0)

    assert written.material_slots[0].material.name == "Of object"
    assert written.data.materials[0].name == "Of mesh"


def refused(objects, mode, match, attribute="Radiosity"):
    before = [snapshot(obj) for obj in objects]
    with pytest.raises(SceneError, match=match):
        check_writable(objects, ("combined",), result_mode=mode, attribute=attribute)
    assert [snapshot(obj) for obj in objects] == before


def test_a_users_attribute_of_the_same_name_is_not_touched(cube, bake):
    cube.data.color_attributes.new("Radiosity", "BYTE_COLOR", "POINT")
    before = snapshot(cube)

    for mode in ("keep", "replace", "new"):
        with pytest.raises(SceneError, match=r"'Cube' has an attribute 'Radiosity'.*another attribute name"):
            bake(cube, mode=mode)

    assert snapshot(cube) == before
    assert len(bpy.data.objects) == 2
    assert len(bpy.data.meshes) == 1


def test_an_own_attribute_of_another_kind_is_made_anew(cube, bake):
    cube.data.color_attributes.new("Radiosity", "BYTE_COLOR", "POINT")
    cube.data[OURS_KEY] = {"Radiosity": "combined"}

    bake(cube, mode="keep")

    assert cube.data.attributes["Radiosity"].data_type == "FLOAT_COLOR"


def test_a_shared_mesh_cannot_keep_two_lights(cube):
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Twin", cube.data))
    refused([cube], "keep", r"'Cube' shares its mesh.*Make Single User")


def test_a_fake_user_is_no_second_one(cube, bake):
    cube.data.use_fake_user = True
    assert bake(cube, mode="keep") == [cube]


def test_shape_keys_cannot_be_replaced(cube):
    cube.shape_key_add()
    refused([cube], "replace", r"'Cube' has shape keys.*New Object")


@pytest.mark.parametrize("mode", ["keep", "replace"])
def test_edit_mode_is_left_first(cube, mode):
    bpy.context.view_layer.objects.active = cube
    bpy.ops.object.mode_set(mode="EDIT")
    refused([cube], mode, r"'Cube' is in Edit Mode: leave it")


def test_linked_objects_get_a_copy_only(cube, bake, tmp_path):
    path = str(tmp_path / "library.blend")
    bpy.data.libraries.write(path, {cube})
    bpy.data.objects.remove(cube)
    with bpy.data.libraries.load(path, link=True) as (_, target):
        target.objects = ["Cube"]
    linked = target.objects[0]
    bpy.context.scene.collection.objects.link(linked)
    bpy.context.view_layer.update()

    for mode in ("keep", "replace"):
        refused([linked], mode, r"'Cube' is linked from another file.*Make Local")
    (copy,) = bake(linked, mode="new", levels=1)

    assert copy.library is None
    assert copy.data.library is None
    assert len(copy.data.polygons) == 48


def test_a_nameless_attribute_is_refused(cube):
    refused([cube], "keep", "has no name", attribute="")


@pytest.mark.parametrize("attribute", ["x" * 68, "\u65e5" * 23])
def test_a_name_that_not_every_blender_can_keep_is_refused(cube, attribute):
    """Up to 5.0 it would give no attribute at all. Seen to fail: an error in the middle of writing."""
    refused([cube], "keep", "too long", attribute=attribute)


def test_a_mesh_edited_during_the_bake_is_refused_and_nothing_is_left_behind(cube, add_mesh, bake):
    edited = add_mesh("Edited")

    def edit():
        edited.data.vertices.add(1)

    with pytest.raises(SceneError, match="'Edited' was changed during the bake"):
        bake(cube, edited, mode="replace", meanwhile=edit)
    assert "Radiosity" not in cube.data.attributes
    assert len(bpy.data.meshes) == 2


def test_an_object_renamed_during_the_bake_is_found_and_a_removed_one_named(cube, bake):
    def rename():
        cube.name = "Box"

    assert bake(cube, mode="keep", meanwhile=rename) == [cube]
    with pytest.raises(SceneError, match="'Box' was removed during the bake"):
        bake(cube, mode="keep", meanwhile=lambda: bpy.data.objects.remove(cube))


def test_light_brighter_than_white_survives(cube, bake_positions, colours):
    scene, sources = read_scene(bpy.context.evaluated_depsgraph_get(), [cube], tessellate=False)
    result = bake_positions(scene)
    result.objects[0].layers["combined"][:] = 1234.5

    write(bpy.context, result, sources, result_mode="keep")

    np.testing.assert_array_equal(colours(cube.data, "Radiosity"), 1234.5)
