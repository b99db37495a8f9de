"""What is odd about meshes is found, and what only looks odd is not."""

from dataclasses import replace

import numpy as np
import pytest

from radiosity_baker.core.lint import findings
from radiosity_baker.core.scene import PointLamp, Scene, SunLamp, Surface

SUN = SunLamp("sun", (0.0, 0.0, -1.0), (1.0, 1.0, 1.0))
WHITE = Surface("white")


def kinds(*objects, lamps=(SUN,), surfaces=(WHITE,), kept=False):
    return [(f.kind, f.name, f.count) for f in findings(Scene(objects, surfaces, lamps), kept=kept)]


def with_triangles(thing, triangles):
    triangles = np.asarray(triangles, np.int32)
    return replace(thing, triangles=triangles, surface=np.zeros(len(triangles), np.int32))


def test_a_sound_box_is_sound(build):
    assert kinds(build.box()) == []


def test_one_flipped_triangle_is_found_with_its_neighbours(build):
    box = build.box()
    turned = box.triangles.copy()
    turned[0] = turned[0][::-1]
    assert kinds(with_triangles(box, turned)) == [("mixed winding", box.name, 4)]


def test_a_box_that_faces_inward_is_inside_out_unless_it_is_a_room(build):
    inward = build.box(inward=True)
    assert kinds(inward) == [("inside out", inward.name, 12)]
    lamp = PointLamp("lamp", tuple(inward.vertices.mean(axis=0)), (1.0, 1.0, 1.0))
    assert kinds(inward, lamps=(lamp,)) == []


def test_an_open_box_may_face_either_way(build):
    inward = build.box(inward=True)
    assert kinds(with_triangles(inward, inward.triangles[:-2])) == []


def test_faces_without_area_and_faces_twice_are_counted(build):
    quad = build.quad()
    a, b, c = quad.triangles[0]
    assert kinds(with_triangles(quad, [*quad.triangles, (a, a, b)])) == [("zero area", quad.name, 1)]
    # The same triangle from another corner on.
    assert ("duplicate faces", quad.name, 1) in kinds(with_triangles(quad, [*quad.triangles, (b, c, a)]))


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_small_scenes_and_large_ones_are_judged_alike(build, scale):
    box = build.box()
    assert kinds(replace(box, vertices=box.vertices * scale)) == []


def test_too_white_a_surface_is_named_if_it_is_used(build):
    assert kinds(build.quad(), surfaces=(Surface("snow", (1.0, 0.5, 0.5)),)) == [("albedo", "snow", 2)]
    assert kinds(build.quad(), surfaces=(WHITE, Surface("snow", (1.0, 0.5, 0.5)))) == []


def test_a_kept_mesh_is_coarse_near_a_lamp_only(build):
    quad = build.quad()
    near = PointLamp("lamp", tuple(quad.vertices.mean(axis=0) + np.array([0.0, 0.0, 0.2])), (1.0, 1.0, 1.0))
    far = PointLamp("lamp", (0.0, 0.0, 50.0), (1.0, 1.0, 1.0))
    assert kinds(quad, lamps=(near,), kept=True) == [("coarse", quad.name, 2)]
    assert kinds(quad, lamps=(near,)) == kinds(quad, lamps=(far,), kept=True) == []
