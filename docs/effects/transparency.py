"""What lets light through, on, or back: veils, holes, translucent cloth, mirrors and glass, between a lamp and a stage.

Only the stage is compared. A point on a translucent surface cannot be: the probe that Cycles bakes there lies over the
surface itself, which is in the way of the light from behind.
"""

from __future__ import annotations

from collections.abc import Callable

import bpy
import numpy as np

from ...sample_blends.modelling import Point, Shape, add_mesh, area_lamp, box, diffuse, join, polygons, sphere
from .catalogue import effect_scene
from .skies import plain
from .textures import unwrap

WHITE = (1.0, 1.0, 1.0)
STAGE = ("Stage",)


def stage() -> None:
    """A floor with a red and a white wall, and a lamp over it."""
    white, red = diffuse("White", (0.7, 0.7, 0.7)), diffuse("Red", (0.7, 0.2, 0.1))
    floor, wall, side = box((4.0, 4.0, 0.1), white), box((4.0, 0.1, 2.0), white), box((0.1, 4.0, 2.0), red)
    add_mesh("Stage", join([floor.moved(z=-0.1), wall.moved(y=2.05, z=-0.1), side.moved(x=-2.05, z=-0.1)]))
    area_lamp("Softbox", 150.0, WHITE, (0.2, -0.3, 2.4), (0.8, 0.8))


def made_of(name: str, kind: str, **values: object) -> bpy.types.Material:
    """A material of one shader node, with values of its inputs by their names, spaces as underscores."""
    material = diffuse(name, WHITE)
    tree = material.node_tree
    shader = tree.nodes.new(kind)
    for field, value in values.items():
        shader.inputs[field.replace("_", " ")].default_value = value
    tree.links.new(shader.outputs[0], tree.get_output_node("ALL").inputs["Surface"])
    return material


def mixed(
    name: str, share: float, *shaders: Callable[[bpy.types.NodeTree], bpy.types.ShaderNode]
) -> bpy.types.Material:
    material = diffuse(name, WHITE)
    tree = material.node_tree
    mix = tree.nodes.new("ShaderNodeMixShader")
    mix.inputs[0].default_value = share
    for socket, make in zip(mix.inputs[1:], shaders, strict=True):
        tree.links.new(make(tree).outputs[0], socket)
    tree.links.new(mix.outputs[0], tree.get_output_node("ALL").inputs["Surface"])
    return material


def coloured(kind: str, colour: Point) -> Callable[[bpy.types.NodeTree], bpy.types.ShaderNode]:
    def make(tree: bpy.types.NodeTree) -> bpy.types.ShaderNode:
        shader = tree.nodes.new(kind)
        shader.inputs["Color"].default_value = (*colour, 1.0)
        return shader

    return make


def screen(material: bpy.types.Material, width: float = 1.6, height: float = 1.6) -> Shape:
    """One upright face along x, centred, from z = 0.1 on."""
    x = width / 2
    corners = np.array([(-x, 0.0, 0.1), (x, 0.0, 0.1), (x, 0.0, 0.1 + height), (-x, 0.0, 0.1 + height)])
    return polygons(corners, [(0, 1, 2, 3)], material)


def fence() -> bpy.types.Material:
    """Bars of wood, painted on a picture whose alpha cuts away the rest."""
    bars = np.ones((16, 16, 4), np.float32)
    bars[..., 3] = 0.0
    bars[:, 2:6, 3] = bars[:, 10:14, 3] = bars[3:6, :, 3] = 1.0
    picture = bpy.data.images.new("Bars", 16, 16, alpha=True)
    picture.pixels.foreach_set(bars.ravel())
    wood = made_of("Wood", "ShaderNodeBsdfPrincipled", Base_Color=(0.4, 0.25, 0.1, 1.0))
    tree = wood.node_tree
    image = tree.nodes.new("ShaderNodeTexImage")
    image.image, image.interpolation = picture, "Closest"
    shader = tree.get_output_node("ALL").inputs["Surface"].links[0].from_node
    tree.links.new(image.outputs["Alpha"], shader.inputs["Alpha"])
    return wood


