"""Patches cover the scene once, keep surfaces apart, and gather small triangles."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_baker.core.patches import (
    shading_normals,
    split_objects,
    triangle_geometry,
    unit_space,
)
from radiosity_baker.core.scene import Scene, SceneObject, Surface

SURFACES = (Surface("a", (0.1, 0.2, 0.3)), Surface("b", (0.4, 0.5, 0.6), (1, 2, 3)), Surface("c", (0.7, 0.8, 0.9)))


@pytest.fixture(scope="module")
def scene(build) -> Scene:
    """A striped wall, a dense ball, a pearl smaller than a patch and a block, away from the origin."""
    wall = build.quad("wall", (10, 0, 0), (8, 0, 0), (0, 0, 4), surface=[0, 1])
    ball = build.sphere("ball", level=4, surface=np.arange(2048) % 2)
    ball = SceneObject("ball", 2 * ball.vertices + np.array([14, 3, 2]), ball.triangles, ball.surface)
    pearl = build.sphere("pearl", radius=0.05, level=2)
    pearl = SceneObject("pearl", pearl.vertices + np.array([17.1, 0.9, 3.7]), pearl.triangles, pearl.surface)
    return Scene((wall, ball, pearl, build.box("block", (10, 1, 0), (12, 3, 1), surface=2)), SURFACES)


@pytest.fixture(scope="module")
def patches(build, scene):
    return build.patches(scene, 600)


def area_of(scene: Scene, surface: int) -> float:
    return sum(triangle_geometry(o.vertices[o.triangles])[1][o.surface == surface].sum() for o in scene.objects)


def test_the_unit_box_holds_the_scene_and_touches_it(scene):
    space = unit_space(scene)
    points = np.concatenate([space.normalise(o.vertices) for o in scene.objects])
    assert np.abs(points).max() == pytest.approx(1.0)
    assert (points.min(axis=0) + points.max(axis=0)) / 2 == pytest.approx(0.0, abs=1e-12)
    assert space.metres == pytest.approx(4.0)


def test_vertices_without_faces_do_not_count(build):
    stray = build.triangles("t", [(0, 0, 0), (1, 0, 0), (0, 1, 0), (1e6, 0, 0)], [(0, 1, 2)])
    assert unit_space(Scene((stray,), SURFACES)).metres == pytest.approx(0.5)


def test_a_scene_without_extent_has_a_space(build):
    point = build.triangles("t", [(1, 1, 1)] * 3, [(0, 1, 2)])
    assert np.isfinite(unit_space(Scene((point,), SURFACES)).normalise(point.vertices)).all()


def test_areas_add_up_surface_by_surface(scene, patches):
    for number, surface in enumerate(SURFACES):
        own = patches.albedo[:, 0] == np.float32(surface.albedo[0])
        assert patches.patch_area[own].sum() * patches.space.metres**2 == pytest.approx(area_of(scene, number))
    assert patches.area.sum() == pytest.approx(patches.patch_area.sum())


def test_each_patch_has_one_surface_with_its_emission(patches):
    numbers = {surface.albedo: surface for surface in SURFACES}
    for albedo, emission in zip(patches.albedo.tolist(), patches.emission.tolist(), strict=True):
        surface = numbers[tuple(round(channel, 5) for channel in albedo)]
        assert emission == list(surface.emission)


def test_no_patch_mixes_directions_or_reaches_far(scene, patches):
    """The centres of a patch's triangles lie in one cell of the grid that small ones are grouped by."""
    centers = patches.corners.mean(axis=1)
    cell = 0.8 * split_objects(scene, 600).edge / patches.space.metres
    for number in range(len(patches)):
        own = centers[patches.patch == number]
        assert np.ptp(own, axis=0).max() <= cell
        facing = patches.normals[patches.patch == number]
        assert (facing @ facing.mean(axis=0)).min() > 0


def test_members_list_the_triangles_of_each_patch(patches):
    assert patches.first[0] == 0
    assert patches.first[-1] == len(patches.members) == len(patches.patch)
    for number in (0, 7, len(patches) - 1):
        listed = patches.members[patches.first[number] : patches.first[number + 1]]
        assert sorted(listed) == np.flatnonzero(patches.patch == number).tolist()
    assert np.bincount(patches.patch, patches.area) == pytest.approx(patches.patch_area)


