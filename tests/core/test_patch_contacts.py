"""Patches end where something stands on them, so that no light runs on beneath a wall."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from radiosity_baker.core.bake import bake
from radiosity_baker.core.patch_contacts import cut_at_contacts, parted
from radiosity_baker.core.patches import make_patches, split_objects, triangle_geometry, unit_space
from radiosity_baker.core.scene import PointLamp, Scene, SunLamp, Surface
from radiosity_baker.core.settings import Settings
from radiosity_baker.core.visibility import Visibility

WHITE = Surface("white", (0.5, 0.5, 0.5))
SUN = SunLamp("sun", (0.3, 0.2, -1.0), (1e3, 1e3, 1e3))


def turned(scene_object, degrees):
    """Turned about the z axis, and moved so that it lies askew on any grid."""
    cosine, sine = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    turn = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    return replace(scene_object, vertices=scene_object.vertices @ turn + (0.11, 0.07, 0.0))


def cut(scene, wanted):
    """The split meshes before and after, and the patches of the latter, with what parts them."""
    space, split = unit_space(scene), split_objects(scene, wanted)
    patches = make_patches(scene, space, split)
    visibility = Visibility(patches.corners)
    after = cut_at_contacts(split, patches, visibility)
    pieces = make_patches(scene, space, after)
    return split, after, replace(pieces, parted=parted(pieces, visibility))


@pytest.mark.parametrize("degrees", [0.0, 17.0, 37.0])
def test_no_patch_reaches_from_one_side_of_a_wall_to_the_other(build, degrees):
    ground = build.quad("ground", (-3, -3, 0), (6, 0, 0), (0, 6, 0))
    wall = turned(build.box("wall", (-1, -0.0005, 0), (1, 0.0005, 1)), degrees)
    split, after, patches = cut(Scene((ground, wall), (WHITE,)), 1000)
    corners = after.meshes[0].vertices[after.meshes[0].triangles] - (0.11, 0.07, 0.0)
    angle = np.radians(degrees)
    along = corners @ (np.cos(angle), np.sin(angle), 0.0)
    across = corners @ (-np.sin(angle), np.cos(angle), 0.0)
    beside = (np.abs(along) < 0.98).all(axis=1)
    # A twentieth of an edge is how narrow a piece may be that is not cut again.
    narrow = 0.05 * split.edge
    assert beside.sum() > 20
    assert not (beside & (across.max(axis=1) > narrow) & (across.min(axis=1) < -narrow)).any()
    assert len(after.halvings) < 1.5 * len(split.halvings)
    middle = across.mean(axis=1)
    group = patches.coarser_groups[patches.patch[: len(middle)]]
    within = (np.abs(middle) > narrow) & ~np.isin(group, group[~beside])
    one, other = (set(group[within & (sign * middle > 0)]) for sign in (1, -1))
    assert one
    assert other
    assert not one & other


def test_where_nothing_stands_the_meshes_stay_as_they_are(build):
    ground = build.quad("ground", (-1, -1, 0), (2, 0, 0), (0, 2, 0))
    room = build.box("room", (-2, -2, -1), (2, 2, 3), inward=True)
    ball = build.sphere("ball", 0.4, 3)
    ball = replace(ball, vertices=ball.vertices + np.array([0.0, 0.0, 1.5]))
    split, after, patches = cut(Scene((ground, room, ball), (WHITE,)), 2000)
    assert after is split
    assert not patches.parted.any()


def test_what_stands_everywhere_makes_no_more_than_half_as_many_patches_again(build):
    """However many triangles something else has that is finely modelled, whose patches are groups of them."""
    ground = build.quad("ground", (-2, -2, 0), (4, 0, 0), (0, 4, 0))
    places = np.random.default_rng(1).uniform(-1.8, 1.8, (400, 2))
    blades = [build.quad(f"blade {k}", (x, y, 0), (0.05, 0.02, 0), (0, 0, 0.1)) for k, (x, y) in enumerate(places)]
    ball = build.sphere("ball", 0.4, 5)
    ball = replace(ball, vertices=ball.vertices + np.array([0.0, 0.0, 3.0]))
    scene = Scene((ground, *blades, ball), (WHITE,))
    before = make_patches(scene, unit_space(scene), split_objects(scene, 600))
    assert len(before) < len(ball.triangles)
    _, _, patches = cut(scene, 600)
    assert 1.2 * len(before) < len(patches) <= 1.5 * len(before) + 3


def radiance(baked, chosen) -> tuple[float, float]:
    """Mean and largest of a baked object's triangles, of which those are chosen that say so by their middles (t, 3) and
    normals (t, 3)."""
    corners = baked.vertices[baked.triangles]
    normals, area = triangle_geometry(corners)
    some, light = chosen(corners.mean(axis=1), normals), baked.layers["combined"].mean(axis=(1, 2))
    assert some.any()
    return float(area[some] @ light[some] / area[some].sum()), float(light[some].max())


@pytest.mark.parametrize(("thickness", "degrees"), [(0.001, 0.0), (0.001, 37.0), (0.2, 17.0)])
def test_the_sun_does_not_get_into_a_closed_house_along_the_ground(build, thickness, degrees):
    """Of the strip along the walls that patches half outside used to light, a twentieth of a patch's edge may be left:
    that was 1e-3 of the light outside, and is a twentieth of it."""
    t = thickness
    ground = build.quad("ground", (-12, -12, 0), (24, 0, 0), (0, 24, 0))
    shell = {
        "west": ((-2 - t, -2, 0), (-2, 2, 3)),
        "east": ((2, -2, 0), (2 + t, 2, 3)),
        "south": ((-2 - t, -2 - t, 0), (2 + t, -2, 3)),
        "north": ((-2 - t, 2, 0), (2 + t, 2 + t, 3)),
        "roof": ((-2 - t, -2 - t, 3), (2 + t, 2 + t, 3 + t)),
    }
    house = tuple(turned(build.box(name, *corners), degrees) for name, corners in shell.items())
    result = bake(Scene((ground, *house), (WHITE,), (SUN,)), Settings(size=0.4, threads=2))
    floor = next(o for o in result.objects if o.name == "ground")
    inside, _ = radiance(floor, lambda middle, _: np.hypot(*(middle[:, :2] - (0.11, 0.07)).T) < 1.9)
    outside, _ = radiance(floor, lambda middle, _: np.hypot(*(middle[:, :2] - (0.11, 0.07)).T) > 6.0)
    assert inside <= 1e-3 / 20 * outside


@pytest.mark.parametrize("bright", [3.0, 1e4])
def test_a_shadow_in_a_room_that_shows_its_backs_is_in_sight_under_a_bright_day(build, bright):
    """The underside of a table gets the light that it gets at night, within the night's stated error."""
    room = build.box("room", (-2, -2, 0), (2, 2, 3))
    table = build.box("table", (-0.5, -0.5, 0.7), (0.5, 0.5, 0.8))
    ground = build.quad("ground", (-12, -12, -0.01), (24, 0, 0), (0, 24, 0))
    lamp = PointLamp("bulb", (0.0, 0.0, 2.0), (1.0, 1.0, 1.0))
    light = []
    for lamps in ((lamp,), (lamp, replace(SUN, irradiance=(bright,) * 3))):
        result = bake(Scene((ground, room, table), (WHITE,), lamps), Settings(size=0.25, threads=2))
        (shown,) = (o for o in result.objects if o.name == "table")
        beneath, _ = radiance(shown, lambda _, normals: normals[:, 2] < -0.9)
        every, _ = radiance(shown, lambda _, normals: normals[:, 2] < 2.0)
        light.append((beneath, every, result.report.estimated_error["total"]))
    (night, mean, error), (day, _, _) = light
    assert day == pytest.approx(night, abs=error * mean)