def canopy(material: bpy.types.Material) -> Shape:
    """One level face at z = 1.2."""
    corners = np.array([(-0.8, -0.8, 1.2), (0.8, -0.8, 1.2), (0.8, 0.8, 1.2), (-0.8, 0.8, 1.2)])
    return polygons(corners, [(0, 1, 2, 3)], material)


@effect_scene("transparency", receivers=STAGE)
def veil_that_covers_half() -> None:
    stage()
    add_mesh("Veil", canopy(made_of("Gauze", "ShaderNodeBsdfPrincipled", Base_Color=(0.2, 0.5, 0.8, 1.0), Alpha=0.5)))


@effect_scene("transparency", receivers=STAGE)
def coloured_films_over_each_other() -> None:
    stage()
    plain((0.5, 0.5, 0.5))
    add_mesh("Blue", canopy(made_of("Blue", "ShaderNodeBsdfTransparent", Color=(0.2, 0.4, 0.9, 1.0))))
    film = mixed(
        "Yellow",
        0.3,
        coloured("ShaderNodeBsdfTransparent", (0.9, 0.8, 0.2)),
        coloured("ShaderNodeBsdfDiffuse", (0.8, 0.8, 0.8)),
    )
    add_mesh("Yellow", canopy(film), at=(0.4, 0.3, -0.4))


@effect_scene("transparency", receivers=STAGE)
def fence_of_a_picture_with_holes() -> None:
    stage()
    unwrap(add_mesh("Fence", screen(fence()), at=(0.0, 0.6, 0.0)))


@effect_scene("transparency", receivers=STAGE)
def ball_that_casts_no_shadow() -> None:
    stage()
    ball = add_mesh("Ghost", sphere(0.4, diffuse("Blue", (0.1, 0.3, 0.7))), at=(0.3, 0.2, 0.6))
    ball.visible_shadow = False


@effect_scene("diffuse transmission", receivers=STAGE)
def curtain_before_the_light() -> None:
    stage()
    cloth = made_of("Cloth", "ShaderNodeBsdfTranslucent", Color=(0.8, 0.7, 0.5, 1.0))
    add_mesh("Curtain", canopy(cloth))


@effect_scene("diffuse transmission", receivers=STAGE)
def leaves_that_reflect_and_transmit() -> None:
    stage()
    plain((0.5, 0.5, 0.5))
    leaf = mixed(
        "Leaf",
        0.5,
        coloured("ShaderNodeBsdfDiffuse", (0.2, 0.6, 0.1)),
        coloured("ShaderNodeBsdfTranslucent", (0.5, 0.8, 0.1)),
    )
    for number in range(4):
        at = (0.6 * (number % 2) - 0.3, 0.6 * (number // 2) - 0.3, -0.2 * number)
        add_mesh(f"Leaf {number}", canopy(leaf), at=at)


@effect_scene("mirrors", receivers=STAGE)
def mirror_under_the_sky() -> None:
    stage()
    plain(WHITE)
    bpy.data.objects.remove(bpy.data.objects["Softbox"])
    add_mesh(
        "Mirror", screen(made_of("Silver", "ShaderNodeBsdfAnisotropic", Color=(0.9, 0.9, 0.9, 1.0), Roughness=0.0))
    )


@effect_scene("mirrors", receivers=STAGE)
def ball_of_rough_gold_under_the_sky() -> None:
    stage()
    plain(WHITE)
    bpy.data.objects.remove(bpy.data.objects["Softbox"])
    gold = made_of("Gold", "ShaderNodeBsdfPrincipled", Base_Color=(0.9, 0.6, 0.2, 1.0), Metallic=1.0, Roughness=0.4)
    add_mesh("Ball", sphere(0.5, gold), at=(-0.3, 0.4, 0.5))


@effect_scene("clear glass", receivers=STAGE)
def pane_of_glass_before_the_sky() -> None:
    stage()
    plain(WHITE)
    bpy.data.objects.remove(bpy.data.objects["Softbox"])
    glass = made_of("Glass", "ShaderNodeBsdfGlass", Color=(0.8, 0.95, 0.9, 1.0), Roughness=0.0, IOR=1.45)
    add_mesh("Pane", box((1.6, 1.6, 0.02), glass), at=(0.2, 0.2, 0.8))
