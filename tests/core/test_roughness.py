"""How many triangles light calls for, against its closed form."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_baker.core.pilot import Pilot
from radiosity_baker.core.roughness import roughness
from radiosity_baker.core.scene import PointLamp, Scene, SunLamp

HALF, HEIGHT = 2.0, 0.5


def floor(build, *lamps, scale=1.0):
    side = 2 * HALF * scale
    ground = build.quad("floor", (-HALF * scale, -HALF * scale, 0), (side, 0, 0), (0, side, 0))
    return Pilot(Scene((ground,), (build.grey,), lamps))


def lamp(x=0.0, y=0.0, power=1.0, scale=1.0):
    return PointLamp("lamp", (x * scale, y * scale, HEIGHT * scale), (power,) * 3)


def expected() -> float:
    """E = h / (h^2 + r^2)^(3/2), whose second derivatives are -3 h (h^2 - 4 r^2) / (h^2 + r^2)^(7/2) along r and
    -3 h / (h^2 + r^2)^(5/2) across; over a fine grid and all directions."""
    x, y = np.meshgrid(*[(np.arange(400) + 0.5) / 400 * 2 * HALF - HALF] * 2)
    squared, h = x**2 + y**2, HEIGHT
    along = -3 * h * (h**2 - 4 * squared) / (h**2 + squared) ** 3.5
    across = -3 * h / (h**2 + squared) ** 2.5
    turns = np.pi * (np.arange(16) + 0.5) / 16
    bends = np.abs(along[..., None] * np.cos(turns) ** 2 + across[..., None] * np.sin(turns) ** 2)
    area = (2 * HALF) ** 2
    mean = (h / (h**2 + squared) ** 1.5).mean()
    # Over two triangles to a square whose side is the distance of the two points beside one: D2 L (side / 2)^2.
    return float((bends ** (2 / 3)).mean() ** 1.5 * area / 2.0 / mean)


def test_a_lamp_over_a_floor_calls_for_what_its_second_derivatives_say(build):
    """Of 1024 points, whose |D2 L|^(2/3) scatters by its own mean, within four deviations, to the power of 3/2; and a
    finite step over a lamp so near that its pool is four steps wide takes off a little."""
    assert roughness(floor(build, lamp()), 0.0) == pytest.approx(expected(), rel=4 * 1.5 / np.sqrt(1024) + 0.05)


def test_only_where_lamps_are_matters(build):
    one = roughness(floor(build, lamp()), 0.0)
    assert roughness(floor(build, lamp(power=7.0)), 0.0) == pytest.approx(one)
    assert roughness(floor(build, lamp(scale=30.0), scale=30.0), 0.0) == pytest.approx(one, rel=1e-6)
    assert roughness(floor(build), 0.0) == 0.0
    assert roughness(floor(build, SunLamp("sun", (0, 0, -1), (1.0,) * 3)), 0.0) == pytest.approx(0.0, abs=1e-9)


def test_pools_of_light_call_for_more_and_other_light_beside_them_for_less(build):
    one = roughness(floor(build, lamp()), 0.0)
    pools = floor(build, *(lamp(x, y) for x in (-1, 1) for y in (-1, 1)))
    assert roughness(pools, 0.0) > 1.5 * one
    assert roughness(pools, 1e3) < 0.1 * one
