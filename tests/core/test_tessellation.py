"""Triform: no cracks, nothing lost, and edges as short as asked."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from radiosity_baker.core.patches import triangle_geometry
from radiosity_baker.core.shapes import box
from radiosity_baker.core.tessellation import (
    Tessellation,
    edge_for_count,
    predicted_count,
    split_triangles,
    triform,
    whole,
)

#: Each of at most 24 passes rounds a midpoint once, by half a unit in the last place of a coordinate about 1.
ROUNDING = 24 * 2.0**-53


def edges(mesh: Tessellation) -> np.ndarray:
    """(t, 3) lengths."""
    corners = mesh.vertices[mesh.triangles]
    return np.linalg.norm(corners[:, [1, 2, 0]] - corners, axis=2)


def areas(mesh: Tessellation) -> np.ndarray:
    return triangle_geometry(mesh.vertices[mesh.triangles])[1]


def is_closed(triangles: np.ndarray) -> bool:
    """Every edge is used once in either direction: nothing is open, and no vertex stands on a neighbour's edge."""
    one_way = np.stack([triangles, triangles[:, [1, 2, 0]]], axis=2).reshape(-1, 2)
    forth, back = ({tuple(edge) for edge in way.tolist()} for way in (one_way, one_way[:, ::-1]))
    return len(forth) == len(one_way) and forth == back


@pytest.fixture(scope="module")
def closed(build):
    """Closed meshes whose edges differ in length."""
    long_box = build.box(high=(1, 0.07, 0.3))
    ball = build.sphere(level=1)
    return [whole(long_box.vertices, long_box.triangles), whole(ball.vertices * [1, 0.2, 0.5], ball.triangles)]


@pytest.mark.parametrize("size", [0.05, 0.11, 0.4])
def test_triform_leaves_no_crack_and_shares_midpoints(closed, size):
    for mesh in closed:
        finer = triform(mesh, size)
        assert is_closed(finer.triangles)
        # Euler's formula, V - E + F = 2 with E = 3 F / 2, fails if a midpoint exists twice or is not used.
        assert len(finer.vertices) == 2 + len(finer.triangles) // 2
        assert len(np.unique(finer.vertices, axis=0)) == len(finer.vertices)


@pytest.mark.parametrize("size", [0.05, 0.11, 0.4])
def test_triform_meets_the_longest_edge_and_stops_there(closed, size):
    for mesh in closed:
        finer = triform(mesh, size)
        assert edges(finer).max() <= size
        assert triform(mesh, edges(mesh).max()) is mesh
        assert triform(finer, size) is finer


def test_triform_keeps_the_input_and_says_where_each_piece_lies(closed):
    for mesh in closed:
        finer = triform(mesh, 0.05)
        assert finer.vertices[: len(mesh.vertices)].tobytes() == mesh.vertices.tobytes()
        assert (np.diff(finer.parent) >= 0).all()
        told = finer.barycentric @ mesh.vertices[mesh.triangles][finer.parent]
        assert np.abs(told - finer.vertices[finer.triangles]).max() <= ROUNDING
        assert np.bincount(finer.parent, areas(finer)) == pytest.approx(areas(mesh), rel=1e-12)
        assert (np.einsum("tk,tk->t", normals(finer), normals(mesh)[finer.parent]) > 0).all()


def normals(mesh: Tessellation) -> np.ndarray:
    return triangle_geometry(mesh.vertices[mesh.triangles])[0]


def test_an_equal_triangle_becomes_four_alike():
    mesh = whole(np.array([[0, 0, 0], [1, 0, 0], [0.5, np.sqrt(0.75), 0]]), np.array([[0, 1, 2]], dtype=np.int32))
    finer = triform(mesh, 0.5 * (1 + 1e-9))
    assert len(finer.triangles) == 4
    assert edges(finer) == pytest.approx(0.5)
    assert (finer.parent == 0).all()


@pytest.mark.parametrize("share", [0.02, 0.2, 0.7])
def test_splitting_chosen_triangles_leaves_no_crack(closed, share):
    for mesh in closed:
        mesh = triform(mesh, 0.1)  # noqa: PLW2901 - the same mesh, finer
        chosen = np.random.default_rng(int(100 * share)).random(len(mesh.triangles)) < share
        finer, source = split_triangles(mesh, chosen)
        assert is_closed(finer.triangles)
        a, b, c = mesh.vertices[mesh.triangles].transpose(1, 0, 2)
        sides = np.linalg.norm([b - a, c - b, a - c], axis=2)
        stout = chosen & (sides.min(axis=0) >= 0.5 * sides.max(axis=0))
        assert (np.bincount(source)[stout] == 4).all()
        assert (np.bincount(source)[chosen] >= 3).all()
        assert (np.bincount(source) <= 4).all()
        assert (mesh.parent[source] == finer.parent).all()
        assert np.bincount(source, areas(finer)) == pytest.approx(areas(mesh), rel=1e-12)
        assert finer.vertices[: len(mesh.vertices)].tobytes() == mesh.vertices.tobytes()


