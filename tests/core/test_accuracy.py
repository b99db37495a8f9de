"""The estimates of the error, on light whose error is known."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_baker.core.accuracy import (
    ALPHAS,
    COARSENING,
    PARABOLA_BEND,
    STEP_BEND,
    Fitted,
    _Halves,
    _unresolved,
    _unresolved_by_kind,
    cross_validate,
    estimate_error,
    fit_halves,
    level_error,
    squared_mean,
)
from radiosity_baker.core.parallel import Workers
from radiosity_baker.core.patches import unit_space
from radiosity_baker.core.progress import Progress
from radiosity_baker.core.receivers import make_receivers
from radiosity_baker.core.reconstruction import Fit, Samples
from radiosity_baker.core.sampling import plane_points, triangle_points
from radiosity_baker.core.scene import Scene
from radiosity_baker.core.settings import Settings

DIRECTIONS = 8


@pytest.fixture(scope="module")
def floor(build):
    scene = Scene((build.quad(),), (build.grey,))
    return make_receivers(scene, unit_space(scene), Settings(), 800)


@pytest.fixture(scope="module")
def finer_floor(build):
    scene = Scene((build.quad(),), (build.grey,))
    return make_receivers(scene, unit_space(scene), Settings(), 3000)


def waves_on_one_half(points, height):
    return 1.0 + height * np.sin(12.0 * np.pi * np.minimum(points[:, 0], 0.0))


def sample(receivers, light, passes, rng, noise=0.0) -> Samples:
    """One channel, with normal noise of a known deviation."""
    cells, count = receivers.cells, len(receivers.cells)
    samples, shift = Samples(count, np.ones(1)), rng.random((count, 2))
    for number in range(passes):
        weights = triangle_points(plane_points(np.full(count, number), shift))
        points = np.einsum("nc,nck->nk", weights, cells.corners)
        values = light(points) + noise * rng.standard_normal(count)
        samples.add(slice(None), weights, values[:, None], np.full(count, noise**2), np.ones(count, bool))
    return samples


def sampled_twice(receivers, light, rng, noise=0.0) -> tuple[list[Samples], Fit]:
    """Two halves of four samples in each cell, and what they are fitted with."""
    halves = [sample(receivers, light, 2, rng, noise) for _ in range(2)]
    return halves, Fit(receivers, halves[0].lumped, np.zeros(len(receivers.cells), bool))


def squared_error(receivers, light, corners, rng) -> float:
    """Mean over the floor of (light - fit)^2, by 40 points a cell."""
    cells, total = receivers.cells, 0.0
    for number in range(40):
        weights = triangle_points(plane_points(np.full(len(cells), number), rng.random((len(cells), 2))))
        points = np.einsum("nc,nck->nk", weights, cells.corners)
        total += cells.area @ (light(points) - np.einsum("nc,nc->n", weights, corners)) ** 2 / 40
    return total / cells.area.sum()


def fronts(profile):
    """Light that changes across a straight front, in all directions."""
    for k in range(DIRECTIONS):
        angle = np.pi * (k + 0.37) / DIRECTIONS
        along = np.array([np.cos(angle), np.sin(angle), 0.0])
        yield lambda points, along=along: profile(points @ along - 0.03)


@pytest.mark.parametrize(
    ("profile", "low", "high"),
    [
        (lambda t: (t > 0) * 1.0, 0.8 * STEP_BEND, 1.25 * STEP_BEND),
        (lambda t: t**2, 0.8 * PARABOLA_BEND, 1.25 * PARABOLA_BEND),
        (lambda t: np.maximum(t, 0), STEP_BEND, PARABOLA_BEND),
        (lambda t: np.sqrt(np.maximum(t, 0)), STEP_BEND, PARABOLA_BEND),
    ],
    ids=["step", "parabola", "kink", "root"],
)
def test_the_error_of_a_fit_is_a_known_share_of_its_bends(floor, profile, low, high):
    """A step and a parabola are the two ends; over all directions each ratio scatters by less than a quarter."""
    rng = np.random.default_rng(1)
    bend = error = 0.0
    for light in fronts(profile):
        samples = sample(floor, light, 4, rng)
        fit = Fit(floor, samples.lumped, np.zeros(len(floor.cells), bool))
        values = fit.solve(fit.system(samples), ALPHAS[0])
        bend += floor.cells.area @ fit.bending(values, values) / floor.cells.area.sum()
        error += squared_error(floor, light, fit.at_corners(values)[..., 0], rng)
    assert low < bend / error < high


def test_independent_noise_bends_nothing(floor):
    """The product of n independent bends of either sign is 1/sqrt(n) of their squares; here within four deviations."""
    rng = np.random.default_rng(2)
    halves, fit = sampled_twice(floor, lambda points: np.ones(len(points)), rng, noise=1.0)
    first, second = (fit.solve(fit.system(half), ALPHAS[0]) for half in halves)
    area = floor.cells.area
    alone = area @ fit.bending(first, first)
    assert alone > 0
    assert abs(area @ fit.bending(first, second)) < 4 * alone / np.sqrt(floor.vertices / 3)


def stated_and_true(floor, light, rng, noise=0.0) -> tuple[float, float]:
    """Mean squared errors of a fit to four samples in each cell: as it is stated, and as it is."""
    area = floor.cells.area
    halves, fit = sampled_twice(floor, light, rng, noise)
    fitted = fit_halves(fit, halves, cross_validate(fit, halves, area, np.ones(len(area))))
    stated = area @ (fitted.sampling + fitted.unresolved + fitted.smoothed) / area.sum()
    return stated, squared_error(floor, light, fit.at_corners(fitted.values)[..., 0], rng)


@pytest.mark.parametrize("noise", [0.0, 0.05, 0.5])
def test_the_stated_error_is_the_true_one(floor, noise):
    """A soft front with sampling noise: stated over true within the 0.7 to 1.5 that a person is promised."""
    rng = np.random.default_rng(3)
    lights = fronts(lambda t: np.clip(t / 0.1, 0, 1))
    stated, true = np.sum([stated_and_true(floor, light, rng, noise) for light in lights], axis=0)
    assert 0.7 < np.sqrt(stated / true) < 1.5


@pytest.mark.parametrize("length", [0.2, 0.05, 0.02])
def test_light_that_changes_inside_cells_is_stated(floor, length):
    """Pools of light down to a third of a cell: stated over true is never below the half that a person is promised."""

    def light(points):
        return (np.sin(2.0 * np.pi * points[:, :2] / length) > 0.7).all(axis=1) * 1.0

    stated, true = stated_and_true(floor, light, np.random.default_rng(5))
    assert 0.5 < np.sqrt(stated / true) < 1.5


def test_light_is_smoothed_where_it_is_smooth(finer_floor):
    """Waves on one half of the floor, nothing on the other, noise on both: no single smoothing is as good for both."""
    floor, rng = finer_floor, np.random.default_rng(4)

    def light(points):
        return waves_on_one_half(points, 0.5)

    halves, fit = sampled_twice(floor, light, rng, noise=0.2)
    fitted = fit_halves(fit, halves, cross_validate(fit, halves, floor.cells.area, np.ones(len(floor.cells))))
    place = np.zeros(floor.vertices)
    place[floor.corner_vertex] = floor.element_corners[..., 0]
    assert np.median(fitted.alpha[place > 0.3]) == ALPHAS[-1]
    assert np.median(fitted.alpha[place < -0.3]) < 0.1 * ALPHAS[-1]
    merged = halves[0] + halves[1]
    system, limits = fit.system(merged), fit.limits(merged)
    alike = [fit.solve_within(system, alpha, limits) for alpha in ALPHAS]
    errors = [squared_error(floor, light, fit.at_corners(values)[..., 0], rng) for values in (fitted.values, *alike)]
    assert errors[0] < 0.8 * min(errors[1:])


def test_noise_is_no_reason_to_split(finer_floor):
    """Waves on one half of the floor, noise on both: with the cells around, its bends of either sign cancel."""
    floor, rng = finer_floor, np.random.default_rng(7)

    def light(points):
        return waves_on_one_half(points, 0.3)

    halves, fit = sampled_twice(floor, light, rng, noise=0.2)
    judged = cross_validate(fit, halves, floor.cells.area, np.ones(len(floor.cells)))
    flat = floor.cells.corners[..., 0].min(axis=1) > 0.0
    share = judged.unresolved * floor.cells.area
    assert share[flat].sum() < 0.25 * share.sum()


def test_two_witnesses_count_by_what_they_know():
    """A thousand cells that agree are sure to one part in thirty; two that contradict each other know nothing: then any
    ratio from that of a step to that of a parabola is as likely."""
    many, few = np.tile([1.0, 3.0], 500), np.array([1.0, 3.0])
    unknown = 2.0 * np.log(PARABOLA_BEND / STEP_BEND) / (PARABOLA_BEND - STEP_BEND)
    assert _unresolved(few, np.array([1e6, -1e6]), np.zeros(2), np.full(2, 0.5)).mean() == pytest.approx(
        unknown, rel=1e-2
    )
    middle = 2.0 / np.sqrt(STEP_BEND * PARABOLA_BEND)
    each, none = np.full(1000, 1e-3), np.zeros(1000)
    assert _unresolved(many, np.full(1000, 2 * middle), none, each).mean() == pytest.approx(2 * middle, rel=5e-3)
    # It lies where the bends are, and is never less than of a curve nor more than of a step.
    assert _unresolved(many, np.full(1000, middle), none, each)[:2] == pytest.approx(
        [middle / 2, middle * 1.5], rel=5e-3
    )
    fewer = np.full(100, 4 * middle), none[:100], np.full(100, 1e-2)
    assert 0.9 * 2.0 / STEP_BEND < _unresolved(many[:100], *fewer).mean() <= 2.0 / STEP_BEND
    assert _unresolved(many, np.full(1000, -middle), none, each).mean() == pytest.approx(2.0 / PARABOLA_BEND, rel=0.02)
    assert _unresolved(np.zeros(2), np.ones(2), np.zeros(2), np.ones(2)).tolist() == [0, 0]
    # Of what samples are sure of, less three deviations, no bend says otherwise, and then it lies where they do.
    sure = 1.0 - 3.0 / np.sqrt(1000)
    uneven = np.tile([0.0, 2.0], 500)
    for bend in (many, -many, none):
        assert _unresolved(bend, np.full(1000, 5 * middle), none, each) == pytest.approx(5 * middle * sure)
        assert _unresolved(bend, 5 * middle * uneven, none, each)[::2].max() == 0.0
    # Noise a hundred times as large as what is left of it is not known so well that the samples could tell.
    noisy = _unresolved(many, np.full(1000, 202 * middle), np.full(1000, 200 * middle), each).mean()
    assert unknown < noisy < 1.5 * unknown


def test_noise_beside_a_break_is_no_error():
    """Of 1000 cells whose samples lie as far from the fit as their noise says, on average, half lie farther. What is
    left in all is within four deviations of nothing; and where there is an error, all of it is found."""
    rng = np.random.default_rng(6)
    noise, weight, broken = np.ones(1000), np.full(1000, 1e-3), np.ones(1000, dtype=bool)
    distance = rng.standard_normal((1000, 4)) ** 2 @ np.full(4, 0.25)
    found = _unresolved_by_kind(broken, np.zeros(1000), distance, noise, weight)
    assert found.min() >= 0.0
    assert weight @ found < 4.0 * np.sqrt(2.0 / 4.0 / 1000)
    assert weight @ np.maximum(distance - noise, 0.0) > 0.2
    found = _unresolved_by_kind(broken, np.zeros(1000), distance + 3.0, noise, weight)
    assert weight @ found == pytest.approx(3.0 + weight @ (distance - noise))


def test_what_lies_beside_a_break_says_nothing_of_the_rest():
    """Beside a contour samples lie far off; elsewhere they are as near as a smooth fit's."""
    bend, noise, weight = np.ones(200), np.zeros(200), np.full(200, 1 / 200)
    broken = np.repeat([False, True], 100)
    distance = np.where(broken, 1 / 5, 1 / 40)
    found = _unresolved_by_kind(broken, bend, distance, noise, weight)
    # As likely at any ratio is less likely by its square at any error: two variances of a tenth squared.
    assert found[:100] == pytest.approx(1 / 40, rel=0.03)
    assert found[100:] == pytest.approx(1 / 5)
    assert _unresolved(bend, distance, noise, weight)[:100].mean() > 2 / 40


