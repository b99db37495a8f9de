"""Materials and worlds as albedo and emission: the diffuse part of what Cycles sees.

A table maps each shader node to its converter, another each node that gives colours. What they give is either constant
or an image: colours (3,) or (h, w, 3), numbers (1,) or (h, w, 1), which numpy combines by itself. Colour attributes are
read where they multiply the albedo. For a node that is in no table the plain value behind the link is used, and its
name is kept in a warning: the material can still be sampled by Cycles (`material_bake.py`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Literal

import bpy
import numpy as np
from mathutils import Matrix

from ..core.scene import ALBEDO_LIMIT, RGB, Float64, Surface, Texture
from .compat import rough_colour, shader_tree
from .images import MISSING, Extension, UnreadableImage, has_pixels, read_image

#: What Cycles gives faces without a material: its default Principled BSDF, of which `_principled` makes this.
DEFAULT_SURFACE = Surface("", albedo=(0.8, 0.8, 0.8))

#: Roughness up to which glass looks clear.
_CLEAR = 0.1

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


#: Custom property of a material that shows baked light: the material in whose place it stands, if there was one.
STANDS_FOR_KEY = "radiosity_baker_stands_for"


def own_material(material: bpy.types.Material | None) -> bpy.types.Material | None:
    """The person's own material, behind the one that shows baked light if there is one."""
    if material is None or STANDS_FOR_KEY not in material:
        return material
    behind = material[STANDS_FOR_KEY]
    return behind if isinstance(behind, bpy.types.Material) else None


@dataclass(frozen=True)
class Placement:
    """How an image lies on a mesh: by which UV map (empty: the active one for rendering), moved by matrix (2, 3), and
    what is between and beyond its pixels."""

    uv_map: str
    matrix: tuple[tuple[float, float, float], ...]
    extension: Extension
    interpolation: Literal["linear", "closest"]


@dataclass(frozen=True)
class MaterialSurface(Surface):
    """A surface, and what of the mesh it takes.

    placement of its textures. color_attribute: what multiplies its albedo; None: nothing, empty: the active one for
    rendering. unread: warnings of nodes that only Cycles can read. by_object: it takes its object's colour.
    """

    placement: Placement | None = None
    color_attribute: str | None = None
    unread: tuple[str, ...] = ()
    by_object: bool = False


def read_material(
    material: bpy.types.Material, object_color: Sequence[float] = (1.0, 1.0, 1.0)
) -> tuple[MaterialSurface, list[str]]:
    """The surface that Cycles' diffuse bake would see, and warnings that name what could not be read.

    object_color: of the object that has it, for the Object Info node.
    """
    tree = shader_tree(material)
    if tree is None:
        return MaterialSurface(material.name, albedo=_rgb(np.array(material.diffuse_color[:3]))), []
    reader = _TreeReader(f"Material '{material.name}'", object_color)
    shading = reader.output(tree)
    one_sided = reader.tells_sides and _emits_in_front_only(reader, shading, tree)
    even = shading.albedo.ndim == 1 and shading.color_attribute is None and not reader.unread
    if even and shading.albedo.max() > ALBEDO_LIMIT:
        reader.warn(f"reflects more than it receives; its colour is limited to {ALBEDO_LIMIT}. Lower the base colour.")
    reflected, through = reader.alike(shading.albedo, shading.transmission)
    diffuse = np.clip(reflected + through, 0.0, ALBEDO_LIMIT)
    albedo, albedo_texture = reader.split(diffuse)
    # A texture multiplies what leaves either side, so the shares of the two are those of their means.
    whole = _mean(reflected) + _mean(through)
    front = np.divide(_mean(reflected), whole, out=np.ones(3), where=whole > 0.0)
    opacity, opacity_texture = reader.split(np.clip(np.repeat(shading.opacity, 3, axis=-1), 0.0, 1.0))
    emission, emission_texture = reader.split(np.maximum(shading.emission, 0.0))
    surface = MaterialSurface(
        material.name,
        albedo=_rgb(albedo * front),
        transmission=_rgb(albedo * (1.0 - front)),
        emission=emission,
        opacity=opacity[0],
        opacity_texture=opacity_texture,
        transparent=_rgb(np.clip(shading.clear, 0.0, 1.0)),
        mirror=_rgb(np.clip(shading.mirror, 0.0, 1.0)),
        glass=_rgb(np.clip(shading.glass, 0.0, 1.0)),
        ior=shading.ior,
        roughness=shading.roughness,
        albedo_texture=albedo_texture,
        emission_texture=emission_texture,
        placement=reader.placement,
        color_attribute=None if reader.unread else shading.color_attribute,
        unread=tuple(reader.unread),
        by_object=reader.by_object,
        one_sided=one_sided,
    )
    return surface, reader.warnings


