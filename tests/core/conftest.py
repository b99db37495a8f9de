"""Simple scenes that have closed forms, and the stages of the pipeline on them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from radiosity_baker.core.direct.illumination import DirectLight
from radiosity_baker.core.parallel import Workers
from radiosity_baker.core.patches import Patches, make_patches, split_objects, unit_space
from radiosity_baker.core.plan import Effort, choose_effort
from radiosity_baker.core.progress import Progress
from radiosity_baker.core.scene import AreaLamp, Scene, SceneObject, Surface
from radiosity_baker.core.settings import Settings
from radiosity_baker.core.transport import Transport, make_transport
from radiosity_baker.core.visibility import Visibility

GREY = Surface("grey", (0.5, 0.5, 0.5))


def quad(name="quad", corner=(0, 0, 0), u=(1, 0, 0), v=(0, 1, 0), surface=0, receives=True) -> SceneObject:
    """Two triangles that face cross(u, v)."""
    c, a, b = np.array(corner, float), np.array(u, float), np.array(v, float)
    return triangles(name, [c, c + a, c + a + b, c + b], [[0, 1, 2], [0, 2, 3]], surface, receives)


def triangles(name, vertices, faces, surface=0, receives=True) -> SceneObject:
    faces = np.array(faces, dtype=np.int32)
    surfaces = np.broadcast_to(np.asarray(surface, dtype=np.int32), len(faces)).copy()
    return SceneObject(name, np.array(vertices, dtype=float), faces, surfaces, receives=receives)


def box(name="box", low=(0, 0, 0), high=(1, 1, 1), surface=0, inward=False, receives=True) -> SceneObject:
    """Twelve triangles on eight vertices; surface may be six numbers, of the faces -x, +x, -y, +y, -z, +z."""
    unit = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    vertices = np.array(low) + unit * (np.array(high, float) - low)
    faces = []
    for axis in range(3):
        for side in (0, 1):
            corner = np.flatnonzero(unit[:, axis] == side)  # in the order of the two other axes
            a, b, c, d = corner[[0, 2, 3, 1]]
            outward = np.cross(unit[b] - unit[a], unit[c] - unit[a])[axis] * (2 * side - 1) > 0
            ring = [a, b, c, d] if outward != inward else [a, d, c, b]
            faces += [[ring[0], ring[1], ring[2]], [ring[0], ring[2], ring[3]]]
    return triangles(name, vertices, faces, np.repeat(np.broadcast_to(surface, 6), 2), receives)


def sphere(name="sphere", radius=1.0, level=2, inward=False, surface=0, smooth=False) -> SceneObject:
    """An octahedron with every triangle cut into four, `level` times, on the sphere: 8 * 4 ** level triangles."""
    vertices = [np.array(v, float) for v in ((1, 0, 0), (0, 1, 0), (0, 0, 1), (-1, 0, 0), (0, -1, 0), (0, 0, -1))]
    faces = [(0, 1, 2), (1, 3, 2), (3, 4, 2), (4, 0, 2), (1, 0, 5), (3, 1, 5), (4, 3, 5), (0, 4, 5)]
    for _ in range(level):
        middle: dict[tuple[int, int], int] = {}
        finer = []
        for a, b, c in faces:
            ends = []
            for one, two in ((a, b), (b, c), (c, a)):
                key = (min(one, two), max(one, two))
                if key not in middle:
                    middle[key] = len(vertices)
                    between = vertices[one] + vertices[two]
                    vertices.append(between / np.linalg.norm(between))
                ends.append(middle[key])
            d, e, f = ends
            finer += [(a, d, f), (d, b, e), (f, e, c), (d, e, f)]
        faces = finer
    positions = np.array(vertices)
    order = np.array(faces)[:, ::-1] if inward else np.array(faces)
    made = triangles(name, positions * radius, order, surface)
    normals = (positions[order] * (-1 if inward else 1)).astype(np.float32) if smooth else None
    return SceneObject(name, made.vertices, made.triangles, made.surface, normals)


def furnished_room(albedo=0.7) -> Scene:
    """A closed room of 2 m, a box that stands on its floor, and a lamp under its ceiling."""
    lamp = AreaLamp("lamp", (0, 0, 1.9), (0.3, 0, 0), (0, 0.3, 0), (0, 0, -1), (10.0, 9.0, 8.0))
    room = box("room", (-1, -1, 0), (1, 1, 2), inward=True, surface=[0, 1, 2, 2, 2, 2])
    block = box("block", (-0.5, -0.3, 0), (0.1, 0.3, 0.8), surface=2)
    surfaces = (
        Surface("red", (albedo, 0.1, 0.1)),
        Surface("green", (0.1, albedo, 0.1)),
        Surface("white", (albedo, albedo, albedo)),
    )
    return Scene((room, block), surfaces, (lamp,))


def effort(**changes) -> Effort:
    """The usual effort, on fewer patches, solved to rounding and with nothing culled, with changes."""
    usual = choose_effort(furnished_room(), Settings())
    return replace(usual, **({"patches": 500, "tolerance": 1e-6, "threshold": 0.0} | changes))


def patches_of(scene: Scene, wanted: int) -> Patches:
    return make_patches(scene, unit_space(scene), split_objects(scene, wanted))


@pytest.fixture(scope="session")
def build() -> SimpleNamespace:
    """Builders of objects, scenes and stages, by name."""
    return SimpleNamespace(
        grey=GREY,
        quad=quad,
        triangles=triangles,
        box=box,
        sphere=sphere,
        furnished_room=furnished_room,
        effort=effort,
        patches=patches_of,
    )


@pytest.fixture
def workers() -> Iterator[Workers]:
    with Workers(2, Progress()) as two:
        yield two


@pytest.fixture
def transport(workers):
    """Solve the exchange of light in a scene; lights: what is sampled as lamps."""

    def run(scene: Scene, lights=(), seed=0, purpose="test", **changes) -> Transport:
        asked = effort(**changes)
        patches = patches_of(scene, asked.patches)
        visibility = Visibility(patches.corners)
        direct_light = DirectLight(list(lights), visibility, seed)
        sky = np.array(scene.sky)
        return make_transport(patches, visibility, direct_light, sky, asked, workers, seed=seed, purpose=purpose)

    return run
