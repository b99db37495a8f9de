"""The solve against dense elimination, and the bound it states against the true error."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from radiosity_baker.core.form_factors.rows import Rows, balance
from radiosity_baker.core.solver import contraction, shoot, shoot_until, solve

#: Rows are kept in single precision; light that comes back 1 / (1 - p) times carries their rounding with it.
SINGLE = 2.0**-23


def closed_room(seed: int, count: int = 60) -> tuple[Rows, np.ndarray]:
    """Balanced exchange areas of two groups of sides that see little of each other, each side with holes in its row:
    light that goes around slowly and unevenly."""
    rng = np.random.default_rng(seed)
    area = rng.uniform(0.2, 2.0, count)
    exchange = area[:, None] * area * rng.uniform(0.1, 1, (count, count)) * (rng.random((count, count)) < 0.5)
    group = np.arange(count) % 2
    exchange *= np.where(group[:, None] == group, 1.0, 0.02)
    exchange = exchange + exchange.T
    row, column = np.nonzero(exchange)
    return balance(Rows.from_triplets(row, column, exchange[row, column], count), area, steps=100), area


def dense(rows: Rows) -> np.ndarray:
    matrix = np.zeros((len(rows), len(rows)))
    np.add.at(matrix, (rows.owners(), rows.columns), rows.weights)
    return matrix


def eliminate(exchange: Rows, area: np.ndarray, albedo: np.ndarray, direct: np.ndarray) -> np.ndarray:
    """H = E + F (albedo H), channel by channel."""
    factors = dense(exchange) / area[:, None]
    solved = [np.linalg.solve(np.eye(len(area)) - factors * albedo[:, c], direct[:, c]) for c in range(direct.shape[1])]
    return np.stack(solved, axis=1)


def relative_error(found: np.ndarray, truth: np.ndarray) -> float:
    return float((np.abs(found - truth).max(axis=0) / np.abs(truth).max(axis=0)).max())


def one_bright_side(count: int) -> np.ndarray:
    direct = np.zeros((count, 3))
    direct[3] = [1.0, 10.0, 0.1]
    return direct


@pytest.mark.parametrize("albedo", [0.5, 0.9, 0.99, 0.999])
@pytest.mark.parametrize("tolerance", [1e-2, 1e-4])
def test_is_what_elimination_gives_within_a_bound_that_holds(albedo, tolerance):
    exchange, area = closed_room(1)
    shares = np.full((len(area), 3), albedo)
    direct = one_bright_side(len(area))
    solution = solve(exchange, area, shares, direct, tolerance)
    error = relative_error(solution.irradiance, eliminate(exchange, area, shares, direct))
    assert solution.bound <= tolerance
    assert error <= solution.bound + SINGLE / (1 - albedo)
    assert solution.iterations < 50


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10**6), st.floats(0.0, 0.999), st.sampled_from([1e-1, 1e-2, 1e-3, 1e-5]))
def test_the_bound_holds_for_any_room(seed, brightest, tolerance):
    exchange, area = closed_room(seed, 20)
    rng = np.random.default_rng(seed)
    albedo = rng.uniform(0, brightest, (20, 3)) * (rng.random((20, 3)) < 0.8)
    direct = rng.exponential(size=(20, 3)) * (rng.random((20, 1)) < 0.3) + 1e-6
    solution = solve(exchange, area, albedo, direct, tolerance)
    error = relative_error(solution.irradiance, eliminate(exchange, area, albedo, direct))
    assert solution.bound <= tolerance
    assert error <= solution.bound + SINGLE / (1 - brightest)
    assert (solution.irradiance >= direct * (1 - 1e-6)).all(), "bounces only add light"


@pytest.mark.parametrize("albedo", [0.5, 0.9, 0.99, 0.999])
def test_a_furnace_is_the_same_everywhere(albedo):
    """Every side lit by E in a closed room: H = E / (1 - p), within the tolerance and the rounding of the rows."""
    exchange, area = closed_room(2)
    count = len(area)
    solution = solve(exchange, area, np.full((count, 1), albedo), np.full((count, 1), 3.0), 1e-6)
    slack = 1e-6 + 2 * SINGLE / (1 - albedo)
    assert solution.irradiance == pytest.approx(3.0 / (1 - albedo), rel=slack)
    assert solution.iterations < 50


def test_a_channel_that_nothing_reflects_is_the_direct_light():
    exchange, area = closed_room(3)
    albedo = np.tile([0.8, 0.0, 0.8], (len(area), 1))
    direct = one_bright_side(len(area))
    solution = solve(exchange, area, albedo, direct, 1e-4)
    assert solution.irradiance[:, 1].tolist() == direct[:, 1].tolist()
    assert (solution.irradiance[:, 0] > direct[:, 0]).all()


def test_black_sides_receive_and_send_nothing_on():
    exchange, area = closed_room(4)
    albedo = np.where(np.arange(len(area)) < 30, 0.0, 0.9)[:, None] * np.ones(3)
    direct = one_bright_side(len(area))
    solution = solve(exchange, area, albedo, direct, 1e-5)
    truth = eliminate(exchange, area, albedo, direct)
    assert relative_error(solution.irradiance, truth) <= 1e-5 + 10 * SINGLE
    assert (solution.irradiance[:30] >= direct[:30]).all()


def test_no_light_is_solved_at_once():
    exchange, area = closed_room(5)
    solution = solve(exchange, area, np.full((len(area), 3), 0.9), np.zeros((len(area), 3)), 1e-4)
    assert (solution.irradiance == 0).all()
    assert solution.iterations == 0
    assert solution.bound == 0


def test_an_empty_channel_does_not_disturb_the_others():
    exchange, area = closed_room(6)
    albedo, direct = np.full((len(area), 3), 0.9), one_bright_side(len(area))
    direct[:, 1] = 0
    solution = solve(exchange, area, albedo, direct, 1e-4)
    assert (solution.irradiance[:, 1] == 0).all()
    truth = eliminate(exchange, area, albedo, direct)[:, [0, 2]]
    assert relative_error(solution.irradiance[:, [0, 2]], truth) <= 1e-4


def test_a_source_a_million_times_brighter_than_the_rest():
    exchange, area = closed_room(7)
    albedo, direct = np.full((len(area), 1), 0.7), np.full((len(area), 1), 1.0)
    direct[5] = 1e6
    solution = solve(exchange, area, albedo, direct, 1e-7)
    truth = eliminate(exchange, area, albedo, direct)
    assert relative_error(solution.irradiance, truth) <= 1e-7 + 10 * SINGLE


def test_shooting_accumulates_the_bounces_one_by_one():
    """After n passes: direct light, and F (p ...) of it up to n times; the residual is the last of these."""
    exchange, area = closed_room(8)
    factors = exchange.scaled(1 / area)
    albedo, direct = np.full((len(area), 3), 0.6), one_bright_side(len(area))
    bounce, total = direct, direct
    for accumulated, residual in itertools.islice(shoot(factors, albedo, direct), 4):
        assert accumulated == pytest.approx(total)
        assert residual == pytest.approx(bounce)
        bounce = dense(factors) @ (0.6 * bounce)
        total = total + bounce


def test_shooting_alone_gets_there_as_well():
    exchange, area = closed_room(9)
    factors = exchange.scaled(1 / area)
    albedo, direct = np.full((len(area), 3), 0.6), one_bright_side(len(area))
    solution = shoot_until(factors, albedo, direct, 1e-6)
    truth = eliminate(exchange, area, albedo, direct)
    # What a pass brings is the residual; the rest of the series is at most q / (1 - q) times that.
    assert solution.bound <= 1e-6
    assert relative_error(solution.irradiance, truth) <= 1e-6 * 0.6 / 0.4 + 10 * SINGLE


def test_shooting_ends_even_where_light_grows_for_ever():
    exchange, area = closed_room(10)
    grows = exchange.scaled(1.3 / area)
    solution = shoot_until(grows, np.full((len(area), 1), 0.9), np.ones((len(area), 1)), 1e-4)
    assert solution.iterations <= 1000
    assert solution.bound > 1e-4
    assert np.isfinite(solution.irradiance).all()


def test_contraction_is_the_most_that_any_side_gets_of_even_light():
    exchange, area = closed_room(11)
    albedo = np.full((len(area), 3), 0.2)
    albedo[4, 1] = 0.7
    seen = exchange.scaled(1.0 / area).apply(np.eye(len(area))[:, 4]).max()  # of the whitest side, from anywhere
    assert contraction(exchange.scaled(0.5 / area), albedo) == pytest.approx(0.5 * (0.2 + 0.5 * seen), rel=1e-5)


def test_the_solution_does_not_depend_on_threads(workers):
    exchange, area = closed_room(12, 400)
    albedo, direct = np.full((400, 3), 0.9), one_bright_side(400)
    alone = solve(exchange, area, albedo, direct, 1e-4)
    shared = solve(exchange, area, albedo, direct, 1e-4, workers)
    assert alone.irradiance.tobytes() == shared.irradiance.tobytes()