def test_only_neighbours_of_the_chosen_are_split(build):
    ball = build.sphere(level=3)
    mesh = whole(ball.vertices, ball.triangles)
    chosen = np.zeros(len(mesh.triangles), dtype=bool)
    chosen[100] = True
    _, source = split_triangles(mesh, chosen)
    children = np.bincount(source)
    assert children[100] == 4
    assert np.count_nonzero(children == 2) == 3
    assert np.count_nonzero(children == 1) == len(children) - 4


def test_a_sliver_is_split_along_its_length_alone(build):
    """Ten times as long as it is wide, and so are its pieces if it is cut across as well."""
    strip = build.quad(u=(10, 0, 0), v=(0, 1, 0))
    finer, source = split_triangles(whole(strip.vertices, strip.triangles), np.ones(2, dtype=bool))
    assert np.bincount(source).tolist() == [3, 3]
    assert edges(finer).max() < 5.2
    assert areas(finer) == pytest.approx([2.5, 2.5, 1.25] * 2, abs=1.3)
    assert areas(finer).sum() == pytest.approx(10.0)


def test_choosing_none_changes_nothing(closed):
    finer, source = split_triangles(closed[0], np.zeros(12, dtype=bool))
    assert finer.triangles.tolist() == closed[0].triangles.tolist()
    assert source.tolist() == list(range(12))


coordinate = st.floats(-1, 1, allow_subnormal=False)
corners = st.lists(st.tuples(coordinate, coordinate, coordinate), min_size=3, max_size=3)


@settings(max_examples=100, deadline=None)
@given(corners, st.sampled_from([1.0, 1e-3, 1e-6]), st.integers(1, 40))
def test_any_triangle_even_a_needle_is_split_whole(points, thickness, pieces):
    mesh = whole(np.array(points) * [1, thickness, thickness], np.array([[0, 1, 2]], dtype=np.int32))
    longest = edges(mesh).max()
    finer = triform(mesh, longest / pieces)
    assert edges(finer).max() <= longest / pieces * (1 + 1e-12) or longest == 0
    assert areas(finer).sum() == pytest.approx(areas(mesh).sum(), rel=1e-9, abs=1e-15)
    told = finer.barycentric @ mesh.vertices[mesh.triangles][finer.parent]
    assert np.abs(told - finer.vertices[finer.triangles]).max() <= ROUNDING


@pytest.mark.parametrize("wanted", [100, 1000, 3000, 10_000, 31_000])
def test_edge_for_count_meets_the_count_within_a_factor_of_two(build, wanted):
    objects = [build.box(), build.sphere(level=1), build.quad(u=(3, 0, 0))]
    vertices, triangles = [o.vertices for o in objects], [o.triangles for o in objects]
    size = edge_for_count(vertices, triangles, wanted)
    made = sum(len(triform(whole(v, t), size).triangles) for v, t in zip(vertices, triangles, strict=True))
    assert wanted / 2 <= made <= wanted * 2


def test_the_predicted_count_is_exact_for_triform_of_equal_triangles(build):
    ball = build.sphere(level=0)
    for size in (0.8, 0.4, 0.2):
        made = len(triform(whole(ball.vertices, ball.triangles), size).triangles)
        assert predicted_count([ball.vertices], [ball.triangles], size) == made


def test_a_mesh_denser_than_wanted_is_left_alone(build):
    ball = build.sphere(level=4)
    size = edge_for_count([ball.vertices], [ball.triangles], 100)
    assert len(triform(whole(ball.vertices, ball.triangles), size).triangles) == len(ball.triangles)


def test_a_vertex_astray_does_not_take_all_memory():
    """A box of which one corner lies 1e20 times its size away, as broken files have it: a few times as many triangles
    as asked for. Seen to fail: an edge by the area alone, at which needles split without end."""
    body = box("box")
    vertices = np.array(body.vertices, dtype=float)
    vertices[0] = (1e20, 0.0, 0.0)
    edge = edge_for_count([vertices], [body.triangles], 500)
    assert predicted_count([vertices], [body.triangles], edge) <= 2000
