"""What of Blender's scene is read, where it lies, and what is refused."""

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from radiosity_baker.addon import scene_reader
from radiosity_baker.addon.copies import ORIGINAL_KEY, PLACE_KEY
from radiosity_baker.addon.scene_reader import pick_receivers, read_scene
from radiosity_baker.core import cost
from radiosity_baker.core.scene import SceneError

CUBE = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
CUBE_FACES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


@pytest.fixture(autouse=True)
def lamp(add_lamp):
    """Some light, which reading insists on."""
    return add_lamp("POINT", {"energy": 10.0}, location=(0, 0, 5))


def read(*receivers, tessellate=True):
    return read_scene(bpy.context.evaluated_depsgraph_get(), receivers, tessellate=tessellate)


def names(scene):
    return sorted(obj.name for obj in scene.objects)


def pick(names=None):
    return pick_receivers(bpy.context.scene, bpy.context.view_layer, names)


def geometric_normals(obj):
    a, b, c = np.moveaxis(obj.vertices[obj.triangles], 1, 0)
    normals = np.cross(b - a, c - a)
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def test_an_n_gon_becomes_triangles_at_its_place_in_the_world(add_mesh):
    pentagon = [(np.cos(a), np.sin(a), 0) for a in np.radians(np.arange(0, 360, 72))]
    obj = add_mesh(vertices=pentagon, faces=[range(5)])
    obj.matrix_world = Matrix.Translation((1e5, 2, 3)) @ Matrix.Rotation(0.5, 4, "X") @ Matrix.Diagonal((2, 3, 4, 1))
    bpy.context.view_layer.update()

    scene, (source,) = read(obj)

    (found,) = scene.objects
    matrix = np.array(obj.matrix_world, dtype=np.float64)
    local = np.array([vertex.co for vertex in obj.data.vertices], dtype=np.float64)
    np.testing.assert_array_equal(found.vertices, local @ matrix[:3, :3].T + matrix[:3, 3])
    assert found.vertices.dtype == np.float64
    assert found.triangles.shape == (3, 3)
    assert found.receives
    assert found.corner_normals is None
    np.testing.assert_array_equal(source.polygons, 0)
    np.testing.assert_array_equal(found.triangles, source.corners)  # In one face corner i is at vertex i.
    np.testing.assert_allclose(geometric_normals(found) @ np.array(obj.matrix_world.col[2][:3]) / 4, 1.0, atol=1e-6)


@pytest.mark.parametrize("scale", [(1, 1, 1), (-1, 1, 1), (-1, -2, 1), (-1, -1, -3)])
def test_mirrored_objects_still_face_outward(add_mesh, scale):
    cube = add_mesh(vertices=CUBE, faces=CUBE_FACES, scale=scale)
    cube.data.shade_smooth()
    scene, (source,) = read(cube)

    (found,) = scene.objects
    centre = found.vertices.mean(axis=0)
    outward = found.vertices[found.triangles].mean(axis=1) - centre
    assert ((geometric_normals(found) * outward).sum(axis=1) > 0).all()
    corner_outward = found.vertices[found.triangles] - centre
    np.testing.assert_array_equal(np.sign(found.corner_normals), np.sign(corner_outward))
    np.testing.assert_allclose(np.linalg.norm(found.corner_normals, axis=2), 1.0, atol=1e-6)
    # Corner order maps back: the same corners as the mesh's own triangles.
    vertex_of_corner = np.array([loop.vertex_index for loop in cube.data.loops])
    np.testing.assert_array_equal(vertex_of_corner[source.corners], found.triangles)
    assert source.flipped == (np.prod(scale) < 0)


def test_normals_of_a_squeezed_sphere_follow_the_inverse_transpose(add_mesh):
    obj = add_mesh(vertices=CUBE, faces=CUBE_FACES, scale=(1, 1, 0.1), rotation_euler=(0.1, 0.2, 0.3))
    obj.data.shade_smooth()

    scene, (source,) = read(obj)

    local = np.array([normal.vector for normal in obj.data.corner_normals])[source.corners]
    expected = local @ np.linalg.inv(np.array(obj.matrix_world)[:3, :3])
    expected /= np.linalg.norm(expected, axis=2, keepdims=True)
    np.testing.assert_allclose(scene.objects[0].corner_normals, expected, atol=1e-5)