def test_noise_takes_nothing_away_from_what_triangles_cannot_show():
    """Two parts, of which one's smoothing has come out as less than none: 3 and 4 % of unresolved light make 5."""
    cells, nothing = np.full(100, 1.0), np.zeros(100)
    empty = _Halves(nothing, nothing)
    parts = [
        Fitted(nothing, (nothing, nothing), nothing, nothing, nothing, bent**2 * cells, smooth * cells, empty, nothing)
        for bent, smooth in ((0.03, 0.0), (0.04, -0.01))
    ]
    error, local = estimate_error(parts, nothing, cells, cells, 1.0)
    assert error.resolution == pytest.approx(0.05)
    assert error.total == pytest.approx(0.05)
    assert (local >= 0.0).all()


def test_the_mean_of_a_squared_linear_function():
    """Of x on the triangle (0, 0), (1, 0), (0, 1): the integral of x^2 is 1/12, over an area of 1/2."""
    assert squared_mean(np.array([[0.0, 1.0, 0.0]])) == pytest.approx(1 / 6)


def test_coarser_groups_blur_as_squares_of_four_patches(build):
    """Second moments about the centre: A/9 each way of a right-angled triangle with equal legs, A/3 of a square of four
    of them: three times as much. A grid that cuts across the triangles makes it a little more."""
    made = build.patches(Scene((build.quad(),), (build.grey,)), 2048)
    center, group = made.corners.mean(axis=1), made.coarser_groups
    weight = np.bincount(group, made.patch_area)
    middle = np.stack([np.bincount(group, made.patch_area * x) / weight for x in center.T], axis=1)
    between = np.sum(made.patch_area[:, None] * (center - middle[group]) ** 2)
    within = np.sum(made.patch_area**2 * 2 / 9)
    assert 2.0 < (between + within) / within < 4.0


