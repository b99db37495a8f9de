"""The analytic estimator in scenes: closed rooms, blockers, backs, culling, threads."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_baker.core.form_factors.analytic import analytic_rows, unoccluded_exchange
from radiosity_baker.core.form_factors.contour import exchange_area
from radiosity_baker.core.form_factors.pairs import Estimate, Faces
from radiosity_baker.core.form_factors.polygon import polygon_irradiance
from radiosity_baker.core.form_factors.rows import balance, symmetric_exchange
from radiosity_baker.core.parallel import Workers
from radiosity_baker.core.patches import make_patches, split_objects, triangle_geometry, unit_space
from radiosity_baker.core.progress import Progress
from radiosity_baker.core.sampling import triangle_points
from radiosity_baker.core.scene import Scene, SceneObject, Surface
from radiosity_baker.core.visibility import Visibility

CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
QUADS = [(0, 2, 6, 4), (1, 5, 7, 3), (0, 4, 5, 1), (2, 3, 7, 6), (0, 1, 3, 2), (4, 6, 7, 5)]
#: The faces of the unit cube, turned inward.
INWARD = np.array([[a, c, b] for a, b, c, _ in QUADS] + [[a, d, c] for a, _, c, d in QUADS], dtype=np.int32)


def mesh(name: str, vertices: np.ndarray, triangles: np.ndarray, surface: int = 0) -> SceneObject:
    return SceneObject(name, vertices, triangles, np.full(len(triangles), surface, dtype=np.int32))


def room() -> SceneObject:
    return mesh("room", CORNERS, INWARD)


def box() -> SceneObject:
    """A block that floats in the room."""
    return mesh("box", CORNERS * 0.3 + 0.2, np.ascontiguousarray(INWARD[:, ::-1]))


def square(name: str, size: float, z: float, surface: int, *, up: bool) -> SceneObject:
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * size / 2 + (0, 0, z)
    turned = corners if up else corners[::-1]
    return mesh(name, np.ascontiguousarray(turned), np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32), surface)


def estimate(*objects: SceneObject, wanted: int, threshold: float = 0.0, threads: int = 1, seed: int = 1) -> Estimate:
    """Surfaces 0, 1, 2 have the red albedos 0, 0.25, 0.5, by which the patches are told apart."""
    scene = Scene(objects, tuple(Surface(f"s{k}", (k / 4, 0.5, 0.5)) for k in range(3)))
    patches = make_patches(scene, unit_space(scene), split_objects(scene, wanted))
    with Workers(threads, Progress()) as workers:
        return analytic_rows(
            patches, Visibility(patches.corners), workers, threshold=threshold, seed=seed, purpose="test"
        )


def exchanged(found: Estimate, first: int, second: int) -> float:
    """Sum of A_i F_ij from the sides of one surface to those of another."""
    red = found.sides.albedo[:, 0]
    return float((found.sides.area * found.rows.apply((red == second / 4).astype(float)))[red == first / 4].sum())


def test_near_pairs_agree_with_lambert_over_a_fine_grid() -> None:
    """60 random pairs, at any distance, some of which cut each other's planes or each other.

    4,096 midpoints of the first triangle. Where the second touches or cuts it, the light jumps from one point to the
    next: a strip 1/64 of the triangle wide, which holds about 0.4 / 64 of an area of 0.3 and is half right, errs 1e-3.
    """
    rng = np.random.default_rng(7)
    corners = rng.uniform(-1, 1, (120, 3, 3)) / 2
    corners[60:] += rng.uniform(-1, 1, (60, 1, 3)) * np.linspace(0, 2, 60)[:, None, None]
    normals, area = triangle_geometry(corners)
    centroid = corners.mean(axis=1)
    radius = np.linalg.norm(corners - centroid[:, None], axis=2).max(axis=1)
    faces = Faces(corners, normals, area, centroid, radius, np.arange(120))
    first, second = np.arange(60), np.arange(60, 120)
    steps = (np.arange(64) + 0.5) / 64
    grid = triangle_points(np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2))
    shed = polygon_irradiance(grid @ corners[first], normals[first, None], corners[second, None])
    found = unoccluded_exchange(faces, first, second)
    assert (found > 1e-4).sum() > 20
    assert found == pytest.approx(area[first] * shed.mean(axis=1), rel=2e-3, abs=1e-3)
    assert unoccluded_exchange(faces, second, first) == pytest.approx(found, abs=1e-12)


def test_every_distance_has_a_rule_that_holds() -> None:
    """Pairs face to face, from a hundredth of a radius apart to a hundred: within 5e-3 of the contour integral, three
    times the root mean square error of the rules at their limits."""
    rng = np.random.default_rng(11)
    angle = rng.uniform(0, 2 * np.pi, (400, 1)) + np.array([0, 2.0, 4.2])
    corners = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
    corners[200:] = corners[200:, ::-1]
    corners[200:, :, 2] += np.geomspace(0.01, 100, 200)[:, None] * (1 + 0.3 * rng.random((200, 3)))
    normals, area = triangle_geometry(corners)
    centroid = corners.mean(axis=1)
    radius = np.linalg.norm(corners - centroid[:, None], axis=2).max(axis=1)
    faces = Faces(corners, normals, area, centroid, radius, np.arange(400))
    found = unoccluded_exchange(faces, np.arange(200), np.arange(200, 400))
    assert found == pytest.approx(exchange_area(corners[:200], corners[200:]), rel=5e-3)


@pytest.mark.parametrize("wanted", [12, 192])
def test_rows_of_a_closed_cube_sum_to_one(wanted: int) -> None:
    found = estimate(room(), wanted=wanted)
    assert len(found.sides.side) == len(found.sides.patches)
    assert found.rows.row_sums() == pytest.approx(1.0, abs=1e-4)
    assert found.opening.share.max() == 0.0


@pytest.mark.parametrize("albedo", [0.5, 0.9, 0.99])
@pytest.mark.parametrize("wanted", [12, 192])
def test_furnace(albedo: float, wanted: int) -> None:
    """Every side emits 1, so every radiosity is 1/(1 - albedo)."""
    found = estimate(room(), wanted=wanted)
    count, area = len(found.rows), found.sides.area
    balanced = balance(symmetric_exchange(found.rows, area), area * (1 - found.opening.share))
    factors = np.zeros((count, count))
    factors[balanced.owners(), balanced.columns] = balanced.weights / area[balanced.owners()]
    radiosity = np.linalg.solve(np.eye(count) - albedo * factors, np.ones(count))
    assert radiosity == pytest.approx(1 / (1 - albedo), rel=1e-3)


def test_is_reciprocal_without_balancing() -> None:
    found = estimate(room(), box(), wanted=200)
    count = len(found.rows)
    exchange = np.zeros((count, count))
    exchange[found.rows.owners(), found.rows.columns] = found.rows.weights
    exchange *= found.sides.area[:, None]
    assert exchange == pytest.approx(exchange.T, rel=1e-6)


def test_box_in_a_room_neither_loses_nor_gains_light() -> None:
    """Rows are 1 up to the sampled visibility: a pair that is half hidden and has 1 ray errs by half of itself,
    but a row has a hundred such pairs and the room hundreds of rows."""
    found = estimate(room(), box(), wanted=400)
    sums = found.rows.row_sums()
    assert np.average(sums, weights=found.sides.area) == pytest.approx(1.0, abs=0.01)
    assert np.abs(sums - 1).max() < 0.15
    assert found.opening.share.max() == 0.0


def test_a_wall_between_leaves_nothing() -> None:
    ground, lid = square("ground", 1, 0, 1, up=True), square("lid", 1, 1, 2, up=False)
    assert exchanged(estimate(ground, lid, wanted=60), 1, 2) > 0
    assert exchanged(estimate(ground, lid, square("wall", 9, 0.5, 0, up=True), wanted=200), 1, 2) == 0.0


def test_a_wall_half_way_over_half_of_it_takes_exactly_half() -> None:
    """Half way between two equal squares a way passes the wall's edge if x1 + x2 > 0, and half of them do.

    32 x 32 pairs of at least 4 rays: the standard error is under 0.5 / sqrt(4096), 1.6 % of the half.
    """
    ground, lid = square("ground", 1, 0, 1, up=True), square("lid", 1, 1, 2, up=False)
    corners = np.array([[0, -1, 0.5], [1, -1, 0.5], [1, 1, 0.5], [0, 1, 0.5]])
    wall = mesh("wall", corners, np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32))
    free, half = estimate(ground, lid, wanted=60), estimate(ground, lid, wall, wanted=200)
    ratio = half.sides.patches.space.metres**2 / free.sides.patches.space.metres**2
    assert exchanged(half, 1, 2) * ratio / exchanged(free, 1, 2) == pytest.approx(0.5, rel=0.07)


def test_a_blocker_smaller_than_a_patch_takes_its_fraction() -> None:
    """Against 400,000 random ways between the squares, of which about 10 % meet the blocker: 0.5 % standard error.

    8 x 8 pairs of 16 rays give an estimate sqrt(0.1 0.9 / 1024), 9.5 % of the fraction, at most; 16 seeds 2.4 %.
    """
    rng = np.random.default_rng(3)
    start, end = rng.uniform(-0.5, 0.5, (2, 400_000, 2))
    kernel = 1 / (1 + ((start - end) ** 2).sum(axis=1)) ** 2
    met = (np.abs(start + end) < 0.2).all(axis=1)
    expected = (kernel * met).sum() / kernel.sum()
    ground, lid = square("ground", 1, 0, 1, up=True), square("lid", 1, 1, 2, up=False)
    blocker = square("blocker", 0.2, 0.5, 0, up=True)
    free = exchanged(estimate(ground, lid, wanted=16), 1, 2)
    hidden = [1 - exchanged(estimate(ground, lid, blocker, wanted=16, seed=seed), 1, 2) / free for seed in range(16)]
    assert np.mean(hidden) == pytest.approx(expected, rel=0.1)
    assert np.std(hidden) < 0.15 * expected


def test_backs_take_part_where_light_reaches_them() -> None:
    """A sheet inside the room: its back sees the room as its front does."""
    sheet = mesh("sheet", CORNERS * 0.4 + 0.3, INWARD[[0, 6]], 1)
    found = estimate(room(), sheet, wanted=150)
    of_sheet = found.sides.albedo[:, 0] == 0.25
    assert found.sides.back[of_sheet].sum() == of_sheet.sum() / 2
    assert not found.sides.back[~of_sheet].any()
    assert found.rows.row_sums()[of_sheet] == pytest.approx(1.0, abs=0.02)


def test_culled_light_is_reported() -> None:
    """What the rows lose to the threshold in an empty room is what is reported, and it does not escape."""
    found = estimate(room(), wanted=200, threshold=5e-3)
    assert found.culled.max() > 0.05
    assert found.rows.row_sums() + found.culled == pytest.approx(1.0, abs=1e-4)
    assert found.opening.share.max() == 0.0


@pytest.mark.parametrize("threshold", [0.0, 5e-3])
def test_open_sky_escapes(threshold: float) -> None:
    """A lidless cube: every side's light goes to the others or out through the top, as a lid would have received it.

    Culled light does not count as escaped.
    """
    lid = np.flatnonzero((CORNERS[INWARD][:, :, 2] == 1).all(axis=1))
    found = estimate(mesh("cube", CORNERS, np.delete(INWARD, lid, axis=0)), wanted=100, threshold=threshold)
    front = ~found.sides.back
    assert (found.rows.row_sums() + found.opening.share + found.culled)[front] == pytest.approx(1.0, abs=1e-6)
    ground = front & (found.sides.patches.normals[found.sides.patch][:, 2] > 0.5)
    assert np.average(found.opening.share[ground], weights=found.sides.area[ground]) == pytest.approx(
        0.199824896, abs=1e-3
    )
    assert (found.culled.max() > 0.01) == (threshold > 0)


def test_threads_give_the_same_bytes() -> None:
    objects = room(), box()
    one, two = (estimate(*objects, wanted=300, threads=threads) for threads in (1, 2))
    assert one.rows.weights.tobytes() == two.rows.weights.tobytes()
    assert one.rows.columns.tobytes() == two.rows.columns.tobytes()


def test_faces_that_cross_at_their_centres():
    """As near as can be, and no distance between them (found by the fuzzer: divided by)."""
    corners = np.array([[-4, -1, 0], [4, -3, 0], [0, 4, 0]], dtype=float)  # and no rounding
    flat = mesh("flat", corners, np.array([[0, 1, 2]], dtype=np.int32))
    upright = mesh("upright", corners[:, [2, 0, 1]], np.array([[0, 1, 2]], dtype=np.int32), 1)
    found = estimate(flat, upright, wanted=2)
    assert np.isfinite(found.rows.weights).all()
    assert (found.rows.row_sums() <= 1).all()
