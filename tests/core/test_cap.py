"""The cap's closed form against quadrature over the cap, and against the closed forms of spheres and discs."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_baker.core.direct.cap import cap_irradiance


def by_quadrature(tilt: float, half_angle: float) -> float:
    """Integral of max(cos, 0)/pi over the cap: midpoints in the squared sine-like height and in the turn.

    2,000 x 2,000 midpoints: the integrand is continuous with a kink at the horizon, so the error is of second order in
    the step, under 1e-6 of the cap.
    """
    steps = 2000
    height = np.cos(half_angle) + (1 - np.cos(half_angle)) * (np.arange(steps) + 0.5) / steps
    turn = np.pi * (np.arange(steps) + 0.5) / steps
    lift = np.cos(tilt) * height[:, None] + np.sin(tilt) * np.sqrt(1 - height**2)[:, None] * np.cos(turn)
    return float(np.maximum(lift, 0).mean() * 2 * (1 - np.cos(half_angle)))


@pytest.mark.parametrize("half_angle", [0.05, 0.5, 1.2, 1.55])
@pytest.mark.parametrize("tilt", [0.0, 0.4, 1.0, 1.5, np.pi / 2, 1.6, 2.2, 3.0])
def test_against_quadrature(tilt: float, half_angle: float) -> None:
    got = cap_irradiance(np.array([np.cos(tilt)]), np.array([np.sin(half_angle)]))[0]
    assert got == pytest.approx(by_quadrature(tilt, half_angle), abs=1e-5 * np.sin(half_angle) ** 2)


def test_half_the_sky() -> None:
    """A cap of 90 degrees tilted by t: (1 + cos t)/2, what a sphere's own surface sees of it."""
    cosine = np.linspace(-1, 1, 21)
    assert cap_irradiance(cosine, np.ones(21)) == pytest.approx((1 + cosine) / 2, abs=1e-15)


def test_inside_the_sphere_and_below_the_horizon() -> None:
    assert cap_irradiance(np.array([-1.0, 0.3]), np.array([1.5, 1.0001])).tolist() == [1.0, 1.0]
    assert cap_irradiance(np.array([-0.5, -1.0]), np.array([0.4, 0.0])).tolist() == [0.0, 0.0]


@pytest.mark.parametrize("half_angle", [1e-5, 1e-4, 0.0047, 0.1, 1.0, 1.5707])
def test_single_precision_is_as_good_as_its_input(half_angle: float) -> None:
    """Across the horizon the form factor moves by at most half_angle^2 per unit of cosine / half_angle."""
    sine = np.full(2001, np.sin(half_angle), np.float32)
    cosine = np.clip(np.linspace(-1.5, 1.5, 2001) * sine, -1, 1).astype(np.float32)
    single, double = cap_irradiance(cosine, sine), cap_irradiance(cosine.astype(float), sine.astype(float))
    assert single.dtype == np.float32
    assert np.abs(single - double).max() <= 1e-6 * np.sin(half_angle) ** 2 * max(1.0, np.sin(half_angle))
    assert (np.diff(double) >= -1e-9 * sine[0] ** 2).all()


@pytest.mark.parametrize(("height", "expected"), [(1.0, 0.146446609), (2.0, 0.052786405), (0.1, 0.450248140)])
@pytest.mark.parametrize("radius", [0.01, 0.09])
def test_sphere_to_coaxial_disc(height: float, expected: float, radius: float) -> None:
    """Whatever its size, a sphere sends (1 - 1/sqrt(1 + 1/h^2))/2 of its light to the unit disc below it.

    By reciprocity from the disc's rings: 4,000 midpoints, error of order (1/4000/height)^2.
    """
    ring = (np.arange(4000) + 0.5) / 4000
    distance = np.sqrt(height**2 + ring**2)
    shed = cap_irradiance(height / distance, radius / distance)
    disc_to_sphere = (shed * 2 * ring).mean()
    assert disc_to_sphere * np.pi / (4 * np.pi * radius**2) == pytest.approx(expected, rel=1e-4)