def test_a_loose_fit_is_off_by_no_more_than_it_may_and_threads_change_nothing(build):
    """What is left of the scaled system is more than a close fit leaves, and at most ten times that."""
    scene = Scene((build.quad(),), (build.grey,))
    floor = make_receivers(scene, unit_space(scene), Settings(), 3000)
    rng, every = np.random.default_rng(7), np.zeros(len(floor.cells), bool)
    halves = [sample(floor, lambda points: 2.0 + points[:, 0], 2, rng, noise=0.3) for _ in range(2)]
    fit, area = Fit(floor, halves[0].lumped, every), floor.cells.area
    with Workers(2, Progress()) as workers:
        judged = (cross_validate(fit, halves, area, np.ones(len(area)), 10.0, each) for each in (map, workers.each))
        loose, threaded = (
            fit_halves(fit, halves, j, 10.0, each) for j, each in zip(judged, (map, workers.each), strict=True)
        )
    assert loose.values.tobytes() == threaded.values.tobytes()
    system = fit.system(halves[0] + halves[1])
    matrix = fit.matrix(system, loose.alpha)
    left = system.target - matrix @ loose.values
    ratio = np.sqrt(np.sum(left**2 / matrix.diagonal[:, None]) / np.sum(system.target**2 / matrix.diagonal[:, None]))
    assert 5e-4 < ratio < 5e-3


@pytest.mark.parametrize(
    ("doubts", "said"),
    [
        ([(0.02, 0.0), (0.02, 0.0)], 0.02),  # both halves see the same: it is there
        ([(0.02, 0.0), (0.0, 0.0)], 0.01),  # chance of one: the mean is off by half of it
        ([(0.02, 0.0), (-0.02, 0.0)], 0.02 / 2**0.5),  # chance of both, which happens to cancel
        ([(0.0, 0.02 * COARSENING), (0.0, -0.02 * COARSENING)], 0.02),  # patches are as large in both
    ],
)
def test_the_level_is_as_sure_as_the_mean_of_two_halves(doubts, said):
    assert level_error(tuple(doubts)) == pytest.approx(said)
