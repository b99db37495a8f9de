"""Direct light behind occluders: exact where nothing is in the way, unbiased and honest about its noise where it is.

Statistics are asked to lie within four standard deviations.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from radiosity_baker.core.direct.emitters import emitting_panels
from radiosity_baker.core.direct.illumination import DirectLight
from radiosity_baker.core.direct.lamps import place
from radiosity_baker.core.effects import MOST_PANELS
from radiosity_baker.core.patches import Space, unit_space
from radiosity_baker.core.scene import AreaLamp, PointLamp, Scene, SpotLamp, SunLamp, Surface
from radiosity_baker.core.visibility import Visibility

UNIT = Space(np.zeros(3), 1.0)
COUNT = 4000
PANEL = AreaLamp("panel", (0, 0, 0.8), (0.2, 0, 0), (0, 0.2, 0), (0, 0, -1), (1.0, 2.0, 4.0))
POINT = PointLamp("point", (0, 0, 0.8), (1.0, 2.0, 4.0))
BALL = PointLamp("ball", (0, 0, 0.8), (1.0, 2.0, 4.0), radius=0.2)
SUN = SunLamp("sun", (0, 0, -1), (1.0, 2.0, 4.0), angle=0.3)
#: The ground below lies at the edge of its cone; and at the edge of what its grid lets pass.
TILTED = ((0.8, 0.0, 0.6), (0.0, 1.0, 0.0), (-0.6, 0.0, 0.8))
EDGE = SpotLamp("edge", (0, 0, 0.8), (1.0, 2.0, 4.0), TILTED, cone_angle=1.4, blend=0.2, radius=0.1)
GRID = AreaLamp("grid", (0.4, 0, 0.8), (0.2, 0, 0), (0, 0.2, 0), (0, 0, -1), (1.0, 2.0, 4.0), spread=1.0)


def behind(build, lamps, *objects, points=((0, 0, 0),), rays=4, tries=COUNT, normal=(0, 0, 1), shading=None, seed=1):
    """Illumination of each point `tries` times over, on an even ground that itself blocks nothing."""
    far = build.quad(corner=(0.9, 0.9, -1), u=(0.1, 0, 0), v=(0, 0.1, 0))
    corners = np.concatenate([o.vertices[o.triangles] for o in (*objects, far)])
    light = DirectLight([place(lamp, UNIT) for lamp in lamps], Visibility(corners), 0)
    where = np.repeat(np.array(points, float), tries, axis=0)
    normals = np.tile(np.array(normal, float), (len(where), 1))
    shading = normals if shading is None else np.tile(np.array(shading, float), (len(where), 1))
    return light.at(where, normals, shading, rays, np.random.default_rng(seed))


def half_sail(build, height=0.4):
    """Hides all that is on one side of the vertical plane through the origin."""
    return build.quad("sail", (0, -1, height), (1, 0, 0), (0, 2, 0))


@pytest.mark.parametrize("lamp", [PANEL, BALL, SUN], ids=lambda lamp: lamp.name)
@pytest.mark.parametrize("rays", [2, 4, 16])
def test_half_a_lamp_gives_half_its_light(build, lamp, rays):
    whole = behind(build, [lamp], tries=1).irradiance[0]
    half = behind(build, [lamp], half_sail(build), rays=rays).irradiance
    error = half.std(axis=0) / np.sqrt(COUNT)
    assert (error > 0).all()
    assert (np.abs(half.mean(axis=0) - whole / 2) <= 4 * error).all()


@pytest.mark.parametrize("lamp", [PANEL, BALL, SUN], ids=lambda lamp: lamp.name)
@pytest.mark.parametrize("rays", [2, 4, 16])
def test_the_stated_variance_is_the_true_one(build, lamp, rays):
    """The mean over many tries of (difference of halves)^2 / 4 is the variance of the mean of the halves."""
    seen = behind(build, [lamp], half_sail(build), rays=rays)
    stated, true = seen.variance[:, 0], (seen.irradiance[:, 0] - seen.irradiance[:, 0].mean()) ** 2
    error = np.sqrt(stated.var() + true.var()) / np.sqrt(COUNT)
    assert abs(stated.mean() - true.mean()) <= 4 * error + true.mean() / COUNT


@pytest.mark.parametrize("lamp", [PANEL, BALL, SUN, POINT], ids=lambda lamp: lamp.name)
def test_what_is_seen_whole_has_no_noise(build, lamp):
    seen = behind(build, [lamp], points=((0.1, 0.2, -0.3),), tries=100)
    assert seen.variance.max() == 0
    assert np.ptp(seen.irradiance, axis=0) == pytest.approx(0, abs=1e-12)
    assert seen.irradiance.min() > 0


@pytest.mark.parametrize("lamp", [PANEL, BALL, SUN, POINT], ids=lambda lamp: lamp.name)
def test_what_is_hidden_is_exactly_dark(build, lamp):
    roof = build.quad("roof", (-1, -1, 0.4), (2, 0, 0), (0, 2, 0))
    seen = behind(build, [lamp], roof, tries=100)
    assert seen.irradiance.max() == 0
    assert seen.variance.max() == 0


@pytest.mark.parametrize("together", [1, 30])
def test_no_lamp_reaches_the_dark_by_chance(build, together):
    """Of a lamp that the plane of a surface cuts, some ways bring nothing and take no ray: what the two that are left
    do not tell is a guess, right on average only, and it is there in the dark as well."""
    low = [AreaLamp("low", (0, 0.5, 0.02), (0.2, 0, 0), (0, 0, 0.2), (0, -1, 0), (1.0, 2.0, 4.0))] * together
    wall = build.quad("wall", (-0.9, 0.25, -0.9), (1.8, 0, 0), (0, 0, 1.8))
    hidden, free = (behind(build, low, *objects, rays=2, tries=200) for objects in ([wall], []))
    assert (hidden.irradiance != 0).any() == (together == 1), "many lamps tell more of each other"
    assert not hidden.reached.any()
    assert free.reached.mean() > 0.5


@pytest.mark.parametrize("rays", [2, 4, 64])
def test_what_is_seen_of_a_large_near_lamp_is_the_light_of_that_part(build, rays):
    """A sail right under the lamp hides what is beyond x = 0.3; the rest is an area lamp of its own."""
    lamp = AreaLamp("panel", (0, 0, 0.2), (0.8, 0, 0), (0, 0.8, 0), (0, 0, -1), (1.0, 1.0, 1.0))
    rest = AreaLamp("rest", (-0.25, 0, 0.2), (0.55, 0, 0), (0, 0.8, 0), (0, 0, -1), (1.0, 1.0, 1.0))
    sail = build.quad("sail", (0.3, -1, 0.1999), (0.7, 0, 0), (0, 2, 0))
    truth = behind(build, [rest], tries=1).irradiance[0, 0]
    seen = behind(build, [lamp], sail, rays=rays).irradiance[:, 0]
    assert abs(seen.mean() - truth) <= 4 * seen.std() / np.sqrt(COUNT) + 1e-3 * truth


@pytest.mark.parametrize("lamp", [EDGE, GRID], ids=lambda lamp: lamp.name)
@pytest.mark.parametrize("open_sky", [True, False], ids=["open", "half hidden"])
def test_where_a_lamp_shines_unevenly_light_is_right_on_average_and_its_variance_true(build, lamp, open_sky):
    sails = [] if open_sky else [half_sail(build)]
    many = behind(build, [lamp], *sails, rays=2048, tries=200).irradiance[:, 0]
    seen = behind(build, [lamp], *sails)
    error = np.sqrt(seen.irradiance[:, 0].var() / COUNT + many.var() / 200)
    assert error > 0
    assert abs(seen.irradiance[:, 0].mean() - many.mean()) <= 4 * error
    stated, true = seen.variance[:, 0], (seen.irradiance[:, 0] - seen.irradiance[:, 0].mean()) ** 2
    assert abs(stated.mean() - true.mean()) <= 4 * np.sqrt(stated.var() + true.var()) / np.sqrt(COUNT)


@pytest.mark.parametrize("lamp", [EDGE, GRID], ids=lambda lamp: lamp.name)
def test_where_nothing_hides_a_lamp_the_edge_of_its_light_is_not_left_to_the_rays(build, lamp):
    """Eight places for each ray tell of it: even an eighth of the variance would be what chance leaves of that many."""
    light, points = place(lamp, UNIT), np.zeros((3, COUNT), dtype=np.float32)
    ways = light.aim(points, np.random.default_rng(1).random((2, 4, COUNT), dtype=np.float32))
    by_rays = (ways.towards[2] * ways.inverse * ways.solid * light.gain(points, ways)).mean(axis=0)
    assert behind(build, [lamp]).irradiance[:, 0].var() < by_rays.var() / 8


@pytest.mark.parametrize("lamp", [EDGE, GRID], ids=lambda lamp: lamp.name)
def test_many_uneven_lamps_bring_what_they_bring_one_by_one(build, lamp):
    field = "center" if lamp is GRID else "position"
    places = np.random.default_rng(0).uniform(-0.3, 0.3, (30, 2))
    lamps = [replace(lamp, **{field: (x, y, 0.8)}) for x, y in places]
    together = behind(build, lamps, tries=500).irradiance[:, 0]
    alone = np.sum([behind(build, [one], rays=256, tries=500).irradiance[:, 0] for one in lamps], axis=0)
    assert abs(together.mean() - alone.mean()) <= 4 * np.sqrt((together.var() + alone.var()) / 500)


def test_a_quarter_behind_two_sails(build):
    quarter = build.quad("other", (-1, 0, 0.4), (2, 0, 0), (0, 1, 0))
    whole = behind(build, [PANEL], tries=1).irradiance[0]
    seen = behind(build, [PANEL], half_sail(build), quarter).irradiance
    assert (np.abs(seen.mean(axis=0) - whole / 4) <= 4 * seen.std(axis=0) / np.sqrt(COUNT)).all()


def test_signatures_tell_which_lamps_are_seen(build):
    """Whole, in part, and not at all; of two lamps, which."""
    left = PointLamp("left", (-0.5, 0, 0.8), (1.0, 1.0, 1.0))
    right = PointLamp("right", (0.5, 0, 0.8), (1.0, 1.0, 1.0))
    sail = build.quad("sail", (0.1, -1, 0.4), (0.9, 0, 0), (0, 2, 0))
    points = ((-0.8, 0, 0), (-0.7, 0.1, 0), (0.2, 0, 0), (0.9, 0, 0), (0.9, 0.1, 0))
    signature = behind(build, [left, right], sail, points=points, tries=1).signature
    assert signature[0] == signature[1] != 0, "both"
    assert signature[3] == signature[4], "none or one"
    assert len({signature[0], signature[2], signature[3]}) >= 2
    assert (behind(build, [PANEL], half_sail(build), rays=16, tries=20).signature == -1).all()
    roof = build.quad("roof", (-1, -1, 0.4), (2, 0, 0), (0, 2, 0))
    assert (behind(build, [PANEL], roof, tries=5).signature == 0).all()


def test_no_light_comes_from_below_the_surface_itself(build):
    """Whatever the shading normal says."""
    below = PointLamp("below", (0.8, 0, -0.1), (1.0, 1.0, 1.0))
    tilted = np.array([1, 0, 1]) / np.sqrt(2)
    assert behind(build, [below], shading=tilted, tries=5).irradiance.max() == 0
    above = PointLamp("above", (0.8, 0, 0.1), (1.0, 1.0, 1.0))
    assert behind(build, [above], shading=tilted, tries=5).irradiance.min() > 0


def test_lamps_add_up(build):
    """Their light, and exactly their rays: no kind of lamp makes another one dearer."""
    lamps = (PANEL, BALL, SUN, POINT)
    alone = [behind(build, [lamp], tries=1) for lamp in lamps]
    together = behind(build, lamps, tries=1)
    assert together.irradiance[0] == pytest.approx(np.sum([one.irradiance[0] for one in alone], axis=0))
    assert together.rays["shadow"] == sum(one.rays["shadow"] for one in alone)


def test_a_point_lamp_takes_one_ray_and_darkness_none(build):
    assert behind(build, [POINT], tries=7, rays=16).rays.total() == 7
    assert behind(build, [PANEL], tries=7, rays=16).rays.total() == 7 * 16
    assert behind(build, [POINT, PANEL], tries=7, normal=(0, 0, -1)).rays.total() == 0
    assert behind(build, [], tries=7).irradiance.max() == 0


GLOW = Surface("glow", (0.5, 0.5, 0.5), (1.0, 2.0, 4.0))


def test_an_emitting_quad_is_an_area_lamp_of_its_radiance(build):
    """From in front; and it shines backwards as well."""
    floor = build.quad("floor", (-2, -2, 0), (4, 0, 0), (0, 4, 0))
    glowing = build.quad("glowing", (-0.5, -0.3, 1), (0, 0.6, 0), (1, 0, 0), surface=1)
    scene = Scene((floor, glowing), (build.grey, GLOW))
    space = unit_space(scene)
    panels = emitting_panels(scene, space)
    lamp = place(AreaLamp("lamp", (0, 0, 1), (0.5, 0, 0), (0, 0.3, 0), (0, 0, -1), GLOW.emission), space)
    points = space.normalise(np.random.default_rng(2).uniform(-2, 2, (50, 3)) * [1, 1, 0.1])
    normals = np.tile([0.0, 0, 1], (50, 1))
    nothing = Visibility(np.full((1, 3, 3), 90.0) + np.eye(3))

    def light_of(lights, where, facing):
        return DirectLight(lights, nothing, 0).at(where, facing, facing, 4, np.random.default_rng(3)).irradiance

    both = light_of(panels, points, normals)
    assert both == pytest.approx(light_of([lamp], points, normals), rel=1e-6, abs=1e-12)
    over = points * [1, 1, -1] + 2 * space.normalise(np.array([0, 0, 1.0])) * [0, 0, 1]
    back = light_of(panels, over, -normals)
    assert back == pytest.approx(both, rel=1e-6, abs=1e-12)


@pytest.mark.parametrize("height", [0.1, 0.01, 0.001])
def test_an_emitting_quad_close_by_is_not_in_its_own_way(build, height):
    glowing = build.quad("glowing", (-0.5, -0.5, height), (0, 1, 0), (1, 0, 0), surface=1)
    scene = Scene((glowing, build.quad("floor", (-1, -1, 0), (2, 0, 0), (0, 2, 0))), (build.grey, GLOW))
    space = unit_space(scene)
    corners = np.concatenate([space.normalise(o.vertices[o.triangles]) for o in scene.objects])
    up = np.array([[0, 0, 1.0]])
    point = space.normalise(np.array([[0.1, 0.2, 0]]))
    panels = emitting_panels(scene, space)
    seen = DirectLight(panels, Visibility(corners), 0).at(point, up, up, 16, np.random.default_rng(3)).irradiance
    assert seen[0] == pytest.approx(sum(p.share(point, up)[0] * p.color for p in panels))


def test_only_what_emits_becomes_a_panel(build):
    scene = Scene((build.box(surface=[0, 1, 0, 0, 0, 0]), build.quad()), (build.grey, GLOW))
    panels = emitting_panels(scene, unit_space(scene))
    assert [panel.name for panel in panels] == ["glow", "glow"]
    # Rays find many better than a lamp for each.
    many = build.sphere(level=2, surface=1)
    assert len(many.triangles) > MOST_PANELS
    scene = Scene((many,), (build.grey, GLOW))
    assert emitting_panels(scene, unit_space(scene)) == []


def test_emitting_triangles_without_area_are_no_lamps(build):
    line = build.triangles("line", [(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 1, 0)], [(0, 1, 2), (0, 1, 3)], surface=0)
    scene = Scene((line,), (GLOW,))
    assert len(emitting_panels(scene, unit_space(scene))) == 1
