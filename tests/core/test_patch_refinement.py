"""Patches get finer where light varies inside them, and nowhere else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from radiosity_baker.core.direct.lamps import place
from radiosity_baker.core.patch_refinement import patches_by_light
from radiosity_baker.core.patches import make_patches, split_objects, unit_space
from radiosity_baker.core.pilot import Pilot
from radiosity_baker.core.scene import PointLamp, Scene, SunLamp

SUN = SunLamp("sun", (0, 0, -1), (1.0, 1.0, 1.0))


def by_light(build, workers, *objects, lamps=(SUN,), wanted=500):
    scene = Scene(objects, (build.grey,) * 3, lamps)
    space = unit_space(scene)
    lights = [place(lamp, space) for lamp in lamps]
    return patches_by_light(scene, space, lights, build.effort(patches=wanted), 0, workers, Pilot(scene))[0]


def test_patches_are_finer_along_a_shadow_edge(build, workers):
    """A hard shadow of a square; away from its edge, by more than a patch, nothing is split."""
    ground = build.quad("ground", (-2, -2, 0), (4, 0, 0), (0, 4, 0))
    sail = build.quad("sail", (-0.7, -0.7, 1), (1.4, 0, 0), (0, 1.4, 0))
    patches = by_light(build, workers, ground, sail)
    on_ground = patches.normals[:, 2] * (patches.corners[:, :, 2].max(axis=1) < 0) > 0
    middle = np.abs(patches.corners.mean(axis=1)[on_ground, :2]).max(axis=1) * patches.space.metres
    area = patches.area[on_ground] * patches.space.metres**2
    edge = np.abs(middle - 0.7)
    assert np.median(area[edge < 0.03]) <= np.median(area[edge > 0.5]) / 4
    assert area[edge > 0.5].min() == pytest.approx(area.max())


def test_patches_stay_as_they_are_where_light_is_even(build, workers):
    patches = by_light(build, workers, build.quad())
    assert patches.area == pytest.approx(patches.area[0])


def test_finer_patches_cover_the_same(build, workers):
    room = build.furnished_room()
    lamp = PointLamp("lamp", (0.5, 0.2, 1.5), (1.0, 1.0, 1.0))
    patches = by_light(build, workers, *room.objects, lamps=(lamp,))
    whole = 6 * 4 + 2 * 0.6 * 0.6 + 4 * 0.6 * 0.8
    assert patches.area.sum() * patches.space.metres**2 == pytest.approx(whole)
    assert len(patches) <= 2 * 500 * 2


def test_a_mesh_of_which_all_patches_are_groups(build, workers):
    patches = by_light(build, workers, build.sphere(level=6), wanted=30)
    assert len(patches) < 300


def test_patches_are_finer_where_a_lamp_is_near(build, workers):
    """No shadow falls on the floor; but under the lamp the light changes within a patch."""
    lamp = PointLamp("lamp", (0, 0, 0.15), (1.0, 1.0, 1.0))
    floor = build.quad("floor", (-2, -2, 0), (4, 0, 0), (0, 4, 0))
    patches = by_light(build, workers, floor, lamps=(lamp,))
    away = np.linalg.norm(patches.corners.mean(axis=1)[:, :2], axis=1) * patches.space.metres
    assert np.median(patches.area[away < 0.1]) <= patches.area.max() / 4
    assert patches.area[away > 1.5].min() == pytest.approx(patches.area.max())


def test_groups_are_finer_where_a_lamp_is_near(build, workers):
    """A lamp inside a dense ball, near one side of it: the light is inside, on the backs of the triangles."""
    lamp = PointLamp("lamp", (0, 0, 0.9), (1.0, 1.0, 1.0))
    ball = build.sphere(level=5)
    even = by_light(build, workers, ball, lamps=(), wanted=100)
    patches = by_light(build, workers, ball, lamps=(lamp,), wanted=100)
    height = np.full(len(patches), -1.0)
    np.maximum.at(height, patches.patch, patches.corners[..., 2].mean(axis=1))
    assert len(patches) > len(even)
    assert np.median(patches.patch_area[height > 0.9]) < 0.5 * np.median(patches.patch_area[height < 0])


@pytest.mark.parametrize(("wanted", "same"), [(2048, True), (8000, False)])
def test_embree_serves_the_bake_where_its_triangles_are_those_of_the_pilot(build, wanted, same):
    """A floor that is split as far as the pilot splits it, and farther."""
    scene = Scene((build.quad(),), (build.grey,) * 3, (SUN,))
    pilot = Pilot(scene)
    patches = make_patches(scene, unit_space(scene), split_objects(scene, wanted))
    assert (pilot.visibility_for(patches) is pilot.visibility) == (len(patches.area) == len(pilot.patches.area)) == same


def test_shapes_that_the_pilot_knows_are_not_found_anew(build):
    """A dense ball, of whose triangles nothing is split: only how they are grouped differs."""
    scene = Scene((build.sphere(level=5),), (build.grey,) * 3)
    space, split, pilot = unit_space(scene), split_objects(scene, 100), Pilot(scene)
    known = pilot.like(space, split)
    assert known is pilot.patches
    grouped, anew = make_patches(scene, space, split, known), make_patches(scene, space, split)
    assert grouped.corners is known.corners
    assert len(grouped) < len(known)
    for name in ("corners", "normals", "area", "triangle", "patch", "patch_area", "members", "albedo"):
        assert np.array_equal(getattr(grouped, name), getattr(anew, name))
    assert pilot.like(space, split_objects(scene, 30_000)) is None
    assert pilot.like(replace(space, metres=2.0 * space.metres), split) is None
