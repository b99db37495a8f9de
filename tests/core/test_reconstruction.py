"""Least squares onto vertices: what lies in the space of linear elements comes back exactly, and energy is kept."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from radiosity_baker.core import reconstruction
from radiosity_baker.core.accuracy import ALPHAS
from radiosity_baker.core.patches import unit_space
from radiosity_baker.core.receivers import make_receivers
from radiosity_baker.core.reconstruction import (
    Fit,
    Pattern,
    Samples,
    SparseMatrix,
    conjugate_gradients,
    gradient_jumps,
)
from radiosity_baker.core.sampling import triangle_points
from radiosity_baker.core.scene import Scene
from radiosity_baker.core.settings import Settings


@pytest.fixture
def exactly(monkeypatch):
    """Solve to rounding, so that what is tested is the fit."""
    monkeypatch.setattr(reconstruction, "_TOLERANCE", 1e-13)
    monkeypatch.setattr(reconstruction, "_MAXIMUM_ITERATIONS", 2000)


@pytest.fixture(scope="module")
def floor(build):
    return receive(build, build.quad(u=(2, 0, 0)), size=0.3)


def receive(build, *objects, **asked):
    scene = Scene(objects, (build.grey,))
    settings = Settings(**asked)
    return make_receivers(scene, unit_space(scene), settings, settings.triangles)


def sample(receivers, function, passes=6, valid=None, seed=0) -> Samples:
    """Samples of function(points) -> (c, k) at random points of each cell."""
    rng = np.random.default_rng(seed)
    cells = receivers.cells
    valid = np.ones(len(cells), dtype=bool) if valid is None else valid
    samples = None
    for _ in range(passes):
        weights = triangle_points(rng.random((len(cells), 2)))
        values = function(np.einsum("nc,nck->nk", weights, cells.corners))
        samples = samples or Samples(len(cells), values.shape[1])
        inside = weights if cells.barycentric is None else np.einsum("nc,nck->nk", weights, cells.barycentric)
        samples.add(slice(None), inside, values, np.zeros_like(values), valid)
    return samples


def fit_of(receivers, count) -> Fit:
    return Fit(receivers, count, np.zeros(len(count), dtype=bool))


def at_vertices(receivers, function) -> np.ndarray:
    values = np.zeros((receivers.vertices, function(np.zeros((1, 3))).shape[1]))
    values[receivers.corner_vertex] = function(receivers.element_corners.reshape(-1, 3)).reshape(
        *receivers.corner_vertex.shape, -1
    )
    return values


def slope(points):
    """Two linear functions."""
    return points @ np.array([[1.0, 0.3], [-2.0, 0.1], [0.0, 5.0]]) + [3.0, 0.0]


def constant(points):
    return np.full((len(points), 2), [4.0, 0.125])


@pytest.mark.usefixtures("exactly")
@pytest.mark.parametrize("alpha", [0.0, *ALPHAS, 1e3])
@pytest.mark.parametrize("tessellate", [True, False])
def test_linear_light_is_reproduced_whatever_the_smoothing(build, alpha, tessellate):
    receivers = receive(build, build.quad(u=(2, 0, 0)), size=0.3, tessellate=tessellate)
    samples = sample(receivers, slope)
    fit = fit_of(receivers, samples.count)
    solved = fit.solve(fit.system(samples), alpha)
    assert solved == pytest.approx(at_vertices(receivers, slope), abs=1e-7)
    assert samples.squared_residual(fit.at_corners(solved)).max() < 1e-12


@pytest.mark.usefixtures("exactly")
@pytest.mark.parametrize("alpha", ALPHAS)
def test_constants_are_kept_on_every_surface(build, alpha):
    receivers = receive(build, build.box(), build.sphere(level=2, smooth=True), size=0.5)
    samples = sample(receivers, constant)
    fit = fit_of(receivers, samples.count)
    assert fit.solve(fit.system(samples), alpha) == pytest.approx(constant(np.zeros((receivers.vertices, 3))))


def noise(points):
    return np.random.default_rng(len(points)).exponential(size=(len(points), 2)) * (1 + np.sin(9 * points[:, :1]))


@pytest.mark.usefixtures("exactly")
@pytest.mark.parametrize("alpha", ALPHAS)
def test_the_mean_of_the_samples_is_kept(floor, alpha):
    """Constants jump nowhere, so 1'(M + alpha R) = 1'M and the sum of M x is that of b: what the interpolated light is
    at the sample points, weighted by the cells' areas, is on average what the samples are."""
    samples = sample(floor, noise)
    fit = fit_of(floor, samples.count)
    system = fit.system(samples)
    weight = floor.cells.area / samples.count
    sampled = np.einsum("c,cik->k", weight, samples.light)
    # For corner values x the sum over samples of the interpolated value is sum_i (sum of weights_i) x_i.
    moments = samples.moments
    weights = moments[:, :3] + moments[:, [3, 3, 4]] + moments[:, [4, 5, 5]]
    shown = np.einsum("c,ci,cik->k", weight, weights, fit.at_corners(fit.solve(system, alpha)))
    assert shown == pytest.approx(sampled, rel=1e-9)


