"""Lambert's formula against closed forms, against itself in pieces, and against blind sampling."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from radiosity_baker.core.form_factors.polygon import polygon_irradiance

UP = np.array([0.0, 0.0, 1.0])
#: A square of side 1 over the origin's first quadrant, shining down, and one standing along the y axis, shining to -x.
CEILING = np.array([[0, 0, 1], [0, 1, 1], [1, 1, 1], [1, 0, 1]], dtype=float)
coordinate = st.floats(-2.0, 2.0, width=32)
vector = arrays(np.float64, 3, elements=coordinate)


def unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def directions(rng: np.random.Generator, count: int) -> np.ndarray:
    """Cosine-distributed directions about +z: each that meets the polygon adds 1/count to the form factor."""
    u, v = rng.random((2, count))
    return np.stack([np.sqrt(u) * np.cos(2 * np.pi * v), np.sqrt(u) * np.sin(2 * np.pi * v), np.sqrt(1 - u)], axis=1)


def met(ways: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Which rays from the origin run through the triangle (3, 3)."""
    sides = np.stack([ways @ np.cross(corners[i], corners[(i + 1) % 3]) for i in range(3)])
    return (sides > 0).all(0) | (sides < 0).all(0)


@pytest.mark.parametrize(("height", "expected"), [(1.0, 0.138531606), (0.1, 0.247971408)])
def test_parallel_rectangle_over_its_corner(height: float, expected: float) -> None:
    assert polygon_irradiance(np.zeros(3), UP, CEILING * (1, 1, height)) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize(("distance", "expected"), [(1.0, 0.055734197), (0.1, 0.221738671)])
def test_perpendicular_rectangle(distance: float, expected: float) -> None:
    wall = np.array([[distance, 0, 0], [distance, 0, 1], [distance, 1, 1], [distance, 1, 0]], dtype=float)
    assert polygon_irradiance(np.zeros(3), UP, wall) == pytest.approx(expected, abs=1e-9)


def test_wall_is_cut_at_the_horizon() -> None:
    whole = np.array([[1, 0, -5], [1, 0, 1], [1, 1, 1], [1, 1, -5]], dtype=float)
    assert polygon_irradiance(np.zeros(3), UP, whole) == pytest.approx(0.055734197, abs=1e-9)
    assert polygon_irradiance(np.zeros(3), -UP, whole - (0, 0, 2)) > 0.055
    assert polygon_irradiance(np.zeros(3), UP, whole - (0, 0, 2)) == 0.0


def test_endless_wall_covers_half_the_sky() -> None:
    wall = np.array([[1, -1e6, -1e6], [1, -1e6, 1e6], [1, 1e6, 1e6], [1, 1e6, -1e6]])
    assert polygon_irradiance(np.zeros(3), UP, wall) == pytest.approx(0.5, abs=1e-5)


