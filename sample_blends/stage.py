"""Builds stage.blend beside this file: smooth forms on a stage, lit by eight spot lamps and one point lamp, no sky.

The stage is a cyclorama, a floor that rises into the back wall in one curve. x runs across it; the audience looks
along +y.
"""

from __future__ import annotations

from math import pi
from pathlib import Path

import bpy
import numpy as np
from modelling import (
    Colour,
    Shape,
    add_camera,
    add_mesh,
    aim,
    curve,
    diffuse,
    hanging_cloth,
    join,
    lathe,
    new_scene,
    point_lamp,
    save,
    sheet,
    show,
    sphere,
    spot_lamp,
    tube,
)

Material = bpy.types.Material

#: What keeps two solids apart that seem to touch.
GAP = 0.0005
STEP_HEIGHT, STEPS = 0.16, 3
PODIUM = STEP_HEIGHT * STEPS
TRUSS_HEIGHT, TRUSS_Y = 4.5, 2.3

PALETTE: dict[str, Colour] = {
    "Backdrop": (0.62, 0.60, 0.58),
    "Podium": (0.46, 0.44, 0.43),
    "Plinth": (0.55, 0.53, 0.50),
    "Ivory": (0.80, 0.76, 0.68),
    "Plaster": (0.78, 0.77, 0.75),
    "Gold": (0.72, 0.44, 0.12),
    "Coral": (0.72, 0.22, 0.16),
    "Blue": (0.12, 0.24, 0.56),
    "Cloth": (0.74, 0.70, 0.66),
    "Velvet": (0.44, 0.03, 0.035),
    "Iron": (0.06, 0.06, 0.065),
}

#: name, power in W, colour, position, target, cone angle, blend
SPOTS: list[tuple[str, float, Colour, tuple[float, ...], tuple[float, ...], float, float]] = [
    ("Key", 1800.0, (1.0, 0.80, 0.56), (-3.2, -5.4, 5.0), (0.0, -0.5, 1.0), 38.0, 0.85),
    ("Amber", 1900.0, (1.0, 0.52, 0.18), (1.6, -5.4, 5.0), (-3.1, -0.1, 1.2), 29.0, 0.6),
    ("Violet", 2100.0, (0.66, 0.44, 1.0), (-1.2, -5.4, 5.0), (3.1, -0.1, 1.3), 29.0, 0.6),
    ("Magenta", 900.0, (1.0, 0.12, 0.55), (-2.3, TRUSS_Y, TRUSS_HEIGHT), (0.3, -0.4, 0.9), 42.0, 0.35),
    ("Cyan", 900.0, (0.10, 0.75, 1.0), (2.3, TRUSS_Y, TRUSS_HEIGHT), (-0.3, -0.4, 0.9), 42.0, 0.35),
    ("White", 700.0, (1.0, 0.92, 0.80), (0.0, TRUSS_Y, TRUSS_HEIGHT), (0.0, -1.0, 0.0), 34.0, 0.5),
    ("Blue wash", 420.0, (0.10, 0.22, 1.0), (-3.0, 1.7, 0.236), (-1.6, 4.2, 2.2), 120.0, 1.0),
    ("Rose wash", 420.0, (1.0, 0.16, 0.34), (3.0, 1.7, 0.236), (1.6, 4.2, 2.2), 120.0, 1.0),
]


