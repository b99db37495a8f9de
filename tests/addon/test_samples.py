"""The sample scenes are clean: what a bake gets wrong in them is the bake's own fault."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import combinations
from pathlib import Path

import bpy
import numpy as np
import pytest
from mathutils.bvhtree import BVHTree

SAMPLES = Path(__file__).parents[2] / "sample_blends"

#: Single-sided by design: what they enclose is never seen from behind. All others are closed solids.
OPEN = {"Room", "Floor", "Facade", "Light", "Short block", "Tall block"}

BLOCKS = {"Room", "Short block", "Tall block"}


@dataclass(frozen=True)
class Expected:
    """What a sample holds. size: of the bounding box of its receivers, metres."""

    lamps: dict[str, int]
    receivers: set[str]
    others: set[str]
    size: tuple[float, float, float]
    triangles: int


EXPECTED = {
    "cornell_box_area_lamp": Expected({"AREA": 1}, BLOCKS, set(), (0.556, 0.5592, 0.5488), 30),
    "cornell_box_emitter": Expected({}, BLOCKS, {"Light"}, (0.556, 0.5592, 0.5488), 38),
    "living_room": Expected(
        {"SUN": 1, "POINT": 1},
        {
            *("Room", "Floor", "Skirting", "Window frame", "Window sill", "Curtains", "Rug", "Sofa", "Sofa pillows"),
            *("Armchair", "Pouf", "Low table", "Table things", "Bookshelf", "Books", "Floor lamp", "Plant", "Picture"),
        },
        {"Facade"},
        (5.5, 4.2, 2.6),
        30_000,
    ),
    "stage": Expected(
        {"SPOT": 8, "POINT": 1},
        {
            *("Cyclorama", "Podium", "Knot plinth", "Torus knot", "Draped table", "Amphora", "Dancer plinth", "Dancer"),
            *("Coral ball", "Blue ball", "Ivory ball", "Left column", "Right column", "Left curtain", "Right curtain"),
            *("Truss", "Key can", "Amber can", "Violet can", "Magenta can", "Cyan can", "White can"),
            *("Blue wash can", "Rose wash can"),
        },
        set(),
        (12.0, 9.888, 6.03),
        30_000,
    ),
}


@dataclass(frozen=True, eq=False)
class Solid:
    """One object in world space. vertices (v, 3), triangles (t, 3); faces as tuples of vertex indices."""

    name: str
    selected: bool
    vertices: np.ndarray
    triangles: np.ndarray
    faces: list[tuple[int, ...]]

    @property
    def corners(self) -> np.ndarray:
        """(t, 3, 3)"""
        return self.vertices[self.triangles]


@dataclass(frozen=True, eq=False)
class Sample:
    solids: list[Solid]
    lamps: dict[str, int]
    has_camera: bool
    engine: str
    world: tuple[float, ...]
    shaders: set[str]


@cache
def _read(name: str) -> Sample:
    bpy.ops.wm.open_mainfile(filepath=str(SAMPLES / f"{name}.blend"))
    scene = bpy.context.scene
    bpy.context.view_layer.update()
    lamps: dict[str, int] = {}
    for obj in scene.objects:
        if obj.type == "LIGHT":
            lamps[obj.data.type] = lamps.get(obj.data.type, 0) + 1
    background = scene.world.node_tree.nodes["Background"].inputs
    sample = Sample(
        solids=[_solid(obj) for obj in scene.objects if obj.type == "MESH"],
        lamps=lamps,
        has_camera=scene.camera is not None,
        engine=scene.render.engine,
        world=tuple(
            channel * background["Strength"].default_value for channel in background["Color"].default_value[:3]
        ),
        shaders={node.bl_idname for material in bpy.data.materials for node in material.node_tree.nodes},
    )
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return sample


def _solid(obj: bpy.types.Object) -> Solid:
    mesh = obj.data
    mesh.calc_loop_triangles()
    local = np.empty(len(mesh.vertices) * 3)
    mesh.vertices.foreach_get("co", local)
    matrix = np.array(obj.matrix_world)
    triangles = np.empty(len(mesh.loop_triangles) * 3, dtype=np.int32)
    mesh.loop_triangles.foreach_get("vertices", triangles)
    return Solid(
        obj.name,
        obj.select_get(),
        local.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3],
        triangles.reshape(-1, 3),
        [tuple(polygon.vertices) for polygon in mesh.polygons],
    )


@pytest.fixture(params=EXPECTED)
def name(request: pytest.FixtureRequest) -> str:
    return request.param


def test_holds_what_the_manual_says(name: str) -> None:
    sample, expected = _read(name), EXPECTED[name]
    assert sample.lamps == expected.lamps
    assert {solid.name for solid in sample.solids if solid.selected} == expected.receivers
    assert {solid.name for solid in sample.solids if not solid.selected} == expected.others
    assert sample.has_camera
    assert sample.engine == "CYCLES"
    assert (sum(sample.world) > 0.0) == (name == "living_room")
    assert sample.shaders <= {"ShaderNodeBsdfDiffuse", "ShaderNodeEmission", "ShaderNodeOutputMaterial"}


def test_has_the_expected_size(name: str) -> None:
    receivers = [solid for solid in _read(name).solids if solid.selected]
    vertices = np.concatenate([solid.vertices for solid in receivers])
    assert np.ptp(vertices, axis=0) == pytest.approx(EXPECTED[name].size, abs=1e-3)
    assert sum(len(solid.triangles) for solid in receivers) <= EXPECTED[name].triangles


def test_has_no_degenerate_face(name: str) -> None:
    """Every triangle is at least 10 micrometres high, or a hundred thousandth of its longest edge."""
    for solid in _read(name).solids:
        corners = solid.corners
        longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
        double_area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        assert (double_area / longest).min() > 1e-5, solid.name
        assert (double_area / longest**2).min() > 1e-5, solid.name


def test_solids_are_closed_and_face_outward(name: str) -> None:
    for solid in _read(name).solids:
        if solid.name in OPEN:
            continue
        edges = [edge for face in solid.faces for edge in zip(face, face[1:] + face[:1], strict=True)]
        assert len(edges) == len(set(edges)), f"{solid.name}: an edge is used twice in one direction"
        assert {(b, a) for a, b in edges} == set(edges), f"{solid.name}: an edge has one face only"
        for part in _parts(solid):
            a, b, c = (part.corners - part.vertices[part.triangles[0, 0]]).transpose(1, 0, 2)
            assert np.einsum("ij,ij->", a, np.cross(b, c)) > 0.0, f"{solid.name}: a part is inside out"


def test_room_and_facade_close_the_house() -> None:
    """Welded together, walls, floor and facade leave no edge open to the sky, so no light can leak in but through the
    window. The floor's boards meet the walls along their whole length, in more vertices than the walls have."""
    sample = {solid.name: solid for solid in _read("living_room").solids}
    edges: dict[tuple[tuple[float, ...], ...], int] = {}
    for solid in (sample["Room"], sample["Facade"]):
        places = [tuple(row) for row in solid.vertices.round(5).tolist()]
        for face in solid.faces:
            for a, b in zip(face, face[1:] + face[:1], strict=True):
                edge = tuple(sorted((places[a], places[b])))
                edges[edge] = edges.get(edge, 0) + 1
    border = {edge for edge, uses in edges.items() if uses == 1}
    assert {place[2] for edge in border for place in edge} == {0.0}
    assert len(border) == 4
    floor = sample["Floor"].vertices
    room = sample["Room"].vertices
    assert floor[:, :2].min(axis=0) == pytest.approx(room[:, :2].min(axis=0), abs=1e-6)
    assert floor[:, :2].max(axis=0) == pytest.approx((5.2, 4.2), abs=1e-6)


