"""By which diagonal Blender shows a quad: light is fitted to the triangles that are drawn and exported."""

import bmesh
import bpy
import numpy as np

from radiosity_baker.addon.scene_reader import read_scene


def test_a_quad_is_read_by_the_diagonal_that_every_mode_draws(add_mesh, add_lamp):
    """Object Mode, renders and exporters take the loop triangles of the mesh, Edit Mode those of its own: the same, for
    convex quads and concave ones, flat and bent."""
    rng = np.random.default_rng(0)
    square = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)])
    quads = [square + rng.normal(0.0, 0.35, (4, 3)) * (1, 1, k % 2) for k in range(400)]
    obj = add_mesh("Quads", np.concatenate(quads).tolist(), np.arange(1600).reshape(-1, 4).tolist())
    add_lamp("POINT", {"energy": 1.0}, location=(0, 0, 5))
    scene, _ = read_scene(bpy.context.evaluated_depsgraph_get(), [obj], tessellate=False)
    read = {frozenset(corners) for corners in scene.objects[0].triangles.tolist()}

    obj.data.calc_loop_triangles()
    drawn = {frozenset(triangle.vertices) for triangle in obj.data.loop_triangles}
    edited = bmesh.new()
    edited.from_mesh(obj.data)
    in_edit_mode = {frozenset(loop.vert.index for loop in three) for three in edited.calc_loop_triangles()}
    edited.free()

    assert read == drawn == in_edit_mode
    # Both diagonals occur, so that this can tell.
    assert 0 < sum(frozenset((k, k + 1, k + 2)) in read for k in range(0, 1600, 4)) < 400
