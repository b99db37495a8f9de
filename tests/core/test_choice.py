"""A few of many lights: which, how often, and that the light of all comes of it."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_baker.core.direct.choice import chances, draw
from radiosity_baker.core.direct.illumination import MOST_ASKED, DirectLight
from radiosity_baker.core.direct.lamps import place
from radiosity_baker.core.patches import Space
from radiosity_baker.core.scene import AreaLamp, PointLamp
from radiosity_baker.core.visibility import Visibility

SPACE = Space(np.zeros(3), 1.0)
TRIES = 4000


def test_chances_follow_the_light_and_add_up_to_the_count():
    light = np.random.default_rng(1).random((50, 7)) ** 4
    chance = chances(light, 8)
    assert chance.sum(axis=0) == pytest.approx(8)
    assert chance.max() <= 1
    for point in range(7):
        some = chance[:, point] < 1
        ratio = chance[some, point] / light[some, point]
        assert ratio == pytest.approx(ratio[0])
        assert light[~some, point].min(initial=np.inf) > light[some, point].max()


def test_what_is_dark_is_never_asked_and_few_lights_are_asked_for_sure():
    light = np.zeros((50, 2))
    light[:5, 0] = [1, 2, 3, 4, 1e-6]
    chance = chances(light, 8)
    assert (chance[:5, 0] == 1).all()
    assert chance.sum() == 5


def test_lights_are_drawn_as_often_as_their_chances_say():
    rng = np.random.default_rng(2)
    chance = chances(rng.random((20, 1)) ** 2, 6)
    drawn = draw(np.repeat(chance, TRIES, axis=1), rng.random((1, TRIES)))[0]
    assert (drawn.sum(axis=0) == 6).all()
    error = np.sqrt(chance[:, 0] * (1 - chance[:, 0]) / TRIES)
    assert (np.abs(drawn.mean(axis=1) - chance[:, 0]) <= 4 * error).all()


def hall(sized):
    """A hundred lamps of all colours under a ceiling."""
    rng = np.random.default_rng(3)
    lamps = []
    for k in range(100):
        position, color = (*rng.uniform(-0.9, 0.9, 2), 0.8), tuple(rng.random(3))
        if sized:
            lamps.append(AreaLamp(f"panel {k}", position, (0.05, 0, 0), (0, 0.05, 0), (0, 0, -1), color))
        else:
            lamps.append(PointLamp(f"bulb {k}", position, color))
    return [place(lamp, SPACE) for lamp in lamps]


def seen(lights, corners, tries, rays=4, asked=MOST_ASKED):
    where = np.tile([[0.1, 0.2, 0.0]], (tries, 1))
    up = np.tile([[0, 0, 1.0]], (tries, 1))
    return DirectLight(lights, Visibility(corners), 0, asked).at(where, up, up, rays, np.random.default_rng(4))


@pytest.mark.parametrize("asked", [MOST_ASKED, MOST_ASKED // 3])
@pytest.mark.parametrize("sized", [True, False])
def test_a_hall_of_lamps_is_exact_where_nothing_is_in_the_way_and_costs_a_few_rays(sized, asked):
    lights = hall(sized)
    nothing = np.full((1, 3, 3), 90.0) + np.eye(3)
    light = seen(lights, nothing, 50, asked=asked)
    point, up = np.array([[0.1, 0.2, 0.0]]), np.array([[0, 0, 1.0]])
    every = sum(one.share(point, up)[0] * one.color for one in lights)
    assert light.irradiance == pytest.approx(np.tile(every, (50, 1)), rel=1e-6)
    assert light.variance.max() <= 1e-12 * every.max() ** 2
    assert light.rays["shadow"] <= 50 * 2 * asked * (2 if sized else 1)


@pytest.mark.parametrize("sized", [True, False])
def test_a_hall_behind_a_sail_is_right_on_average_and_says_how_sure_it_is(build, sized):
    lights = hall(sized)
    sail = build.quad("sail", (0.15, -1, 0.4), (1, 0, 0), (0, 2, 0))
    corners = sail.vertices[sail.triangles]
    one_by_one = [seen([light], corners, 1 if not sized else 400, rays=16).irradiance.mean(axis=0) for light in lights]
    light = seen(lights, corners, TRIES)
    mean, spread = light.irradiance.mean(axis=0), light.irradiance.std(axis=0)
    assert (np.abs(mean - np.sum(one_by_one, axis=0)) <= 4 * spread / np.sqrt(TRIES) + 1e-3 * mean).all()
    # At worst as noisy as so many tosses of a coin for all the light there is.
    point, up = np.array([[0.1, 0.2, 0.0]]), np.array([[0, 0, 1.0]])
    every = sum(one.share(point, up)[0] * one.color.mean() for one in lights)
    assert light.irradiance.mean(axis=1).std() < 0.5 / np.sqrt(2 * MOST_ASKED) * every
    stated = light.variance.mean(axis=0)
    wobble = 4 * light.variance.std(axis=0) / np.sqrt(TRIES)
    # The halves lend each other how much is free, which makes them a little alike: up to a tenth of the variance.
    assert (np.abs(stated - spread**2) <= wobble + 0.1 * spread**2).all()
