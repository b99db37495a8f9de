"""Bright parts of a sky map as suns: nothing is lost, and a painted sun is the lamp that it depicts."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_baker.core.bake import bake
from radiosity_baker.core.direct.sky import _CONTRAST, split_bright
from radiosity_baker.core.scene import Scene, SkyMap, SunLamp, Surface
from radiosity_baker.core.settings import Settings

HEIGHT = 256
AXIS = np.array([0.48, -0.6, 0.64])


def directions() -> np.ndarray:
    """(h, 2 h, 3) the middles of the pixels."""
    polar = np.pi * (1 - (np.arange(HEIGHT) + 0.5) / HEIGHT)[:, None]
    azimuth = 2 * np.pi * (0.5 - (np.arange(2 * HEIGHT) + 0.5) / (2 * HEIGHT))[None]
    level = np.ones_like(azimuth)
    return np.stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar) * level], axis=-1)


SOLID_ANGLE = (
    np.repeat(np.diff(-np.cos(np.linspace(0, np.pi, HEIGHT + 1)))[:, None], 2 * HEIGHT, axis=1) * np.pi / HEIGHT
)


def painted(angle: float, background: float, radiance: float) -> SkyMap:
    """An even sky with a disc of a full angle in it."""
    disc = directions() @ AXIS > np.cos(angle / 2)
    red = np.where(disc, radiance, background)
    return SkyMap(np.stack([red, red, 2 * red], axis=-1).astype(np.float32))


def flux(pixels) -> np.ndarray:
    """Vector irradiance (3 channels, 3)."""
    return np.einsum("hwc,hwk,hw->ck", pixels.astype(float), directions(), SOLID_ANGLE)


@pytest.mark.parametrize("angle", [0.08, 0.12])
def test_a_painted_disc_becomes_the_sun_that_it_depicts(angle):
    """Irradiance pi L sin^2(a / 2) of what is over the background, which the disc covers as well; its edge is as ragged
    as pixels are, half of one here and there."""
    sky = painted(angle, 1.0, 1000.0)
    rest, (sun,) = split_bright(sky)
    pixel = np.pi / HEIGHT
    assert -np.array(sun.direction) == pytest.approx(AXIS, abs=pixel / 4)
    assert sun.angle == pytest.approx(angle, abs=pixel / 2)
    cut = rest.pixels[..., 0].max()
    area = SOLID_ANGLE[sky.pixels[..., 0] > 2].sum()
    even = np.pi * np.sin(np.arccos(1 - area / 2 / np.pi)) ** 2
    assert sun.irradiance[0] == pytest.approx((1000 - cut) * even, rel=1e-3)
    assert sun.irradiance[2] == pytest.approx(2 * sun.irradiance[0], rel=1e-6)


def test_energy_and_direction_are_kept():
    """A plane that sees all of a sky's bright parts gets from the split sky what it gets from the whole one."""
    generator = np.random.default_rng(3)
    pixels = generator.uniform(0.5, 1.5, (HEIGHT, 2 * HEIGHT, 3))
    for _ in range(4):
        axis = generator.normal(size=3)
        pixels[directions() @ axis / np.linalg.norm(axis) > 0.99] += generator.uniform(50, 500, 3)
    sky = SkyMap(pixels.astype(np.float32))
    rest, suns = split_bright(sky)
    assert len(suns) >= 4
    discs = sum(np.outer(sun.irradiance, -np.array(sun.direction)) for sun in suns)
    whole = flux(sky.pixels)
    assert flux(rest.pixels) + discs == pytest.approx(whole, abs=2e-3 * np.abs(whole).max())
    assert (rest.pixels <= sky.pixels).all()
    mean = (rest.pixels.mean(axis=2) * SOLID_ANGLE).sum() / SOLID_ANGLE.sum()
    assert rest.pixels.mean(axis=2).max() == pytest.approx(_CONTRAST * mean, rel=1e-3)


def test_an_even_enough_sky_stays_whole():
    sky = SkyMap((1 + directions()[..., 2:] * np.ones(3)).astype(np.float32))
    assert split_bright(sky) == (sky, ())


def test_a_sun_in_a_map_lights_and_shades_like_the_lamp(build):
    """A block on the ground, its shadow included: within the error that was asked for, and on average within what the
    disc's ragged edge makes."""
    angle, radiance = 0.15, 2000.0
    ground = build.quad("ground", (-1, -1, 0), (2, 0, 0), (0, 2, 0))
    block = build.box("block", (-0.3, -0.3, 0), (0.3, 0.3, 0.5))
    lamp = SunLamp("sun", tuple(-AXIS), tuple(np.pi * radiance * np.sin(angle / 2) ** 2 * np.array([1, 1, 2])), angle)
    settings = Settings(size=0.12, error=0.08, threads=2)
    surfaces = (Surface("white", (0.5, 0.5, 0.5)),)
    by_map = bake(Scene((ground, block), surfaces, sky=painted(angle, 1.0, 1.0 + radiance)), settings)
    by_lamp = bake(Scene((ground, block), surfaces, (lamp,), sky=(1.0, 1.0, 2.0)), settings)
    assert next(e for e in by_map.report.effects if e.name == "sky lights").active
    for one, two in zip(by_map.objects, by_lamp.objects, strict=True):
        if one.layers["combined"].shape == two.layers["combined"].shape:
            error = one.layers["combined"] - two.layers["combined"]
            assert np.sqrt(np.mean(error**2)) <= 0.08 * two.layers["combined"].mean()
        assert build.mean_light(one) == pytest.approx(build.mean_light(two), rel=0.02)
