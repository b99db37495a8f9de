"""Worlds, with Cycles' bake of tiny triangles in the open as the judge of what they give."""

from __future__ import annotations

from collections import Counter

import bpy
import numpy as np
import pytest

from radiosity_baker.addon.world import read_world
from radiosity_baker.core.scene import SkyMap

NORMALS = np.array([(0, 0, 1), (0.6, 0, 0.8), (0, -1, 0), (-0.48, 0.64, 0.6), (0.36, 0.48, -0.8)])
#: Apart, so that none hides the sky from another.
PLACES = np.arange(len(NORMALS))[:, None] * (0.1, 0.0, 0.0)


@pytest.fixture
def world():
    world = bpy.data.worlds.new("Sky")
    if world.node_tree is None:
        world.use_nodes = True
    bpy.context.scene.world = world
    return world


def background(world):
    return next(node for node in world.node_tree.nodes if node.bl_idname == "ShaderNodeBackground")


def linked(world, kind, output=0, to="Color"):
    """A node of a kind that feeds the world's background."""
    node = world.node_tree.nodes.new(kind)
    world.node_tree.links.new(node.outputs[output], background(world).inputs[to])
    return node


def irradiance(light, normals=NORMALS):
    """What a world that was read gives planes in the open, by summing up its map and its suns."""
    if isinstance(light.sky, SkyMap):
        height, width = light.sky.pixels.shape[:2]
        polar = np.pi * (1 - (np.arange(height) + 0.5) / height)[:, None]
        azimuth = 2 * np.pi * (0.5 - (np.arange(width) + 0.5) / width)[None]
        ways = [np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar) + 0 * azimuth]
        directions = np.stack(ways, axis=-1)
        solid = np.diff(-np.cos(np.linspace(0, np.pi, height + 1)))[:, None] * 2 * np.pi / width
        total = [np.einsum("hw,hwk->k", np.maximum(directions @ n, 0) * solid, light.sky.pixels) for n in normals]
    else:
        total = [np.pi * np.array(light.sky)] * len(normals)
    for sun in light.suns:
        total += np.maximum(normals @ -np.array(sun.direction), 0)[:, None] * np.array(sun.irradiance)
    return np.array(total)


def ids():
    return Counter(
        (kind, item.name)
        for kind in ("scenes", "worlds", "meshes", "objects", "node_groups", "images")
        for item in getattr(bpy.data, kind)
    )


def test_constants_need_no_map(world):
    background(world).inputs["Color"].default_value = (0.2, 0.4, 0.6, 1)
    background(world).inputs["Strength"].default_value = 2.5
    light = read_world(world)
    np.testing.assert_allclose(light.sky, (0.5, 1.0, 1.5), rtol=1e-6)
    assert light.warnings == []
    assert light.suns == ()


def test_no_world_and_one_that_diffuse_rays_do_not_see_are_black(world):
    assert read_world(None).sky == (0, 0, 0)
    world.cycles_visibility.diffuse = False
    assert read_world(world).sky == (0, 0, 0)


def test_a_direction_is_where_cycles_has_it(world):
    """The direction as a colour: each pixel shows its own, or black where that is negative."""
    linked(world, "ShaderNodeTexCoord", "Generated")
    pixels = read_world(world).sky.pixels
    height = len(pixels)
    polar, azimuth = np.pi * (1 - 99.5 / height), 2 * np.pi * (0.5 - 300.5 / (2 * height))
    expected = [np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)]
    assert pixels[99, 300] == pytest.approx(np.maximum(expected, 0), abs=1e-3)


def gradient(world):
    """Over the height, mixed from two colours."""
    nodes, links = world.node_tree.nodes, world.node_tree.links
    mix = linked(world, "ShaderNodeMixRGB")
    mix.inputs[1].default_value, mix.inputs[2].default_value = (0.8, 0.5, 0.2, 1), (0.1, 0.3, 1.0, 1)
    split, coordinates = nodes.new("ShaderNodeSeparateXYZ"), nodes.new("ShaderNodeTexCoord")
    links.new(coordinates.outputs["Generated"], split.inputs[0])
    links.new(split.outputs["Z"], mix.inputs[0])


