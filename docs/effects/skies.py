"""Skies: of one colour, in colours, with suns, over a stage and through the windows of a room."""

from __future__ import annotations

from math import radians

import bpy
import numpy as np

from ...sample_blends.modelling import Colour, Point, Shape, add_mesh, box, diffuse, join, point_lamp, polygons
from .catalogue import effect_scene
from .lamps import WARM, stage

ROOM = ("Room",)


def world() -> tuple[bpy.types.NodeTree, bpy.types.ShaderNode]:
    """The nodes of a new world, and its background."""
    made = bpy.data.worlds.new("Sky")
    bpy.context.scene.world = made
    if made.node_tree is None:
        made.use_nodes = True
    return made.node_tree, made.node_tree.nodes["Background"]


def plain(colour: Colour, strength: float = 1.0) -> None:
    _, background = world()
    background.inputs["Color"].default_value = (*colour, 1.0)
    background.inputs["Strength"].default_value = strength


def coloured_by(node: bpy.types.ShaderNode, strength: float = 1.0) -> None:
    """A world in the colours of a node of its tree."""
    tree = node.id_data
    background = tree.nodes["Background"]
    background.inputs["Strength"].default_value = strength
    tree.links.new(node.outputs[0], background.inputs["Color"])


def gradient(strength: float = 1.0) -> None:
    """From brown below to blue above."""
    tree, _ = world()
    ramp, apart = tree.nodes.new("ShaderNodeValToRGB"), tree.nodes.new("ShaderNodeSeparateXYZ")
    place = tree.nodes.new("ShaderNodeTexCoord")
    ramp.color_ramp.elements[0].color, ramp.color_ramp.elements[1].color = (0.9, 0.5, 0.2, 1.0), (0.1, 0.3, 1.0, 1.0)
    tree.links.new(place.outputs["Generated"], apart.inputs[0])
    tree.links.new(apart.outputs["Z"], ramp.inputs[0])
    coloured_by(ramp, strength)


def environment(sun: float, strength: float = 1.0) -> None:
    """A picture of 512 x 256 pixels: blue above and brown below, and a spot of four pixels that is so bright."""
    tree, _ = world()
    pixels = np.ones((256, 512, 4), np.float32)
    pixels[:128, :, :3], pixels[128:, :, :3] = (0.2, 0.15, 0.1), (0.3, 0.5, 0.9)
    pixels[205:207, 340:342, :3] = sun
    picture = bpy.data.images.new("Panorama", 512, 256, float_buffer=True)
    picture.pixels.foreach_set(pixels.ravel())
    texture = tree.nodes.new("ShaderNodeTexEnvironment")
    texture.image, texture.interpolation = picture, "Closest"
    coloured_by(texture, strength)


def sky_texture(elevation: float, strength: float = 0.05) -> None:
    """Blender's own sky, with the disc of its sun."""
    tree, _ = world()
    texture = tree.nodes.new("ShaderNodeTexSky")
    texture.sun_elevation, texture.sun_rotation = radians(elevation), radians(160.0)
    coloured_by(texture, strength)


def room(name: str, size: Point, windows: dict[str, tuple[float, float, float, float]], at: Point = (0, 0, 0)) -> Shape:
    """The inside of a box that stands on z = 0, centred on x = y = 0. windows: by wall (west, east, south, north) from
    where to where along it, and from which height to which."""
    white = diffuse(name, (0.7, 0.7, 0.7))
    x, y, z = size[0] / 2, size[1] / 2, size[2]
    walls = {
        "west": ((-x, y), (-x, -y)),
        "east": ((x, -y), (x, y)),
        "south": ((-x, -y), (x, -y)),
        "north": ((x, y), (-x, y)),
    }
    floor = [(-x, -y, 0.0), (x, -y, 0.0), (x, y, 0.0), (-x, y, 0.0)]
    faces = [floor, [(a, b, z) for a, b, _ in reversed(floor)]]
    for wall, (start, end) in walls.items():
        begin, way = np.array(start), np.subtract(end, start)
        length = float(np.linalg.norm(way))
        low, high, sill, head = windows.get(wall, (length, length, 0.0, z))
        for u0, u1, z0, z1 in ((0, low, 0, z), (high, length, 0, z), (low, high, 0, sill), (low, high, head, z)):
            if u1 > u0 and z1 > z0:
                a, b = (begin + u / length * way for u in (u0, u1))
                faces.append([(*b, z0), (*a, z0), (*a, z1), (*b, z1)])
    corners = np.array(faces, dtype=float).reshape(-1, 3)
    return polygons(corners, np.arange(len(corners)).reshape(-1, 4).tolist(), white).moved(*at)


def furnished(size: Point = (4.0, 4.0, 2.5), window: tuple[float, float, float, float] = (1.4, 2.6, 0.9, 1.9)) -> None:
    """A room with a window in its east wall, and a box in it."""
    add_mesh("Room", room("Walls", size, {"east": window}))
    add_mesh("Box", box((0.8, 0.8, 0.8), diffuse("Red", (0.7, 0.2, 0.1))), at=(-0.4, 0.5, 0.0), turn=25.0)


@effect_scene("sky")
def sky_of_one_colour() -> None:
    stage()
    plain((0.6, 0.8, 1.0))


@effect_scene("sky", "sky map")
def sky_in_a_gradient() -> None:
    stage()
    gradient()


@effect_scene("sky", "sky map", "sky lights")
def picture_of_a_sky_with_a_small_bright_sun() -> None:
    """The sun is as small as a pixel or two, and brings two thirds of the light."""
    stage()
    environment(12_000.0)


@effect_scene("sky", "sky map", "sun")
def sky_texture_with_its_sun() -> None:
    stage()
    sky_texture(35.0)


@effect_scene("sky", "portals", receivers=ROOM)
def room_lit_through_a_window() -> None:
    """Nobody has placed a portal."""
    furnished()
    plain((0.6, 0.8, 1.0), 4.0)


@effect_scene("sky", "sky map", "portals", receivers=ROOM)
def room_lit_through_a_window_by_a_gradient() -> None:
    furnished()
    gradient(4.0)


@effect_scene("sky", "portals", receivers=("Room", "Hall"))
def room_lit_through_a_doorway() -> None:
    """From a hall with a window in it."""
    size = (3.0, 4.0, 2.5)
    add_mesh("Room", room("Walls", size, {"east": (1.5, 2.5, 0.0, 2.1)}))
    add_mesh("Hall", room("Hall", size, {"west": (0.0, 4.0, 0.0, 2.5), "east": (0.8, 3.2, 0.8, 2.0)}, at=(3.0, 0, 0)))
    plain((0.8, 0.9, 1.0), 4.0)


@effect_scene("sky", "sky map", "sky lights", receivers=ROOM)
def sunbeam_through_a_window() -> None:
    """From a picture of the sky: the spot of sun on the floor, and what it lights in turn."""
    furnished(window=(1.2, 2.8, 0.5, 2.1))
    environment(12_000.0)


@effect_scene("point lamps", "bounces", receivers=ROOM)
def closed_room_under_a_bright_sky() -> None:
    """No ray finds the sky, so it is left out."""
    add_mesh("Room", join([room("Walls", (4.0, 4.0, 2.5), {})]))
    add_mesh("Box", box((0.8, 0.8, 0.8), diffuse("Red", (0.7, 0.2, 0.1))), at=(-0.4, 0.5, 0.0), turn=25.0)
    point_lamp("Bulb", 60.0, WARM, at=(0.3, -0.6, 1.8), radius=0.1)
    plain((0.6, 0.8, 1.0), 1.0)
