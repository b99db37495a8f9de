"""Colours and emission that vary over a surface: images, colour attributes, procedural nodes, mixed materials."""

from __future__ import annotations

from math import radians

import bpy
import numpy as np

from ...sample_blends.modelling import add_mesh, area_lamp, box, diffuse, join
from .catalogue import effect_scene

WHITE = (1.0, 1.0, 1.0)


def stage(floor: bpy.types.Material, block: bpy.types.Material | None = None) -> bpy.types.Object:
    """A floor before a white wall, with a block on it. UV maps have one unit to the metre."""
    white = diffuse("White", (0.7, 0.7, 0.7))
    ground, wall = box((4.0, 4.0, 0.1), white, top=floor), box((4.0, 0.1, 2.0), white)
    unwrap(add_mesh("Stage", join([ground.moved(z=-0.1), wall.moved(y=2.05, z=-0.1)])))
    return unwrap(add_mesh("Block", box((0.8, 0.8, 0.8), block or white), at=(-0.6, 0.3, 0.1), turn=25.0))


def unwrap(obj: bpy.types.Object) -> bpy.types.Object:
    """A UV map: each face seen along the axis that it faces most."""
    mesh = obj.data
    uv = mesh.uv_layers.new(name="Map").uv
    for face in mesh.polygons:
        axis = int(np.argmax(np.abs(face.normal)))
        for corner in face.loop_indices:
            uv[corner].vector = np.delete(mesh.vertices[mesh.loops[corner].vertex_index].co, axis)
    return obj


def image(name: str, height: int, width: int, seed: int, low: float = 0.05, high: float = 0.9) -> bpy.types.Image:
    """Colours at random, as many as pixels, stored with the sRGB curve."""
    made = bpy.data.images.new(name, width, height)
    pixels = np.ones((height, width, 4), np.float32)
    pixels[..., :3] = np.random.default_rng(seed).uniform(low, high, (height, width, 3))
    made.pixels.foreach_set(pixels.ravel())
    return made


def image_node(
    material: bpy.types.Material, shown: bpy.types.Image, scale: float = 0.25
) -> bpy.types.ShaderNodeTexImage:
    """An image texture, larger by 1 / scale, and turned a little."""
    tree = material.node_tree
    texture, mapping = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeMapping")
    uv = tree.nodes.new("ShaderNodeUVMap")
    uv.uv_map, texture.image = "Map", shown
    mapping.inputs["Scale"].default_value = (scale, scale, 1.0)
    mapping.inputs["Rotation"].default_value = (0.0, 0.0, radians(20.0))
    tree.links.new(uv.outputs[0], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs[0], texture.inputs["Vector"])
    return texture


def shader(material: bpy.types.Material) -> bpy.types.ShaderNode:
    """The node that feeds a material's output."""
    output = material.node_tree.get_output_node("ALL")
    return output.inputs["Surface"].links[0].from_node


def coloured_by(name: str, kind: str) -> tuple[bpy.types.Material, bpy.types.ShaderNode]:
    """A diffuse material whose colour is the first output of a new node."""
    material = diffuse(name, WHITE)
    node = material.node_tree.nodes.new(kind)
    material.node_tree.links.new(node.outputs[0], shader(material).inputs["Color"])
    return material, node


def pictured(name: str, shown: bpy.types.Image, scale: float = 0.25) -> bpy.types.Material:
    material = diffuse(name, WHITE)
    texture = image_node(material, shown, scale)
    material.node_tree.links.new(texture.outputs["Color"], shader(material).inputs["Color"])
    return material


def softbox() -> None:
    area_lamp("Softbox", 150.0, WHITE, (0.2, -0.5, 2.2), (0.8, 0.8))


@effect_scene("albedo textures")
def image_texture() -> None:
    stage(pictured("Picture", image("Spots", 4, 4, seed=1)), pictured("Label", image("Stripes", 1, 4, seed=2), 0.5))
    softbox()


