"""Many emitting triangles: some rays to some of them bring, on average, the light of all."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_baker.core.direct.emitter_tree import EmitterTree
from radiosity_baker.core.direct.emitters import emitting_panels
from radiosity_baker.core.direct.illumination import DirectLight
from radiosity_baker.core.form_factors.polygon import polygon_irradiance
from radiosity_baker.core.patches import Space, unit_space
from radiosity_baker.core.scene import Scene, SceneObject, Surface
from radiosity_baker.core.visibility import Visibility

TRIES = 4000
RADIANCE = np.array([1.0, 2.0, 4.0])
NORMAL = np.array([0.0, 0, 1])


def plate(height, cells=9, size=0.5):
    """A square of 2 * cells * cells triangles that faces down."""
    line = np.linspace(-size, size, cells + 1)
    corner = np.array([(x, y, height) for x in line for y in line])
    index = np.arange((cells + 1) ** 2).reshape(cells + 1, -1)
    a, b, c, d = (i.ravel() for i in (index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]))
    return corner[np.concatenate([np.column_stack([a, c, b]), np.column_stack([a, d, c])])]


def seen(tree, corners, point, normal=NORMAL, rays=4):
    light = DirectLight([tree], Visibility(corners), 0)
    where, facing = np.tile(point, (TRIES, 1)), np.tile(normal, (TRIES, 1))
    return light.at(where, facing, facing, rays, np.random.default_rng(5))


@pytest.mark.parametrize("point", [(0, 0, 0), (0.3, 0.2, 0.78), (0.9, -0.9, 0.5)])
def test_a_plate_of_many_triangles_is_one_rectangle(point):
    """From afar, from so near that a triangle fills the view, and from aside."""
    triangles = plate(0.8)
    light = seen(EmitterTree(triangles, np.tile(RADIANCE, (len(triangles), 1))), triangles, point)
    whole = np.array([(-0.5, -0.5, 0.8), (-0.5, 0.5, 0.8), (0.5, 0.5, 0.8), (0.5, -0.5, 0.8)])
    truth = np.pi * RADIANCE * polygon_irradiance(np.array(point, float), NORMAL, whole, two_sided=True).item()
    error = light.irradiance.std(axis=0) / np.sqrt(TRIES)
    # Shadow rays end a little short of the emitter itself, so nothing is in the way.
    assert (np.abs(light.irradiance.mean(axis=0) - truth) <= 4 * error).all()
    assert light.irradiance[:, 0].std() < 0.5 * truth[0]
    assert light.rays["shadow"] <= 2 * 4 * TRIES


def test_each_triangle_shines_in_its_own_colour():
    triangles = plate(0.8)
    radiance = np.random.default_rng(6).random((len(triangles), 3)) ** 4
    light = seen(EmitterTree(triangles, radiance), triangles, (0.2, 0, 0))
    parts = [polygon_irradiance(np.array([0.2, 0, 0]), NORMAL, t, two_sided=True).item() for t in triangles]
    truth = np.pi * np.array(parts) @ radiance
    error = light.irradiance.std(axis=0) / np.sqrt(TRIES)
    assert (np.abs(light.irradiance.mean(axis=0) - truth) <= 4 * error).all()


def test_a_bulb_hides_its_own_back(build):
    """A convex mesh: what faces the point shines, the rest is behind it. And the noise is what it says."""
    bulb = build.sphere(radius=0.1, level=4)
    triangles = bulb.vertices[bulb.triangles] + [0, 0, 0.7]
    tilted = np.array([0.6, 0, 0.8])
    light = seen(EmitterTree(triangles, np.tile(RADIANCE, (len(triangles), 1))), triangles, (0.1, 0, 0), tilted)
    parts = polygon_irradiance(np.array([[0.1, 0, 0]])[:, None], tilted[None, None], triangles)
    truth = np.pi * RADIANCE * parts.sum()
    spread = light.irradiance.std(axis=0)
    assert (np.abs(light.irradiance.mean(axis=0) - truth) <= 4 * spread / np.sqrt(TRIES)).all()
    stated = light.variance.mean(axis=0)
    assert (np.abs(stated - spread**2) <= 4 * light.variance.std(axis=0) / np.sqrt(TRIES)).all()


def test_one_triangle_and_none_facing_the_point():
    triangles = plate(0.8)[:1]
    tree = EmitterTree(triangles, RADIANCE[None])
    truth = np.pi * RADIANCE * polygon_irradiance(np.zeros(3), NORMAL, triangles[0], two_sided=True).item()
    light = seen(tree, triangles, (0, 0, 0))
    error = light.irradiance.std(axis=0) / np.sqrt(TRIES)
    assert (np.abs(light.irradiance.mean(axis=0) - truth) <= 4 * error).all()
    dark = seen(tree, triangles, (0, 0, 0), -NORMAL)
    assert dark.irradiance.max() == 0
    assert dark.rays["shadow"] == 0


def test_many_small_bulbs_become_one_tree_and_a_glowing_room_is_left_to_the_rays(build):
    glow = Surface("glow", (0, 0, 0), (1.0, 1, 1))
    bulb = build.sphere(radius=0.05, level=3, surface=1)
    scene = Scene((build.box(low=(-1, -1, -1)), bulb), (build.grey, glow))
    (tree,) = emitting_panels(scene, unit_space(scene))
    assert isinstance(tree, EmitterTree)
    room = Scene((build.sphere(level=3, surface=1),), (build.grey, glow))
    assert emitting_panels(room, unit_space(room)) == []


@pytest.mark.parametrize("cells", [2, 9], ids=["panels", "tree"])
def test_one_sided_emitters_light_what_is_before_them_as_two_sided_ones_do_and_nothing_behind(build, cells):
    """The plate faces down: before it exactly the same, with the same random numbers; behind it nothing. What does not
    emit is much larger, or rays would find the plate."""
    triangles = plate(0.0, cells)
    sheet = SceneObject(
        "plate",
        triangles.reshape(-1, 3),
        np.arange(triangles[..., 0].size).reshape(-1, 3),
        np.zeros(len(triangles), int),
    )
    below, above = np.array([0.1, 0.2, -0.5]), np.array([0.1, 0.2, 0.5])

    def irradiance(point, normal, *, one_sided):
        glow = Surface("glow", (0, 0, 0), (1.0, 1.0, 1.0), one_sided=one_sided)
        scene = Scene((sheet, build.quad("far", (-5, -5, -9), (10, 0, 0), (0, 10, 0), 1)), (glow, build.grey))
        light = DirectLight(emitting_panels(scene, Space(np.zeros(3), 1.0)), Visibility(triangles), 0)
        return light.at(point[None], normal[None], normal[None], 4, np.random.default_rng(5)).irradiance

    before = irradiance(below, NORMAL, one_sided=True)
    assert before.min() > 0
    assert np.array_equal(before, irradiance(below, NORMAL, one_sided=False))
    assert irradiance(above, -NORMAL, one_sided=True).max() == 0
    assert irradiance(above, -NORMAL, one_sided=False).min() > 0


def test_triangles_without_area_say_nothing_and_take_nothing():
    """All in a line, but for rounding: from running sums they got what rounding left of the others, times 1e300."""
    triangles = plate(0.8)
    folded = triangles[:40] + np.array([0.1, 0.7, 0.0])
    folded[:, 2] = 0.7 * folded[:, 0] + 0.3 * folded[:, 1]
    every = np.concatenate([triangles, folded])
    light = seen(EmitterTree(every, np.tile(RADIANCE, (len(every), 1))), triangles, (0, 0, 0))
    alone = seen(EmitterTree(triangles, np.tile(RADIANCE, (len(triangles), 1))), triangles, (0, 0, 0))
    error = np.hypot(light.irradiance.std(axis=0), alone.irradiance.std(axis=0)) / np.sqrt(TRIES)
    assert (np.abs(light.irradiance.mean(axis=0) - alone.irradiance.mean(axis=0)) <= 4 * error).all()
