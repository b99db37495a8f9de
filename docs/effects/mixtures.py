"""Scenes that mix many effects, as people's scenes do."""

from __future__ import annotations

from math import radians

import bpy
import numpy as np

from ...sample_blends.modelling import (
    add_mesh,
    aim,
    area_lamp,
    box,
    diffuse,
    emission,
    join,
    point_lamp,
    sphere,
    spot_lamp,
    sun_lamp,
    tube,
)
from .catalogue import effect_scene
from .lamps import COLD, WARM
from .skies import gradient, plain, room, sky_texture
from .textures import image, image_node, pictured, unwrap
from .transparency import canopy, coloured, fence, made_of, mixed, screen

STAGE, ROOM = ("Stage",), ("Room",)


def corner(floor: bpy.types.Material) -> None:
    """A floor before a white and a red wall."""
    white, red = diffuse("White", (0.7, 0.7, 0.7)), diffuse("Red", (0.7, 0.2, 0.1))
    ground, wall = box((4.0, 4.0, 0.1), white, top=floor), box((4.0, 0.1, 2.0), white)
    side = box((0.1, 4.0, 2.0), red)
    pieces = [ground.moved(z=-0.1), wall.moved(y=2.05, z=-0.1), side.moved(x=-2.05, z=-0.1)]
    unwrap(add_mesh("Stage", join(pieces)))


def unmirrored(lamp: bpy.types.Object) -> None:
    """No mirror shows the lamp: its caustics are the one kind of light in these scenes that the bake leaves out."""
    lamp.visible_glossy = False


def silver() -> bpy.types.Material:
    return made_of("Silver", "ShaderNodeBsdfAnisotropic", Color=(0.9, 0.9, 0.9, 1.0), Roughness=0.0)


def pane() -> bpy.types.Material:
    return made_of("Glass", "ShaderNodeBsdfGlass", Color=(0.8, 0.95, 0.9, 1.0), Roughness=0.0, IOR=1.45)


def cloth(name: str, reflected: tuple[float, ...], let_through: tuple[float, ...]) -> bpy.types.Material:
    """What reflects and transmits half of each colour."""
    halves = ("ShaderNodeBsdfDiffuse", reflected), ("ShaderNodeBsdfTranslucent", let_through)
    return mixed(name, 0.5, *(coloured(kind, colour) for kind, colour in halves))


@effect_scene("sky", "sky map", "sun", "area lamps", "mirrors", "albedo textures", receivers=ROOM)
def living_room_by_day() -> None:
    """A window under Blender's sky and sun, a lamp under the ceiling, a mirror, a picture."""
    add_mesh("Room", room("Walls", (4.0, 4.0, 2.5), {"south": (1.0, 3.0, 0.7, 2.1)}))
    sky_texture(40.0, 0.15)
    unmirrored(area_lamp("Ceiling lamp", 40.0, WARM, (0.0, 0.5, 2.45), (0.6, 0.6)))
    add_mesh("Mirror", screen(silver(), 0.8, 1.2), at=(0.6, 1.9, 0.4))
    unwrap(
        add_mesh(
            "Picture", box((1.0, 0.04, 0.8), pictured("Canvas", image("Paint", 4, 5, seed=8), 1.0)), at=(-1.0, 1.9, 1.0)
        )
    )
    add_mesh("Table", box((1.0, 0.7, 0.6), diffuse("Wood", (0.4, 0.25, 0.12))), at=(-0.4, -0.2, 0.0), turn=20.0)


@effect_scene("sky", "sky map", "clear glass", "diffuse transmission", "point lamps", receivers=STAGE)
def greenhouse() -> None:
    """Leaves behind glass, and a lamp among them."""
    corner(diffuse("Soil", (0.3, 0.2, 0.12)))
    gradient()
    add_mesh("Pane", box((2.4, 0.02, 1.8), pane()), at=(0.3, -0.9, 0.1))
    leaf = cloth("Leaf", (0.2, 0.6, 0.1), (0.5, 0.8, 0.1))
    for number in range(3):
        add_mesh(f"Leaf {number}", canopy(leaf).scaled(0.5, 0.5, 1.0), at=(0.7 * number - 0.7, 0.3, -0.3 * number))
    point_lamp("Grow lamp", 40.0, (1.0, 0.4, 0.9), at=(0.0, 0.6, 1.7), radius=0.1)


