"""The double contour integral: limits that are known, and agreement with Lambert's formula where both hold."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_baker.core.form_factors.contour import exchange_area, in_front
from radiosity_baker.core.form_factors.polygon import polygon_irradiance


@pytest.mark.parametrize("degrees", [0.1, 1.0, 5.0, 45.0, 90.0, 170.0])
def test_long_strips_that_share_an_edge(degrees: float) -> None:
    """Endless strips exchange 1 - sin(a/2). Here they are 200 long and 1 wide: their ends lose under 0.2 of a width
    each, 1e-3 in all, and edges as unequal as that cost the quadrature 5e-4."""
    cos, sin = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    ground = np.array([[[0, 0, 0], [1, 0, 0], [1, 200, 0], [0, 200, 0.0]]])
    lid = np.array([[[0, 0, 0], [0, 200, 0], [cos, 200, sin], [cos, 0, sin]]])
    expected = 1 - np.sin(np.radians(degrees) / 2)
    assert exchange_area(ground, lid)[0] / 200 == pytest.approx(expected, abs=1.5e-3)


def test_is_symmetric_and_scales_with_area() -> None:
    rng = np.random.default_rng(0)
    low = rng.random((50, 3, 3)) * (1, 1, 0)
    high = np.add(rng.random((50, 3, 3)), (0, 0, 0.1))
    there, back = exchange_area(low, high), exchange_area(high, low)
    assert there == pytest.approx(back, abs=1e-5)
    shifted = [1e3 * polygon + np.array([3e3, -2e3, 1e3]) for polygon in (low, high)]
    assert exchange_area(*shifted) == pytest.approx(1e6 * there, rel=1e-6, abs=1)


def test_agrees_with_lambert_over_a_fine_grid() -> None:
    """Midpoints of 256 parts: the error of the rule is of order (size of a part / distance)^2 = (1/16 / 0.5)^2 / 8."""
    steps = (np.arange(16) + 0.5) / 16
    x, y = (a.ravel() for a in np.meshgrid(steps, steps))
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
    triangle = np.array([[0.1, 0.2, 0.5], [0.3, 1.5, 0.8], [1.2, 0.4, 0.6]])
    shed = polygon_irradiance(np.stack([x, y, 0 * x], axis=1), np.array([0, 0, 1.0]), triangle)
    assert exchange_area(square[None], triangle[None])[0] == pytest.approx(shed.mean(), rel=2e-3)


@pytest.mark.parametrize("height", [2.0, 1.0, 0.5, 0.0, -0.5, -1.0, -2.0])
def test_part_in_front_of_a_plane(height: float) -> None:
    """A triangle from z = -1 to z = 1, cut at a height: what is left is as large as similar triangles say."""
    triangle = np.array([[[0, 0, -1], [2, 0, -1], [1, 0, 1.0]]])
    part = in_front(triangle, np.array([[5.0, 5, height]]), np.array([[0, 0, 1.0]]))[0]
    across = sum(np.cross(part[k] - part[0], part[k + 1] - part[0]) for k in (1, 2))
    assert np.linalg.norm(across) / 2 == pytest.approx(2 * np.clip((1 - height) / 2, 0, 1) ** 2, abs=1e-12)