def test_tilted_plane_through_the_nadir() -> None:
    """An unbounded plane leaning by angle t hides (1 - cos t)/2, even where it runs under the receiver's feet."""
    for tilt in np.radians([1.0, 30.0, 60.0, 89.0]):
        along, normal = np.array([np.cos(tilt), 0, np.sin(tilt)]), np.array([-np.sin(tilt), 0, np.cos(tilt)])
        corners = np.array([a * along + b * np.array([0, 1.0, 0]) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
        plane = 1e6 * corners - normal
        assert polygon_irradiance(np.zeros(3), UP, plane) == pytest.approx((1 - np.cos(tilt)) / 2, abs=1e-5)


def test_only_the_emitting_side_shines() -> None:
    assert polygon_irradiance(np.zeros(3), UP, CEILING[::-1]) == 0.0
    assert polygon_irradiance(np.zeros(3), UP, CEILING[::-1], two_sided=True) == pytest.approx(0.138531606, abs=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_coplanar_neighbours_see_exactly_nothing(seed: int) -> None:
    """Also when the plane is tilted and stored in float32, where the corners leave it by rounding."""
    rng = np.random.default_rng(seed)
    u, v = np.linalg.qr(rng.normal(size=(3, 3)))[0][:2]
    grid = rng.uniform(-1, 1, (200, 4, 2)) @ np.stack([u, v])
    corners = grid[:, 1:].astype(np.float32)
    facing = polygon_irradiance(grid[:, 0], np.cross(u, v), corners, two_sided=True)
    assert (facing[np.linalg.norm(grid[:, :1] - grid[:, 1:], axis=-1).min(-1) > 0.5] == 0.0).all()


def test_small_and_far_keeps_its_digits() -> None:
    """At distance d a patch of area A straight ahead gives A/(pi d^2), to the next order 1/d^2."""
    square = (np.array([[-1, -1, 0], [-1, 1, 0], [1, 1, 0], [1, -1, 0]]) / 2)[None]
    for distance in (1e2, 1e4, 1e6):
        shift = np.array([3e4, -7e4, 1e4])
        got = polygon_irradiance(shift[None], UP, square + shift + (0, 0, distance))
        assert got[0] == pytest.approx(1 / (np.pi * distance**2), rel=1e-3)


def test_touching_points_stay_finite() -> None:
    points = np.concatenate([CEILING, CEILING[:1] / 2 + CEILING[1:2] / 2, CEILING.mean(0, keepdims=True)])
    for normal in (UP, -UP, unit(np.array([1.0, 2.0, 3.0]))):
        got = polygon_irradiance(points, normal, CEILING)
        assert ((got >= 0) & (got <= 1)).all()


def test_table_is_the_same_as_one_by_one() -> None:
    rng = np.random.default_rng(5)
    points, normals, corners = rng.normal(size=(7, 3)), unit(rng.normal(size=(7, 3))), rng.normal(size=(11, 3, 3))
    table = polygon_irradiance(points[:, None], normals[:, None], corners)
    for i in range(7):
        for j in range(11):
            assert table[i, j] == polygon_irradiance(points[i], normals[i], corners[j])


def test_agrees_with_sampled_directions() -> None:
    """60 random triangles, 40,000 directions each. A wrong formula fails; a right one does once in 1,000 runs at most:
    |z| < 4.4 holds for all 60 normal deviates with probability 0.9993, and the seed is fixed."""
    rng = np.random.default_rng(20)
    ways = directions(rng, 40_000)
    corners = rng.uniform(-1, 1, (60, 3, 3)) + rng.uniform(-0.5, 1, (60, 1, 3))
    exact = polygon_irradiance(np.zeros((60, 3)), UP, corners, two_sided=True)
    for triangle, expected in zip(corners, exact, strict=True):
        hits = met(ways, triangle) & ((ways @ np.linalg.solve(triangle, np.ones(3))) > 0)
        error = np.sqrt(max(expected * (1 - expected), 1e-5) / len(ways))
        assert abs(hits.mean() - expected) < 4.4 * error


@settings(max_examples=200, deadline=None)
@given(
    point=vector,
    normal=vector.filter(lambda v: np.linalg.norm(v) > 0.1),
    corners=arrays(np.float64, (3, 3), elements=coordinate),
    s=st.floats(0.01, 0.99),
)
def test_parts_add_up_and_stay_within_bounds(
    point: np.ndarray, normal: np.ndarray, corners: np.ndarray, s: float
) -> None:
    """Split along a line from one corner: the parts sum to the whole. Points on the triangle itself have no value."""
    across = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    if np.linalg.norm(across) < 1e-3 or abs((point - corners[0]) @ unit(across)) < 1e-3:
        return
    n, middle = unit(normal), corners[1] + s * (corners[2] - corners[1])
    parts = [[corners[0], corners[1], middle], [corners[0], middle, corners[2]]]
    whole = polygon_irradiance(point, n, corners, two_sided=True)
    assert 0.0 <= whole <= 1.0
    assert polygon_irradiance(point, n, np.array(parts), two_sided=True).sum() == pytest.approx(whole, abs=1e-6)
    assert polygon_irradiance(
        point, n, np.array([corners[0], corners[1], middle, corners[2]]), two_sided=True
    ) == pytest.approx(whole, abs=1e-6)


@settings(max_examples=100, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_a_turned_shifted_scaled_scene_is_the_same(seed: int) -> None:
    rng = np.random.default_rng(seed)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    shift, scale = rng.normal(size=3), np.exp(rng.normal())
    point, normal, corners = rng.normal(size=3), unit(rng.normal(size=3)), rng.normal(size=(4, 3))
    corners[3] = corners[2] + corners[0] - corners[1]
    here = polygon_irradiance(point, normal, corners)
    there = polygon_irradiance(scale * point @ turn + shift, normal @ turn, scale * corners @ turn + shift)
    assert there == pytest.approx(here, abs=1e-6)
