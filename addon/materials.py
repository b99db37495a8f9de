"""Materials and worlds as one constant albedo and one constant emission each: the diffuse part of what Cycles sees.

A table maps each shader node to its converter; a node that is not in it is named in a warning. Only constants are read:
unlinked sockets, and RGB and Value nodes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import bpy
import numpy as np

from ..core.scene import ALBEDO_LIMIT, RGB, Float64, Surface
from .compat import shader_tree

#: What Cycles gives faces without a material: its default Principled BSDF, of which `_principled` makes this.
DEFAULT_SURFACE = Surface("", albedo=(0.8, 0.8, 0.8))

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def read_material(material: bpy.types.Material) -> tuple[Surface, list[str]]:
    """The surface that Cycles' diffuse bake would see, and warnings that name what could not be read."""
    tree = shader_tree(material)
    if tree is None:
        return Surface(material.name, albedo=_rgb(np.array(material.diffuse_color[:3]))), []
    reader = _TreeReader(f"Material '{material.name}'")
    shading = reader.output(tree)
    if shading.albedo.max() > ALBEDO_LIMIT:
        reader.warn(f"reflects more than it receives; its colour is limited to {ALBEDO_LIMIT}. Lower the base colour.")
    albedo = np.clip(shading.albedo, 0.0, ALBEDO_LIMIT)
    emission = np.maximum(shading.emission, 0.0)
    return Surface(material.name, albedo=_rgb(albedo), emission=_rgb(emission)), reader.warnings


def read_world(world: bpy.types.World | None) -> tuple[RGB, list[str]]:
    """Radiance of the sky, W/(m^2 sr), and warnings. Without a world Cycles' sky is black."""
    if world is None:
        return (0.0, 0.0, 0.0), []
    tree = shader_tree(world)
    if tree is None:
        return _rgb(np.array(world.color)), []
    reader = _TreeReader(f"World '{world.name}'")
    return _rgb(np.maximum(reader.output(tree).emission, 0.0)), reader.warnings


def read_lamp_nodes(lamp: bpy.types.Light) -> tuple[RGB, list[str]]:
    """Factor per channel that a lamp's own nodes put on its strength, and warnings."""
    tree = shader_tree(lamp)
    if tree is None:
        return (1.0, 1.0, 1.0), []
    reader = _TreeReader(f"Lamp '{lamp.name}'")
    return _rgb(reader.output(tree).emission), reader.warnings


@dataclass(frozen=True)
class _Shading:
    """albedo and emission: (3,) float64."""

    albedo: Float64 = field(default_factory=lambda: np.zeros(3))
    emission: Float64 = field(default_factory=lambda: np.zeros(3))

    def scaled(self, factor: float) -> _Shading:
        return _Shading(self.albedo * factor, self.emission * factor)

    def plus(self, other: _Shading) -> _Shading:
        return _Shading(self.albedo + other.albedo, self.emission + other.emission)


class _TreeReader:
    """Follows the links of one node tree from its output; collects warnings that begin with the owner's name."""

    def __init__(self, owner: str) -> None:
        self.owner = owner
        self.warnings: list[str] = []

    def warn(self, message: str) -> None:
        warning = f"{self.owner} {message}"
        if warning not in self.warnings:
            self.warnings.append(warning)

    def output(self, tree: bpy.types.NodeTree) -> _Shading:
        node = tree.get_output_node("CYCLES")
        if node is None or _source(node.inputs["Surface"]) is None:
            self.warn("has no shader at its surface output, so it is black. Connect one, for example a Diffuse BSDF.")
            return _Shading()
        return self.shader(node.inputs["Surface"])

    def shader(self, socket: bpy.types.NodeSocket) -> _Shading:
        source = _source(socket)
        if source is None:
            return _Shading()
        converter = CONVERTERS.get(source.node.bl_idname)
        if converter is None:
            self.warn(
                f"uses the node {source.node.bl_label}, which has no diffuse part or is not read yet: it is taken as "
                "black. Use Diffuse BSDF, Principled BSDF, Emission, Mix Shader or Add Shader."
            )
            return _Shading()
        return converter(self, source.node)

    def colour(self, socket: bpy.types.NodeSocket) -> Float64:
        value = self._constant(socket)
        return np.full(3, float(value)) if isinstance(value, float) else np.array(value[:3], np.float64)

    def number(self, socket: bpy.types.NodeSocket | None, default: float = 0.0) -> float:
        """Value of a socket; `default` where this Blender's node lacks it."""
        if socket is None:
            return default
        value = self._constant(socket)
        return value if isinstance(value, float) else float(np.dot(value[:3], LUMINANCE))

    def _constant(self, socket: bpy.types.NodeSocket) -> float | Sequence[float]:
        source = _source(socket)
        if source is None:
            return socket.default_value
        if source.node.bl_idname in {"ShaderNodeRGB", "ShaderNodeValue"}:
            return source.default_value
        self.warn(
            f"takes its {socket.name} from the node {source.node.bl_label}, which is not read yet: the plain value "
            f"behind the link is used. Set that value to the average, or unlink it."
        )
        return socket.default_value


