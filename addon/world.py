"""Blender's world as core.scene's sky: one colour, or what Cycles itself sees in every direction.

A world of constants is read from its nodes. Any other tree is evaluated by Cycles: a bake of the pass "Environment"
gives the world's radiance in the direction from the origin to each point of a mesh, without noise. That happens in a
scene of its own, with a copy of the world, and both are gone afterwards.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import bpy
import numpy as np

from ..core.scene import RGB, Bool, Float32, Float64, SkyMap, SunLamp
from .compat import shader_tree
from .cycles_studio import bake_corners, cycles_studio, posed
from .materials import read_constant_background

#: Rows of the map: of a tree without pictures, and at most. Every bright pixel and its neighbours are looked at again
#: in so many times so many directions.
_HEIGHT, _MOST_HEIGHT, _FINER = 256, 1024, 6
#: Times the mean radiance from which a pixel is bright; most pixels that are looked at again.
_BRIGHT, _MOST_BRIGHT = 6.0, 20_000
#: What Light Path tells a ray that a diffuse surface has sent out; of anything else it tells 0.
_DIFFUSE_RAY = {"Is Diffuse Ray", "Is Reflection Ray", "Ray Depth", "Diffuse Depth"}
#: Directions across the square around a sun's disc, which is this much wider.
_SUN_GRID, _SUN_MARGIN = 96, 1.2


@dataclass(frozen=True)
class WorldLight:
    """sky: radiance, W/(m^2 sr), by direction or the same everywhere. suns: discs too small for a map."""

    sky: RGB | SkyMap = (0.0, 0.0, 0.0)
    suns: tuple[SunLamp, ...] = ()
    warnings: list[str] = field(default_factory=list)


def read_world(world: bpy.types.World | None) -> WorldLight:
    """The light of a world as diffuse surfaces see it. Without a world Cycles' sky is black."""
    if world is None or not world.cycles_visibility.diffuse:
        return WorldLight()
    tree = shader_tree(world)
    if tree is None:
        red, green, blue = world.color
        return WorldLight((red, green, blue))
    warnings = []
    output = tree.get_output_node("CYCLES")
    if output is not None and output.inputs["Volume"].is_linked:
        warnings.append(f"World '{world.name}' is filled with a volume, which is not baked: its light is not dimmed.")
    colour, unread = read_constant_background(world)
    if not unread:
        return WorldLight(colour, warnings=warnings)
    try:
        with _observatory(world) as observatory:
            sky, suns = _look(observatory)
            return WorldLight(sky, suns, warnings)
    except RuntimeError as problem:
        # Cycles is switched off, or busy with a render.
        remedy = f"could not be evaluated by Cycles ({str(problem).strip()}): switch the add-on Cycles on"
        warnings.append(f"World '{world.name}' {remedy}. A plain colour is used.")
        return WorldLight(colour, warnings=warnings)


def _look(observatory: _Observatory) -> tuple[RGB | SkyMap, tuple[SunLamp, ...]]:
    """The sky over all directions, and the discs of its suns apart."""
    height = observatory.height
    row, column = np.divmod(np.arange(2 * height * height), 2 * height)
    everywhere = _direction(row + 0.5, column + 0.5, height)
    suns = [_around_sun(node) for node in observatory.suns]
    shown = [observatory.radiance(directions) for directions, _ in suns]
    for node in observatory.suns:
        node.sun_disc = False
    # Every bake prepares the sky anew, which takes most of its time: so all the rest in one.
    seen = observatory.radiance(np.concatenate([everywhere, *(directions for directions, _ in suns)]))
    pixels, *behind = np.split(seen, len(everywhere) + np.cumsum([0] + [len(light) for light in shown])[:-1])
    lamps = [
        _lamp(f"{observatory.name} sun {number}", node, directions, (disc - sky) * solid_angle[:, None])
        for number, (node, (directions, solid_angle), disc, sky) in enumerate(
            zip(observatory.suns, suns, shown, behind, strict=True), start=1
        )
    ]
    if np.ptp(pixels, axis=0).max() <= 1e-5 * pixels.max():
        red, green, blue = pixels.mean(axis=0).tolist()
        return (red, green, blue), tuple(lamp for lamp in lamps if lamp)
    if observatory.has_pictures:
        chosen = np.flatnonzero(_bright(pixels.mean(axis=1).reshape(height, -1)))
        inside = (np.arange(_FINER) + 0.5) / _FINER
        down, across = (part.ravel() for part in np.meshgrid(inside, inside, indexing="ij"))
        finer = _direction(row[chosen, None] + down, column[chosen, None] + across, height)
        if len(chosen):
            pixels[chosen] = observatory.radiance(finer.reshape(-1, 3)).reshape(len(chosen), -1, 3).mean(axis=1)
    return SkyMap(pixels.reshape(height, -1, 3)), tuple(lamp for lamp in lamps if lamp)


def _bright(grey: Float32) -> Bool:
    """Pixels (h, w) that are much brighter than the mean, and their neighbours; the brightest, where they are many."""
    width = np.sin(np.pi * (np.arange(len(grey)) + 0.5) / len(grey))
    mean = float(width @ grey.mean(axis=1) / width.sum())
    limit = max(_BRIGHT * mean, float(np.partition(grey.ravel(), -_MOST_BRIGHT)[-_MOST_BRIGHT]))
    bright = np.pad(grey > limit, ((1, 1), (0, 0)))
    wide = bright | np.roll(bright, 1, axis=1) | np.roll(bright, -1, axis=1)
    return np.asarray(wide[:-2] | wide[1:-1] | wide[2:])