@pytest.mark.usefixtures("exactly")
def test_without_smoothing_no_other_values_are_nearer_to_the_samples(floor):
    samples = sample(floor, noise)
    fit = fit_of(floor, samples.count)
    best = fit.solve(fit.system(samples), 0.0)
    area = floor.cells.area

    def distance(values):
        return area @ samples.squared_residual(fit.at_corners(values)).sum(axis=1)

    rng = np.random.default_rng(6)
    for _ in range(20):
        assert distance(best) < distance(best + 0.01 * rng.normal(size=best.shape))


@pytest.mark.usefixtures("exactly")
def test_more_smoothing_jumps_less(floor):
    samples = sample(floor, noise)
    fit = fit_of(floor, samples.count)
    vertex, jump, weight = gradient_jumps(floor, fit.measured)
    system = fit.system(samples)

    def roughness(alpha):
        values = fit.solve(system, alpha)
        return (weight[:, None] * np.einsum("ei,eik->ek", jump, values[vertex]) ** 2).sum()

    rough = [roughness(alpha) for alpha in (0.0, *ALPHAS)]
    assert (np.diff(rough) < 0).all()


def test_linear_functions_do_not_jump_and_tents_do(floor):
    vertex, jump, weight = gradient_jumps(floor, np.ones(floor.vertices, dtype=bool))
    assert weight.min() > 0
    assert np.einsum("ei,eik->ek", jump, at_vertices(floor, slope)[vertex]) == pytest.approx(0.0, abs=1e-12)
    tent = np.zeros(floor.vertices)
    tent[0] = 1.0
    jumps = np.einsum("ei,ei->e", jump, tent[vertex])
    assert (np.abs(jumps) > 1e-9).any()
    assert (jumps[~(vertex == 0).any(axis=1)] == 0).all()


def test_light_does_not_bleed_over_hard_edges(build):
    """A box lit on its top only has dark walls, to the last vertex."""
    receivers = receive(build, build.box(), size=0.3)
    top = receivers.cells.normals[:, 2] > 0.5

    def light(points):
        return np.where(top[:, None], 7.0, 0.0) * np.ones((len(points), 1))

    samples = sample(receivers, light)
    fit = fit_of(receivers, samples.count)
    shown = fit.at_corners(fit.solve(fit.system(samples), 1.0))
    assert shown[top] == pytest.approx(7.0, rel=1e-3)
    assert np.abs(shown[~top]).max() == 0


def test_vertices_without_a_sample_are_filled_from_their_neighbours(floor):
    """The hole takes values between the lowest and the highest around it."""
    valid = np.linalg.norm(floor.cells.corners.mean(axis=1) - [0.1, 0.0, 0], axis=1) > 0.45
    samples = sample(floor, lambda points: 5.0 + 0.5 * slope(points), valid=valid)
    fit = fit_of(floor, samples.count)
    filled = fit.fill(fit.solve(fit.system(samples), 0.05))
    assert 0 < np.count_nonzero(~fit.measured) < floor.vertices
    known = filled[fit.measured]
    assert (filled >= known.min(axis=0) - 1e-9).all()
    assert (filled <= known.max(axis=0) + 1e-9).all()


def test_a_filled_vertex_is_the_mean_of_its_neighbours(build):
    """A hexagon's centre, unmeasured."""
    angle = np.arange(6) * np.pi / 3
    rim = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    fan = build.triangles("fan", [(0, 0, 0), *rim], [(0, k + 1, (k + 1) % 6 + 1) for k in range(6)])
    receivers = receive(build, fan, size=10.0)
    fit = fit_of(receivers, np.ones(6))
    centre = receivers.corner_vertex[0, 0]
    fit.measured = np.arange(7) != centre
    values = np.arange(7.0)[:, None].copy()
    assert fit.fill(values)[centre, 0] == pytest.approx(np.delete(np.arange(7.0), centre).mean())


def test_invalid_samples_count_for_nothing(floor):
    valid = np.arange(len(floor.cells)) % 2 == 0
    good = sample(floor, slope, valid=valid)
    mixed = sample(floor, lambda points: np.where(valid[:, None], slope(points), 1e6), valid=valid)
    for name in vars(good):
        assert (getattr(good, name) == getattr(mixed, name)).all()