def _source(socket: bpy.types.NodeSocket) -> bpy.types.NodeSocket | None:
    """The output that feeds an input, through reroutes and muted nodes; None when nothing does."""
    while True:
        link = next((link for link in socket.links if link.is_valid and not link.is_muted), None)
        if link is None:
            return None
        node = link.from_node
        if node.bl_idname == "NodeReroute":
            socket = node.inputs[0]
        elif node.mute:
            passed = [inner.from_socket for inner in node.internal_links if inner.to_socket == link.from_socket]
            if not passed:
                return None
            socket = passed[0]
        else:
            return link.from_socket


def _diffuse(reader: _TreeReader, node: bpy.types.Node) -> _Shading:
    colour = reader.colour(node.inputs["Color"])
    return _Shading(albedo=rough_albedo(colour, reader.number(node.inputs["Roughness"])))


def _subsurface(reader: _TreeReader, node: bpy.types.Node) -> _Shading:
    return _Shading(albedo=reader.colour(node.inputs["Color"]))


def _emission(reader: _TreeReader, node: bpy.types.Node) -> _Shading:
    return _Shading(emission=reader.colour(node.inputs["Color"]) * reader.number(node.inputs["Strength"]))


def _principled(reader: _TreeReader, node: bpy.types.Node) -> _Shading:
    """Base colour without its metallic and transmitted shares, plus emission.

    The thin reflecting layer over it is not split off: under an even sky Cycles 5.0.1's Combined bake of the default
    node at base colour 0.8 is 0.8085, 0.770 of it diffuse and the rest the layer's reflection. Under a sun it is 0.93
    where the light comes from behind the viewer and 0.79 where it comes at 45 degrees: that highlight is not baked.
    """
    metallic = reader.number(node.inputs["Metallic"])
    transmission = reader.number(node.inputs["Transmission Weight"])
    if metallic > 0.0:
        reader.warn(f"is {metallic:.0%} metallic: mirror reflections are not baked, so that share of it stays dark.")
    if transmission > 0.0:
        reader.warn(f"transmits {transmission:.0%} of the light: it is baked as opaque, and that share stays dark.")
    if reader.number(node.inputs["Alpha"]) < 1.0:
        reader.warn("is transparent (Alpha below 1): it is baked as opaque.")
    base = rough_albedo(reader.colour(node.inputs["Base Color"]), reader.number(node.inputs.get("Diffuse Roughness")))
    return _Shading(
        albedo=base * (1.0 - metallic) * (1.0 - transmission),
        emission=reader.colour(node.inputs["Emission Color"]) * reader.number(node.inputs["Emission Strength"]),
    )


def _mix(reader: _TreeReader, node: bpy.types.Node) -> _Shading:
    second = min(max(reader.number(node.inputs[0]), 0.0), 1.0)
    return reader.shader(node.inputs[1]).scaled(1.0 - second).plus(reader.shader(node.inputs[2]).scaled(second))


def _add(reader: _TreeReader, node: bpy.types.Node) -> _Shading:
    return reader.shader(node.inputs[0]).plus(reader.shader(node.inputs[1]))


def rough_albedo(colour: Float64, roughness: float) -> Float64:
    """Share of even light that Cycles' rough diffuse surface (energy preserving Oren-Nayar) sends along its normal.

    colour: (3,). From Portsmouth, Kutz, Hill, "EON: a practical energy-preserving rough diffuse BRDF" (2025), which
    agrees with furnaces in Cycles 5.0.1 to 1e-4. Light from one side only differs: at colour 0.8 and roughness 1 by 5 %
    when it falls straight on and by 11 % at 80 degrees.
    """
    if roughness <= 0.0:
        return colour
    single = 1.0 / (1.0 + (0.5 - 2.0 / (3.0 * math.pi)) * roughness)
    mean = single * (1.0 + (2.0 / 3.0 - 28.0 / (15.0 * math.pi)) * roughness)
    multiple = colour**2 * mean / (1.0 - colour * (1.0 - mean))
    return np.asarray(colour * (single + (1.0 - single) * multiple))


#: Node to its albedo and emission.
CONVERTERS: dict[str, Callable[[_TreeReader, bpy.types.Node], _Shading]] = {
    "ShaderNodeBsdfDiffuse": _diffuse,
    "ShaderNodeBsdfPrincipled": _principled,
    "ShaderNodeSubsurfaceScattering": _subsurface,
    "ShaderNodeEmission": _emission,
    "ShaderNodeBackground": _emission,
    "ShaderNodeMixShader": _mix,
    "ShaderNodeAddShader": _add,
}


def _rgb(colour: Float64) -> RGB:
    return (float(colour[0]), float(colour[1]), float(colour[2]))