def build() -> None:
    scene = new_scene(world_colour=(0.0, 0.0, 0.0))
    scene.render.resolution_x, scene.render.resolution_y = 1200, 800
    show(scene, "Standard", exposure=0.1)
    paint = {name: diffuse(name, colour) for name, colour in PALETTE.items()}

    knot = torus_knot(paint["Ivory"])
    middle = (0.0, 0.0, PODIUM + 0.302 - float(knot.vertices[:, 2].min()))

    receivers = [
        add_mesh("Cyclorama", cyclorama(paint["Backdrop"])),
        add_mesh("Podium", podium(paint["Podium"]), at=(0.0, 0.0, GAP)),
        add_mesh("Knot plinth", drum(0.40, 0.30, paint["Plinth"]), at=(0.0, 0.0, PODIUM + 2.0 * GAP)),
        add_mesh("Torus knot", knot, at=middle),
        add_mesh("Draped table", draped_table(paint["Cloth"]), at=(-2.75, 0.25, GAP)),
        add_mesh("Amphora", amphora(paint["Gold"]), at=(-2.75, 0.25, 0.902)),
        add_mesh("Dancer plinth", drum(0.52, 0.20, paint["Plinth"]), at=(2.75, 0.25, GAP)),
        add_mesh("Dancer", dancer(paint["Plaster"]), at=(2.75, 0.25, 0.201)),
        add_mesh("Coral ball", sphere(0.34, paint["Coral"], 32), at=(-1.35, -1.75, GAP)),
        add_mesh("Blue ball", sphere(0.22, paint["Blue"], 28), at=(1.70, -1.55, GAP)),
        add_mesh("Ivory ball", sphere(0.13, paint["Ivory"], 24), at=(1.22, -2.0, GAP)),
        add_mesh("Left column", column(paint["Plaster"]), at=(-3.65, 1.9, GAP)),
        add_mesh("Right column", column(paint["Plaster"]), at=(3.65, 1.9, GAP)),
        add_mesh("Left curtain", curtain(paint["Velvet"]), at=(-4.0, -1.2, 0.01)),
        add_mesh("Right curtain", curtain(paint["Velvet"]), at=(4.0, -1.2, 0.01), turn=180.0),
        add_mesh("Truss", truss(paint["Iron"]), at=(0.0, TRUSS_Y + 0.12, TRUSS_HEIGHT + 0.34)),
    ]
    for name, power, colour, position, target, angle, blend in SPOTS:
        spot_lamp(name, power, colour, position, target, angle=angle, blend=blend, radius=0.05)
        receivers.append(aim(add_mesh(f"{name} can", can(paint["Iron"]), at=position), target))
    point_lamp("Ember", 30.0, (1.0, 0.42, 0.12), at=middle, radius=0.07)
    add_camera(at=(0.0, -8.6, 1.8), target=(0.0, 0.0, 1.66), focal_length=37.0)
    save(Path(__file__).with_name("stage.blend"), receivers)


# The stage


def cyclorama(material: Material) -> Shape:
    """Floor, curve and back wall as one smooth sheet, 6 cm thick; the floor's upper side is z = 0."""
    thickness, radius, back = 0.06, 1.6, 4.2
    angles = np.linspace(0.0, pi / 2.0, 13)
    bend = [(back - radius + radius * np.sin(a), radius - radius * np.cos(a)) for a in angles]
    profile = [*[(y, 0.0) for y in np.linspace(-5.0, back - radius, 9)[:-1]], *bend]
    profile += [(back, z) for z in np.linspace(radius, 6.0, 6)[1:]]
    y, z = np.array(profile).T
    x = np.linspace(-6.0, 6.0, 13)
    points = np.stack([np.repeat(x[:, None], len(y), 1), *(np.repeat(v[None], len(x), 0) for v in (y, z))], axis=-1)
    return sheet(points, thickness, material).moved(z=-thickness / 2.0)


def podium(material: Material) -> Shape:
    """Three round steps."""
    profile = [(0.0, 0.0)]
    for k in range(STEPS):
        radius = 1.75 - 0.38 * k
        bottom, top = k * STEP_HEIGHT, (k + 1) * STEP_HEIGHT
        profile += [(radius, bottom), (radius, top - 0.015), (radius - 0.015, top)]
    return lathe([*profile, (0.0, PODIUM)], material, 72)


def curtain(material: Material) -> Shape:
    return hanging_cloth((1.9, 5.6), 0.02, material, folds=7, depth=0.16)


def drum(radius: float, height: float, material: Material) -> Shape:
    """A round plinth with a chamfered edge."""
    return lathe(
        [(0.0, 0.0), (radius, 0.0), (radius, height - 0.012), (radius - 0.012, height), (0.0, height)], material, 48
    )


def torus_knot(material: Material) -> Shape:
    """The (2, 3) torus knot, upright, its middle at the origin."""
    t = np.linspace(0.0, 2.0 * pi, 120, endpoint=False)
    ring = 0.62 + 0.255 * np.cos(3.0 * t)
    line = np.column_stack([ring * np.sin(2.0 * t), 0.285 * np.sin(3.0 * t), ring * np.cos(2.0 * t)])
    return tube(line, 0.13, material, 16, closed=True)


