"""What shares a fit vertex and what does not, and where cells lie on the receivers."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_baker.core.patches import triangle_geometry, unit_space
from radiosity_baker.core.receivers import Receivers, fit_vertices, make_receivers, shared_edges, split_cells
from radiosity_baker.core.scene import Scene, Surface
from radiosity_baker.core.settings import Settings

SURFACES = (Surface("a"), Surface("b"))


def receive(*objects, **settings) -> Receivers:
    scene = Scene(objects, SURFACES)
    asked = Settings(**settings)
    return make_receivers(scene, unit_space(scene), asked, asked.triangles)


def flat_normals(vertices, triangles):
    return np.repeat(triangle_geometry(np.array(vertices, float)[triangles])[0][:, None], 3, axis=1)


def numbered(receiver) -> tuple[np.ndarray, int]:
    normals = flat_normals(receiver.vertices, receiver.triangles)
    return fit_vertices(receiver.triangles, normals, receiver.surface)


def test_coplanar_neighbours_share_their_vertices(build):
    assert numbered(build.quad())[1] == 4


def test_a_material_border_is_not_shared(build):
    assert numbered(build.quad(surface=[0, 1]))[1] == 6


def test_hard_edges_are_not_shared(build):
    """Four values on each of the six faces of a box."""
    number, count = numbered(build.box())
    assert count == 24
    assert all(len(np.unique(number[face : face + 2])) == 4 for face in range(0, 12, 2))


def test_smooth_edges_are_shared(build):
    ball = build.sphere(level=2, smooth=True)
    number, count = fit_vertices(ball.triangles, ball.corner_normals.astype(float), ball.surface)
    assert count == len(ball.vertices)
    # The same mesh vertex has the same fit vertex, wherever it is used.
    assert len(np.unique(np.column_stack([number.ravel(), ball.triangles.ravel()]), axis=0)) == count


def test_flat_shaded_balls_share_nothing(build):
    assert numbered(build.sphere(level=1))[1] == 3 * 32


@pytest.mark.parametrize("end", [0, 1])
def test_an_edge_that_is_smooth_at_one_end_only_is_hard(build, end):
    square = build.quad()
    normals = np.tile([0.0, 0, 1], (2, 3, 1))
    normals[1, end] = [0.6, 0, 0.8]  # triangle (0, 2, 3): its corner at an end of the common edge
    assert fit_vertices(square.triangles, normals, square.surface)[1] == 6


def test_normals_of_a_chain_may_turn_far_as_long_as_no_edge_does(build):
    """A fan whose normals lean four degrees more with each triangle is one smooth surface around its centre."""
    angle = np.radians(np.arange(20) * 4)
    rim = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(20)])
    fan = build.triangles("fan", [(0, 0, 0), *rim], [(0, k, k + 1) for k in range(1, 20)])
    lean = np.radians(4.0 * np.arange(19))
    normals = np.repeat(np.column_stack([np.sin(lean), 0 * lean, np.cos(lean)])[:, None], 3, axis=1)
    number, _ = fit_vertices(fan.triangles, normals, fan.surface)
    assert len(np.unique(number[:, 0])) == 1


def test_an_edge_of_three_triangles_is_not_shared(build):
    fin = build.triangles(
        "fin", [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1)], [(0, 1, 2), (1, 0, 3), (0, 1, 4)]
    )
    up = np.tile([0.0, 0, 1], (3, 3, 1))
    assert fit_vertices(fin.triangles, up, fin.surface)[1] == 9


def test_triangles_that_touch_in_one_vertex_do_not_share_it(build):
    bow = build.triangles("bow", [(0, 0, 0), (1, 0, 0), (1, 1, 0), (-1, 0, 0), (-1, -1, 0)], [(0, 1, 2), (0, 3, 4)])
    assert numbered(bow)[1] == 6


def test_shared_edges_name_the_same_vertices_from_both_sides(build):
    ball = build.sphere(level=2)
    here, there = shared_edges(ball.triangles)
    corner = ball.triangles.ravel()
    assert len(here) == 3 * len(ball.triangles) // 2
    assert (corner[here] == corner[there]).all()
    assert (here // 3 != there // 3).all()
    assert len(np.unique(np.sort(corner[here], axis=1), axis=0)) == len(here)


def test_shared_edges_of_neighbours_that_turn_the_same_way_or_not():
    """Triangle winding is not to be relied on: a flipped neighbour shares the edge all the same."""
    for faces in ([(0, 1, 2), (1, 0, 3)], [(0, 1, 2), (0, 1, 3)]):
        here, there = shared_edges(np.array(faces))
        assert len(here) == 1
        assert (np.ravel(faces)[here] == np.ravel(faces)[there]).all()


def test_open_edges_are_not_shared():
    here, there = shared_edges(np.array([[0, 1, 2]]))
    assert len(here) == len(there) == 0


def covers_its_elements(receivers: Receivers) -> bool:
    """Whether the cells' corners are where their barycentric coordinates say, and fill their elements."""
    cells = receivers.cells
    within = np.eye(3) if cells.barycentric is None else cells.barycentric
    told = within @ receivers.element_corners[cells.element]
    filled = np.bincount(cells.element, cells.area, len(receivers.element_corners))
    whole = triangle_geometry(receivers.element_corners)[1]
    return np.allclose(told, cells.corners, atol=1e-12) and np.allclose(filled, whole, rtol=1e-9)


