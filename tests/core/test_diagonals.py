"""Diagonals that follow the light."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from radiosity_baker.core import layers
from radiosity_baker.core.bake import bake
from radiosity_baker.core.diagonals import turn_diagonals
from radiosity_baker.core.patches import unit_space
from radiosity_baker.core.receivers import Receivers, make_receivers
from radiosity_baker.core.scene import Scene, Surface
from radiosity_baker.core.settings import Settings
from radiosity_baker.core.shapes import quad

SQUARE = quad("square", (0, 0, 0), (1, 0, 0), (0, 1, 0))
GREY = Surface("grey", (0.5, 0.5, 0.5))


@pytest.fixture
def grid() -> Receivers:
    """Squares of which all diagonals rise to the right, with those of the two triangles that they are made from."""
    scene = Scene((SQUARE,), (GREY,))
    return make_receivers(scene, unit_space(scene), Settings(size=0.1), 0)


def crease(place: np.ndarray) -> np.ndarray:
    """Light that falls, and from a line on, which falls to the right, rises."""
    return np.abs(place[..., 0] + place[..., 1] - 0.5)


def at_vertices(receivers: Receivers) -> np.ndarray:
    light = np.zeros(receivers.vertices)
    corners = receivers.meshes[0].vertices[receivers.meshes[0].triangles]
    light[receivers.corner_vertex] = crease(corners)
    return light


def nothing(receivers: Receivers) -> np.ndarray:
    return np.zeros(len(receivers.corner_vertex), dtype=bool)


def test_a_crease_is_shown_exactly(grid):
    """On either side of a crease along diagonals of squares the light is linear, so linear elements miss nothing of it
    if their diagonals run along it; but the diagonal between the input's own triangles has to stay."""
    mesh, light = grid.meshes[0], at_vertices(grid)
    corner = turn_diagonals(grid, light, nothing(grid))

    def missed(corner: np.ndarray) -> float:
        centre = mesh.vertices[mesh.triangles.ravel()[corner]].mean(axis=1)
        return float(np.abs(light[grid.corner_vertex.ravel()[corner]].mean(axis=1) - crease(centre)).max())

    every = np.arange(mesh.triangles.size).reshape(-1, 3)
    place = mesh.vertices[mesh.triangles.ravel()[corner]]
    within = (np.abs(place[..., 0] - place[..., 1]) < 1e-9).sum(axis=1) < 2
    assert missed(every[within]) > 0.01
    assert missed(corner[within]) < 1e-12


def test_what_turns_covers_what_it_covered(grid):
    """The turned triangles face alike, overlap nowhere and are parts of the same triangles of the input."""
    rng = np.random.default_rng(1)
    corner = turn_diagonals(grid, rng.random(grid.vertices), nothing(grid))

    def signed(corner: np.ndarray) -> np.ndarray:
        a, b, c = np.moveaxis(grid.meshes[0].vertices[grid.meshes[0].triangles.ravel()[corner]], 1, 0)
        return np.cross(b - a, c - a)[:, 2] / 2

    areas = signed(corner)
    assert (corner != np.arange(corner.size).reshape(-1, 3)).any(axis=1).mean() > 0.2
    assert areas.min() > 0.0
    assert areas.sum() == pytest.approx(1.0)
    np.testing.assert_array_equal(grid.parent[corner // 3], np.broadcast_to(grid.parent[:, None], corner.shape))
    edges = np.sort(grid.corner_vertex.ravel()[corner][:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    assert np.unique(edges, axis=0, return_counts=True)[1].max() == 2


def test_where_nothing_bends_nothing_turns(grid):
    every = np.arange(grid.corner_vertex.size).reshape(-1, 3)
    linear = np.zeros(grid.vertices)
    linear[grid.corner_vertex] = grid.meshes[0].vertices[grid.meshes[0].triangles] @ [1.0, 2.0, 0.0]
    for light in (linear, np.zeros(grid.vertices)):
        np.testing.assert_array_equal(turn_diagonals(grid, light, nothing(grid)), every)


def test_nothing_turns_beside_what_is_fixed_or_over_a_break(grid):
    every = np.arange(grid.corner_vertex.size).reshape(-1, 3)
    light = at_vertices(grid)
    np.testing.assert_array_equal(turn_diagonals(grid, light, ~nothing(grid)), every)
    broken = replace(grid, breaks=np.ones(grid.corner_vertex.shape, dtype=bool))
    np.testing.assert_array_equal(turn_diagonals(broken, at_vertices(broken), nothing(grid)), every)


def test_a_contour_stays_whole(grid):
    """Whatever light does there: what runs along a contour has both its ends on it."""
    every = np.arange(grid.corner_vertex.size).reshape(-1, 3)
    place = grid.meshes[0].vertices[grid.meshes[0].triangles]
    step = np.zeros(grid.vertices)
    step[grid.corner_vertex] = place[..., 0] + place[..., 1] > 0.55
    assert (turn_diagonals(grid, step, nothing(grid)) != every).any()
    drawn = replace(grid, on_contour=np.ones(every.shape, dtype=bool))
    np.testing.assert_array_equal(turn_diagonals(drawn, step, nothing(grid)), every)
    apart = replace(grid, on_contour=np.zeros(every.shape, dtype=bool))
    np.testing.assert_array_equal(turn_diagonals(apart, step, nothing(grid)), turn_diagonals(grid, step, nothing(grid)))


def test_all_layers_keep_their_values_at_the_vertices(build, monkeypatch):
    """Bakes with turned diagonals and without differ by the triangles between the vertices, and by nothing else."""
    asked = Settings(triangles=2000, error=0.05, threads=2, layers=("combined", "indirect", "error", "triangles"))
    turned = bake(build.furnished_room(), asked)
    monkeypatch.setattr(layers, "turn_diagonals", lambda *_: None)
    plain = bake(build.furnished_room(), asked)
    differ = 0
    for one, other in zip(turned.objects, plain.objects, strict=True):
        np.testing.assert_array_equal(one.vertices, other.vertices)
        np.testing.assert_array_equal(one.parent, other.parent)
        differ += int((one.triangles != other.triangles).any(axis=1).sum())
        for name in ("combined", "indirect", "error"):
            assert shown(one, name) == shown(other, name)
        assert (one.layers["triangles"] == one.layers["triangles"][:, :1]).all()
        places = [np.round(np.concatenate([b.barycentric, b.vertices[b.triangles]], axis=2), 9) for b in (one, other)]
        assert {*map(bytes, places[0].reshape(-1, 6))} == {*map(bytes, places[1].reshape(-1, 6))}
    assert differ > 20


def shown(baked, name: str) -> set[tuple[float, ...]]:
    """All vertices with the values that they have in a layer."""
    values = baked.layers[name].reshape(-1, 3)
    return {(int(v), *map(float, value)) for v, value in zip(baked.triangles.ravel(), values, strict=True)}
