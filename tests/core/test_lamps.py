"""Each kind of lamp against its closed form, where nothing is in the way."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_baker.core.direct.illumination import DirectLight
from radiosity_baker.core.direct.lamps import place
from radiosity_baker.core.patches import Space
from radiosity_baker.core.scene import AreaLamp, PointLamp, SpotLamp, SunLamp
from radiosity_baker.core.visibility import Visibility

#: Neither the unit of length nor the origin is that of the unit box.
SPACE = Space(np.array([1.0, 2.0, 3.0]), 4.0)
FAR_AWAY = np.full((1, 3, 3), 90.0) + np.eye(3)
UP = (0.0, 0.0, 1.0)
COLOR = (1.0, 2.0, 4.0)


def irradiance(lamp, point, normal=UP, rays=64, count=1):
    """Mean (3,) over `count` tries at a point in metres, W/m^2, and the standard error of that mean."""
    light = DirectLight([place(lamp, SPACE)], Visibility(FAR_AWAY), 0)
    points = np.tile(SPACE.normalise(np.array(point, float)), (count, 1))
    normals = np.tile(np.array(normal, float), (count, 1))
    seen = light.at(points, normals, normals, rays, np.random.default_rng(1)).irradiance
    return seen.mean(axis=0), seen.std(axis=0) / np.sqrt(count)


def arrives(lamp, point, normal=UP) -> np.ndarray:
    return irradiance(lamp, point, normal)[0]


def times(factor) -> np.ndarray:
    return pytest.approx(factor * np.array(COLOR), rel=1e-9)


def test_a_receiver_may_touch_a_lamp():
    """At its very place there is no direction to it, but how much light there is stays a number."""
    lamp = place(PointLamp("lamp", (1.0, 2.0, 3.0), COLOR), SPACE)
    with np.errstate(all="raise"):
        ways = lamp.aim(lamp.position[:, None].astype(np.float32), np.zeros((2, 1, 1), dtype=np.float32))
    assert np.isfinite(ways.solid).all()


@pytest.mark.parametrize(("point", "distance"), [((0, 0, 0), 5.0), ((3, 0, 1), 5.0)])
def test_a_point_lamp_obeys_the_inverse_square_and_the_cosine(point, distance):
    lamp = PointLamp("lamp", (0, 0, 5), COLOR)
    cosine = (5 - point[2]) / distance
    assert arrives(lamp, point) == times(cosine / distance**2)
    assert arrives(lamp, point, normal=(0, 0, -1)).max() == 0


@pytest.mark.parametrize(("facing_disc", "share"), [(True, 1 / (9 + 0.25)), (False, 1 / 9)])
def test_a_round_lamp_is_a_disc_or_a_sphere(facing_disc, share):
    """Radiance I / (pi r^2). A coaxial disc has the form factor r^2 / (r^2 + d^2), a sphere (r / d)^2 cos."""
    lamp = PointLamp("lamp", (0, 0, 3), COLOR, radius=0.5, facing_disc=facing_disc)
    assert arrives(lamp, (0, 0, 0)) == times(share)
    tilted = (np.sin(0.5), 0, np.cos(0.5))
    assert arrives(lamp, (0, 0, 0), tilted) == times(share * np.cos(0.5))


def test_inside_a_spherical_lamp_it_is_all_one_sees():
    """E = pi L = I / r^2, whichever way one looks."""
    lamp = PointLamp("lamp", (0, 0, 0), COLOR, radius=2.0, facing_disc=False)
    for normal in (UP, (1, 0, 0)):
        assert arrives(lamp, (0, 0, 0.5), normal) == times(1 / 4)


def test_the_horizon_cuts_a_round_lamp_in_half():
    """A sphere or disc centred on the horizon, seen under the angle 2 s: the mean height of the half disc,
    (s - sin s cos s) / pi of all around, in units of pi L."""
    lamp = PointLamp("lamp", (3, 0, 0), COLOR, radius=1.5, facing_disc=False)
    s = np.arcsin(0.5)
    assert arrives(lamp, (0, 0, 0)) == times((s - np.sin(s) * np.cos(s)) / np.pi / 1.5**2)


def test_a_sun_shines_alike_everywhere():
    down = np.array([0.6, 0, -0.8])
    for angle in (0.0, 0.02, 0.8):
        lamp = SunLamp("sun", tuple(2 * down), COLOR, angle)
        for point in ((0, 0, 0), (3, -2, 5)):
            assert arrives(lamp, point) == times(0.8)
        assert arrives(lamp, (0, 0, 0), (0, 0, -1)).max() == 0


def test_a_setting_sun_is_cut_by_the_horizon():
    """Centred on the horizon, as for the sphere; its radiance is E / (pi sin^2)."""
    lamp = SunLamp("sun", (1, 0, 0), COLOR, angle=1.0)
    s = 0.5
    assert arrives(lamp, (0, 0, 0)) == times((s - np.sin(s) * np.cos(s)) / np.pi / np.sin(s) ** 2)


def panel(**changes) -> AreaLamp:
    """A square of two metres, one metre above the origin."""
    given = {"center": (0, 0, 1), "half_u": (1, 0, 0), "half_v": (0, 1, 0), "normal": (0, 0, -1), "radiance": COLOR}
    return AreaLamp("panel", **(given | changes))


def test_an_area_lamp_is_a_polygon():
    """Catalogue: element to parallel unit square at its corner, distance 1: 0.138531606; E = pi L F."""
    assert arrives(panel(), (0, 0, 0)) == pytest.approx(np.pi * 4 * 0.138531606 * np.array(COLOR), rel=1e-7)
    assert arrives(panel(), (1, 1, 0)) == pytest.approx(np.pi * F_CORNER_2 * np.array(COLOR), rel=1e-7)


#: Element under the corner of a parallel a x b rectangle at c: Howell B-4, with X = Y = 2.
F_CORNER_2 = 4 / np.sqrt(5) * np.arctan(2 / np.sqrt(5)) / (2 * np.pi)


def test_an_area_lamp_shines_along_its_normal_only():
    assert arrives(panel(), (0, 0, 2), (0, 0, -1)).max() == 0
    turned = panel(normal=(0, 0, 1), half_u=(0, 1, 0), half_v=(1, 0, 0))
    for lamp in (panel(normal=(0, 0, 1)), turned):
        seen = arrives(lamp, (0, 0, 2), (0, 0, -1))
        assert seen == pytest.approx(np.pi * 4 * 0.138531606 * np.array(COLOR), rel=1e-7)
        assert arrives(lamp, (0, 0, 0)).max() == 0


def test_a_disc_shaped_area_lamp():
    """Coaxial disc: r^2 / (r^2 + d^2); the polygon that stands for it is off by less than 1e-3, it says."""
    lamp = panel(shape="ellipse")
    assert arrives(lamp, (0, 0, 0)) == pytest.approx(np.pi * 0.5 * np.array(COLOR), rel=1e-3)
    wide = panel(shape="ellipse", half_u=(2, 0, 0))
    far = SPACE.center * 0 + [0, 0, -40]
    assert arrives(wide, far) == pytest.approx(2 * np.pi / 41**2 * np.array(COLOR), rel=5e-3)


@pytest.mark.parametrize("spread", [0.5, 1.5, 2.5])
def test_the_spread_of_an_area_lamp_keeps_its_power(spread):
    """A small lamp sends L (tan h - tan a) / (tan h - h) cos a its area to a distant point at the angle a."""
    lamp = panel(half_u=(1e-3, 0, 0), half_v=(0, 1e-3, 0), spread=spread)
    half = spread / 2
    for angle in (0.0, 0.5 * half, 0.9 * half, 1.1 * half):
        point = (2 * np.sin(angle), 0, 1 - 2 * np.cos(angle))
        gain = max(np.tan(half) - np.tan(angle), 0.0) / (np.tan(half) - half)
        expected = gain * np.cos(angle) ** 2 * 4e-6 / 4
        assert arrives(lamp, point) == pytest.approx(expected * np.array(COLOR), rel=5e-3, abs=1e-12)


@pytest.mark.parametrize("rays", [4, 256])
def test_the_spread_of_a_large_lamp_is_averaged_without_bias(rays):
    """A disc of radius r in all directions from below its centre at d: 2 pi L * integral of gain(a) cos a sin a da."""
    lamp = panel(shape="ellipse", spread=1.6)
    mean, error = irradiance(lamp, (0, 0, 0), rays=rays, count=8000 // rays)
    half = 0.8
    angle = (np.arange(20_000) + 0.5) / 20_000 * min(half, np.pi / 4)
    gain = (np.tan(half) - np.tan(angle)) / (np.tan(half) - half)
    truth = 2 * np.pi * np.mean(gain * np.cos(angle) * np.sin(angle)) * angle.max() * np.array(COLOR)
    # The polygon that stands for the disc is off by up to 1e-3 of its light, and more of its rim, where the gain ends.
    assert (np.abs(mean - truth) <= 4 * error + 5e-3 * truth).all()


def spot(**changes) -> SpotLamp:
    given = {"position": (0, 0, 5), "intensity": COLOR, "axes": ((1, 0, 0), (0, 1, 0), (0, 0, 1))}
    return SpotLamp("spot", **(given | {"cone_angle": 1.0, "blend": 0.5} | changes))


def at_angle(angle):
    """Two metres from the spot lamp, seen by it at an angle to its axis; and the normal that faces it."""
    way = np.array([np.sin(angle), 0, -np.cos(angle)])
    return np.array([0, 0, 5]) + 2 * way, -way


@pytest.mark.parametrize("blend", [0.0, 0.3, 1.0])
def test_a_spot_lamp_is_dimmed_smoothly_towards_its_cone(blend):
    """x = (cos a - cos(h/2)) / ((1 - cos(h/2)) blend), then x x (3 - 2 x)."""
    lamp = spot(blend=blend)
    edge = np.cos(0.5)
    for angle in (0.0, 0.2, 0.35, 0.45, 0.499, 0.501, 0.9):
        width = max((1 - edge) * blend, 1e-6)
        x = np.clip((np.cos(angle) - edge) / width, 0, 1)
        expected = x * x * (3 - 2 * x) / 4
        # The cosine is good to some units of single precision; the step has a slope of 1.5 / width.
        slack = 1.5 / width * 16 * 2.0**-24 if 0 < x < 1 else 1e-9
        assert arrives(lamp, *at_angle(angle)) == pytest.approx(expected * np.array(COLOR), rel=1e-6, abs=4 * slack)


def test_a_turned_and_stretched_spot_lamp_lights_an_ellipse():
    """Along its stretched local x the cone reaches twice as far; its -z points where its axes say."""
    lamp = spot(axes=((0, 0, 2), (0, 1, 0), (-1, 0, 0)), blend=0.0)
    lit = np.array([1.0, 0, np.tan(0.5) * 1.9])
    dark = np.array([1.0, np.tan(0.5) * 1.1, 0])
    for way, seen in ((lit, True), (dark, False), (np.array([-1.0, 0, 0]), False)):
        normal = -way / np.linalg.norm(way)
        assert (arrives(lamp, np.array([0, 0, 5]) + way, normal).max() > 0) == seen


def test_a_spot_lamp_with_a_size_is_that_disc_behind_its_cone():
    """On the axis, well inside a wide and hard cone, all of the disc shines."""
    lamp = spot(radius=0.3, blend=0.0, cone_angle=2.5)
    assert arrives(lamp, (0, 0, 2)) == times(1 / (9 + 0.09))
    assert arrives(lamp, (0, 0, 6), (0, 0, -1)).max() == 0
