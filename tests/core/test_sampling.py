"""Point sets are even, frames are frames, and streams can be told apart and repeated.

Statistics are asked to lie within four standard deviations of what is true: with fixed seeds they either do or do not,
and a fresh seed would fail one time in 16,000.
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from radiosity_baker.core.sampling import cosine_patterns, frames, plane_points, stream, triangle_points

#: Single precision: a handful of roundings of numbers up to one.
SINGLE = 8 * 2.0**-24
SETS, RAYS = 4000, 17


@pytest.fixture(scope="module")
def patterns() -> np.ndarray:
    return cosine_patterns(SETS, RAYS, np.random.default_rng(1)).astype(np.float64)


def within_four_deviations(samples: np.ndarray, truth: float) -> bool:
    """Whether the mean of independent samples (n,) is what it should be."""
    return abs(samples.mean() - truth) <= 4 * samples.std(ddof=1) / np.sqrt(len(samples)) + 1e-7


def test_patterns_are_unit_directions_above_the_horizon(patterns):
    assert patterns.shape == (SETS, RAYS, 3)
    assert np.linalg.norm(patterns, axis=2) == pytest.approx(1.0, abs=SINGLE)
    assert patterns[..., 2].min() >= 0


def test_patterns_have_the_moments_of_a_cosine(patterns):
    """With density cos/pi: E z = 2/3, E z^2 = 1/2, E x^2 = 1/4, E x = E y = E xy = 0."""
    x, y, z = np.moveaxis(patterns, 2, 0)
    for samples, truth in ((z, 2 / 3), (z * z, 1 / 2), (x * x, 1 / 4), (x, 0), (y, 0), (x * y, 0)):
        assert within_four_deviations(samples.mean(axis=1), truth)


def test_each_pattern_puts_one_direction_into_each_of_its_rings(patterns):
    """r^2 is even under a cosine, so ring k of equal share is k <= r^2 * rays <= k + 1."""
    ring = np.sort(1.0 - patterns[..., 2] ** 2, axis=1) * RAYS
    slack = RAYS * 4 * SINGLE
    assert (ring >= np.arange(RAYS) - slack).all()
    assert (ring <= np.arange(1, RAYS + 1) + slack).all()


def test_patterns_spread_better_than_chance(patterns):
    """The mean of z over random directions has the variance 1/18 over their number."""
    assert patterns[..., 2].mean(axis=1).var() < 1 / (18 * RAYS) / 10


unit = st.floats(-1, 1, width=32)


@settings(max_examples=200)
@given(st.tuples(unit, unit, unit).filter(lambda v: np.linalg.norm(v) > 1e-3), st.floats(0, 7, width=32))
def test_frames_are_orthonormal_and_right_handed(direction, angle):
    normal = np.array(direction) / np.linalg.norm(direction)
    frame = frames(normal[None].astype(np.float32), np.array([angle], dtype=np.float32))[0]
    assert frame.dtype == np.float32
    assert frame @ frame.T == pytest.approx(np.eye(3), abs=2 * SINGLE)
    assert np.cross(frame[0], frame[1]) == pytest.approx(frame[2], abs=2 * SINGLE)
    assert frame[2] == pytest.approx(normal, abs=SINGLE)


@pytest.mark.parametrize("normal", [(0, 0, 1), (0, 0, -1), (0, 0, -0.0), (1e-7, 0, -1), (0, -1e-20, -1), (1, 0, 0)])
def test_frames_have_no_pole(normal):
    vector = np.array(normal, dtype=np.float64)
    vector = np.array([1.0, 0, -0.0]) if not vector.any() else vector
    frame = frames(vector[None].astype(np.float32), np.zeros(1, np.float32))[0]
    assert frame @ frame.T == pytest.approx(np.eye(3), abs=2 * SINGLE)


def test_the_angle_turns_a_frame_about_its_normal():
    normal = np.tile(np.array([[0.6, 0.0, -0.8]], dtype=np.float32), (2, 1))
    still, turned = frames(normal, np.array([0.0, 0.3], dtype=np.float32))
    assert turned[0] @ still[0] == pytest.approx(np.cos(0.3), abs=SINGLE)
    assert turned[0] @ still[1] == pytest.approx(np.sin(0.3), abs=SINGLE)


def grid(side: int) -> np.ndarray:
    """(side^2, 2) midpoints of the cells of the unit square."""
    middle = (np.arange(side) + 0.5) / side
    return np.stack(np.meshgrid(middle, middle, indexing="ij"), axis=-1).reshape(-1, 2)


def test_triangle_points_are_uniform():
    """Moments of barycentric weights over a triangle: E b = 1/3, E b^2 = 1/6, E b c = 1/12; a grid of n^2 points finds
    them to about 1/n^2, and only the cells that the map's diagonal cuts, 1/n of them, are off by as much as 1/n."""
    side = 256
    weights = triangle_points(grid(side))
    assert weights.min() >= 0
    assert weights.sum(axis=1) == pytest.approx(1.0, abs=1e-15)
    expected = (np.ones((3, 3)) + np.eye(3)) / 12
    assert weights.T @ weights / side**2 == pytest.approx(expected, abs=4 / side**2)
    assert weights.mean(axis=0) == pytest.approx(1 / 3, abs=4 / side**2)