def _emits_in_front_only(reader: _TreeReader, front: _Shading, tree: bpy.types.NodeTree) -> bool:
    """Whether the back of a material that tells its sides apart emits nothing, but the front does. Warns where they
    differ by more or by something else."""
    back = _TreeReader(reader.owner, reader.object_color, side=1.0).output(tree)
    dark = bool(front.emission.any() and not back.emission.any())
    if not _same(replace(back, emission=front.emission) if dark else back, front):
        reader.warn("is not the same from behind: its front is used for both sides.")
    return dark


def _same(one: _Shading, other: _Shading) -> bool:
    pairs = ((getattr(one, f.name), getattr(other, f.name)) for f in fields(_Shading))
    return all(np.array_equal(a, b) for a, b in pairs)


def read_constant_background(world: bpy.types.World) -> tuple[RGB, list[str]]:
    """Radiance of a world's nodes, W/(m^2 sr), and warnings unless it is the same everywhere."""
    reader = _TreeReader(f"World '{world.name}'")
    return _rgb(np.maximum(reader.output(world.node_tree).emission, 0.0)), reader.warnings


def read_lamp_nodes(lamp: bpy.types.Light) -> tuple[RGB, list[str]]:
    """Factor per channel that a lamp's own nodes put on its strength, and warnings."""
    tree = shader_tree(lamp)
    if tree is None:
        return (1.0, 1.0, 1.0), []
    reader = _TreeReader(f"Lamp '{lamp.name}'")
    return _rgb(reader.output(tree).emission), reader.warnings


@dataclass(frozen=True)
class _Shading:
    """What a shader does, as in Surface: albedo, emission and transmission (3,) or (h, w, 3) float64 and opacity (1,)
    or (h, w, 1) may be images; clear (the tint of what goes straight through), mirror and glass are (3,).
    color_attribute: multiplies the albedo, as in MaterialSurface."""

    albedo: Float64 = field(default_factory=lambda: np.zeros(3))
    emission: Float64 = field(default_factory=lambda: np.zeros(3))
    color_attribute: str | None = None
    transmission: Float64 = field(default_factory=lambda: np.zeros(3))
    opacity: Float64 = field(default_factory=lambda: np.ones(1))
    clear: Float64 = field(default_factory=lambda: np.ones(3))
    mirror: Float64 = field(default_factory=lambda: np.zeros(3))
    glass: Float64 = field(default_factory=lambda: np.zeros(3))
    ior: float = 1.0
    roughness: float = 0.0


class Unreadable(ValueError):
    """A node that this module does not know, or not as it is used. The message goes on after the node's name."""