def test_faces_have_their_materials_and_empty_slots_are_grey(add_mesh, add_material):
    obj = add_mesh(vertices=CUBE, faces=CUBE_FACES)
    obj.data.materials.append(add_material("ShaderNodeBsdfDiffuse", name="Red", Color=(0.5, 0, 0, 1)))
    obj.data.materials.append(None)
    obj.data.materials.append(add_material("ShaderNodeBsdfDiffuse", name="Unused", Color=(0.5, 0, 0, 1)))
    obj.data.materials.append(add_material("ShaderNodeBsdfDiffuse", name="Last", Color=(0, 0, 0.5, 1)))
    for face, index in zip(obj.data.polygons, (0, 1, 0, 3, 99, 1), strict=True):
        face.material_index = index

    scene, (source,) = read(obj)

    albedo = np.array([surface.albedo for surface in scene.surfaces])[scene.objects[0].surface]
    by_face = {0: (0.5, 0, 0), 1: (0.8, 0.8, 0.8), 2: (0.5, 0, 0), 3: (0, 0, 0.5), 4: (0, 0, 0.5), 5: (0.8, 0.8, 0.8)}
    np.testing.assert_allclose(albedo, [by_face[face] for face in source.polygons], rtol=1e-6)
    assert sorted(surface.name for surface in scene.surfaces) == ["", "Last", "Red"]


def test_a_material_of_the_object_wins_over_the_meshs(add_mesh, add_material):
    obj = add_mesh()
    obj.data.materials.append(add_material("ShaderNodeBsdfDiffuse", name="Of mesh"))
    obj.material_slots[0].link = "OBJECT"
    obj.material_slots[0].material = add_material("ShaderNodeBsdfDiffuse", name="Of object")

    scene, _ = read(obj)

    assert [surface.name for surface in scene.surfaces] == ["Of object"]


def collection(name, *objects, **switches):
    made = bpy.data.collections.new(name)
    bpy.context.scene.collection.children.link(made)
    for obj in objects:
        bpy.context.scene.collection.objects.unlink(obj)
        made.objects.link(obj)
    for key, value in switches.items():
        setattr(made, key, value)
    return made


def test_what_a_render_hides_is_left_out(add_mesh, add_lamp):
    floor = add_mesh("Floor")
    add_mesh("Camera icon off", hide_render=True)
    collection("A", add_mesh("In a hidden collection"), hide_render=True)
    inner = collection("B", add_mesh("In a hidden collection's child"))
    bpy.context.scene.collection.children.unlink(inner)
    bpy.data.collections["A"].children.link(inner)
    collection("C", add_mesh("Excluded"))
    bpy.context.view_layer.layer_collection.children["C"].exclude = True
    add_mesh("No rays", visible_diffuse=False, visible_shadow=False)
    add_lamp("SUN", {"energy": 1.0}, hide_render=True)
    add_lamp("SUN", {"energy": 1.0}, visible_diffuse=False)

    scene, _ = read(floor)

    assert names(scene) == ["Floor"]
    assert [lamp.name for lamp in scene.lamps] == ["Lamp"]


def test_what_only_the_viewport_hides_is_read_and_stays_hidden(add_mesh):
    floor = add_mesh("Floor")
    ceiling = add_mesh("Eye shut")
    screen = add_mesh("Screen icon off", hide_viewport=True)
    of_collection = collection("A", add_mesh("In a hidden collection"), hide_viewport=True)
    collection("B", add_mesh("In a shut layer"))
    layer = bpy.context.view_layer.layer_collection.children["B"]
    layer.hide_viewport = True
    ceiling.hide_set(True)
    instanced = bpy.data.collections.new("Instanced")
    lamp_post = bpy.data.objects.new("Post", floor.data)
    lamp_post.hide_viewport = True
    instanced.objects.link(lamp_post)
    stand = bpy.data.objects.new("Stand", None)
    stand.instance_type, stand.instance_collection = "COLLECTION", instanced
    bpy.context.scene.collection.objects.link(stand)

    scene, _ = read(floor)

    assert names(scene) == [
        "Eye shut",
        "Floor",
        "In a hidden collection",
        "In a shut layer",
        "Screen icon off",
        "Stand/Post",
    ]
    assert ceiling.hide_get()
    assert screen.hide_viewport
    assert of_collection.hide_viewport
    assert layer.hide_viewport
    assert lamp_post.hide_viewport


