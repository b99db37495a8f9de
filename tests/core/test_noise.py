"""More samples where noise would show: in the dark, and where the light bends too much to be smoothed."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from radiosity_baker.core.accuracy import ALPHAS, cross_validate, fit_halves, squared_mean
from radiosity_baker.core.bake import bake
from radiosity_baker.core.noise import samples_wanted
from radiosity_baker.core.patches import unit_space
from radiosity_baker.core.plan import HIDING
from radiosity_baker.core.receivers import make_receivers
from radiosity_baker.core.reconstruction import Fit, Samples
from radiosity_baker.core.refinement import more_samples
from radiosity_baker.core.scene import Scene
from radiosity_baker.core.settings import Settings
from radiosity_baker.core.survey import Survey


@pytest.fixture(scope="module")
def floor(build):
    scene = Scene((build.quad(),), (build.grey,))
    return make_receivers(scene, unit_space(scene), Settings(), 3000)


@pytest.fixture(scope="module")
def fit(floor):
    return Fit(floor, np.ones((len(floor.cells), 3)), np.zeros(len(floor.cells), bool))


def across(floor):
    """(c,) where the cells lie, from -1 to 1."""
    return floor.cells.corners.mean(axis=1)[:, 0]


@pytest.fixture(scope="module")
def floors(build):
    """The fit of two floors, the second with a hundredth of the first one's area; and which cells (c,) are of it."""
    small = build.quad("small", (2, 0, 0), (0.1, 0, 0), (0, 0.1, 0))
    scene = Scene((build.quad(), small), (build.grey,))
    made = make_receivers(scene, unit_space(scene), Settings(), 6000)
    second = np.arange(len(made.cells)) >= len(made.fine[0].triangles)
    return Fit(made, np.ones((len(made.cells), 3)), np.zeros(len(made.cells), bool)), made.cells.area, second


def test_as_many_more_samples_are_wanted_as_there_are_to_be_had_and_no_cell_has_fewer_or_more_than_16_times(floors):
    fit, area, small = floors
    rng = np.random.default_rng(1)
    light, noise = np.where(small, 1e-2, 1.0), rng.uniform(0.5, 2.0, len(area))
    for more in (0.5, 1.0, 2.0):
        wanted = samples_wanted(fit, 2, more, area, noise, light)
        assert (wanted % 2 == 0).all()
        assert wanted.mean() == pytest.approx(2.0 * (1.0 + more), rel=0.02)
        assert wanted.min() >= 2
        assert wanted.max() <= 32


def test_samples_go_as_the_root_of_what_shows_and_of_the_area(floors):
    """The small floor has a sixteenth of the light, with as much noise: a sample there counts as four. Where it is said
    to be a quarter as large, it wants half as many."""
    fit, area, small = floors
    noise, light = np.full(len(area), 0.01), np.where(small, 1.0 / 16.0, 1.0)
    area = np.where(small, area / 4.0, area)
    wanted = samples_wanted(fit, 100, 0.4, area, noise, light) / np.sqrt(area)
    bright = np.median(wanted[~small])
    assert np.median(wanted[small]) == pytest.approx(4.0 * bright, rel=0.02)
    assert np.ptp(wanted[~small]) < 0.02 * bright


def test_what_is_all_but_black_is_no_darker_to_the_eye_than_a_thousandth_of_the_light(floors):
    fit, area, small = floors
    noise = np.where(small, 1e-4, 1e-2)  # a tenth of the deviation, so that none reaches sixteen times
    mean = area[~small].sum() / area.sum()
    black, dark = (
        samples_wanted(fit, 20, 0.5, area, noise, np.where(small, light, 1.0)) for light in (1e-9, 1e-3 * mean)
    )
    assert np.abs(black - dark).max() <= 2  # rounded to an even number


def test_where_there_is_no_noise_or_no_light_nothing_more_is_wanted(floor, fit):
    area, none = floor.cells.area, np.zeros(len(floor.cells))
    assert (samples_wanted(fit, 2, 1.0, area, none, np.ones(len(area))) == 2).all()
    assert (samples_wanted(fit, 2, 1.0, area, none + 0.01, none) == 2).all()
    assert (samples_wanted(fit, 2, 1.0, none, none + 0.01, none + 1.0) == 2).all()  # nothing is in sight