def test_light_fills_the_hole_in_the_ceiling() -> None:
    """The emitting quad and the ceiling around it share their corners and together have the whole ceiling's area."""
    sample = {solid.name: solid for solid in _read("cornell_box_emitter").solids}
    light = {tuple(row) for row in sample["Light"].vertices.round(6).tolist()}
    assert light < {tuple(row) for row in sample["Room"].vertices.round(6).tolist()}
    ceiling = sample["Room"].corners[(sample["Room"].corners[:, :, 2] > 0.5487).all(axis=1)]
    assert _area(ceiling) + _area(sample["Light"].corners) == pytest.approx(0.556 * 0.5592, rel=1e-6)
    assert _area(sample["Light"].corners) == pytest.approx(0.130 * 0.105, rel=1e-6)


def _area(corners: np.ndarray) -> float:
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return float(np.linalg.norm(cross, axis=1).sum()) / 2.0


def test_has_no_coplanar_overlap(name: str) -> None:
    """No two triangles lie on top of each other: that is where renderers and bakers give black or flicker."""
    corners = np.concatenate([solid.corners for solid in _read(name).solids])
    names = np.concatenate([[solid.name] * len(solid.triangles) for solid in _read(name).solids])
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    first = np.argmax(np.abs(normals) > 1e-3, axis=1)[:, None]
    normals *= np.sign(np.take_along_axis(normals, first, axis=1))
    planes = np.column_stack([normals * 10.0, np.einsum("ij,ij->i", normals, corners.mean(axis=1))]) / 1e-4
    # Rounded twice, half a cell apart, so that no pair is missed because it straddles a cell's border.
    for shift in (0.0, 0.5):
        _, plane = np.unique(np.floor(planes + shift), axis=0, return_inverse=True)
        i, j = _neighbours(corners, plane.ravel())
        overlap = _overlap(corners[i], corners[j], normals[i])
        assert {
            (names[a], names[b], *corners[a].mean(axis=0).round(3)) for a, b in np.stack([i, j])[:, overlap].T
        } == set()


