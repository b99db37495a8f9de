"""What a person may say of one object: whether it receives, casts and bounces, and how finely it is split."""

import bpy
import numpy as np
import pytest

from radiosity_baker.addon.bake_scene import bake_objects
from radiosity_baker.addon.scene_reader import pick_receivers, read_scene
from radiosity_baker.core.scene import SceneError
from radiosity_baker.core.settings import Settings

pytestmark = pytest.mark.usefixtures("registered")


@pytest.fixture
def floor(add_mesh, add_lamp):
    add_lamp("POINT", {"energy": 100.0, "shadow_soft_size": 0.0}, location=(0.0, 0.0, 4.0))
    return add_mesh("Floor", [(x, y, 0) for x, y in ((-2, -2), (2, -2), (2, 2), (-2, 2))])


@pytest.fixture
def shelf(add_mesh):
    return add_mesh("Shelf", [(x, y, 1) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))])


def light_in_the_middle(floor, colours, *others):
    settings = Settings(error=0.2, triangles=500)
    objects = [floor, *others]
    _, written = bake_objects(bpy.context, objects, settings, result_mode="new", attribute="Radiosity")
    mesh = written[0].data
    corners = np.array([mesh.vertices[loop.vertex_index].co for loop in mesh.loops])
    return colours(mesh, "Radiosity")[np.linalg.norm(corners, axis=1) < 0.5].mean()


def test_what_casts_nothing_leaves_no_shadow(floor, shelf, colours):
    dark = light_in_the_middle(floor, colours)
    shelf.radiosity_baker.casts = False
    bright = light_in_the_middle(floor, colours, shelf)
    assert dark < 0.1 * bright


def test_what_does_not_bounce_is_black_to_others_and_keeps_its_own_light(floor, shelf):
    shelf.radiosity_baker.bounces = False
    scene, sources = read_scene(bpy.context.evaluated_depsgraph_get(), [floor, shelf], tessellate=True)
    by_name = {o.name: o for o in scene.objects}
    assert [source.name for source in sources] == ["Floor", "Shelf"]
    assert not by_name["Shelf"].present
    assert by_name["Shelf"].receives
    assert scene.surfaces[by_name["Shelf (black)"].surface[0]].albedo == (0.0, 0.0, 0.0)
    assert {o.name for o in scene.surroundings().objects} == {"Floor", "Shelf (black)"}


def test_what_does_not_receive_is_not_baked_unless_it_is_named(floor, shelf):
    shelf.radiosity_baker.receives = False
    scene, layer = bpy.context.scene, bpy.context.view_layer
    assert pick_receivers(scene, layer, None) == [floor]
    assert pick_receivers(scene, layer, ["Shelf"]) == [shelf]
    floor.radiosity_baker.receives = False
    with pytest.raises(SceneError, match="switch Receives on"):
        pick_receivers(scene, layer, None)


def test_an_object_is_split_to_its_own_size(floor, shelf):
    shelf.radiosity_baker.use_size, shelf.radiosity_baker.size = True, 0.1
    settings = Settings(error=0.5, size=1.0)
    _, written = bake_objects(bpy.context, [floor, shelf], settings, result_mode="new", attribute="Radiosity")
    longest = [max(_length(obj.data, e) for e in obj.data.edges) for obj in written]
    assert longest[1] <= 0.1 + 1e-6 < 0.5 <= longest[0]


def _length(mesh, edge):
    one, two = (mesh.vertices[index].co for index in edge.vertices)
    return (one - two).length