def noisy(floor, light, more, rng):
    """Samples of a light with noise of 0.2 in every cell, and so many more in some (c,)."""
    count = len(floor.cells)
    samples = Samples(count, np.ones(1))

    def add(cells):
        weights = rng.dirichlet(np.ones(3), len(cells))
        points = np.einsum("nc,nck->nk", weights, floor.cells.corners[cells])
        values = light(points) + 0.2 * rng.standard_normal(len(cells))
        samples.add(cells, weights, values[:, None], np.full(len(cells), 0.04), np.ones(len(cells), bool))

    add(np.arange(count))
    for _ in range(more):
        add(np.flatnonzero(across(floor) > 0.0))
    return samples


def test_after_more_samples_the_fit_is_as_much_better_and_says_so(floor):
    """Seven more samples for each on half of a flat floor: a light that bends everywhere is fitted with less smoothing
    there, is nearer to the truth, and the stated error of sampling is the true one."""

    def light(points):
        return 1.0 + 0.5 * np.sin(6.0 * np.pi * points[:, 1])

    def halves(more, seed):
        return [noisy(floor, light, more, np.random.default_rng(2 * seed + k)) for k in range(2)]

    area, one = floor.cells.area, np.ones(len(floor.cells))
    right, place = across(floor) > 0.1, np.zeros(floor.vertices)
    place[floor.corner_vertex] = floor.element_corners[..., 0]
    few, many = halves(0, 1), halves(7, 1)
    fit = Fit(floor, few[0].lumped, np.zeros(len(area), bool))
    judged = cross_validate(fit, few, area, one)
    before, after = fit_halves(fit, few, judged), fit_halves(fit, many, judged)
    truth = np.zeros(floor.vertices)
    truth[floor.corner_vertex] = light(floor.element_corners.reshape(-1, 3)).reshape(-1, 3)

    def error(fitted):
        return np.sqrt(np.mean((fitted.grey - truth)[place > 0.1] ** 2))

    assert np.allclose(after.alpha[place < -0.1], before.alpha[place < -0.1])
    least = np.minimum(before.alpha, ALPHAS[0])
    assert np.allclose(after.alpha[place > 0.1], np.maximum(before.alpha / 8.0, least)[place > 0.1])
    assert error(after) < 0.75 * error(before)
    again = fit_halves(fit, halves(7, 2), judged)
    apart = squared_mean(fit.at_corners(after.grey - again.grey)) / 2.0
    stated, true = (np.sqrt(area[right] @ squares[right] / area[right].sum()) for squares in (after.sampling, apart))
    assert stated == pytest.approx(true, rel=0.15)  # some 400 degrees of freedom each: 3.5 % deviation


def test_a_bake_looks_longer_where_its_noise_would_show(build, monkeypatch):
    """Where triangles are large; but not if little is asked, or if a mesh is kept."""
    longer = []
    monkeypatch.setattr(Survey, "top_up", lambda survey, wanted: longer.append((survey, wanted)))
    for error, tessellate in ((0.1, True), (0.05, True), (0.05, False)):
        bake(build.furnished_room(), Settings(triangles=3000, error=error, tessellate=tessellate))
    assert len({id(survey) for survey, _ in longer}) == 1
    survey, wanted = longer[0]
    area = survey.receivers.cells.area
    assert wanted.min() == survey.passes
    assert np.average(wanted, weights=area) > 1.2 * wanted.mean()


def test_once_the_time_is_up_nobody_looks_longer(build, monkeypatch):
    longer = []
    monkeypatch.setattr(Survey, "top_up", lambda survey, _: longer.append(survey.passes))
    for seconds, looked in ((60.0, True), (0.01, False)):
        longer.clear()
        bake(build.furnished_room(), Settings(triangles=3000, error=0.05, seconds=seconds))
        assert bool(longer) == looked


@pytest.mark.parametrize(("time", "more"), [(np.inf, 1.0), (0.25, 0.25), (-1.0, 0.0)])
def test_no_more_samples_are_taken_than_there_is_time_for(time, more):
    survey = SimpleNamespace(surroundings=object(), receivers=SimpleNamespace(tessellated=True), error=0.02)
    assert more_samples(survey, time) == more * HIDING
