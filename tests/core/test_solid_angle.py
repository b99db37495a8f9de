"""Places spread evenly over a solid angle: the angle is right, and their mean cosine is the closed form."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_baker.core.direct.solid_angle import rectangle_places, triangle_directions
from radiosity_baker.core.form_factors.polygon import polygon_irradiance

GRID = np.stack(np.meshgrid(*[(np.arange(200) + 0.5) / 200] * 2)).reshape(2, -1, 1)


def tripod(a, b, c):
    """Solid angle of a triangle seen from the origin: Van Oosterom and Strackee (1983)."""
    la, lb, lc = (np.linalg.norm(v) for v in (a, b, c))
    below = la * lb * lc + (a @ b) * lc + (b @ c) * la + (c @ a) * lb
    return 2 * np.arctan2(abs(a @ np.cross(b, c)), below)


def test_a_face_of_a_cube_is_a_sixth_of_the_sphere():
    _, solid = rectangle_places(np.array([[-1.0], [-1]]), np.array([[1.0], [1]]), np.ones(1), GRID)
    assert solid == pytest.approx(4 * np.pi / 6)


def test_a_rectangle_seen_edge_on_has_no_solid_angle():
    """From beside it and a few millionths of a millimetre off its plane (found by the fuzzer: 0 / 0)."""
    low, high = np.array([[-1.00603057], [-0.53042016]]), np.array([[-0.48678114], [0.54764355]])
    places, solid = rectangle_places(low, high, np.array([4.07269557e-09]), GRID)
    assert solid == pytest.approx(0, abs=1e-7)
    assert np.isfinite(places).all()


@pytest.mark.parametrize(
    ("low", "high", "depth"),
    [
        ((-1, -1), (1, 1), 0.2),
        ((-0.3, 0.4), (2.0, 0.9), 0.1),
        ((0.5, 0.5), (0.9, 3), 1.0),
        ((-3, -0.01), (3, 0.01), 0.5),
    ],
)
def test_a_rectangle_is_spread_over_its_solid_angle(low, high, depth):
    """Mean of cosine * solid angle / pi is the form factor, for receivers that face the plane and that look askew."""
    (x, y), solid = rectangle_places(np.array(low)[:, None], np.array(high)[:, None], np.array([depth]), GRID)
    assert solid == pytest.approx(
        tripod(*np.array([(*low, depth), (high[0], low[1], depth), (*high, depth)], float))
        + tripod(*np.array([(*low, depth), (*high, depth), (low[0], high[1], depth)], float))
    )
    assert x.min() >= low[0]
    assert x.max() <= high[0]
    assert y.min() >= low[1]
    assert y.max() <= high[1]
    ways = np.stack([x, y, np.full_like(x, depth)]) / np.sqrt(x * x + y * y + depth**2)
    corners = np.array([(*low, depth), (low[0], high[1], depth), (*high, depth), (high[0], low[1], depth)], float)
    for normal in (np.array([0, 0, 1.0]), np.array([0.6, 0, 0.8])):
        mean = np.maximum(np.tensordot(normal, ways, axes=1), 0).mean() * solid / np.pi
        # A grid of 200 x 200 midpoints of a function that bends at the horizon is good to its spacing squared.
        assert mean.item() == pytest.approx(polygon_irradiance(np.zeros(3), normal, corners).item(), rel=1e-3)


@pytest.mark.parametrize(
    "corners",
    [
        ((1, 0, 0.0), (0, 1, 0), (0, 0, 1)),
        ((-1, -1, 0.3), (2, -1, 0.3), (0, 1, 0.3)),
        ((0.1, 0.1, 1.0), (0.4, 0.1, 1.2), (0.1, 0.2, 1.0)),
        ((0, 1, 0.0), (1, 0, 0), (0, 0, 1)),
    ],
)
def test_a_triangle_is_spread_over_its_solid_angle(corners):
    """In either order of its corners."""
    triangle = np.array(corners, float)
    ways, solid = triangle_directions(triangle[:, :, None], GRID)
    assert solid == pytest.approx(tripod(*triangle))
    assert np.linalg.norm(ways, axis=0) == pytest.approx(1)
    normal = np.array([0, 0, 1.0])
    mean = np.maximum(ways[2], 0).mean() * solid / np.pi
    exact = polygon_irradiance(np.zeros(3), normal, triangle, two_sided=True).item()
    assert mean.item() == pytest.approx(exact, rel=1e-3)
    # Each lies within: on the inner side of all three edges' planes.
    sides = [np.tensordot(np.cross(triangle[k], triangle[k - 2]), ways, axes=1) for k in range(3)]
    assert (np.stack(sides) * np.sign(np.linalg.det(triangle)) > -1e-9).all()