def draped_table(material: Material) -> Shape:
    """A round table under a cloth that falls to the floor in folds."""
    edge = curve([(0.44, 0.90), (0.485, 0.87), (0.50, 0.78), (0.53, 0.45), (0.59, 0.15), (0.66, 0.0)], 3)
    solid = lathe([(0.0, 0.9), (0.22, 0.9), *edge, (0.0, 0.0)], material, 96)

    def fold(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, ...]:
        angle, fall = np.arctan2(y, x), np.clip((0.88 - z) / 0.88, 0.0, 1.0)
        wave = np.cos(12.0 * angle + 0.8 * np.sin(3.0 * angle)) * (1.0 + 0.35 * np.sin(5.0 * angle + 1.0))
        swell = 1.0 + 0.115 * fall**0.8 * wave
        return x * swell, y * swell, z

    return solid.reshaped(fold)


def amphora(material: Material) -> Shape:
    """A vase with two handles."""
    profile = curve(
        [(0.12, 0.0), (0.10, 0.05), (0.23, 0.32), (0.245, 0.46), (0.10, 0.64), (0.085, 0.74), (0.14, 0.80)], 5
    )
    body = lathe([(0.0, 0.0), *profile, (0.12, 0.80), (0.07, 0.745), (0.0, 0.735)], material, 36)
    a = np.linspace(0.0, 1.0, 11)
    handle = np.column_stack([0.088 + 0.17 * np.sin(pi * a) ** 0.8 + 0.135 * a, 0.0 * a, 0.735 - 0.20 * a])
    return join([body, *(tube(handle * (side, 1.0, 1.0), 0.017, material, 8) for side in (1.0, -1.0))])


def dancer(material: Material) -> Shape:
    """A turned figure: a pleated skirt, waist, shoulders, neck and head."""
    skirt = curve([(0.46, 0.0), (0.44, 0.06), (0.30, 0.34), (0.19, 0.68), (0.115, 0.92)], 4)
    torso = curve([(0.115, 0.92), (0.17, 1.10), (0.20, 1.24), (0.15, 1.35), (0.065, 1.42), (0.058, 1.48)], 3)
    angles = np.linspace(-1.12, pi / 2.0, 11)[:-1]
    head = [(0.135 * np.cos(a), 1.60 + 0.155 * np.sin(a)) for a in angles]
    solid = lathe([(0.0, 0.0), *skirt, *torso[1:], *head, (0.0, 1.755)], material, 60)

    def pleat(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, ...]:
        angle, fall = np.arctan2(y, x), np.clip((0.9 - z) / 0.9, 0.0, 1.0)
        swell = 1.0 + 0.085 * fall * np.cos(12.0 * angle + 2.2 * fall)
        return x * swell, y * swell, z

    return solid.reshaped(pleat)


def column(material: Material) -> Shape:
    """A fluted column with base and capital."""
    base = [(0.0, 0.0), (0.40, 0.0), (0.40, 0.10), (0.36, 0.12), (0.36, 0.17), (0.31, 0.20)]
    shaft = [(0.285 - 0.045 * t, 0.24 + 3.2 * t) for t in np.linspace(0.0, 1.0, 3)]
    capital = [(0.29, 3.50), (0.36, 3.60), (0.36, 3.72), (0.0, 3.72)]
    solid = lathe([*base, *shaft, *capital], material, 64)

    def flute(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, ...]:
        on_shaft = (z > 0.23) & (z < 3.45)
        swell = 1.0 - 0.035 * on_shaft * (1.0 + np.cos(16.0 * np.arctan2(y, x)))
        return x * swell, y * swell, z

    return solid.reshaped(flute)


def truss(material: Material) -> Shape:
    """Two rails with a zigzag between them, from which the lamps hang."""
    length, height, bays = 10.6, 0.30, 18
    rails = [
        tube(np.array([(-length / 2.0, 0.0, z), (length / 2.0, 0.0, z)]), 0.03, material, 6) for z in (0.0, height)
    ]
    x = np.linspace(-length / 2.0 + 0.1, length / 2.0 - 0.1, bays + 1)
    braces = []
    for k in range(bays):
        low, high = (0.05, height - 0.05)[:: 1 if k % 2 else -1]
        braces.append(tube(np.array([(x[k] + 0.03, 0.0, low), (x[k + 1] - 0.03, 0.0, high)]), 0.012, material, 4))
    return join([*rails, *braces])


def can(material: Material) -> Shape:
    """A lamp housing, open along -z; the lamp sits at the origin, in its mouth."""
    return lathe(
        [(0.0, 0.30), (0.07, 0.30), (0.115, 0.22), (0.12, 0.0), (0.112, 0.0), (0.107, 0.21), (0.0, 0.24)], material, 28
    )


if __name__ == "__main__":
    build()