def test_collection_instances_come_at_their_places(add_mesh):
    floor = add_mesh("Floor")
    source = bpy.data.collections.new("Source")
    chair, hidden = bpy.data.objects.new("Chair", floor.data), bpy.data.objects.new("Hidden", floor.data)
    hidden.hide_render = True
    chair.location.x = 1.0
    source.objects.link(chair)
    source.objects.link(hidden)
    for index in range(3):
        empty = bpy.data.objects.new(f"Place {index}", None)
        empty.instance_type, empty.instance_collection = "COLLECTION", source
        empty.location.y = 10.0 * index
        empty.hide_render = index == 2
        bpy.context.scene.collection.objects.link(empty)

    scene, sources = read(floor)

    assert names(scene) == ["Floor", "Place 0/Chair", "Place 1/Chair"]
    assert [source.name for source in sources] == ["Floor"]
    placed = {obj.name: obj.vertices.min(axis=0) for obj in scene.objects}
    np.testing.assert_allclose(placed["Place 1/Chair"], (1.0, 10.0, 0.0))


def test_lamps_in_collection_instances_shine_from_their_places(add_mesh):
    """Each with its light, its shadows and its warnings; hidden ones do not, nor does the collection itself, which is
    in no scene."""
    floor = add_mesh("Floor")
    source = bpy.data.collections.new("Chandelier")
    for name in ("Bulb", "Linked", "Hidden", "Unseen"):
        bulb = bpy.data.objects.new(name, bpy.data.lights.new(name, "POINT"))
        bulb.data.energy, bulb.data.use_shadow = 10.0, name != "Bulb"
        bulb.location.z = 2.0
        source.objects.link(bulb)
    source.objects["Hidden"].hide_render = True
    source.objects["Unseen"].visible_diffuse = False
    source.objects["Linked"].light_linking.receiver_collection = bpy.data.collections.new("Only these")
    for index in range(2):
        empty = bpy.data.objects.new(f"Hook {index}", None)
        empty.instance_type, empty.instance_collection = "COLLECTION", source
        empty.location.x = 3.0 * index
        bpy.context.scene.collection.objects.link(empty)

    scene, _ = read(floor)

    lamps = {lamp.name: lamp for lamp in scene.lamps}
    assert set(lamps) == {"Lamp", "Hook 0/Bulb", "Hook 1/Bulb", "Hook 0/Linked", "Hook 1/Linked"}
    assert lamps["Hook 1/Bulb"].position == pytest.approx((3.0, 0.0, 2.0))
    assert lamps["Hook 1/Bulb"].intensity == pytest.approx(lamps["Lamp"].intensity)
    assert [lamps[name].casts_shadow for name in ("Hook 1/Bulb", "Hook 1/Linked")] == [False, True]
    assert sum("Light linking" in warning and "Linked'" in warning for warning in scene.warnings) == 2


def test_instances_on_vertices_follow_the_instancers_render_switch(add_mesh):
    floor = add_mesh("Floor", location=(0, 0, -5))
    parent, child = add_mesh("Parent"), add_mesh("Child")
    child.parent = parent
    parent.instance_type = "VERTS"
    parent.show_instancer_for_render = False

    scene, _ = read(floor)

    assert names(scene).count("Parent/Child") == 4
    assert "Parent" not in names(scene)


