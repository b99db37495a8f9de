"""Emitting surfaces: from one panel to thousands of triangles, large and small."""

from __future__ import annotations

import numpy as np

from ...sample_blends.modelling import add_mesh, box, emission, join, polygons, sphere, tube
from .catalogue import effect_scene
from .lamps import stage

RECEIVERS = ("Stage", "Box", "Ball")


@effect_scene("emitting surfaces", receivers=RECEIVERS)
def glowing_slab() -> None:
    """Twelve triangles, each a lamp."""
    stage()
    add_mesh("Slab", box((1.0, 0.6, 0.05), emission("Glow", (20.0, 16.0, 12.0))), at=(0.2, -0.4, 1.9))


@effect_scene("emitting surfaces", receivers=RECEIVERS)
def glowing_slab_near_the_wall() -> None:
    stage()
    add_mesh("Strip", box((3.0, 0.02, 0.1), emission("Glow", (40.0, 40.0, 30.0))), at=(0.0, 1.95, 1.0))


@effect_scene("emitting surfaces", receivers=RECEIVERS)
def mesh_lamp_of_five_thousand_triangles() -> None:
    stage()
    ball = sphere(0.15, emission("Glow", (150.0, 120.0, 80.0)), segments=72)
    add_mesh("Lamp", ball, at=(0.2, -0.6, 1.6))


@effect_scene("emitting surfaces", receivers=RECEIVERS)
def fifty_small_bulbs() -> None:
    stage()
    glow = emission("Glow", (400.0, 320.0, 220.0))
    bulbs = [
        sphere(0.025, glow, segments=8).moved(x=0.36 * i - 1.6, y=0.7 * j - 1.6) for i in range(10) for j in range(5)
    ]
    add_mesh("Bulbs", join(bulbs), at=(0.0, 0.0, 1.5))


@effect_scene("emitting surfaces", receivers=RECEIVERS)
def neon_tube() -> None:
    """Long and thin: much of it, little of the sky."""
    stage()
    t = np.linspace(0.0, 2.0, 60)
    line = np.column_stack([1.5 * t - 1.5, -0.8 + 0.3 * np.sin(4.0 * t), 1.2 + 0.3 * np.cos(5.0 * t)])
    add_mesh("Neon", tube(line, 0.015, emission("Neon", (120.0, 20.0, 60.0))))


@effect_scene("emitting surfaces", receivers=RECEIVERS)
def panel_that_shines_from_its_front_alone() -> None:
    """Before the wall and turned away from it: the node Geometry tells its back, which is black."""
    stage()
    glow = emission("Glow", (20.0, 16.0, 12.0))
    tree = glow.node_tree
    mix, geometry = tree.nodes.new("ShaderNodeMixShader"), tree.nodes.new("ShaderNodeNewGeometry")
    black = tree.nodes.new("ShaderNodeBsdfDiffuse")
    black.inputs["Color"].default_value = (0.0, 0.0, 0.0, 1.0)
    output = tree.get_output_node("ALL").inputs["Surface"]
    tree.links.new(geometry.outputs["Backfacing"], mix.inputs[0])
    tree.links.new(output.links[0].from_socket, mix.inputs[1])
    tree.links.new(black.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], output)
    corners = [(-0.6, 0.0, 0.0), (0.6, 0.0, 0.0), (0.6, 0.0, 0.8), (-0.6, 0.0, 0.8)]
    add_mesh("Panel", polygons(corners, [(0, 1, 2, 3)], glow), at=(0.2, 1.2, 0.9))
