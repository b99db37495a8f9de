"""The baseline does what it is known to do, wrong as it is."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_baker.core.form_factors.centroid import centroid_exchange, centroid_rows, quarters_share
from radiosity_baker.core.form_factors.pairs import Estimate, Faces
from radiosity_baker.core.parallel import Workers
from radiosity_baker.core.patches import make_patches, split_objects, unit_space
from radiosity_baker.core.progress import Progress
from radiosity_baker.core.scene import Scene, SceneObject, Surface
from radiosity_baker.core.visibility import Visibility

CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
QUADS = [(0, 2, 6, 4), (1, 5, 7, 3), (0, 4, 5, 1), (2, 3, 7, 6), (0, 1, 3, 2), (4, 6, 7, 5)]
INWARD = np.array([[a, c, b] for a, b, c, _ in QUADS] + [[a, d, c] for a, _, c, d in QUADS], dtype=np.int32)


def estimate(vertices: np.ndarray, triangles: np.ndarray, wanted: int) -> Estimate:
    surface = np.zeros(len(triangles), dtype=np.int32)
    scene = Scene((SceneObject("mesh", vertices, triangles, surface),), (Surface("grey"),))
    patches = make_patches(scene, unit_space(scene), split_objects(scene, wanted))
    with Workers(1, Progress()) as workers:
        return centroid_rows(patches, Visibility(patches.corners), workers, threshold=0.0, seed=0, purpose="test")


@pytest.mark.parametrize(("wanted", "expected"), [(12, -5.0), (48, -24.0)])
def test_radiosity_of_a_cube_at_albedo_0_9_is_absurd(wanted: int, expected: float) -> None:
    """It should be 10 everywhere. The lowest values are those of the design page, given there as rounded."""
    found = estimate(CORNERS, INWARD, wanted)
    count = len(found.rows)
    assert count == wanted
    factors = np.zeros((count, count))
    factors[found.rows.owners(), found.rows.columns] = found.rows.weights
    radiosity = np.linalg.solve(np.eye(count) - 0.9 * factors, np.ones(count))
    assert radiosity.min() == pytest.approx(expected, abs=0.5)


def test_two_small_triangles_face_to_face() -> None:
    """A_1 F = A_1 A_2 / (pi d^2) straight ahead: areas 1/2, distance 10, lengths in the unit box."""
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 10], [0, 1, 10], [1, 0, 10.0]])
    found = estimate(vertices, np.array([[0, 1, 2], [3, 4, 5]], dtype=np.int32), 2)
    row = found.rows.row_sums()
    assert row[:2] == pytest.approx(0.5 / (np.pi * 100), rel=1e-6)


def test_quarters_decide_the_visible_share() -> None:
    """Face to face, turned so that two of the four ways cross over; a wall from x = 0.125 stands in one of them."""
    corners = np.array(
        [
            [[0, 0, 0], [0.3, 0, 0], [0, 0.3, 0]],
            [[0, 0, 0.9], [0, 0.3, 0.9], [0.3, 0, 0.9]],
            [[0.125, -0.9, 0.4], [0.9, -0.9, 0.4], [0.125, 0.9, 0.4]],
        ]
    )
    faces = Faces(
        corners=corners[:2],
        normals=np.array([[0, 0, 1.0], [0, 0, -1.0]]),
        area=np.full(2, 0.045),
        centroid=corners[:2].mean(axis=1),
        radius=np.full(2, 0.3),
        side=np.arange(2),
    )
    for blockers, expected in ((corners, 0.75), (corners[:2], 1.0)):
        share, rays = quarters_share(
            faces, Visibility(blockers), np.array([0]), np.array([1]), np.random.default_rng(0)
        )
        assert share[0] == expected
        assert rays == 4


def test_patches_that_show_by_a_corner_get_no_more_than_without_anything_in_the_way() -> None:
    """Under a block they are a thirty-second of themselves, and what a quarter of them sees is more than that."""
    low, high = np.array([0.255, 0.26, 0.0]), np.array([0.745, 0.74, 0.5])
    vertices = np.concatenate([CORNERS, low + CORNERS * (high - low)])
    found = estimate(vertices, np.concatenate([INWARD, INWARD[:, ::-1] + 8]), 400)
    faces = Faces.of(found.sides)
    assert len(faces.area) == len(found.rows)
    assert found.sides.open_share.min() < 0.1
    p, q = found.rows.owners(), found.rows.columns
    face = np.empty(len(faces.area), dtype=np.int64)
    face[faces.side] = np.arange(len(faces.area))
    alone = centroid_exchange(faces, face[p], face[q]) / faces.area[face[p]]
    assert (found.rows.weights <= alone * (1 + 1e-5)).all()