def test_residuals_are_mean_squared_differences(floor):
    """Against the definition, sample by sample."""
    rng = np.random.default_rng(7)
    count = len(floor.cells)
    corners = rng.normal(size=(count, 3, 2))
    samples, total = Samples(count, 2), np.zeros((count, 2))
    for _ in range(5):
        weights, values = triangle_points(rng.random((count, 2))), rng.normal(size=(count, 2))
        samples.add(slice(None), weights, values, np.zeros_like(values), np.ones(count, dtype=bool))
        total += (values - np.einsum("ci,cik->ck", weights, corners)) ** 2
    assert samples.squared_residual(corners) == pytest.approx(total / 5, abs=1e-12)


def test_halves_of_the_samples_add_up_to_all(floor):
    one, two = sample(floor, slope, seed=1), sample(floor, noise, seed=2)
    both = one + two
    for name in vars(both):
        assert (getattr(both, name) == getattr(one, name) + getattr(two, name)).all()
    alone = both.channel(1)
    assert (alone.light[..., 0] == both.light[..., 1]).all()
    assert alone.squares.shape == (len(floor.cells), 1)


def test_samples_go_to_the_cells_they_are_meant_for(floor):
    samples = Samples(len(floor.cells), 1)
    ones = np.ones((2, 1))
    samples.add(np.array([3, 5]), np.full((2, 3), 1 / 3), ones, 0.25 * ones, np.ones(2, dtype=bool))
    assert np.flatnonzero(samples.count).tolist() == [3, 5]
    assert samples.light[3].tolist() == [[1 / 3]] * 3
    assert samples.noise[5].tolist() == [0.25]


def random_system(seed: int, count: int, crowded: bool) -> np.ndarray:
    """Symmetric positive definite, sparse, with one row that is full if crowded, and one without weight."""
    rng = np.random.default_rng(seed)
    matrix = rng.normal(size=(count, count)) * (rng.random((count, count)) < 0.1)
    if crowded:
        matrix[count // 2] = rng.normal(size=count)
    matrix = matrix + matrix.T
    matrix += np.diag(np.abs(matrix).sum(axis=1) + 0.1)
    matrix[-1] = matrix[:, -1] = 0
    return matrix


def sparse(matrix: np.ndarray) -> SparseMatrix:
    rows, columns = np.nonzero(matrix)
    pattern = Pattern(len(matrix), rows, columns)
    return pattern.matrix(pattern.total(matrix[rows, columns]))


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10**6), st.integers(2, 120), st.booleans())
def test_the_padded_matrix_is_the_dense_one(seed, count, crowded):
    """Rows wider than what is kept in line included."""
    matrix = random_system(seed, count, crowded)
    x = np.random.default_rng(seed).normal(size=(count, 3))
    assert sparse(matrix) @ x == pytest.approx(matrix @ x, abs=1e-10)
    assert sparse(matrix).diagonal == pytest.approx(np.diag(matrix))


def test_entries_of_one_place_add_up():
    pattern = Pattern(2, np.array([0, 0, 1]), np.array([1, 1, 0]))
    assert (pattern.matrix(pattern.total(np.array([1.0, 2.0, 5.0]))) @ np.eye(2)).tolist() == [[0, 3], [5, 0]]


@pytest.mark.usefixtures("exactly")
@pytest.mark.parametrize("crowded", [False, True])
def test_conjugate_gradients_agree_with_elimination(crowded):
    matrix = random_system(8, 60, crowded)
    target = np.random.default_rng(9).normal(size=(60, 4))
    target[-1] = 0
    start = np.full((60, 4), 0.5)
    solved = conjugate_gradients(sparse(matrix), target, start)
    assert solved[:-1] == pytest.approx(np.linalg.solve(matrix[:-1, :-1], target[:-1]), abs=1e-9)
    assert (solved[-1] == 0.5).all(), "a row without weight keeps its start"


def test_conjugate_gradients_stop_at_their_tolerance():
    """The energy of the scaled residual, relative to that of the target, is below the square of the tolerance."""
    matrix = random_system(10, 60, crowded=False)[:-1, :-1]
    target = np.random.default_rng(9).normal(size=(59, 1))
    residual = target - matrix @ conjugate_gradients(sparse(matrix), target, np.zeros((59, 1)))
    scale = 1 / np.diag(matrix)
    assert (scale @ residual**2)[0] <= reconstruction._TOLERANCE**2 * (scale @ target**2)[0] * (1 + 1e-6)