@pytest.mark.parametrize("wanted", [100, 600, 5000])
def test_about_as_many_patches_as_wanted(build, scene, wanted):
    """The edge is met within a factor of two in count; grouping by cells and facing adds up to another two."""
    made = len(build.patches(scene, wanted))
    assert wanted / 2 <= made <= 4 * wanted


def test_dense_meshes_are_grouped(build):
    ball = build.sphere(level=5)
    made = build.patches(Scene((ball,), SURFACES), 300)
    assert len(made.area) == 8192
    assert len(made) <= 1200


def test_large_triangles_stay_their_own_patches(build):
    made = build.patches(Scene((build.quad(),), SURFACES), 512)
    assert len(made) == len(made.area)


def test_triangles_without_area_are_left_out(build):
    line = build.triangles("t", [(0, 0, 0), (1, 0, 0), (0, 1, 0), (2, 0, 0)], [(0, 1, 2), (0, 1, 3), (1, 1, 2)])
    made = build.patches(Scene((line,), SURFACES), 1)
    assert made.area.min() > 0
    assert made.area.sum() * made.space.metres**2 == pytest.approx(0.5)


def test_geometry_of_a_known_triangle():
    normals, area = triangle_geometry(np.array([[[0, 0, 0], [2, 0, 0], [0, 3, 0]], [[0, 0, 0], [1, 1, 1], [2, 2, 2]]]))
    assert normals.tolist() == [[0, 0, 1], [0, 0, 0]]
    assert area.tolist() == [3, 0]


def test_coarser_groups_are_several_times_fewer_and_mix_nothing(build):
    """Of the flat faces of a room: some patches to a group, never of two surfaces, never around an edge."""
    surfaces = tuple(Surface(str(k), (0.1 * (k + 1),) * 3) for k in range(6))
    room = build.box(inward=True, surface=range(6))
    made = build.patches(Scene((room,), surfaces), 3000)
    group = made.coarser_groups
    look = {(g, round(float(a), 4)) for g, a in zip(group, made.albedo[:, 0], strict=True)}
    assert len(look) == group.max() + 1
    assert 3 <= len(made) / len(look) <= 8


def smooth(normals) -> SceneObject:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], dtype=float)
    corner_normals = np.array([normals], dtype=np.float32)
    return SceneObject("t", vertices, np.array([[0, 1, 2]], np.int32), np.zeros(1, np.int32), corner_normals)


def test_shading_normals_are_interpolated_unit_vectors():
    lean = np.array([0.6, 0, 0.8])
    receiver = smooth([lean, (0, 0, 1), (0, 0, 1)])
    weights = np.array([[[1, 0, 0], [0.5, 0.5, 0], [0, 0.5, 0.5]]])
    shaded = shading_normals(receiver, np.zeros(1, np.int32), weights, np.array([[0.0, 0, 1]]))
    between = (lean + shaded[0, 2]) / np.linalg.norm(lean + shaded[0, 2])
    assert shaded[0] == pytest.approx(np.array([lean, between, [0, 0, 1]]), abs=1e-6)


def test_a_shading_normal_on_the_back_gives_way_to_the_geometry():
    receiver = smooth([(0, 0, -1), (0, 0, 0), (0, 0, 1)])
    shaded = shading_normals(receiver, np.zeros(1, np.int32), np.eye(3)[None], np.array([[0.0, 0, 1]]))
    assert shaded[0].tolist() == [[0, 0, 1]] * 3


def test_one_sided_patches_emit_in_front_alone(build):
    glow, lamp = Surface("glow", emission=(1, 2, 3)), Surface("lamp", emission=(4, 5, 6), one_sided=True)
    scene = Scene((build.quad("a"), build.quad("b", (0, 0, 1), surface=1)), (glow, lamp))
    patches = build.patches(scene, 4)
    count = len(patches)
    every = np.arange(2 * count, dtype=np.int32)
    own = np.array([(1, 2, 3), (4, 5, 6)])[patches.surface]
    behind = own * (patches.surface == 0)[:, None]
    assert np.array_equal(patches.emission_of(every), np.concatenate([own, behind]))
    assert build.patches(Scene(scene.objects, (glow, glow)), 4).one_sided is None