def test_geometry_nodes_instances_are_read(add_mesh):
    floor = add_mesh("Floor", location=(0, 0, -5))
    scatter = add_mesh("Scatter")
    tree = bpy.data.node_groups.new("Scatter", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    start, points, ball, end = (
        tree.nodes.new(kind)
        for kind in ("NodeGroupInput", "GeometryNodeInstanceOnPoints", "GeometryNodeMeshIcoSphere", "NodeGroupOutput")
    )
    tree.links.new(start.outputs[0], points.inputs["Points"])
    tree.links.new(ball.outputs[0], points.inputs["Instance"])
    tree.links.new(points.outputs[0], end.inputs[0])
    scatter.modifiers.new("Scatter", "NODES").node_group = tree

    scene, _ = read(floor)

    balls = [obj for obj in scene.objects if obj.name == "Scatter/Scatter"]
    assert [len(ball.triangles) for ball in balls] == [20] * 4
    assert all(ball.surface.max() < len(scene.surfaces) for ball in balls)


def test_curves_texts_surfaces_and_metaballs_block_light(add_mesh, add_material):
    floor = add_mesh("Floor")
    bpy.ops.curve.primitive_bezier_circle_add()
    bpy.context.object.name, bpy.context.object.data.bevel_depth = "Ring", 0.1
    bpy.context.object.data.materials.append(add_material("ShaderNodeBsdfDiffuse", name="Gold"))
    bpy.ops.curve.primitive_bezier_circle_add()
    bpy.context.object.name, bpy.context.object.data.fill_mode = "Wire", "HALF"
    bpy.ops.object.text_add()
    bpy.ops.surface.primitive_nurbs_surface_sphere_add()
    bpy.context.object.name = "Ball"
    bpy.ops.object.metaball_add()

    scene, _ = read(floor)

    assert names(scene) == ["Ball/Ball", "Floor", "Mball/Mball", "Ring/Ring", "Text/Text"]
    assert "Gold" in {surface.name for surface in scene.surfaces}


def test_edit_mode_is_read_as_it_stands(add_mesh):
    obj = add_mesh()
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.subdivide(number_cuts=1)

    scene, _ = read(obj)

    assert len(scene.objects[0].triangles) == 8


def test_modifiers_count_for_a_tessellated_result_and_are_refused_for_kept_corners(add_mesh):
    obj = add_mesh("Smooth")
    obj.modifiers.new("Subdivision", "SUBSURF").levels = 1

    scene, _ = read(obj)
    assert len(scene.objects[0].triangles) == 8

    with pytest.raises(SceneError, match=r"'Smooth' has modifiers that change its faces.*New Object"):
        read(obj, tessellate=False)


def test_modifiers_that_only_move_vertices_keep_their_corners(add_mesh):
    obj = add_mesh()
    displace = obj.modifiers.new("Displace", "DISPLACE")
    displace.strength, displace.mid_level = 2.0, 0.0

    scene, _ = read(obj, tessellate=False)

    np.testing.assert_allclose(scene.objects[0].vertices[:, 2], 2.0)


def test_the_original_is_baked_whichever_of_it_and_its_copy_shows(add_mesh):
    original, copy = add_mesh("Wall"), add_mesh("Wall Radiosity")
    copy[ORIGINAL_KEY] = original

    assert pick() == [original]
    original.hide_render = True
    original.hide_set(True)
    copy.select_set(True)
    assert pick() == [original]
    assert pick(["Wall Radiosity"]) == [original]
    assert names(read(original)[0]) == ["Wall"]

    collection("Put away", original)
    bpy.context.view_layer.layer_collection.children["Put away"].exclude = True
    assert pick() == [copy]
    assert names(read(copy)[0]) == ["Wall Radiosity"]


def test_the_original_is_read_where_its_copy_was_moved_to(add_mesh):
    original, copy = add_mesh("Wall"), add_mesh("Wall Radiosity")
    copy[ORIGINAL_KEY] = original
    copy[PLACE_KEY] = np.ravel(copy.matrix_world).tolist()

    original.location.y = 2.0
    bpy.context.view_layer.update()
    assert read(original)[0].objects[0].vertices[:, 1].min() == 2.0
    copy.location.x = 3.0
    bpy.context.view_layer.update()
    np.testing.assert_allclose(read(original)[0].objects[0].vertices.min(axis=0), [3.0, 0.0, 0.0])


def test_receivers_are_the_named_else_the_selected_else_all(add_mesh):
    one, two, hidden = add_mesh("One"), add_mesh("Two"), add_mesh("Hidden", hide_render=True)
    assert pick() == [one, two]
    two.select_set(True)
    assert pick() == [two]
    assert pick(["One"]) == [one]
    hidden.select_set(True)
    with pytest.raises(SceneError, match="'Hidden' is hidden from rendering"):
        pick()


def test_receivers_that_are_not_there_or_no_mesh_are_named(add_mesh):
    add_mesh("Floor")
    with pytest.raises(SceneError, match=r"no object 'Flor'.*check the spelling"):
        pick(["Floor", "Flor"])
    with pytest.raises(SceneError, match=r"'Lamp' is not a mesh.*convert"):
        pick(["Lamp"])


def test_no_mesh_at_all_is_said():
    with pytest.raises(SceneError, match="has no mesh object"):
        pick()


def test_a_mesh_without_faces_is_refused(add_mesh):
    obj = add_mesh("Cloud", vertices=((0, 0, 0), (1, 0, 0)), faces=())
    with pytest.raises(SceneError, match="'Cloud' has no faces"):
        read(obj)


@pytest.mark.parametrize("bad", [float("nan"), float("inf")])
def test_coordinates_that_are_no_numbers_are_refused(add_mesh, bad):
    floor, broken = add_mesh("Floor"), add_mesh("Broken")
    # Past the limits that Blender's own fields keep, as broken importers do.
    broken.data.vertices.foreach_set("co", [bad] + [0.0] * 11)
    with pytest.raises(SceneError, match="'Broken' has coordinates that are not numbers"):
        read(floor)


def test_a_scene_without_light_is_refused(add_mesh, add_material, lamp):
    floor = add_mesh("Floor")
    lamp.data.energy = 0.0
    with pytest.raises(SceneError, match=r"has no light.*add a lamp"):
        read(floor)
    floor.data.materials.append(add_material("ShaderNodeEmission", Strength=1.0))
    scene, _ = read(floor)
    assert scene.surfaces[0].emission == (1.0, 1.0, 1.0)


def test_the_sky_is_light_too(add_mesh, lamp, shader):
    floor = add_mesh("Floor")
    lamp.hide_render = True
    bpy.context.scene.world = bpy.data.worlds.new("Sky")
    shader(bpy.context.scene.world, "ShaderNodeBackground", Color=(0.25, 0.5, 1.0, 1.0), Strength=2.0)

    assert read(floor)[0].sky == (0.5, 1.0, 2.0)


def test_instances_share_one_conversion_and_warn_once(add_mesh, add_material):
    obj = add_mesh("One", visible_diffuse=False)
    obj.data.materials.append(add_material("ShaderNodeBsdfGlass", name="Glass", Roughness=0.5))
    for index in range(3):
        twin = bpy.data.objects.new(f"Twin {index}", obj.data)
        twin.location.x = index + 2.0
        bpy.context.scene.collection.objects.link(twin)

    scene, _ = read(obj)

    assert len(scene.surfaces) == 1
    assert sorted(warning.split(" ")[1] for warning in scene.warnings) == ["'Glass'", "'One'"]
    lefts = sorted(obj.vertices[:, 0].min() for obj in scene.objects)
    np.testing.assert_allclose(lefts, (0.0, 2.0, 3.0, 4.0))


def test_a_scene_larger_than_memory_is_refused_while_it_is_read(add_mesh, monkeypatch):
    """Two cubes, of which the second is one too many."""
    first, second = (add_mesh(name=name, vertices=CUBE, faces=CUBE_FACES) for name in ("First", "Second"))
    monkeypatch.setattr(scene_reader, "_FIRST_LOOK", 30)
    monkeypatch.setattr(cost, "free_memory_mb", lambda: 1e-6)
    with pytest.raises(SceneError, match="hide from rendering"):
        read(first, second)
    monkeypatch.setattr(cost, "free_memory_mb", lambda: 1e6)
    assert len(read(first, second)[0].objects) == 2
