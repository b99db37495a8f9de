"""Portals: the same light as without, from a sky of any kind, and far less noise in a room with a small window."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from radiosity_baker.core.bake import bake
from radiosity_baker.core.patches import Space
from radiosity_baker.core.scene import Portal, Scene, SkyMap, Surface
from radiosity_baker.core.settings import Settings
from radiosity_baker.core.sky import Rectangle

BLACK, WHITE = Surface("black", (0.0, 0.0, 0.0)), Surface("white", (0.5, 0.5, 0.5))
WINDOW = Portal("window", (2.0, 0.0, 1.0), (0.0, 0.4, 0.0), (0.0, 0.0, 0.3), (-1.0, 0.0, 0.0))


def sunset() -> SkyMap:
    """Red in the west, green in the east, blue above."""
    polar, azimuth = np.pi * (1 - (np.arange(32) + 0.5) / 32)[:, None], np.pi * (1 - (np.arange(64) + 0.5) / 32)[None]
    x, z = np.sin(polar) * np.cos(azimuth), np.cos(polar) + 0 * azimuth
    return SkyMap(np.stack([1 - x, 1 + x, 1 + z], axis=-1).astype(np.float32))


def room(build, sky) -> Scene:
    """Four metres wide, black, with a window in its east wall; only the white floor is baked."""
    y, z = (-2.0, -0.4, 0.4, 2.0), (0.0, 0.7, 1.3, 2.5)
    pieces = [
        build.quad(
            f"wall {i} {j}", (2, y[i], z[j]), (0, 0, z[j + 1] - z[j]), (0, y[i + 1] - y[i], 0), 1, receives=False
        )
        for i in range(3)
        for j in range(3)
        if (i, j) != (1, 1)
    ]
    others = [
        build.quad("west", (-2, -2, 0), (0, 4, 0), (0, 0, 2.5), 1, receives=False),
        build.quad("south", (-2, -2, 0), (0, 0, 2.5), (4, 0, 0), 1, receives=False),
        build.quad("north", (-2, 2, 0), (4, 0, 0), (0, 0, 2.5), 1, receives=False),
        build.quad("ceiling", (-2, -2, 2.5), (0, 4, 0), (4, 0, 0), 1, receives=False),
    ]
    floor = build.quad("floor", (-2, -2, 0), (4, 0, 0), (0, 4, 0))
    return Scene((floor, *pieces, *others), (WHITE, BLACK), sky=sky, portals=(WINDOW,))


def floor(scene, settings, layer="combined"):
    """What was baked, and the mean (3,) of a layer over the floor."""
    result = bake(scene, settings)
    baked = result.objects[0]
    area = np.linalg.norm(
        np.cross(*(baked.vertices[baked.triangles[:, k]] - baked.vertices[baked.triangles[:, 0]] for k in (1, 2))),
        axis=1,
    )
    return result, area @ baked.layers[layer].mean(axis=1) / area.sum()


@pytest.mark.parametrize("sky", [(1.0, 2.0, 3.0), sunset()], ids=["even", "map"])
def test_a_portal_changes_the_noise_and_not_the_light(build, sky):
    """The floor's mean within four standard deviations of what rays alone find: a share of p of the sky, counted with
    n rays, is good to sqrt(p / n). The light of even a single bake with a portal is nearer to another one's."""
    scene = room(build, sky)
    settings = Settings(size=0.15, error=0.08, threads=2)

    (with_portal, one), (_, other) = floor(scene, settings), floor(scene, replace(settings, seed=1))
    without, plain = floor(scene, replace(settings, effects={"portals": False}))
    share = one.max() / 0.5 / 4.0
    deviation = one * np.sqrt(1 / (share * without.report.rays["gather"]))
    assert (np.abs(one - plain) <= 4 * deviation + 2e-3 * one).all()
    assert one == pytest.approx(other, rel=5e-3)
    assert next(e for e in with_portal.report.effects if e.name == "portals").active
    assert with_portal.report.estimated_error["sampling"] < without.report.estimated_error["sampling"] / 2


def test_a_ray_crosses_a_portal_outward_only():
    rectangle = Rectangle.of(WINDOW, Space(np.zeros(3), 1.0))
    origins = np.array([(0, 0, 1), (0, 0, 1), (3, 0, 1), (0, 0, 1), (0, 0, 1)], dtype=np.float32)
    ways = np.array([(1, 0, 0), (-1, 0, 0), (-1, 0, 0), (1, 0.19, 0), (1, 0.21, 0)], dtype=np.float32)
    assert rectangle.crossed(origins.T, ways.T).tolist() == [True, False, False, True, False]


@pytest.mark.parametrize("sky", [(1.0, 2.0, 3.0), sunset()], ids=["even", "map"])
def test_the_sky_behind_two_portals_counts_once(build, sky):
    """A second portal stands before the window, half as large again, so that half of its light crosses both: the mean
    is that of the window's portal alone, within the 0.5 % by which two such bakes differ."""
    scene = room(build, sky)
    larger = Portal("before it", (1.5, 0.0, 1.0), (0.0, 0.5, 0.0), (0.0, 0.0, 0.3), (-1.0, 0.0, 0.0))
    settings = Settings(size=0.25, error=0.05, threads=2)
    (_, once), (_, both) = floor(scene, settings), floor(replace(scene, portals=(larger, WINDOW)), settings)
    assert both == pytest.approx(once, rel=1e-2)


def test_rectangles_that_no_ray_crosses_both_ways_are_known():
    def rectangle(center, half_u, half_v, normal):
        return Rectangle.of(Portal("", center, half_u, half_v, normal), Space(np.zeros(3), 1.0))

    up = (0.0, 0.0, 0.3)
    window = Rectangle.of(WINDOW, Space(np.zeros(3), 1.0))
    beside = rectangle((2.0, 1.0, 1.0), (0.0, 0.4, 0.0), up, (-1.0, 0.0, 0.0))
    north = rectangle((0.0, 2.0, 1.0), (0.4, 0.0, 0.0), up, (0.0, -1.0, 0.0))
    door = rectangle((0.0, 0.0, 1.0), (0.0, 0.4, 0.0), up, (-1.0, 0.0, 0.0))
    assert not window.may_be_crossed_with(beside)
    assert not window.may_be_crossed_with(north)
    assert window.may_be_crossed_with(door)
    assert door.may_be_crossed_with(window)


def spotted() -> SkyMap:
    """Dim, with a bright spot towards the window's side."""
    pixels = np.full((32, 64, 3), 0.2, dtype=np.float32)
    pixels[18, 32] = 500.0
    return SkyMap(pixels)


def test_the_layer_sky_holds_what_came_through_portals_and_from_bright_spots(build):
    """In a black room the floor shows nothing else: up to rounding, since the parts are fitted apart and added."""
    settings = Settings(size=0.3, error=0.1, threads=2, layers=("combined", "sky", "direct"))
    result, _ = floor(room(build, spotted()), settings)
    active = {effect.name for effect in result.report.effects if effect.active}
    assert {"portals", "sky lights"} <= active
    layers = result.objects[0].layers
    assert layers["sky"].max() > 0
    assert layers["sky"] == pytest.approx(layers["combined"], rel=1e-5, abs=1e-6)
    assert layers["direct"] == pytest.approx(layers["combined"], rel=1e-5, abs=1e-6)
