"""How uneven light is, against its closed form."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_baker.core.pilot import Pilot
from radiosity_baker.core.scene import PointLamp, Scene, SpotLamp, SunLamp
from radiosity_baker.core.unevenness import unevenness

HALF, HEIGHT = 2.0, 0.5


def floor(build, *lamps, scale=1.0):
    side = 2 * HALF * scale
    ground = build.quad("floor", (-HALF * scale, -HALF * scale, 0), (side, 0, 0), (0, side, 0))
    return Pilot(Scene((ground,), (build.grey,), lamps)), lamps


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
    assert unevenness(*floor(build, lamp()), 0.0) == pytest.approx(expected(), rel=4 * 1.5 / np.sqrt(1024) + 0.05)


def test_only_where_lamps_are_matters(build):
    one = unevenness(*floor(build, lamp()), 0.0)
    assert unevenness(*floor(build, lamp(power=7.0)), 0.0) == pytest.approx(one)
    assert unevenness(*floor(build, lamp(scale=30.0), scale=30.0), 0.0) == pytest.approx(one, rel=1e-6)
    assert unevenness(*floor(build), 0.0) == 0.0
    assert unevenness(*floor(build, SunLamp("sun", (0, 0, -1), (1.0,) * 3)), 0.0) == pytest.approx(0.0, abs=1e-9)


def test_pools_of_light_are_more_uneven(build):
    one = unevenness(*floor(build, lamp()), 0.0)
    assert unevenness(*floor(build, *(lamp(x, y) for x in (-1, 1) for y in (-1, 1))), 0.0) > 1.2 * one


def test_other_light_beside_them_makes_less_of_them(build):
    """The unevenness is relative to both: r = b / (m + o), so 1/r is linear in what is added."""
    pool = floor(build, lamp())
    alone, more, most = (1.0 / unevenness(*pool, other) for other in (0.0, 1.0, 5.0))
    assert more > 1.5 * alone
    assert most - alone == pytest.approx(5.0 * (more - alone))


def test_a_sharp_cone_is_more_uneven_than_a_soft_one(build):
    def spot(blend):
        axes = ((1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0))
        return SpotLamp("spot", (0, 0, HEIGHT), (1.0,) * 3, axes=axes, cone_angle=2.0, blend=blend)

    soft, sharp = (unevenness(*floor(build, spot(blend)), 0.0) for blend in (1.0, 0.05))
    assert sharp > 1.05 * soft


def test_a_thousand_lamps_are_soon_looked_at(build, monkeypatch):
    asked = []
    pool = floor(build, *(lamp(x, 0.0) for x in np.linspace(-1, 1, 1000)))
    on_receivers = Pilot.on_receivers
    monkeypatch.setattr(Pilot, "on_receivers", lambda self, n, rng: asked.append(n) or on_receivers(self, n, rng))
    assert unevenness(*pool, 0.0) > 0.0
    assert asked[0] * 1000 < 100_000