def _direction(row: Float64, column: Float64, height: int) -> Float32:
    """Unit vectors (..., 3) towards places of a SkyMap of so many rows, counted in pixels."""
    polar = np.pi * (1.0 - row / height)
    azimuth = np.pi * (1.0 - column / height)
    x, y = np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth)
    return np.stack([x, y, np.cos(polar)], axis=-1).astype(np.float32)


@contextmanager
def _observatory(world: bpy.types.World) -> Iterator[_Observatory]:
    """A scene with nothing but a copy of a world, in which Cycles tells its radiance."""
    with cycles_studio() as studio:
        observatory = _Observatory(studio, world.copy(), f"World '{world.name}'")
        try:
            observatory.prepare()
            yield observatory
        finally:
            bpy.data.batch_remove(observatory.made)


class _Observatory:
    """name: what messages call the world; height: rows of a map that shows what its pictures do; suns: Sky Textures
    that show a disc; made: all that is to be removed in the end."""

    def __init__(self, studio: bpy.types.Scene, world: bpy.types.World, name: str) -> None:
        self.name = name
        self.height = _HEIGHT
        self.has_pictures = False
        self.suns: list[bpy.types.Node] = []
        self.made: list[bpy.types.ID] = [world]
        self._studio = studio
        self._world = world

    def prepare(self) -> None:
        """Make the copy show what a diffuse ray sees, whatever ray it is."""
        self._prepare(self._world.node_tree)
        for kind in ("camera", "diffuse", "glossy", "transmission", "scatter"):
            setattr(self._world.cycles_visibility, kind, True)
        # Cycles would draw up a map of where its light comes from, which nothing here asks for.
        self._world.cycles.sampling_method = "NONE"
        self._studio.world = self._world

    def _prepare(self, tree: bpy.types.NodeTree) -> None:
        """Make a node tree show what a diffuse ray sees, and the groups that it uses as well."""
        for node in list(tree.nodes):
            if node.bl_idname == "ShaderNodeLightPath":
                _tell_of_diffuse_rays(tree, node)
            elif node.bl_idname == "ShaderNodeTexSky" and getattr(node, "sun_disc", False):
                self.suns.append(node)
            elif node.bl_idname in {"ShaderNodeTexEnvironment", "ShaderNodeTexImage"} and node.image is not None:
                self.height = min(max(self.height, node.image.size[1]), _MOST_HEIGHT)
                self.has_pictures = True
            elif node.bl_idname == "ShaderNodeGroup" and node.node_tree is not None:
                node.node_tree = node.node_tree.copy()
                self.made.append(node.node_tree)
                self._prepare(node.node_tree)

    def radiance(self, directions: Float32) -> Float32:
        """(n, 3) of the world in directions (n, 3)."""
        with posed(self._studio, _points(directions)) as obj:
            return bake_corners(self._studio, obj, "ENVIRONMENT")[: len(directions)]


def _points(directions: Float32) -> bpy.types.Object:
    """An object with a vertex in each direction; the triangles between them are without meaning."""
    count = -(-len(directions) // 3)
    mesh = bpy.data.meshes.new("Directions")
    mesh.vertices.add(3 * count)
    mesh.vertices.foreach_set("co", np.resize(directions, (3 * count, 3)).ravel())
    mesh.loops.add(3 * count)
    mesh.loops.foreach_set("vertex_index", np.arange(3 * count, dtype=np.int32))
    mesh.polygons.add(count)
    mesh.polygons.foreach_set("loop_start", np.arange(0, 3 * count, 3, dtype=np.int32))
    mesh.update(calc_edges=True)
    return bpy.data.objects.new("Directions", mesh)


def _tell_of_diffuse_rays(tree: bpy.types.NodeTree, node: bpy.types.Node) -> None:
    """Constants in place of what a Light Path node would tell the rays that look for the world."""
    for socket in node.outputs:
        told = 1.0 if socket.name in _DIFFUSE_RAY else 0.0
        for link in list(socket.links):
            constant = tree.nodes.new("ShaderNodeValue")
            constant.outputs[0].default_value = told
            tree.links.new(constant.outputs[0], link.to_socket)


def _lamp(name: str, node: bpy.types.Node, directions: Float32, light: Float64) -> SunLamp | None:
    """The sun of a Sky Texture from its irradiance (n, 3) along directions (n, 3); None where it does not show."""
    light = np.maximum(light, 0.0)
    total = light.mean(axis=1) @ directions
    if not np.any(total):
        return None
    axis = total / np.linalg.norm(total)
    red, green, blue = (light.T @ (directions @ axis)).tolist()
    x, y, z = (-axis).tolist()
    return SunLamp(name, (x, y, z), (red, green, blue), node.sun_size)


def _around_sun(node: bpy.types.Node) -> tuple[Float32, Float64]:
    """Directions (n, 3) over a square about the sun of a Sky Texture, and the solid angle (n,) of each."""
    up, turn = node.sun_elevation, node.sun_rotation
    axis = np.array([np.cos(up) * np.sin(turn), np.cos(up) * np.cos(turn), np.sin(up)])
    aside = np.cross(axis, (0.0, 0.0, 1.0) if abs(axis[2]) < 0.9 else (1.0, 0.0, 0.0))
    first = aside / np.linalg.norm(aside)
    reach = _SUN_MARGIN * np.tan(node.sun_size / 2.0)
    place = ((np.arange(_SUN_GRID) + 0.5) / _SUN_GRID * 2.0 - 1.0) * reach
    x, y = (part.reshape(-1, 1) for part in np.meshgrid(place, place))
    ways = axis + x * first + y * np.cross(axis, first)
    length = np.linalg.norm(ways, axis=1)
    cell = (2.0 * reach / _SUN_GRID) ** 2
    return (ways / length[:, None]).astype(np.float32), cell / length**3
