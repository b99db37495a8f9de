"""Lamps: every kind that Blender has, alone and together, over a floor with a box and a ball on it."""

from __future__ import annotations

from math import radians

from ...sample_blends.modelling import (
    add_mesh,
    aim,
    area_lamp,
    box,
    diffuse,
    join,
    point_lamp,
    sphere,
    spot_lamp,
    sun_lamp,
)
from .catalogue import effect_scene

WARM, COLD = (1.0, 0.8, 0.6), (0.6, 0.8, 1.0)


def stage() -> None:
    """A floor with a wall behind it, a red box, and a blue ball that floats."""
    white = diffuse("White", (0.7, 0.7, 0.7))
    floor, wall = box((4.0, 4.0, 0.1), white), box((4.0, 0.1, 2.0), white)
    add_mesh("Stage", join([floor.moved(z=-0.1), wall.moved(y=2.05, z=-0.1)]))
    add_mesh("Box", box((0.8, 0.8, 0.8), diffuse("Red", (0.7, 0.2, 0.1))), at=(-0.8, 0.3, 0.1), turn=25.0)
    add_mesh("Ball", sphere(0.4, diffuse("Blue", (0.1, 0.3, 0.7))), at=(0.8, 0.2, 0.4))


@effect_scene("point lamps", "soft shadows")
def point_lamp_with_a_radius() -> None:
    stage()
    point_lamp("Bulb", 150.0, WARM, at=(0.3, -0.6, 2.0), radius=0.2)


@effect_scene("point lamps")
def point_lamp_without_a_radius() -> None:
    stage()
    point_lamp("Spark", 150.0, COLD, at=(0.3, -0.6, 2.0), radius=0.0)


@effect_scene("spot lamps", "soft shadows")
def spot_lamp_with_a_soft_cone() -> None:
    stage()
    spot_lamp("Torch", 400.0, WARM, (0.0, -1.5, 2.5), (0.0, 0.2, 0.2), angle=50.0, blend=0.6, radius=0.1)


@effect_scene("sun", "soft shadows")
def sun_of_five_degrees() -> None:
    stage()
    sun_lamp("Sun", 3.0, WARM, (2.0, -2.0, 3.0), (0.0, 0.0, 0.0), angle=5.0)


@effect_scene("area lamps", "soft shadows")
def square_area_lamp() -> None:
    stage()
    area_lamp("Softbox", 150.0, COLD, (0.2, -0.5, 2.2), (0.8, 0.8))


@effect_scene("area lamps", "soft shadows")
def elliptic_area_lamp_with_spread() -> None:
    stage()
    lamp = aim(area_lamp("Oval", 150.0, WARM, (1.0, -1.2, 2.2), (1.0, 0.4)), (0.0, 0.2, 0.2))
    lamp.data.shape = "ELLIPSE"
    lamp.data.spread = radians(100.0)


@effect_scene("area lamps", "soft shadows")
def area_lamp_large_and_near() -> None:
    """Larger than what it lights, and half of it hidden from much of that."""
    stage()
    area_lamp("Ceiling", 300.0, (1.0, 1.0, 1.0), (0.0, 0.0, 1.3), (3.0, 3.0))


@effect_scene("point lamps", "spot lamps", "sun", "area lamps", "soft shadows")
def all_lamps_together() -> None:
    stage()
    point_lamp("Bulb", 60.0, WARM, at=(-1.0, -1.0, 1.6), radius=0.1)
    spot_lamp("Torch", 150.0, COLD, (1.5, -1.5, 2.0), (0.5, 0.3, 0.2), angle=40.0, blend=0.3, radius=0.05)
    sun_lamp("Sun", 0.8, WARM, (-2.0, -2.0, 3.0), (0.0, 0.0, 0.0), angle=2.0)
    area_lamp("Softbox", 40.0, COLD, (0.2, 0.2, 2.2), (0.5, 0.5))


@effect_scene("point lamps", "soft shadows")
def hall_of_two_hundred_lamps() -> None:
    """All of them matter a little everywhere, and the box hides some from every place."""
    stage()
    for k in range(200):
        x, y = (k % 20) / 19.0 * 3.6 - 1.8, (k // 20) / 9.0 * 3.6 - 1.8
        point_lamp(f"Bulb {k}", 1.0, WARM if k % 2 else COLD, at=(x, y, 2.0), radius=0.02)