@effect_scene("spot lamps", "area lamps", "transparency", "mirrors", "emitting surfaces", receivers=STAGE)
def show_on_a_stage() -> None:
    """Three coloured spots, a veil, a golden ball, a row of footlights."""
    corner(diffuse("Boards", (0.35, 0.25, 0.18)))
    for number, colour in enumerate(((1.0, 0.3, 0.2), (0.3, 1.0, 0.3), (0.3, 0.4, 1.0))):
        x = 1.2 * number - 1.2
        unmirrored(
            spot_lamp(
                f"Spot {number}", 300.0, colour, (x, -1.8, 2.6), (0.4 * x, 0.4, 0.0), angle=45.0, blend=0.5, radius=0.12
            )
        )
    unmirrored(area_lamp("Work light", 40.0, WARM, (0.0, 0.0, 2.6), (1.0, 1.0)))
    add_mesh("Veil", screen(made_of("Gauze", "ShaderNodeBsdfPrincipled", Base_Color=(0.8, 0.7, 0.9, 1.0), Alpha=0.4)))
    gold = made_of("Gold", "ShaderNodeBsdfPrincipled", Base_Color=(0.9, 0.6, 0.2, 1.0), Metallic=1.0, Roughness=0.4)
    add_mesh("Ball", sphere(0.4, gold), at=(0.9, 0.9, 0.1))
    add_mesh("Footlights", box((2.4, 0.1, 0.06), emission("Glow", (8.0, 6.0, 4.0))), at=(0.0, -1.7, 0.02))


@effect_scene(
    "textured emission", "emitting surfaces", "clear glass", "albedo textures", "point lamps", receivers=STAGE
)
def shop_window_at_night() -> None:
    """A screen that shows a picture, behind glass, over tiles, with small lamps."""
    corner(pictured("Tiles", image("Tiles", 4, 4, seed=9), 0.5))
    show = diffuse("Screen", (0.0, 0.0, 0.0))
    glow = show.node_tree.nodes.new("ShaderNodeEmission")
    glow.inputs["Strength"].default_value = 12.0
    texture = image_node(show, image("Film", 3, 4, seed=5, low=0.0, high=1.0), 1.0)
    texture.interpolation = "Closest"
    show.node_tree.links.new(texture.outputs["Color"], glow.inputs["Color"])
    show.node_tree.links.new(glow.outputs[0], show.node_tree.get_output_node("ALL").inputs["Surface"])
    tv = unwrap(add_mesh("Screen", box((1.6, 0.04, 1.0), show), at=(0.3, 0.6, 0.5)))
    tv.rotation_euler.x = radians(-15.0)
    add_mesh("Pane", box((2.2, 0.02, 1.6), pane()), at=(0.3, -0.4, 0.1))
    for number in range(4):
        point_lamp(f"Bulb {number}", 12.0, WARM, at=(0.8 * number - 1.2, -0.9, 1.8), radius=0.05)


@effect_scene("emitting surfaces", "transparency", "sky", "sun", "albedo textures", receivers=STAGE)
def street_at_dusk() -> None:
    """Neon, a fence with holes, a low sun, an even sky, painted ground."""
    corner(pictured("Road", image("Road", 3, 3, seed=10, low=0.2, high=0.6), 0.4))
    plain((0.2, 0.25, 0.5), 0.6)
    aim(sun_lamp("Sun", 1.5, (1.0, 0.5, 0.2), (3.0, -2.0, 1.5), (0.0, 0.0, 0.0), angle=2.0), (0.0, 0.0, 0.0))
    t = np.linspace(0.0, 2.0, 40)
    line = np.column_stack([1.2 * t - 1.2, 1.6 + 0.0 * t, 1.2 + 0.2 * np.cos(5.0 * t)])
    add_mesh("Neon", tube(line, 0.03, emission("Neon", (40.0, 8.0, 25.0))))
    unwrap(add_mesh("Fence", screen(fence()), at=(0.4, -0.4, 0.0)))


@effect_scene(
    "sky",
    "sky map",
    "diffuse transmission",
    "emitting surfaces",
    "mirrors",
    "albedo textures",
    receivers=STAGE,
)
def studio_under_a_coloured_sky() -> None:
    """A coloured sky, a lampshade with a glowing bulb in it, marble, a mirror."""
    marble = pictured("Marble", image("Marble", 5, 5, seed=11, low=0.4, high=0.9), 0.5)
    corner(marble)
    gradient(0.7)
    shade = cloth("Shade", (0.6, 0.5, 0.4), (0.8, 0.7, 0.5))
    add_mesh("Shade", sphere(0.35, shade), at=(0.8, 0.6, 0.9))
    add_mesh("Bulb", sphere(0.08, emission("Glow", (60.0, 45.0, 25.0)), segments=8), at=(0.8, 0.6, 1.15))
    add_mesh("Mirror", screen(silver(), 1.0, 1.2), at=(-0.8, 1.7, 0.1), turn=15.0)
    unmirrored(spot_lamp("Key", 120.0, COLD, (-1.5, -1.5, 2.5), (0.0, 0.3, 0.2), angle=50.0, blend=0.5, radius=0.1))