@pytest.fixture(scope="module")
def two(build):
    return build.quad("floor", (5, 5, 5), (2, 0, 0), (0, 2, 0), surface=[0, 1]), build.sphere("ball", level=1)


def test_tessellated_output_is_what_is_sampled(two):
    receivers = receive(*two, size=0.3)
    assert covers_its_elements(receivers)
    assert (receivers.cells.element == np.arange(len(receivers.cells))).all()
    assert receivers.first.tolist() == [0, *np.cumsum([len(m.triangles) for m in receivers.meshes])]
    assert (receivers.cells.surface == receivers.element_surface).all()


def test_kept_triangles_are_sampled_in_fine_cells(two):
    receivers = receive(*two, size=0.3, tessellate=False)
    assert covers_its_elements(receivers)
    assert len(receivers.element_corners) == 2 + 32
    assert len(receivers.cells) > 10 * 34 / 2
    for receiver, mesh in zip(two, receivers.meshes, strict=True):
        assert mesh.triangles.tobytes() == receiver.triangles.tobytes()
        assert mesh.vertices.tobytes() == receiver.vertices.tobytes()
    assert (receivers.cells.surface == receivers.element_surface[receivers.cells.element]).all()


def test_objects_share_no_fit_vertices(two):
    receivers = receive(two[0], two[0], size=1.0)
    one, other = np.split(receivers.corner_vertex, [receivers.first[1]])
    assert not set(one.ravel().tolist()) & set(other.ravel().tolist())
    assert receivers.vertices == receivers.corner_vertex.max() + 1


def test_what_does_not_receive_is_left_out(build, two):
    other = build.box("other", receives=False)
    assert [o.name for o in receive(*two, other, size=1.0).objects] == ["floor", "ball"]


def test_shading_is_none_where_all_is_flat(build, two):
    assert receive(*two, size=1.0).cells.shading is None
    shaded = receive(build.sphere(level=2, smooth=True), size=0.2).cells
    outward = shaded.corners / np.linalg.norm(shaded.corners, axis=2, keepdims=True)
    # Blending normals 1/4 rad apart turns them by at most a hundredth from those of the ball.
    assert np.einsum("cik,cik->ci", shaded.shading, outward).min() > 0.99
    assert np.linalg.norm(shaded.shading, axis=2) == pytest.approx(1.0)


@pytest.mark.parametrize("tessellate", [True, False])
def test_split_cells_cover_the_same_and_know_their_source(two, tessellate):
    receivers = receive(*two, size=0.5, tessellate=tessellate)
    chosen = np.random.default_rng(5).random(len(receivers.cells)) < 0.3
    finer, source = split_cells(receivers, chosen)
    assert covers_its_elements(finer)
    assert (np.bincount(source)[chosen] == 4).all()
    assert np.bincount(source, finer.cells.area) == pytest.approx(receivers.cells.area)
    if not tessellate:
        assert finer.corner_vertex.tolist() == receivers.corner_vertex.tolist()
