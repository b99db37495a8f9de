"""Errors against a reference, on surfaces where the true light and the error are known in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_baker.core.comparison import (
    WORST,
    figures,
    locate,
    radiance_at,
    reference_noise,
    scatter,
    squared_errors,
    visible,
)
from radiosity_baker.core.result import BakedObject
from radiosity_baker.core.scene import Scene, SceneError, Surface
from radiosity_baker.core.tessellation import split_triangles, triform, whole


@pytest.fixture
def scene(build) -> Scene:
    """A quad of 3 m2 and one of 1 m2 that stands on it."""
    big = build.quad("big", u=(3, 0, 0))
    small = build.quad("small", v=(0, 0, 1), surface=1)
    return Scene((big, small), (Surface("grey", (0.5, 0.5, 0.5)), Surface("black", (0.0, 0.0, 0.0))))


def baked(receiver, edge: float, light) -> BakedObject:
    """A receiver split to triangles of that edge, with light(positions) at every corner."""
    mesh = triform(whole(receiver.vertices, receiver.triangles), edge)
    values = light(mesh.vertices[mesh.triangles]).astype(np.float32)
    return BakedObject(
        receiver.name, mesh.vertices, mesh.triangles, mesh.parent, mesh.barycentric, {"combined": values}
    )


def linear(x):
    """A light that linear elements show exactly."""
    return np.stack([1 + x[..., 0], 2 + 3 * x[..., 1], 4 - x[..., 2] + x[..., 0]], axis=-1)


def test_points_lie_on_the_surface_evenly_by_area(scene):
    points = scatter(scene, 400, seed=3)
    # One point in each 400th of the area, so 3 of 4 on the first quad, to within the one that falls on its end.
    assert abs(np.count_nonzero(points.receiver == 0) - 300) <= 1
    own = points.receiver == 0
    assert np.allclose(points.position[own][:, 2], 0.0)
    assert np.allclose(points.normal[own], (0, 0, 1))
    assert np.allclose(points.position[~own][:, 1], 0.0)
    # Even over the quad: the mean of n uniform numbers in 0..3 strays by 3 / sqrt(12 n), 5 of which are 0.25.
    assert points.position[own][:, 0].mean() == pytest.approx(1.5, abs=0.25)
    corners = scene.receivers()[0].vertices[scene.receivers()[0].triangles[points.triangle[own]]]
    assert np.allclose(np.einsum("pc,pck->pk", points.barycentric[own], corners), points.position[own])


def test_points_of_smooth_objects_have_the_smooth_normal(build):
    ball = build.sphere(level=2, smooth=True)
    points = scatter(Scene((ball,), (build.grey,)), 300, seed=1)
    outward = points.position / np.linalg.norm(points.position, axis=1, keepdims=True)
    assert np.allclose(np.linalg.norm(points.shading, axis=1), 1.0)
    # Interpolated from exact normals at the corners of triangles of 0.39: off by at most (0.39 / 2)^2 / 2 = 0.019.
    assert np.abs(points.shading - outward).max() < 0.019
    assert np.abs(points.normal - outward).max() > 0.05


@pytest.mark.parametrize("edge", [5.0, 0.4, 0.03])
def test_linear_light_is_found_exactly_on_any_mesh(scene, edge):
    points = scatter(scene, 500, seed=5)
    # A bake may give its objects back in an order of its own.
    objects = [baked(receiver, edge, linear) for receiver in reversed(scene.receivers())]
    # Corner values are single precision.
    assert np.allclose(radiance_at(objects, points), linear(points.position), rtol=1e-6)


def test_points_are_found_in_an_uneven_mesh(scene):
    receiver = scene.receivers()[0]
    mesh = triform(whole(receiver.vertices, receiver.triangles), 0.5)
    for _ in range(5):
        near = np.linalg.norm(mesh.vertices[mesh.triangles].mean(axis=1) - (1, 0.3, 0), axis=1) < 0.1
        mesh = split_triangles(mesh, near)[0]
    uneven = BakedObject("big", mesh.vertices, mesh.triangles, mesh.parent, mesh.barycentric, {})
    points = scatter(scene, 2000, seed=2)
    own = points.receiver == 0
    element, weights = locate(uneven, points.triangle[own], points.barycentric[own])
    found = np.einsum("pc,pck->pk", weights, mesh.vertices[mesh.triangles[element]])
    assert np.allclose(found, points.position[own])
    assert weights.min() > -1e-9


def noisy(truth, sigma, rng):
    return truth[:, None] + rng.normal(0.0, sigma, (len(truth), 3, 3))


def test_errors_of_a_known_kind_are_found_through_noise():
    rng = np.random.default_rng(1)
    count, error, sigma = 20_000, 0.1, 0.5
    truth = np.full((count, 3), 2.0)
    found = figures(truth + error * rng.choice([-1.0, 1.0], (count, 3)), noisy(truth, sigma, rng))
    # A mean of count * 3 * 3 products, each with a deviation of at most sigma^2 + 2 sigma error = 0.35: 8e-4 of 0.01.
    assert found.surface == pytest.approx(error / 2.0, rel=4 * 8e-4 / 0.01 / 2)
    assert abs(found.surface - error / 2.0) < 4 * found.uncertainty
    # The errors are alike everywhere, so leaving the worst out changes nothing.
    assert found.typical == pytest.approx(error / 2.0, rel=4 * 8e-4 / 0.01 / 2)
    assert found.bias == pytest.approx(0.0, abs=4 * (error + sigma) / 2.0 / np.sqrt(3 * count))


def test_without_error_only_noise_is_left_and_it_is_told():
    rng = np.random.default_rng(2)
    truth = np.full((5000, 3), 2.0)
    reference = noisy(truth, 0.5, rng)
    found = figures(truth, reference)
    assert found.surface <= 4 * max(found.uncertainty, 1e-9) + 1e-9
    assert found.uncertainty < 0.1
    # The mean of three estimates has a third of their variance.
    assert reference_noise(reference) == pytest.approx(0.5 / np.sqrt(3) / 2.0, rel=0.02)
    # Squares would have made the noise an error of 14 %.
    assert abs(squared_errors(truth, reference).mean()) < 0.1 * 0.25 / 3


def test_the_worst_points_count_in_one_figure_only():
    truth = np.ones((1000, 3))
    values = truth.copy()
    values[: int(WORST * 1000)] += 3.0
    values[-1] += 0.5
    found = figures(values, np.repeat(truth[:, None], 3, axis=1))
    assert found.surface == pytest.approx(np.sqrt((20 * 9.0 + 0.25) / 1000))
    assert found.typical == pytest.approx(np.sqrt(0.25 / 980))
    assert found.bias == pytest.approx((60 + 0.5) / 1000)


def test_a_black_reference_is_refused():
    with pytest.raises(SceneError, match="black"):
        figures(np.zeros((5, 3)), np.zeros((5, 3, 3)))


def test_what_reflects_and_has_no_light_is_inside_a_solid(scene):
    points = scatter(scene, 40, seed=0)
    reference = np.zeros((40, 3, 3))
    reference[:10, 1, 2] = 1e-9
    seen = visible(scene, points, reference)
    # Anything at all is light; and nobody expects any of a black surface.
    assert seen[:10].all()
    assert not seen[10:30].any()
    assert seen[points.receiver == 1].all()
