"""Blender's lamps as core.scene's, with the meaning that Cycles gives them.

Each conversion was measured against Cycles' Combined bake in Blender 5.0.1 (tests/addon/test_lamps.py repeats it).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import bpy
import numpy as np

from ..core.scene import RGB, AreaLamp, Float64, Lamp, PointLamp, Portal, SpotLamp, SunLamp, Vector
from .compat import casts_shadow, lamp_strength
from .materials import read_lamp_nodes

#: An area lamp's beam is at least this wide (radians): Cycles' exactly parallel beam has no radiance to speak of.
NARROWEST_SPREAD = math.radians(1.0)


def read_lamp(name: str, lamp: bpy.types.Light, matrix: Float64) -> tuple[Lamp | None, list[str]]:
    """A lamp in world space, and warnings. None when it gives no light: no strength, no size, a sampling portal.

    name: what messages call it. matrix: (4, 4) float64, lamp to world.
    """
    cycles = getattr(lamp, "cycles", None)
    if getattr(cycles, "is_portal", False):
        return None, []
    factor, warnings = read_lamp_nodes(lamp)
    strength = np.array(lamp_strength(lamp, matrix)) * factor
    if not strength.any():
        return None, warnings
    if strength.min() < 0.0:
        warnings.append(
            f"Lamp '{name}' takes light away (negative strength): it is left out. Make its energy positive."
        )
        return None, warnings
    if lamp.type != "POINT" and np.linalg.det(matrix[:3, :3]) == 0.0:
        warnings.append(f"Lamp '{name}' is scaled to nothing along an axis: it is left out. Give it a scale of 1.")
        return None, warnings
    read = READERS[lamp.type](name, lamp, matrix, strength, warnings)
    return read and replace(read, casts_shadow=casts_shadow(lamp)), warnings


def read_portal(name: str, lamp: bpy.types.Light, matrix: Float64) -> Portal | None:
    """An area lamp that is a portal: it gives no light, but tells where the sky shines in. None for any other lamp.

    A round one stands for the rectangle around it, and one without area for none.
    """
    if lamp.type != "AREA" or not getattr(getattr(lamp, "cycles", None), "is_portal", False):
        return None
    lamp_like = _area(name, lamp, matrix, np.ones(3), [])
    if lamp_like is None:
        return None
    return Portal(name, lamp_like.center, lamp_like.half_u, lamp_like.half_v, lamp_like.normal)


def warn_of_linking(name: str, obj: bpy.types.Object) -> list[str]:
    """Warnings where an object shines on, or is shadowed by, some objects only."""
    linking = getattr(obj, "light_linking", None)
    if linking is None or not (linking.receiver_collection or linking.blocker_collection):
        return []
    return [f"Light linking of '{name}' is not baked: it shines on everything, and everything stands in its light."]


def _point(name: str, lamp: bpy.types.PointLight, matrix: Float64, strength: Float64, _: list[str]) -> PointLamp:
    return PointLamp(
        name,
        position=_vector(matrix[:3, 3]),
        intensity=_rgb(strength / (4.0 * math.pi)),
        radius=lamp.shadow_soft_size,  # The object's scale doesn't enter, in Cycles either.
        facing_disc=lamp.use_soft_falloff,
    )


def _spot(name: str, lamp: bpy.types.SpotLight, matrix: Float64, strength: Float64, _: list[str]) -> SpotLamp:
    axes = matrix[:3, :3].T
    return SpotLamp(
        name,
        position=_vector(matrix[:3, 3]),
        intensity=_rgb(strength / (4.0 * math.pi)),
        axes=(_vector(axes[0]), _vector(axes[1]), _vector(axes[2])),
        cone_angle=lamp.spot_size,
        blend=lamp.spot_blend,
        radius=lamp.shadow_soft_size,
        facing_disc=lamp.use_soft_falloff,
    )


def _sun(name: str, lamp: bpy.types.SunLight, matrix: Float64, strength: Float64, _: list[str]) -> SunLamp:
    return SunLamp(
        name,
        direction=_vector(-matrix[:3, 2] / np.linalg.norm(matrix[:3, 2])),
        irradiance=_rgb(strength),
        angle=lamp.angle,
    )


def _area(
    name: str, lamp: bpy.types.AreaLight, matrix: Float64, strength: Float64, warnings: list[str]
) -> AreaLamp | None:
    """Power is kept whatever the object's scale, so the radiance follows from the scaled area."""
    ellipse = lamp.shape in {"DISK", "ELLIPSE"}
    half_u = 0.5 * lamp.size * matrix[:3, 0]
    half_v = 0.5 * (lamp.size_y if lamp.shape in {"RECTANGLE", "ELLIPSE"} else lamp.size) * matrix[:3, 1]
    normal = np.cross(half_u, half_v)
    area = (math.pi if ellipse else 4.0) * float(np.linalg.norm(normal))
    if area == 0.0:
        warnings.append(f"Lamp '{name}' has no area, so it gives no light. Give it a size.")
        return None
    # Along -Z of the object, also where a negative scale turns the axes' cross product round.
    normal *= -math.copysign(1.0, float(normal @ matrix[:3, 2])) / np.linalg.norm(normal)
    return AreaLamp(
        name,
        center=_vector(matrix[:3, 3]),
        half_u=_vector(half_u),
        half_v=_vector(half_v),
        normal=_vector(normal),
        radiance=_rgb(strength / (math.pi * area)),
        shape="ellipse" if ellipse else "rectangle",
        spread=max(lamp.spread, NARROWEST_SPREAD),
    )


#: Blender's kind of lamp to its reader: (name, lamp, matrix, strength, warnings) to a lamp.
READERS: dict[str, Callable[..., Lamp | None]] = {"POINT": _point, "SPOT": _spot, "SUN": _sun, "AREA": _area}


def _vector(values: Float64) -> Vector:
    return (float(values[0]), float(values[1]), float(values[2]))


def _rgb(values: Float64) -> RGB:
    return (float(values[0]), float(values[1]), float(values[2]))