def _neighbours(corners: np.ndarray, plane: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of triangles (t, 3, 3) of one plane (t,) whose bounding boxes touch."""
    low, high = corners.min(axis=1) - 1e-6, corners.max(axis=1) + 1e-6
    order = np.argsort(plane, kind="stable")
    pairs = [np.empty((2, 0), dtype=np.int64)]
    for step in range(1, np.bincount(plane).max()):
        i, j = order[:-step], order[step:]
        same = plane[i] == plane[j]
        i, j = i[same], j[same]
        extent = np.minimum(high[i], high[j]) - np.maximum(low[i], low[j])
        pairs.append(np.stack([i, j])[:, (extent > 0.0).all(axis=1)])
    i, j = np.concatenate(pairs, axis=1)
    return i, j


def _overlap(one: np.ndarray, other: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Which pairs of coplanar triangles (p, 3, 3) overlap by more than 10 micrometres: no edge separates them."""
    apart = np.zeros(len(one), dtype=bool)
    for triangles in (one, other):
        for k in range(3):
            across = np.cross(normal, triangles[:, (k + 1) % 3] - triangles[:, k])
            across /= np.linalg.norm(across, axis=1, keepdims=True)
            a, b = (np.einsum("pcx,px->pc", side, across) for side in (one, other))
            apart |= (a.max(axis=1) < b.min(axis=1) + 1e-5) | (b.max(axis=1) < a.min(axis=1) + 1e-5)
    return ~apart


def test_solids_do_not_cross(name: str) -> None:
    """Furniture stands a hair above what carries it: no solid cuts into another, so no vertex is inside one."""
    crossings = []
    parts = [part for solid in _read(name).solids if solid.name not in OPEN for part in _parts(solid)]
    trees = [BVHTree.FromPolygons(part.vertices.tolist(), part.triangles.tolist()) for part in parts]
    bounds = [(part.vertices.min(axis=0), part.vertices.max(axis=0)) for part in parts]
    for i, j in combinations(range(len(parts)), 2):
        (low, high), (other_low, other_high) = bounds[i], bounds[j]
        if (low < other_high).all() and (other_low < high).all() and trees[i].overlap(trees[j]):
            place = (np.maximum(low, other_low) + np.minimum(high, other_high)) / 2.0
            crossings.append(f"{parts[i].name} and {parts[j].name} near {place.round(3)}")
    assert crossings == []


def test_furniture_stands_on_the_floor() -> None:
    floating = {"Facade", "Room", "Floor", "Window frame", "Window sill", "Curtains", "Table things", "Picture"}
    for solid in _read("living_room").solids:
        lowest = solid.vertices[:, 2].min()
        if solid.name in {"Pouf", "Low table"}:
            assert 0.0115 < lowest < 0.0125, f"{solid.name} does not stand on the rug"
        elif solid.name == "Books":
            assert 0.07 < lowest < 0.0715, "The lowest row does not stand on its shelf"
        elif solid.name == "Sofa pillows":
            assert 0.46 < lowest < 0.48, "The pillows do not stand on the cushions"
        elif solid.name not in floating:
            assert 0.0 < lowest < 0.001, solid.name


def _parts(solid: Solid) -> list[Solid]:
    """The connected pieces of a solid."""
    label = np.arange(len(solid.vertices))
    while True:
        lowest = label[solid.triangles].min(axis=1)
        after = label.copy()
        np.minimum.at(after, solid.triangles, lowest[:, None])
        after = after[after]
        if (after == label).all():
            break
        label = after
    pieces = []
    for root in np.unique(label[solid.triangles[:, 0]]):
        triangles = solid.triangles[label[solid.triangles[:, 0]] == root]
        used, local = np.unique(triangles, return_inverse=True)
        pieces.append(Solid(solid.name, solid.selected, solid.vertices[used], local.reshape(-1, 3), []))
    return pieces
