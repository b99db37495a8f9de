"""Every difference between the supported Blenders, each found by asking for the feature, and for the version only where
nothing else tells."""

from __future__ import annotations

import bpy
import numpy as np

from ..core.scene import RGB, Float32, Float64


def shader_tree(owner: bpy.types.Material | bpy.types.World | bpy.types.Light) -> bpy.types.NodeTree | None:
    """The node tree that shades a material, world or lamp; None when plain colours do.

    Where Blender deprecated the `use_nodes` switch, nodes are always in use and asking for the switch is a warning.
    """
    switch = owner.bl_rna.properties.get("use_nodes")
    if switch is None or getattr(switch, "is_deprecated", False) or owner.use_nodes:
        return owner.node_tree
    return None


def lamp_strength(lamp: bpy.types.Light, matrix: Float64) -> RGB:
    """Power (W) or, for a sun, irradiance (W/m^2) per channel: colour x energy and, from Blender 4.5, the rest.

    matrix: (4, 4) world matrix of the lamp object; an area lamp that isn't normalised shines with its scaled area.
    Measured against Cycles 5.0.1 and 5.2.3: x temperature colour x 2^exposure, x `Light.area()` when not normalised.
    """
    strength = np.array(lamp.color, np.float64) * lamp.energy
    if hasattr(lamp, "exposure"):
        strength *= 2.0**lamp.exposure
    if getattr(lamp, "use_temperature", False):
        strength *= np.array(lamp.temperature_color, np.float64)
    if not getattr(lamp, "normalize", True):
        strength *= lamp.area(matrix_world=matrix.T.tolist())
    return (float(strength[0]), float(strength[1]), float(strength[2]))


def casts_shadow(lamp: bpy.types.Light) -> bool:
    """Whether Cycles lets anything stand in the lamp's light: a setting of Cycles' own at first, of the lamp later."""
    return bool(getattr(getattr(lamp, "cycles", None), "cast_shadow", lamp.use_shadow))


def rough_colour(colour: Float64) -> Float64:
    """What a rough diffuse surface (..., 3) does to the colour of light that leaves it after several bounces on its own
    microfacets, beside what their number does: once too often before Blender 5.3.

    Measured in furnaces of Cycles 5.0.1, 5.2.3 and 5.3.0, to 1e-4. There is no property to ask for.
    """
    return colour if bpy.app.version >= (5, 3, 0) else colour**2


def set_corner_normals(mesh: bpy.types.Mesh, normals: Float32) -> None:
    """Give every corner its shading normal, (l, 3) unit vectors.

    Newer Blenders take them as they are, as an attribute. Older ones convert each to the space of its corner, which
    takes a second for 600,000.
    """
    attribute = mesh.attributes.new("custom_normal", "FLOAT_VECTOR", "CORNER")
    attribute.data.foreach_set("vector", normals.ravel())
    mesh.update()
    if not mesh.has_custom_normals:
        mesh.attributes.remove(mesh.attributes["custom_normal"])
        mesh.normals_split_custom_set(normals)