@effect_scene("albedo textures")
def image_texture_mirrored_and_far_larger_than_its_pixels() -> None:
    """Detail much finer than the patches, of low contrast: what it reflects is its mean."""
    fine = pictured("Fine", image("Grain", 512, 512, seed=3, low=0.72, high=0.76), 1.0)
    next(n for n in fine.node_tree.nodes if n.bl_idname == "ShaderNodeTexImage").extension = "MIRROR"
    stage(fine)
    softbox()


@effect_scene("albedo textures")
def colour_attribute() -> None:
    material, _ = coloured_by("Painted", "ShaderNodeVertexColor")
    block = stage(diffuse("White", (0.7, 0.7, 0.7)), material)
    paint = block.data.color_attributes.new("Paint", "BYTE_COLOR", "CORNER")
    colours = np.random.default_rng(4).uniform(0.1, 0.9, (len(paint.data), 4)).astype(np.float32)
    paint.data.foreach_set("color", colours.ravel())
    softbox()


@effect_scene("albedo textures")
def procedural_noise() -> None:
    """Noise through a colour ramp, which Cycles samples for the bake."""
    material, ramp = coloured_by("Marble", "ShaderNodeValToRGB")
    noise = material.node_tree.nodes.new("ShaderNodeTexNoise")
    place = material.node_tree.nodes.new("ShaderNodeNewGeometry")
    noise.inputs["Scale"].default_value, noise.inputs["Detail"].default_value = 1.2, 0.0
    ramp.color_ramp.elements[0].color, ramp.color_ramp.elements[1].color = (0.8, 0.1, 0.05, 1.0), (0.1, 0.3, 0.9, 1.0)
    material.node_tree.links.new(place.outputs["Position"], noise.inputs["Vector"])
    material.node_tree.links.new(noise.outputs[0], ramp.inputs[0])
    stage(material, material)
    softbox()


@effect_scene("textured emission", "emitting surfaces", receivers=("Stage", "Block"))
def textured_emission() -> None:
    """A screen with a picture lights the room."""
    stage(diffuse("Grey", (0.5, 0.5, 0.5)))
    screen = diffuse("Screen", (0.0, 0.0, 0.0))
    glow = screen.node_tree.nodes.new("ShaderNodeEmission")
    texture = image_node(screen, image("Film", 4, 6, seed=5, low=0.0, high=1.0), 1.0)
    texture.interpolation = "Closest"
    glow.inputs["Strength"].default_value = 12.0
    screen.node_tree.links.new(texture.outputs["Color"], glow.inputs["Color"])
    screen.node_tree.links.new(glow.outputs[0], screen.node_tree.get_output_node("ALL").inputs["Surface"])
    tv = unwrap(add_mesh("Screen", box((1.6, 0.04, 1.0), screen), at=(0.9, -0.8, 0.6), turn=-35.0))
    tv.rotation_euler.x = radians(-25.0)


@effect_scene("albedo textures")
def mixed_materials() -> None:
    """Two shaders mixed by an image on some faces, one colour and another image on others."""
    mixed = diffuse("Mixed", (0.8, 0.2, 0.1))
    tree = mixed.node_tree
    mix, other = tree.nodes.new("ShaderNodeMixShader"), tree.nodes.new("ShaderNodeBsdfDiffuse")
    other.inputs["Color"].default_value = (0.1, 0.4, 0.7, 1.0)
    mask = image("Mask", 5, 5, seed=6, low=0.0, high=1.0)
    mask.colorspace_settings.name = "Non-Color"
    first = shader(mixed)
    tree.links.new(image_node(mixed, mask).outputs["Color"], mix.inputs[0])
    tree.links.new(first.outputs[0], mix.inputs[1])
    tree.links.new(other.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], tree.get_output_node("ALL").inputs["Surface"])
    stage(mixed, pictured("Label", image("Stripes", 1, 4, seed=2), 0.5))
    softbox()
