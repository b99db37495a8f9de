"""Builds cornell_box_area_lamp.blend and cornell_box_emitter.blend beside this file.

Geometry and spectra are the measured ones of the Cornell University Program of Computer Graphics ("Cornell Box Data"),
in millimetres with y up and the camera looking along +z. Here they become metres with z up, the camera looking along +y
and the room centred on x = 0. The real room is not quite square: the red wall leans, and so it does here.
"""

from __future__ import annotations

from math import pi, sqrt
from pathlib import Path

import bpy
import numpy as np
from cornell_spectra import GREEN, LAMP, RED, WHITE, linear_rgb
from modelling import (
    Colour,
    add_camera,
    add_mesh,
    area_lamp,
    diffuse,
    emission,
    new_scene,
    polygons,
    save,
    show,
)

#: Corners of the room, in the measured axes and millimetres. The front is open.
FLOOR = ((552.8, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 559.2), (549.6, 0.0, 559.2))
CEILING = ((556.0, 548.8, 0.0), (0.0, 548.8, 0.0), (0.0, 548.8, 559.2), (556.0, 548.8, 559.2))
LIGHT = ((343.0, 548.8, 227.0), (213.0, 548.8, 227.0), (213.0, 548.8, 332.0), (343.0, 548.8, 332.0))
SHORT_BLOCK = ((130.0, 165.0, 65.0), (82.0, 165.0, 225.0), (240.0, 165.0, 272.0), (290.0, 165.0, 114.0))
TALL_BLOCK = ((423.0, 330.0, 247.0), (265.0, 330.0, 296.0), (314.0, 330.0, 456.0), (472.0, 330.0, 406.0))

#: Radiance of the light's brightest channel, W/(m^2 sr). The measured lamp is known up to a factor; this one exposes
#: the picture without any help from the view settings.
LIGHT_RADIANCE = 42.0

#: How far below the ceiling the area lamp hangs, metres.
LAMP_GAP = 0.001


def metres(points: tuple[tuple[float, float, float], ...]) -> np.ndarray:
    """Measured millimetres (n, 3) with y up to metres with z up, seen from the front with red on the left."""
    x, y, z = np.array(points).T
    return np.column_stack([278.0 - x, z, y]) / 1000.0


def light_radiance() -> Colour:
    """The measured lamp as an eye sees it that is half adapted to it: square roots of its channel ratios.

    Unadapted, the lamp is a deep yellow that drowns the colours of the walls.
    """
    measured = linear_rgb(LAMP)
    red, green, blue = (LIGHT_RADIANCE * sqrt(channel / max(measured)) for channel in measured)
    return red, green, blue


def build(variant: str) -> None:
    """One of the two files: 'area_lamp' hangs a lamp below a whole ceiling, 'emitter' sets a shining quad into it."""
    scene = new_scene(world_colour=(0.0, 0.0, 0.0))
    scene.render.resolution_x = scene.render.resolution_y = 600
    show(scene, "Standard")
    white, green, red = (
        diffuse(name, linear_rgb(spectrum)) for name, spectrum in (("White", WHITE), ("Green", GREEN), ("Red", RED))
    )
    light, radiance = metres(LIGHT), light_radiance()

    vertices = np.concatenate([metres(FLOOR), metres(CEILING)])
    walls = {(0, 1, 2, 3): white, (6, 7, 3, 2): white, (5, 6, 2, 1): green, (7, 4, 0, 3): red}
    if variant == "emitter":
        vertices = np.concatenate([vertices, light])
        ceiling = [(8, 9, 5, 4), (9, 10, 6, 5), (10, 11, 7, 6), (11, 8, 4, 7)]
        add_mesh("Light", polygons(light, [(3, 2, 1, 0)], emission("Light", radiance)))
    else:
        ceiling = [(7, 6, 5, 4)]
        hang_lamp(light, radiance)
    faces = [*walls, *ceiling]
    room = add_mesh("Room", polygons(vertices, faces, [*walls.values(), *[white] * len(ceiling)]))
    blocks = [add_block("Short block", SHORT_BLOCK, white), add_block("Tall block", TALL_BLOCK, white)]

    add_camera(at=(0.0, -0.8, 0.273), target=(0.0, 0.0, 0.273), focal_length=35.0, sensor_width=25.0)
    save(Path(__file__).with_name(f"cornell_box_{variant}.blend"), [room, *blocks])


def hang_lamp(light: np.ndarray, radiance: Colour) -> None:
    """An area lamp of the light's size and radiance: a lamp of power s has radiance s / (pi A)."""
    width, depth = np.ptp(light[:, 0]), np.ptp(light[:, 1])
    peak = max(radiance)
    x, y, z = light.mean(axis=0)
    colour = (radiance[0] / peak, radiance[1] / peak, radiance[2] / peak)
    area_lamp("Lamp", peak * pi * width * depth, colour, (x, y, z - LAMP_GAP), (width, depth))


def add_block(name: str, top: tuple[tuple[float, float, float], ...], material: bpy.types.Material) -> bpy.types.Object:
    """A block of five faces that stands on the floor; as in the data it has no bottom."""
    upper = metres(top)
    vertices = np.concatenate([upper, upper * (1.0, 1.0, 0.0)])
    sides = [(k, k + 4, (k + 1) % 4 + 4, (k + 1) % 4) for k in range(4)]
    return add_mesh(name, polygons(vertices, [(0, 1, 2, 3), *sides], material))


if __name__ == "__main__":
    build("area_lamp")
    build("emitter")
