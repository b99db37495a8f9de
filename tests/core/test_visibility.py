"""Rays find what is first, end short of their target, and leak through nothing."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_baker.core import visibility
from radiosity_baker.core.sampling import triangle_points
from radiosity_baker.core.visibility import OFFSET, Visibility, indexed, offset_along


def single(*rows):
    return np.array(rows, dtype=np.float32)


def corners_of(*objects):
    return np.concatenate([o.vertices[o.triangles] for o in objects])


@pytest.fixture
def layers(build):
    """Three squares over each other, at z = 0, 0.5 and 1; triangles 0-1, 2-3, 4-5."""
    return Visibility(corners_of(*(build.quad(corner=(0, 0, z)) for z in (0, 0.5, 1))))


def test_the_first_triangle_on_the_way_is_met(layers):
    down, up = single([0, 0, -1]), single([0, 0, 1])
    assert layers.nearest(single([0.7, 0.2, 2]), down).tolist() == [4]
    assert layers.nearest(single([0.2, 0.7, 0.75]), down).tolist() == [3]
    assert layers.nearest(single([0.7, 0.2, 0.25]), up).tolist() == [2]
    assert layers.nearest(single([0.7, 0.2, 2]), up).tolist() == [-1]


def test_a_segment_is_blocked_by_what_is_between_its_ends_only(layers):
    origins = single([0.7, 0.2, 0.1], [0.7, 0.2, 0.1], [0.7, 0.2, 0.6], [2, 0.2, 0.1])
    targets = single([0.7, 0.2, 0.4], [0.7, 0.2, 0.6], [0.7, 0.2, 0.9], [2, 0.2, 5])
    assert layers.unblocked(origins, targets).tolist() == [True, False, True, True]


def test_a_target_on_a_surface_is_not_hidden_by_that_surface(layers):
    origins = single([0.7, 0.2, 0.1], [0.3, 0.2, 0.9])
    targets = single([0.3, 0.4, 0.5], [0.6, 0.1, 0.5])
    assert layers.unblocked(origins, targets).all()


def test_rays_do_not_run_into_the_surface_they_leave():
    """Any plane through the unit box, rounded to single precision: half an ulp of each corner and of the origin, less
    than six units in the last place together, tilted by at most the triangle's height; the offset is sixty."""
    rng = np.random.default_rng(3)
    corners = rng.uniform(-1, 1, (300, 3, 3))
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    normals /= length
    fat = length[:, 0] > 0.2
    for triangle, normal in zip(corners[fat], normals[fat], strict=True):
        weights = triangle_points(rng.random((200, 2)))
        directions = rng.normal(size=(200, 3))
        height = directions @ normal
        directions += (np.abs(height) - height)[:, None] * normal
        origins = offset_along(weights @ triangle, np.tile(normal, (200, 1)))
        assert (Visibility(triangle[None]).nearest(origins, directions.astype(np.float32)) == -1).all()


def test_the_offset_is_along_the_normal():
    moved = offset_along(np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]]))
    assert moved.dtype == np.float32
    assert moved[0].tolist() == [0, 0, pytest.approx(OFFSET)]


@pytest.mark.parametrize("level", [0, 3])
def test_a_closed_surface_leaks_nothing(build, level):
    """Half a million rays from everywhere inside, to everywhere."""
    ball = build.sphere(level=level)
    visibility = Visibility(corners_of(ball))
    rng = np.random.default_rng(4)
    origins = rng.uniform(-0.3, 0.3, (250_000, 3)).astype(np.float32)
    directions = rng.normal(size=origins.shape).astype(np.float32)
    assert visibility.nearest(origins, directions).min() >= 0


def test_two_scenes_do_not_share_triangles(build, layers):
    other = Visibility(corners_of(build.quad(corner=(5, 5, 5))))
    assert other.nearest(single([0.7, 0.2, 2]), single([0, 0, -1])).tolist() == [-1]
    assert layers.nearest(single([0.7, 0.2, 2]), single([0, 0, -1])).tolist() == [4]


def test_any_number_of_scenes_at_a_time(build):
    """Seen to fail: a device for each of them, of which a process can have 1,024: a crash. Found by 1,000 faults in a
    row, each of which held on to its bake."""
    square = corners_of(build.quad())
    scenes = [Visibility(square) for _ in range(1500)]
    down = single([0, 0, -1])
    assert all(scene.nearest(single([0.7, 0.2, 2]), down) >= 0 for scene in scenes)


def test_each_point_is_handed_over_once(build):
    corners = corners_of(build.box("box", (0, 0, 0), (1, 1, 1))).astype(np.float32)
    vertices, triangles = indexed(corners)
    assert (vertices.shape, triangles.shape) == ((8, 3), (12, 3))
    assert np.array_equal(vertices[triangles], corners)


def test_points_with_one_key_stay_apart(build, monkeypatch):
    """Light would go through what is left of triangles whose corners became one."""
    monkeypatch.setattr(visibility, "mixed", lambda points: np.zeros(len(points)))
    corners = corners_of(build.quad()).astype(np.float32)
    vertices, triangles = indexed(corners)
    assert np.array_equal(vertices[triangles], corners)