def environment(projection, turned):
    def build(world):
        """A picture of soft blobs, some bright."""
        image = bpy.data.images.new("Blobs", 128, 64, float_buffer=True)
        v, u = np.mgrid[0:64, 0:128] / 64.0
        red = 0.2 + 9 * np.exp(-60 * ((u - 0.5) ** 2 + (v - 0.7) ** 2)) + np.exp(-9 * ((u - 1.5) ** 2 + (v - 0.4) ** 2))
        image.pixels.foreach_set(np.stack([red, 0.5 * red, v, np.ones_like(v)], axis=-1).astype(np.float32).ravel())
        texture = linked(world, "ShaderNodeTexEnvironment")
        texture.image, texture.projection = image, projection
        if turned:
            mapping = world.node_tree.nodes.new("ShaderNodeMapping")
            coordinates = world.node_tree.nodes.new("ShaderNodeTexCoord")
            world.node_tree.links.new(coordinates.outputs["Generated"], mapping.inputs["Vector"])
            world.node_tree.links.new(mapping.outputs[0], texture.inputs["Vector"])
            mapping.inputs["Rotation"].default_value = (0.4, -0.3, 1.2)

    return build


def sky_texture(number):
    def build(world):
        node = linked(world, "ShaderNodeTexSky")
        kinds = [item.identifier for item in node.bl_rna.properties["sky_type"].enum_items]
        node.sky_type = kinds[number % len(kinds)]
        node.sun_elevation, node.sun_rotation = 0.6, 0.8
        node.sun_direction = (0.5, 0.4, 0.77)
        background(world).inputs["Strength"].default_value = 0.3

    return build


WORLDS = {
    "gradient": gradient,
    "panorama": environment("EQUIRECTANGULAR", turned=False),
    "turned panorama": environment("EQUIRECTANGULAR", turned=True),
    "mirror ball": environment("MIRROR_BALL", turned=True),
    **{f"sky {k}": sky_texture(k) for k in range(4)},
}


@pytest.mark.parametrize("build", WORLDS.values(), ids=WORLDS)
def test_planes_in_the_open_get_what_cycles_gives_them(world, build, cycles_irradiance):
    """2 % is what 512 paths to a sky are good for, which Cycles samples by a map of its own, and a sun apart."""
    build(world)
    before = ids()
    light = read_world(world)
    assert ids() == before, "nothing of what it took is left"
    assert light.warnings == []
    expected = cycles_irradiance(PLACES, NORMALS, samples=512)
    np.testing.assert_allclose(irradiance(light), expected, rtol=0.02, atol=0.005 * expected.max())


def test_a_sun_disc_is_a_lamp(world):
    node = linked(world, "ShaderNodeTexSky")
    node.sun_elevation, node.sun_rotation, node.sun_size = 0.5, 2.0, 0.02
    (sun,) = read_world(world).suns
    expected = [np.cos(0.5) * np.sin(2.0), np.cos(0.5) * np.cos(2.0), np.sin(0.5)]
    assert -np.array(sun.direction) == pytest.approx(expected, abs=2e-4)
    assert sun.angle == pytest.approx(0.02)
    assert node.sun_disc, "the user's node is as it was"


def test_a_mix_for_the_camera_alone_is_not_seen_by_surfaces(world):
    tree = world.node_tree
    mix, path, other = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("MixShader", "LightPath", "Background"))
    seen = background(world)
    seen.inputs["Color"].default_value, other.inputs["Color"].default_value = (1, 2, 3, 1), (9, 9, 9, 1)
    tree.links.new(path.outputs["Is Camera Ray"], mix.inputs[0])
    tree.links.new(seen.outputs[0], mix.inputs[1])
    tree.links.new(other.outputs[0], mix.inputs[2])
    output = next(node for node in tree.nodes if node.bl_idname == "ShaderNodeOutputWorld")
    tree.links.new(mix.outputs[0], output.inputs["Surface"])
    light = read_world(world)
    assert light.sky == pytest.approx((1, 2, 3), rel=1e-4)
    assert light.warnings == []


def test_a_volume_gets_a_warning(world):
    tree = world.node_tree
    volume = tree.nodes.new("ShaderNodeVolumeScatter")
    output = next(node for node in tree.nodes if node.bl_idname == "ShaderNodeOutputWorld")
    tree.links.new(volume.outputs[0], output.inputs["Volume"])
    assert "World 'Sky' is filled with a volume" in read_world(world).warnings[0]


def test_without_cycles_the_plain_colour_is_used_and_nothing_left(world, monkeypatch):
    gradient(world)
    before = ids()

    def fail(*_):
        raise RuntimeError("busy")

    monkeypatch.setattr("radiosity_baker.addon.world._Observatory.radiance", fail)
    light = read_world(world)
    assert "World 'Sky' could not be evaluated" in light.warnings[0]
    assert ids() == before
