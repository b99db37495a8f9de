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
}


@pytest.mark.parametrize("mode", ["keep", "replace", "new"])
@pytest.mark.parametrize("thing", THINGS)
def test_the_floor_beside_it_is_as_bright_as_it_is(thing, mode, add_mesh, add_material, shader):
    """Under an even sky, black things on a floor."""
    low, high = THINGS[thing]
    floor = add_mesh("Floor", GRID, SQUARES)
    floor.data.materials.append(add_material("ShaderNodeBsdfDiffuse", Color=(0.5, 0.5, 0.5, 1.0)))
    flat = low[2] == high[2]
    corners = list(product(*zip(low, high, strict=True)))
    body = add_mesh("Body", corners, SIDES[5:] if flat else SIDES)
    body.data.materials.append(add_material("ShaderNodeBsdfDiffuse", "Black", Color=(0.0, 0.0, 0.0, 1.0)))
    bpy.context.scene.world = bpy.data.worlds.new("World")
    shader(bpy.context.scene.world, "ShaderNodeBackground", Color=(1.0, 1.0, 1.0, 1.0))
    settings = Settings(triangles=2000, tessellate=mode != "keep", layers=("light",), threads=2)
    _, (written,) = bake_objects(bpy.context, [floor], settings, result_mode=mode, attribute="Radiosity")
    mesh = written.data
    values = np.empty(4 * len(mesh.loops), np.float32)
    mesh.color_attributes["Radiosity Light"].data.foreach_get("color", values)
    mesh.calc_loop_triangles()
    places = np.array([[mesh.vertices[v].co for v in t.vertices] for t in mesh.loop_triangles])[:, :, :2]
    light = values[::4][np.array([t.loops for t in mesh.loop_triangles])]
    weights = np.random.default_rng(0).dirichlet(np.ones(3), 30)
    points, seen = np.einsum("bi,tik->tbk", weights, places), light @ weights.T
    beside = ((points < np.array(low[:2]) - HAIR) | (points > np.array(high[:2]) + HAIR)).any(axis=2)
    assert seen[beside].min() > LEAST
    assert seen[beside].max() < 1.1
