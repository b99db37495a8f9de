"""Many lights asked together bring what each brings alone, in a few arrays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from radiosity_baker.core.direct.choice import chances
from radiosity_baker.core.direct.crowd import Crowd
from radiosity_baker.core.direct.illumination import MOST_ASKED, DirectLight
from radiosity_baker.core.direct.lamps import Panel, place
from radiosity_baker.core.patches import Space
from radiosity_baker.core.scene import AreaLamp, PointLamp, SpotLamp, SunLamp
from radiosity_baker.core.visibility import Visibility

SPACE = Space(np.zeros(3), 1.0)
NOTHING = np.full((1, 3, 3), 90.0) + np.eye(3)


def mixed(count: int = 60):
    """Lamps of every kind by turns, each at a place, of a size and a colour of its own; some cast no shadow."""
    rng = np.random.default_rng(5)
    lamps = []
    for k in range(count):
        where, color, size = (
            (*rng.uniform(-0.9, 0.9, 2), rng.uniform(0.3, 0.8)),
            tuple(rng.random(3)),
            0.1 * rng.random(),
        )
        axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        spot = SpotLamp("", where, color, tuple(map(tuple, axes)), rng.uniform(1.5, 3.0), 0.5, radius=size)
        point = PointLamp("", where, color, radius=size)
        area = AreaLamp("", where, (size, 0, 0), (0, size, 0), (0, 0, -1), color)
        kinds = (
            point,
            replace(point, facing_disc=True),
            replace(point, radius=0.0),
            spot,
            replace(spot, radius=0.0),
            area,
        )
        lamps.append(replace(kinds[k % len(kinds)], name=f"lamp {k}", casts_shadow=k % 7 > 0))
    lamps.append(SunLamp("noon", (0.1, 0, -1), (1.0, 1.0, 1.0), angle=0.1))
    corners = rng.uniform(-0.9, 0.9, (8, 3, 3)) * [1.0, 1.0, 0.1] + [0.0, 0.0, 0.5]
    glowing = [Panel("glow", own, rng.random(3), two_sided=k % 2 > 0) for k, own in enumerate(corners)]
    return [*(place(lamp, SPACE) for lamp in lamps), *glowing]


def points(count: int):
    where = np.random.default_rng(6).uniform(-0.9, 0.9, (count, 3)) * [1, 1, 0.1]
    return where, np.tile([[0.0, 0.0, 1.0]], (count, 1))


def test_the_lights_of_a_crowd_are_those_it_is_made_of():
    """As many as points, each for one of these: their shares and their ways, to the last bit but one."""
    lights = mixed()
    crowd = Crowd(lights)
    where, up = points(len(lights))
    shares = crowd.shares(where, up)
    np.testing.assert_allclose(shares, [light.share(where, up) for light in lights], rtol=1e-12)
    sure, drawn, _ = crowd.choose(where, up, len(lights), np.random.default_rng(1))
    assert len(drawn.point) == 0
    assert len(sure.point) == np.count_nonzero(shares)
    unit = np.random.default_rng(2).random((2, 4, len(lights)), dtype=np.float32)
    asked = 0
    for light, some in crowd.alike(sure):
        asked += len(some.light)
        here = where[some.point].T.astype(np.float32)
        ways = light.aim(here, unit[:, :, some.point])
        gain = light.gain(here, ways)
        for k in range(0, len(some.light), 7):
            alone, at = lights[some.light[k]], slice(k, k + 1)
            own = alone.aim(here[:, at], unit[:, :, some.point[at]])
            np.testing.assert_allclose(ways.towards[:, :, at], own.towards, rtol=1e-5, atol=1e-6)
            np.testing.assert_allclose(ways.solid[:, at], own.solid, rtol=1e-5)
            own_gain = alone.gain(here[:, at], own)
            assert (gain is None) == (own_gain is None)
            if gain is not None:
                np.testing.assert_allclose(gain[:, at], own_gain, rtol=1e-4, atol=1e-5)
    assert asked == len(sure.light)


def test_what_is_not_asked_for_sure_is_all_that_the_others_bring():
    lights = mixed()
    where, up = points(50)
    _, drawn, rest = Crowd(lights).choose(where, up, 10, np.random.default_rng(1))
    shares = np.stack([light.share(where, up) for light in lights])
    color = np.stack([light.color for light in lights])
    sure = chances(shares * color.mean(axis=1)[:, None], 10) == 1
    assert rest == pytest.approx(np.where(sure, 0, shares).T @ color)
    per_half = np.bincount(2 * drawn.point + drawn.half, minlength=100).reshape(50, 2)
    assert (per_half == (10 - sure.sum(axis=0))[:, None]).all()


def test_lamps_of_every_kind_are_right_on_average_together(build):
    """Behind a sail, beside the same lamps one by one; four standard deviations."""
    lights, tries = mixed(), 2000
    sail = build.quad("sail", (0.15, -1, 0.2), (1, 0, 0), (0, 2, 0))
    occluder = Visibility(sail.vertices[sail.triangles])
    where, up = np.tile([[0.1, 0.2, 0.0]], (tries, 1)), np.tile([[0, 0, 1.0]], (tries, 1))

    def seen(some, rays):
        return DirectLight(some, occluder, 0).at(where, up, up, rays, np.random.default_rng(4)).irradiance

    alone = [seen([light], 8) for light in lights]
    together = seen(lights, 2)
    error = np.sqrt(sum(one.var(axis=0) for one in [*alone, together]) / tries)
    difference = together.mean(axis=0) - sum(one.mean(axis=0) for one in alone)
    # A light without noise is the same but for the rounding of single precision.
    assert (np.abs(difference) <= 4 * error + 1e-6 * together.mean()).all()


def test_ten_times_as_many_lamps_take_as_many_rays_and_looks(monkeypatch):
    """One look at all that are drawn, and one at all that are sure, however many lamps there are."""
    looks = []
    look = DirectLight._look
    monkeypatch.setattr(
        DirectLight, "_look", lambda self, light, *given: looks.append(light) or look(self, light, *given)
    )
    where, up = points(100)
    rays = []
    for count in (2 * MOST_ASKED, 20 * MOST_ASKED):
        rng = np.random.default_rng(7)
        lamps = [PointLamp(f"{k}", (*rng.uniform(-0.9, 0.9, 2), 0.8), (1.0, 1.0, 1.0)) for k in range(count)]
        light = DirectLight([place(lamp, SPACE) for lamp in lamps], Visibility(NOTHING), 0)
        rays.append(light.at(where, up, up, 8, np.random.default_rng(8)).rays["shadow"])
    assert len(looks) <= 2 * 2
    assert rays[1] <= 2 * MOST_ASKED * 100 <= 2 * rays[0]