def test_triangle_points_fill_the_four_triangles_of_triform_alike():
    side = 256
    quarter = np.argmax(np.column_stack([triangle_points(grid(side)) > 0.5, np.ones(side**2)]), axis=1)
    assert np.bincount(quarter) == pytest.approx(side**2 / 4, abs=2 * side)  # cells on a border may go either way


def test_neighbours_in_the_square_stay_neighbours_in_the_triangle():
    """The map is piecewise linear with slopes of at most one, and continuous over its diagonal."""
    rng = np.random.default_rng(2)
    here = rng.random((5000, 2))
    here[:1000, 1] = here[:1000, 0]  # both diagonals, where maps have their seams
    here[1000:2000, 1] = 1 - here[1000:2000, 0]
    there = np.clip(here + rng.uniform(-1e-4, 1e-4, here.shape), 0, 1)
    moved = np.abs(triangle_points(here) - triangle_points(there)).max(axis=1)
    assert (moved <= 1.01 * np.abs(here - there).sum(axis=1)).all()


def test_plane_points_are_even_and_go_on_where_they_stopped():
    shift = np.array([[0.3, 0.9]])
    points = plane_points(np.arange(256), shift)
    assert (points >= 0).all()
    assert (points < 1).all()
    # 256 random points would leave cells with 16 +- 4 of them; an even set is off by a few at most.
    cell = np.floor(points * 4).astype(int) @ [4, 1]
    assert np.abs(np.bincount(cell, minlength=16) - 16).max() <= 4
    assert plane_points(np.full(1, 200), shift)[0] == pytest.approx(points[200], abs=1e-12)
    assert plane_points(np.full(1, 0), shift)[0] == pytest.approx(shift[0])


def test_a_stream_repeats_itself():
    assert (stream(7, "rays", 3).random(1000) == stream(7, "rays", 3).random(1000)).all()


def test_streams_of_other_seeds_purposes_and_chunks_are_independent():
    """Correlations of n pairs of random numbers have the standard deviation 1 / sqrt(n)."""
    count = 20_000
    drawn = [
        stream(seed, purpose, chunk).random(count)
        for seed, purpose, chunk in ((7, "rays", 3), (8, "rays", 3), (7, "ray", 3), (7, "rays", 4), (-7, "rays", 3))
    ]
    correlation = np.corrcoef(drawn)
    assert np.abs(correlation - np.eye(len(drawn))).max() <= 4 / np.sqrt(count)


def test_chunks_do_not_run_into_each_other():
    """However much one chunk draws, it never gets to the numbers of the next."""
    first = set(stream(7, "rays", 0).random(100_000).tolist())
    assert not first & set(stream(7, "rays", 1).random(100).tolist())
