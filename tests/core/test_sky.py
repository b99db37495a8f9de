"""Skies that vary with direction: texels, and the light that a bake takes from them, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_baker.core.bake import bake
from radiosity_baker.core.scene import Scene, SceneObject, SkyMap, Surface
from radiosity_baker.core.settings import Settings
from radiosity_baker.core.sky import DARK, Sky, equal_texels

WHITE = Surface("white", (0.5, 0.5, 0.5))
SLOPE = np.array([0.3, -0.4, 0.6])


def pixel_directions(height: int) -> np.ndarray:
    """(h, 2 h, 3) the middles of a map's pixels, from the definition: u = 1/2 - atan2(y, x) / (2 pi)."""
    polar = np.pi * (1 - (np.arange(height) + 0.5) / height)[:, None]
    azimuth = 2 * np.pi * (0.5 - (np.arange(2 * height) + 0.5) / (2 * height))[None]
    level = np.ones_like(azimuth)
    return np.stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar) * level], axis=-1)


def gradient(height: int = 128) -> SkyMap:
    """Radiance 1 + SLOPE . direction in red, twice that in green, and none in blue."""
    red = 1 + pixel_directions(height) @ SLOPE
    return SkyMap(np.stack([red, 2 * red, 0 * red], axis=-1).astype(np.float32))


def tilted(build, normal) -> SceneObject:
    """A square that faces along a unit normal."""
    aside = np.cross(normal, (0.1, 0.2, 0.97))
    u = aside / np.linalg.norm(aside)
    return build.quad(u=tuple(u), v=tuple(np.cross(normal, u)))


def test_a_texel_holds_what_the_map_shows_in_its_direction():
    directions = np.random.default_rng(0).normal(size=(5000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    sky = Sky.of(gradient())
    seen = sky.light[sky.texel(directions.astype(np.float32))] @ sky.irradiance / np.pi
    # A texel at the pole reaches 14 degrees down, any other is at most 5 degrees high, and the slope is 0.78 a radian.
    off_pole = np.abs(directions[:, 2]) < 0.9
    red = 1 + directions @ SLOPE
    assert np.abs(seen[:, 0] - red).max() <= 0.79 * np.radians(15)
    assert np.abs(seen[off_pole, 0] - red[off_pole]).max() <= 0.79 * np.radians(5)
    assert seen[:, 1] == pytest.approx(2 * seen[:, 0], rel=1e-5)
    assert seen[:, 2].max() == 0


@pytest.mark.parametrize("shape", [(7, 20), (64, 128), (300, 512)])
def test_texels_keep_the_energy_of_a_map(shape):
    pixels = np.random.default_rng(1).uniform(0, 5, (*shape, 3)).astype(np.float32)
    height = np.diff(-np.cos(np.linspace(0, np.pi, shape[0] + 1)))
    mean = np.einsum("hwk,h->k", pixels, height) / shape[1] / 2
    assert equal_texels(SkyMap(pixels), 16, 32).mean(axis=(0, 1)) == pytest.approx(mean, rel=1e-6)


def test_an_even_sky_needs_one_texel_and_a_black_one_no_column():
    assert Sky.of((1.0, 2.0, 3.0)).light.shape == (1, 1)
    assert DARK.light.shape == (1, 0)


@pytest.mark.parametrize("estimator", ["hemisphere", "analytic"])
@pytest.mark.parametrize("normal", [(0, 0, 1), (0.6, 0, 0.8), (0, -1, 0), (0.36, 0.48, -0.8)])
def test_a_gradient_lights_a_tilted_plane(build, normal, estimator):
    """The integral of (1 + s . w) cos over the hemisphere about n is pi + (2 pi / 3) s . n.

    Of at least 2 passes of 32 rays in 50 cells, whose radiance varies by less than 0.8: 0.8 / sqrt(3200) = 1.4 %, and
    less as they are stratified.
    """
    scene = Scene((tilted(build, normal),), (WHITE,), sky=gradient())
    result = bake(scene, Settings(size=0.2, error=0.08, threads=2, layers=("sky",), estimator=estimator))
    sky = result.objects[0].layers["sky"].reshape(-1, 3)
    expected = 0.5 / np.pi * (np.pi + 2 * np.pi / 3 * SLOPE @ np.array(normal))
    assert sky[:, :2].mean(axis=0) == pytest.approx([expected, 2 * expected], rel=0.014)
    assert sky[:, 2].max() == 0


@pytest.mark.parametrize("estimator", ["hemisphere", "analytic"])
def test_sides_take_light_from_where_they_look(build, transport, estimator):
    """The same closed form for the patches; 256 rays of each of 50, of which the analytic estimator takes 64."""
    for normal in ((0.6, 0.0, 0.8), (0.0, -1.0, 0.0)):
        solved = transport(
            Scene((tilted(build, normal),), (WHITE,), sky=gradient()),
            patches=50,
            transport_rays=256,
            estimator=estimator,
        )
        front = ~solved.sides.back
        expected = np.pi + 2 * np.pi / 3 * SLOPE @ np.array(normal)
        assert solved.incoming[front, 0].mean() == pytest.approx(expected, rel=0.014)
        assert solved.incoming[front, 1] == pytest.approx(2 * solved.incoming[front, 0], rel=1e-5)
        assert solved.escape[front] == pytest.approx(1.0)


def test_a_map_of_one_colour_is_an_even_sky(build):
    """To the byte but for rounding: the rays are the same. With a larger error fits would be left further from the
    best, where rounding may decide on which side."""
    ground = build.quad("ground", (-1, -1, 0), (2, 0, 0), (0, 2, 0))
    block = build.box("block", (-0.3, -0.3, 0), (0.3, 0.3, 0.5))
    settings = Settings(triangles=300, error=0.02, threads=2, layers=("combined", "sky"))
    even = bake(Scene((ground, block), (WHITE,), sky=(1.0, 2.0, 3.0)), settings)
    pixels = np.broadcast_to(np.float32([1, 2, 3]), (8, 16, 3))
    mapped = bake(Scene((ground, block), (WHITE,), sky=SkyMap(pixels)), settings)
    for one, two in zip(even.objects, mapped.objects, strict=True):
        for layer in ("combined", "sky"):
            assert two.layers[layer] == pytest.approx(one.layers[layer], rel=1e-4, abs=1e-5)