class _TreeReader:
    """Follows the links of one node tree from its output; collects warnings that begin with the owner's name.

    object_color: of the object whose faces the tree shades; None for lamps and worlds, over which nothing varies.
    side: that is looked at, 0 the front and 1 the back; tells_sides: whether it matters. placement: of the images found
    so far, all alike. unread: the warnings of what only Cycles can read.
    """

    def __init__(self, owner: str, object_color: Sequence[float] | None = None, side: float = 0.0) -> None:
        self.owner = owner
        self.side = side
        self.tells_sides = False
        self.object_color = None if object_color is None else np.array(object_color[:3], np.float64)
        self.warnings: list[str] = []
        self.unread: list[str] = []
        self.placement: Placement | None = None
        self.by_object = False

    def warn(self, message: str) -> None:
        warning = f"{self.owner} {message}"
        if warning not in self.warnings:
            self.warnings.append(warning)

    def cannot_read(self, message: str) -> None:
        """Warn of what only Cycles can read."""
        self.warn(message)
        self.unread.append(f"{self.owner} {message}")

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
            self.cannot_read(
                f"uses the node {source.node.bl_label}, which has no diffuse part or is not read yet: it is taken as "
                "black. Use Diffuse BSDF, Principled BSDF, Emission, Mix Shader or Add Shader."
            )
            return _Shading()
        return converter(self, source.node)

    def colour(self, socket: bpy.types.NodeSocket) -> Float64:
        """(3,) or (h, w, 3)."""
        value = self._value(socket)
        return np.repeat(value, 3, axis=-1) if value.shape[-1] == 1 else value

    def tint(self, socket: bpy.types.NodeSocket) -> tuple[Float64, str | None]:
        """The colour of a socket, and the colour attribute that it is to be multiplied by."""
        source = _source(socket)
        if source is not None and source.node.bl_idname == "ShaderNodeVertexColor" and source.name == "Color":
            return np.ones(3), source.node.layer_name
        return self.colour(socket), None

    def amount(self, socket: bpy.types.NodeSocket | None, default: float = 0.0) -> Float64:
        """(1,) or (h, w, 1): a number; `default` where this Blender's node lacks the socket."""
        if socket is None:
            return np.array([default])
        value = self._value(socket)
        return value if value.shape[-1] == 1 else (value @ LUMINANCE)[..., None]

    def number(self, socket: bpy.types.NodeSocket | None, default: float = 0.0) -> float:
        """A number, or the mean of one that varies; `default` where this Blender's node lacks the socket."""
        return float(self.amount(socket, default).mean())

    def _value(self, socket: bpy.types.NodeSocket) -> Float64:
        """(k,) or (h, w, k): what feeds a socket, k = 1 for numbers and 3 for colours."""
        source = _source(socket)
        if source is None:
            return _plain(socket)
        try:
            return VALUES.get(source.node.bl_idname, _unknown)(self, source.node, source)
        except Unreadable as problem:
            self.cannot_read(
                f"takes its {socket.name} from the node {source.node.bl_label}, which {problem or 'is not read yet'}: "
                "the plain value behind the link is used. Set that value to the average, or unlink it."
            )
            return _plain(socket)

    def sum(self, one: _Shading, share: Float64, two: _Shading, other: Float64) -> _Shading:
        """Shares (1,) or (h, w, 1) of two shadings together."""
        if not one.opacity.any():
            one, share, two, other = two, other, one, share
        if not two.opacity.any():
            # Holes in a surface: its own light is that of what is left.
            return self.with_holes(one, share, two, other)
        if one.opacity.min() < 1.0 or two.opacity.min() < 1.0:
            return self.sum_of_sheer(one, float(share.mean()), two, float(other.mean()))
        if one.color_attribute != two.color_attribute and one.albedo.any() and two.albedo.any():
            self.cannot_read("mixes a colour attribute with other colours: it is left out.")
        attribute = one.color_attribute if one.albedo.any() else two.color_attribute
        try:
            self.check_black_beyond(one.albedo, two.albedo, one.emission, two.emission, share)
        except Unreadable as problem:
            self.cannot_read(f"mixes shaders, which {problem}.")

        def mixed(first: Float64, second: Float64) -> Float64:
            first, second, first_share, second_share = self.alike(first, second, share, other)
            return np.asarray(first * first_share + second * second_share)

        def strongest(name: str, of: str) -> float:
            """Of two mirrors or glasses only one index of refraction or roughness can be kept."""
            return float(getattr(one if getattr(one, of).max() >= getattr(two, of).max() else two, name))

        return _Shading(
            mixed(one.albedo, two.albedo),
            mixed(one.emission, two.emission),
            attribute,
            transmission=mixed(one.transmission, two.transmission),
            mirror=one.mirror * share.mean() + two.mirror * other.mean(),
            glass=one.glass * share.mean() + two.glass * other.mean(),
            ior=strongest("ior", "glass"),
            roughness=strongest("roughness", "mirror"),
        )

    def with_holes(self, one: _Shading, share: Float64, clear: _Shading, other: Float64) -> _Shading:
        """A share of a shading, and through the other, which is clear, one sees what is behind."""
        opacity, share = self.alike(one.opacity, share)
        before, after = float(share.mean() * (1.0 - one.opacity.mean())), float(other.mean())
        tint = (before * one.clear + after * clear.clear) / max(before + after, 1e-12)
        return replace(one, opacity=opacity * share, clear=tint)

    def sum_of_sheer(self, one: _Shading, share: float, two: _Shading, other: float) -> _Shading:
        """Shares of two shadings of which at least one lets light through; its holes become an even veil."""
        covers = share * float(one.opacity.mean()), other * float(two.opacity.mean())
        opens = share - covers[0], other - covers[1]
        total = max(sum(covers), 1e-12)
        solid = self.sum(
            replace(one, opacity=np.ones(1)),
            np.array([covers[0] / total]),
            replace(two, opacity=np.ones(1)),
            np.array([covers[1] / total]),
        )
        tint = (opens[0] * one.clear + opens[1] * two.clear) / max(sum(opens), 1e-12)
        return replace(solid, opacity=np.array([min(total, 1.0)]), clear=tint)

    def alike(self, *values: Float64) -> tuple[Float64, ...]:
        """The same values, images among them with as many pixels as the largest has; or with their means alone where
        that cannot be."""
        sizes = {value.shape[:2] for value in values if value.ndim == 3}
        if len(sizes) < 2:
            return values
        height, width = (max(size[k] for size in sizes) for k in (0, 1))
        if any(height % size[0] or width % size[1] for size in sizes):
            self.cannot_read("combines images of different sizes: their means are used.")
            return tuple(value.mean(axis=(0, 1)) if value.ndim == 3 else value for value in values)
        return tuple(
            value.repeat(height // value.shape[0], axis=0).repeat(width // value.shape[1], axis=1)
            if value.ndim == 3
            else value
            for value in values
        )

    def place(self, placement: Placement) -> None:
        """One more image. Raises Unreadable when it lies otherwise than those before it."""
        if self.placement not in (None, placement):
            raise Unreadable("lies otherwise on the faces than another image")
        self.placement = placement

    def split(self, values: Float64) -> tuple[RGB, Texture | None]:
        """What a surface holds of a colour: a factor, and the texture it multiplies, if it is one."""
        if values.ndim == 1 or self.placement is None:
            return _rgb(values), None
        factor = (1.0, 1.0, 1.0) if values.any() else (0.0, 0.0, 0.0)
        pixels = np.ascontiguousarray(values, np.float32)
        return factor, Texture(pixels, self.placement.extension, self.placement.interpolation)

    def check_black_beyond(self, *values: Float64) -> None:
        """Raise Unreadable when values that are added belong to images that end: beyond them the others remain."""
        ends = self.placement is not None and self.placement.extension == "clip"
        if ends and any(value.ndim == 3 for value in values):
            raise Unreadable("adds something to an image that is clipped")


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


def _plain(socket: bpy.types.NodeSocket) -> Float64:
    """(1,) or (3,): the value of an unlinked socket."""
    return np.atleast_1d(np.array(socket.default_value, np.float64))[:3]


def _diffuse(reader: _TreeReader, node: bpy.types.Node) -> _Shading:
    colour, attribute = reader.tint(node.inputs["Color"])
    return _Shading(rough_albedo(colour, reader.number(node.inputs["Roughness"])), color_attribute=attribute)


def _subsurface(reader: _TreeReader, node: bpy.types.Node) -> _Shading:
    colour, attribute = reader.tint(node.inputs["Color"])
    return _Shading(colour, color_attribute=attribute)


def _emission(reader: _TreeReader, node: bpy.types.Node) -> _Shading:
    colour, strength = reader.alike(reader.colour(node.inputs["Color"]), reader.amount(node.inputs["Strength"]))
    return _Shading(emission=colour * strength)


def _principled(reader: _TreeReader, node: bpy.types.Node) -> _Shading:
    """Base colour without its metallic and transmitted shares, plus emission.

    The thin reflecting layer over it is not split off: under an even sky Cycles 5.0.1's Combined bake of the default
    node at base colour 0.8 is 0.8085, 0.770 of it diffuse and the rest the layer's reflection. Under a sun it is 0.93
    where the light comes from behind the viewer and 0.79 where it comes at 45 degrees: that highlight is not baked.
    """
    metallic = reader.amount(node.inputs["Metallic"])
    transmission = reader.amount(node.inputs["Transmission Weight"])
    roughness = reader.number(node.inputs["Roughness"])
    colour, attribute = reader.tint(node.inputs["Base Color"])
    base = rough_albedo(colour, reader.number(node.inputs.get("Diffuse Roughness")))
    tint = _mean(base)
    metal, passes = float(metallic.mean()), float(((1.0 - metallic.mean()) * transmission).mean())
    if passes > 0.0:
        _warn_of_rough_glass(reader, roughness)
    base, metallic, transmission = reader.alike(base, metallic, transmission)
    glow, strength = reader.alike(
        reader.colour(node.inputs["Emission Color"]), reader.amount(node.inputs["Emission Strength"])
    )
    return _Shading(
        base * (1.0 - metallic) * (1.0 - transmission),
        glow * strength,
        attribute,
        opacity=np.clip(reader.amount(node.inputs["Alpha"]), 0.0, 1.0),
        mirror=metal * metal_reflectance(tint),
        glass=passes * np.sqrt(np.maximum(tint, 0.0)),
        ior=reader.number(node.inputs["IOR"]),
        roughness=roughness,
    )


def _transparent(reader: _TreeReader, node: bpy.types.Node) -> _Shading:
    return _Shading(opacity=np.zeros(1), clear=_mean(reader.colour(node.inputs["Color"])))


def _translucent(reader: _TreeReader, node: bpy.types.Node) -> _Shading:
    return _Shading(transmission=reader.colour(node.inputs["Color"]))


def _glossy(reader: _TreeReader, node: bpy.types.Node) -> _Shading:
    roughness = reader.number(node.inputs["Roughness"])
    return _Shading(mirror=_mean(reader.colour(node.inputs["Color"])), roughness=roughness)


def _metal(reader: _TreeReader, node: bpy.types.Node) -> _Shading:
    if getattr(node, "fresnel_type", "F82") != "F82":
        reader.warn("has a metal by index of refraction and extinction: its base colour is used. Choose F82 Tint.")
    tint = _mean(reader.colour(node.inputs["Base Color"]))
    return _Shading(mirror=metal_reflectance(tint), roughness=reader.number(node.inputs["Roughness"]))


def _glass(reader: _TreeReader, node: bpy.types.Node) -> _Shading:
    _warn_of_rough_glass(reader, reader.number(node.inputs["Roughness"]))
    ior = reader.number(node.inputs["IOR"]) if node.bl_idname == "ShaderNodeBsdfGlass" else 1.0
    return _Shading(glass=_mean(reader.colour(node.inputs["Color"])), ior=ior)


def _holdout(_: _TreeReader, node: bpy.types.Node) -> _Shading:  # noqa: ARG001
    return _Shading()


def _warn_of_rough_glass(reader: _TreeReader, roughness: float) -> None:
    if roughness > _CLEAR:
        reader.warn(
            f"is glass of roughness {roughness:.2f}: light goes straight through it in the bake, and is not scattered. "
            "For frosted glass mix in a Translucent BSDF."
        )


def metal_reflectance(colour: Float64) -> Float64:
    """Share (3,) of even light that a metal with this colour straight on mirrors.

    Schlick's reflectance c + (1 - c)(1 - cos)^5 (1994), which Principled's metal has with a white tint, averaged over
    the hemisphere: c + (1 - c) / 21.
    """
    return np.asarray(colour + (1.0 - colour) / 21.0)


def _mean(values: Float64) -> Float64:
    """(k,) of an image (h, w, k), or of what is constant already."""
    return values.reshape(-1, values.shape[-1]).mean(axis=0)


def _mix(reader: _TreeReader, node: bpy.types.Node) -> _Shading:
    second = np.clip(reader.amount(node.inputs[0]), 0.0, 1.0)
    return reader.sum(reader.shader(node.inputs[1]), 1.0 - second, reader.shader(node.inputs[2]), second)


def _add(reader: _TreeReader, node: bpy.types.Node) -> _Shading:
    return reader.sum(reader.shader(node.inputs[0]), np.ones(1), reader.shader(node.inputs[1]), np.ones(1))


def rough_albedo(colour: Float64, roughness: float) -> Float64:
    """Share of even light that Cycles' rough diffuse surface (energy preserving Oren-Nayar) sends along its normal.

    colour: (..., 3). From Portsmouth, Kutz, Hill, "EON: a practical energy-preserving rough diffuse BRDF" (2025), which
    agrees with furnaces in Cycles to 1e-4, but for a colour (`compat.rough_colour`). Light from one side only differs:
    at colour 0.8 and roughness 1 by 5 % when it falls straight on and by 11 % at 80 degrees.
    """
    if roughness <= 0.0:
        return colour
    single = 1.0 / (1.0 + (0.5 - 2.0 / (3.0 * math.pi)) * roughness)
    mean = single * (1.0 + (2.0 / 3.0 - 28.0 / (15.0 * math.pi)) * roughness)
    multiple = rough_colour(colour) * mean / (1.0 - colour * (1.0 - mean))
    return np.asarray(colour * (single + (1.0 - single) * multiple))


#: Node to its albedo and emission.
CONVERTERS: dict[str, Callable[[_TreeReader, bpy.types.Node], _Shading]] = {
    "ShaderNodeBsdfDiffuse": _diffuse,
    "ShaderNodeBsdfPrincipled": _principled,
    "ShaderNodeSubsurfaceScattering": _subsurface,
    "ShaderNodeEmission": _emission,
    "ShaderNodeBackground": _emission,
    "ShaderNodeBsdfTransparent": _transparent,
    "ShaderNodeBsdfTranslucent": _translucent,
    "ShaderNodeBsdfAnisotropic": _glossy,
    "ShaderNodeBsdfGlossy": _glossy,
    "ShaderNodeBsdfMetallic": _metal,
    "ShaderNodeBsdfGlass": _glass,
    "ShaderNodeBsdfRefraction": _glass,
    "ShaderNodeHoldout": _holdout,
    "ShaderNodeMixShader": _mix,
    "ShaderNodeAddShader": _add,
}


def _unknown(_: _TreeReader, node: bpy.types.Node, output: bpy.types.NodeSocket) -> Float64:  # noqa: ARG001
    raise Unreadable


def _constant(_: _TreeReader, node: bpy.types.Node, output: bpy.types.NodeSocket) -> Float64:  # noqa: ARG001
    return _plain(output)


def _geometry(reader: _TreeReader, _: bpy.types.Node, output: bpy.types.NodeSocket) -> Float64:
    if output.name != "Backfacing":
        raise Unreadable
    reader.tells_sides = True
    return np.array([reader.side])


def _object_info(reader: _TreeReader, _: bpy.types.Node, output: bpy.types.NodeSocket) -> Float64:
    if output.name != "Color" or reader.object_color is None:
        raise Unreadable
    reader.by_object = True
    return reader.object_color


def _image(reader: _TreeReader, node: bpy.types.Node, output: bpy.types.NodeSocket) -> Float64:
    """Pixels as Cycles shows them."""
    if reader.object_color is None:
        raise Unreadable
    if node.projection != "FLAT":
        raise Unreadable(f"projects its image as a {node.projection.lower()}")
    image = node.image
    if image is None or not has_pixels(image):
        missing = (
            f"the image '{image.name}' has no pixels" if image else f"its node {node.label or node.name} has no image"
        )
        reader.warn(f"shows pink, as in a render, because {missing}: find the file, or choose another image.")
        return np.array(MISSING[:3]) if output.name == "Color" else np.ones(1)
    placement = _placement(node)
    smooth, premultiplied = placement.interpolation == "linear", not node.outputs["Alpha"].is_linked
    try:
        colour, alpha = read_image(image, placement.extension, smooth=smooth, premultiplied=premultiplied)
    except UnreadableImage as problem:
        raise Unreadable(f"has an image, '{image.name}', {problem}") from problem
    reader.place(placement)
    return np.asarray(alpha if output.name == "Alpha" else colour, np.float64)


def _placement(node: bpy.types.Node) -> Placement:
    extensions: dict[str, Extension] = {"REPEAT": "repeat", "EXTEND": "extend", "CLIP": "clip", "MIRROR": "mirror"}
    uv_map, matrix = _coordinates(node.inputs["Vector"])
    rows = tuple((row[0], row[1], row[3]) for row in matrix[:2])
    closest = node.interpolation == "Closest"
    return Placement(uv_map, rows, extensions[node.extension], "closest" if closest else "linear")


def _coordinates(socket: bpy.types.NodeSocket) -> tuple[str, Matrix]:
    """UV map by name, and what moves its coordinates. Raises Unreadable for all but UV maps and Mapping nodes."""
    source = _source(socket)
    if source is None:
        return "", Matrix()
    node = source.node
    if node.bl_idname == "ShaderNodeUVMap" and not node.from_instancer:
        return node.uv_map, Matrix()
    if node.bl_idname == "ShaderNodeTexCoord" and source.name == "UV" and not node.from_instancer:
        return "", Matrix()
    if node.bl_idname == "ShaderNodeMapping" and node.vector_type in {"POINT", "TEXTURE"}:
        moves = [node.inputs[name] for name in ("Location", "Rotation", "Scale")]
        if all(_source(move) is None for move in moves) and _source(node.inputs["Vector"]) is not None:
            location, rotation, scale = (move.default_value for move in moves)
            own = Matrix.LocRotScale(location, rotation.to_quaternion(), scale)
            uv_map, before = _coordinates(node.inputs["Vector"])
            return uv_map, (own if node.vector_type == "POINT" else own.inverted_safe()) @ before
    raise Unreadable(f"takes its place from the node {node.bl_label}")


def _mix_colours(reader: _TreeReader, node: bpy.types.Node, _: bpy.types.NodeSocket) -> Float64:
    """Mix, Multiply and Add of two colours."""
    if node.bl_idname == "ShaderNodeMix":
        if node.data_type != "RGBA":
            raise Unreadable("mixes numbers or vectors")
        factor, one, two = (_by_identifier(node, name) for name in ("Factor_Float", "A_Color", "B_Color"))
        clamped = node.clamp_result
    else:
        factor, one, two = node.inputs
        clamped = node.use_clamp
    share = np.clip(reader.amount(factor), 0.0, 1.0)
    share, first, second = reader.alike(share, reader.colour(one), reader.colour(two))
    reader.check_black_beyond(share, first, second)
    blend = BLENDS.get(node.blend_type)
    if blend is None:
        raise Unreadable(f"mixes colours by {node.blend_type.title()}")
    mixed = first * (1.0 - share) + blend(first, second) * share
    return np.clip(mixed, 0.0, 1.0) if clamped else mixed


def _by_identifier(node: bpy.types.Node, identifier: str) -> bpy.types.NodeSocket:
    return next(socket for socket in node.inputs if socket.identifier == identifier)


def _separate(reader: _TreeReader, node: bpy.types.Node, output: bpy.types.NodeSocket) -> Float64:
    if node.mode != "RGB":
        raise Unreadable(f"separates a colour into {node.mode}")
    index = ("Red", "Green", "Blue").index(output.name)
    return reader.colour(node.inputs[0])[..., index : index + 1]


def _math(reader: _TreeReader, node: bpy.types.Node, _: bpy.types.NodeSocket) -> Float64:
    operation = OPERATIONS.get(node.operation)
    if operation is None:
        raise Unreadable(f"calculates {node.operation.title()}")
    one, two = reader.alike(*(reader.amount(socket) for socket in node.inputs[:2]))
    if node.operation != "MULTIPLY":
        reader.check_black_beyond(one, two)
    result = operation(one, two)
    return np.clip(result, 0.0, 1.0) if node.use_clamp else result


def _grey(reader: _TreeReader, node: bpy.types.Node, _: bpy.types.NodeSocket) -> Float64:
    return reader.amount(node.inputs[0])


BLENDS: dict[str, Callable[[Float64, Float64], Float64]] = {
    "MIX": lambda _, second: second,
    "MULTIPLY": np.multiply,
    "ADD": np.add,
}
OPERATIONS: dict[str, Callable[[Float64, Float64], Float64]] = {
    "MULTIPLY": np.multiply,
    "ADD": np.add,
    "SUBTRACT": np.subtract,
}

#: Node to its value at one of its outputs.
VALUES: dict[str, Callable[[_TreeReader, bpy.types.Node, bpy.types.NodeSocket], Float64]] = {
    "ShaderNodeRGB": _constant,
    "ShaderNodeValue": _constant,
    "ShaderNodeObjectInfo": _object_info,
    "ShaderNodeNewGeometry": _geometry,
    "ShaderNodeTexImage": _image,
    "ShaderNodeMix": _mix_colours,
    "ShaderNodeMixRGB": _mix_colours,
    "ShaderNodeSeparateColor": _separate,
    "ShaderNodeMath": _math,
    "ShaderNodeRGBToBW": _grey,
}


def _rgb(colour: Float64) -> RGB:
    return (float(colour[0]), float(colour[1]), float(colour[2]))
