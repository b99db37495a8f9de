"""What lies on a surface or runs into it, in the meshes that a bake leaves: no black ring, no bright rim."""

from itertools import product

import bpy
import numpy as np
import pytest

from radiosity_baker.addon.bake_scene import bake_objects
from radiosity_baker.core.settings import Settings

SIDES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
LINE = np.linspace(-1, 1, 17)
GRID = [(x, y, 0.0) for x in LINE for y in LINE]
SQUARES = [(17 * i + j, 17 * i + 17 + j, 17 * i + 18 + j, 17 * i + 1 + j) for i in range(16) for j in range(16)]
#: Half of the sky is open beside an upright body, and a millimetre within the rim of what lies flat; five standard
#: deviations of the 2 samples of 32 rays that the smallest triangles have. The black ring of other bakers is 0.
LEAST = 0.5 - 5 * 0.5 / np.sqrt(2 * 32)
#: What is nearer to the outline than this is not looked at, metres.
HAIR = 0.002

#: What is there on a floor that spans -1 to 1: the corners of a box.
THINGS = {
    "carpet 1 mm above the floor": ((-0.43, -0.31, 0.001), (0.38, 0.47, 0.001)),
    "picture 2 cm thick": ((-0.43, -0.31, 0.0), (0.38, 0.47, 0.02)),
    "box on the floor": ((-0.43, -0.31, 0.0), (0.38, 0.47, 0.6)),
    "wall through the floor": ((-0.07, -1.2, -0.3), (0.03, 1.2, 0.6)),
    "wall 1 mm thick": ((0.03, -1.2, -0.3), (0.031, 1.2, 0.6)),
}


MODES = ["keep", "replace", "new"]


@pytest.fixture
def things(add_mesh, add_material):
    """Makes a body of a grey, or a box."""

    def make(name, vertices, faces, grey):
        made = add_mesh(name, vertices, faces)
        made.data.materials.append(add_material("ShaderNodeBsdfDiffuse", name, Color=(grey, grey, grey, 1.0)))
        return made

    return make


def boxed(low, high):
    """Vertices and outward faces of a box, or of a sheet that faces up."""
    return list(product(*zip(low, high, strict=True))), SIDES[5:] if low[2] == high[2] else SIDES


def light_on(objects, mode):
    """Of each baked object 30 places (t, 30, 3) on each triangle, and the light (t, 30) that is shown there."""
    settings = Settings(triangles=2000, tessellate=mode != "keep", layers=("light",), threads=2)
    _, written = bake_objects(bpy.context, objects, settings, result_mode=mode, attribute="Radiosity")
    weights = np.random.default_rng(0).dirichlet(np.ones(3), 30)
    for mesh in (obj.data for obj in written):
        values = np.empty(4 * len(mesh.loops), np.float32)
        mesh.color_attributes["Radiosity Light"].data.foreach_get("color", values)
        mesh.calc_loop_triangles()
        places = np.array([[mesh.vertices[v].co for v in t.vertices] for t in mesh.loop_triangles])
        light = values[::4][np.array([t.loops for t in mesh.loop_triangles])]
        yield np.einsum("bi,tik->tbk", weights, places), light @ weights.T


def even_sky(shader):
    bpy.context.scene.world = bpy.data.worlds.new("World")
    shader(bpy.context.scene.world, "ShaderNodeBackground", Color=(1.0, 1.0, 1.0, 1.0))


def outside(points, low, high, hair=HAIR):
    return ((points < np.array(low) - hair) | (points > np.array(high) + hair)).any(axis=2)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("thing", THINGS)
def test_the_floor_beside_it_is_as_bright_as_it_is(thing, mode, things, shader):
    """Under an even sky, black things on a floor."""
    low, high = THINGS[thing]
    floor = things("Floor", GRID, SQUARES, 0.5)
    things("Body", *boxed(low, high), 0.0)
    even_sky(shader)
    ((points, seen),) = light_on([floor], mode)
    beside = outside(points[..., :2], low[:2], high[:2])
    assert seen[beside].min() > LEAST
    assert seen[beside].max() < 1.1


@pytest.mark.parametrize("mode", MODES)
def test_walls_that_overlap_darken_each_other_by_half_at_most(mode, things, shader):
    """Two black walls that run through each other, seen by the sky from all sides: half of it is open to each."""
    boxes = [((-0.8, -0.05, 0.0), (0.7, 0.05, 0.9)), ((-0.03, -0.7, -0.1), (0.06, 0.6, 0.8))]
    walls = [things(f"Wall {k}", *finely(*boxed(*corners)), 0.0) for k, corners in enumerate(boxes)]
    even_sky(shader)
    for (points, seen), other in zip(light_on(walls, mode), boxes[::-1], strict=True):
        beside = outside(points, *other)
        assert seen[beside].min() > LEAST
        assert seen[beside].max() < 1.1


def finely(vertices, faces, steps=16):
    """Each face of four corners as a grid of its own."""
    grid, squares = [], []
    for face in faces:
        a, b, _, d = (np.array(vertices[v]) for v in face)
        first, line = len(grid), np.linspace(0.0, 1.0, steps + 1)
        grid += [tuple(a + (b - a) * s + (d - a) * t) for s in line for t in line]
        row = steps + 1
        squares += [
            tuple(first + row * (i + di) + j + dj for di, dj in ((0, 0), (1, 0), (1, 1), (0, 1)))
            for i in range(steps)
            for j in range(steps)
        ]
    return grid, squares


@pytest.mark.parametrize("mode", MODES)
def test_no_light_gets_through_a_wall_1_mm_thick(mode, things, add_lamp):
    """A point lamp on one side: there light is what the inverse square says, beyond there is none. Triangles that are
    kept and lie on both sides show both, and no other triangle does."""
    floor = things("Floor", GRID, SQUARES, 0.5)
    things("Wall", *boxed((0.03, -1.5, -0.3), (0.031, 1.5, 3.0)), 0.0)
    lamp = np.array([-0.5, 0.0, 0.8])
    add_lamp("POINT", {"energy": 100.0, "shadow_soft_size": 0.0}, location=tuple(lamp))
    ((points, seen),) = light_on([floor], mode)
    distance = np.linalg.norm(points - lamp, axis=2)
    true = 100.0 / (4.0 * np.pi) / np.pi * lamp[2] / distance**3
    reach = LINE[1] - LINE[0] if mode == "keep" else HAIR
    here, there = points[..., 0] < 0.03 - reach, points[..., 0] > 0.031 + reach
    assert (seen[there] < 0.01 * true[there]).all()
    assert abs(seen[here] / true[here] - 1.0).max() < 5 * 0.02  # five times the error that a bake aims at
