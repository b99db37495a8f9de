"""Materials that only Cycles can read, sampled by Cycles itself all over the faces that have them.

A copy of the mesh, cut so finely that its corners lie close together, goes into a scene of its own, and Cycles bakes
the colour and the emission of its materials to the corners (Blender's bake types Diffuse with only Colour, and Emit);
and where there are holes or veils a third time how open they are, made to glow. No light is traced. It all fills a
texture in which each triangle has pixels of its own, as in Ptex (Burley and Lacewell 2008). Everything that is made for
this is removed again, whatever happens; the user's scene, its materials and their nodes are never touched.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix

from ..core.patches import triangle_geometry
from ..core.result import BakedObject
from ..core.scene import Float32, Float64, Int32, Texture
from .cycles_studio import TARGET, bake_corners, cycles_studio, posed
from .receiver_source import ReceiverSource
from .slices import at_once
from .tessellated_mesh import MeshData, build_mesh

#: Parts that all sampled meshes together are cut into, and each at least; most parts along an edge.
_PARTS, _FEWEST, _FINEST = 60_000, 1_000, 96
#: How far the corners of the parts move to their middles. Where six meet, six places around count instead of one.
_INWARD = 0.25
#: Pixels across the texture.
_WIDTH = 1024
#: Nodes whose values depend on the object or its place in the world, and on which outputs.
_BY_OBJECT = {
    "ShaderNodeAttribute": None,
    "ShaderNodeCameraData": None,
    "ShaderNodeNewGeometry": None,
    "ShaderNodeObjectInfo": None,
    "ShaderNodeTexCoord": {"Object", "Camera", "Window", "Reflection"},
    "ShaderNodeVectorTransform": None,
}
#: Inputs of the Principled BSDF that put something over its diffuse part, or take from it what is not baked.
_OVER = ("Specular IOR Level", "Coat Weight", "Sheen Weight", "Subsurface Weight")
_TRANSPARENT = "ShaderNodeBsdfTransparent"
#: Nodes that hand on shaders from elsewhere.
_NO_SHADERS = {"ShaderNodeGroup", "NodeGroupInput", "NodeReroute"}
#: Less than this share of a surface has no colour of its own.
_FAINTEST = 1e-3

Values = np.ndarray[Any, np.dtype[Any]]


@dataclass(frozen=True, eq=False)
class Sampled:
    """Of one mesh: albedo, emission and opacity as textures, None where nothing emits, and where all is opaque; uv
    (t, 3, 2) of its triangles in all of them."""

    albedo: Texture
    emission: Texture | None
    opacity: Texture | None
    uv: Float32


@dataclass(frozen=True, eq=False)
class _Request:
    """A mesh as arrays, since Blender may free it: its attributes, corners (t, 3) and faces (t,) of its triangles, and
    texture space; and of its object the materials by slot, place, colour and index."""

    mesh: MeshData
    corners: Int32
    polygons: Int32
    texture_space: tuple[Values, Values]
    render_color: str
    materials: list[bpy.types.Material | None]
    matrix: Matrix
    color: tuple[float, ...]
    pass_index: int

    @property
    def triangles(self) -> Float64:
        """(t, 3, 3) corners in metres of the mesh's own space."""
        return self.mesh.positions[self.mesh.corner_vertex[self.corners]].astype(np.float64)


class MaterialSamples:
    """Meshes that are to be sampled, and then what was found on them."""

    def __init__(self, frame: int) -> None:
        self._frame = frame
        self._requests: list[_Request] = []
        self._number: dict[tuple[Any, ...], int] = {}

    def add(
        self,
        obj: bpy.types.Object,
        mesh: bpy.types.Mesh,
        name: str,
        matrix: Float64,
        materials: Sequence[bpy.types.Material | None],
    ) -> int:
        """Have the evaluated mesh of an object sampled with materials by slot; the number of the result.

        Instances of a mesh share one, unless a material depends on where and what the object is.
        """
        names = tuple(material and material.name_full for material in materials)
        own = name if any(material and depends_on_object(material.node_tree) for material in materials) else ""
        key = (obj.data.as_pointer(), names, own)
        if key not in self._number:
            self._number[key] = len(self._requests)
            attributes = mesh.color_attributes
            shown = attributes.render_color_index
            self._requests.append(
                _Request(
                    MeshData.read(mesh, (), {TARGET}),
                    *_triangles(mesh),
                    (np.array(mesh.texspace_location), np.array(mesh.texspace_size)),
                    attributes[shown].name if 0 <= shown < len(attributes) else "",
                    [material and material.original for material in materials],
                    Matrix(matrix.tolist()),
                    tuple(obj.color),
                    obj.pass_index,
                )
            )
        return self._number[key]

    def take(self) -> list[Sampled]:
        """Sample all of them, in the order of their numbers. Raises RuntimeError when Cycles cannot."""
        if not self._requests:
            return []
        areas = [float(triangle_geometry(request.triangles)[1].sum()) for request in self._requests]
        shares = [_PARTS * area / max(sum(areas), 1e-30) for area in areas]
        with cycles_studio() as studio:
            studio.frame_current = self._frame
            requests = zip(self._requests, shares, strict=True)
            return [_sample(studio, request, max(share, _FEWEST)) for request, share in requests]


def depends_on_object(tree: bpy.types.NodeTree | None) -> bool:
    """Whether a node tree's colours may differ between two objects with one mesh."""
    for node in tree.nodes if tree else ():
        outputs = _BY_OBJECT.get(node.bl_idname, set())
        if any(output.is_linked and (outputs is None or output.name in outputs) for output in node.outputs):
            return True
        if node.bl_idname == "ShaderNodeGroup" and depends_on_object(node.node_tree):
            return True
    return False


def _sample(studio: bpy.types.Scene, request: _Request, parts: float) -> Sampled:
    lattice = Lattice(_cuts(request.triangles, parts))
    with _finely_cut(studio, request, lattice) as obj:
        with _altered(obj, request.materials, _leave_diffuse_part):
            albedo = bake_corners(studio, obj, "DIFFUSE", "COLOR")
            emission = bake_corners(studio, obj, "EMIT")
        opacity = None
        if any(material and _lets_through(material.node_tree) for material in request.materials):
            with _altered(obj, request.materials, _glow_where_open):
                covers = np.maximum(1.0 - bake_corners(studio, obj, "EMIT"), 0.0)
            opacity, mixed = np.repeat(covers[:, :1], 3, axis=1), covers[:, 1:2]
            # A mix with a transparent shader dims the others; what is there has their whole colour.
            albedo, emission = (v / np.where(mixed > _FAINTEST, mixed, 1.0) for v in (albedo, emission))
    return Sampled(
        lattice.texture(albedo),
        lattice.texture(emission) if emission.any() else None,
        None if opacity is None else lattice.texture(opacity),
        lattice.uv,
    )


@contextmanager
def _finely_cut(studio: bpy.types.Scene, request: _Request, lattice: Lattice) -> Iterator[bpy.types.Object]:
    """The mesh in its place in the studio, cut up, with all its attributes, ready to be baked to."""
    source = ReceiverSource("", 0, request.corners, request.polygons, False, len(request.mesh.corner_vertex), 0)
    count = len(request.mesh.positions)
    triangles = np.arange(count, count + lattice.parent.size * 3, dtype=np.int32).reshape(-1, 3)
    nowhere = np.zeros((count + triangles.size, 3))
    parts = BakedObject("", nowhere, triangles, lattice.parent, lattice.barycentric, layers={})
    mesh = at_once(build_mesh(request.mesh, source, parts))
    obj = bpy.data.objects.new(TARGET, mesh)
    obj.matrix_world, obj.color, obj.pass_index = request.matrix, request.color, request.pass_index
    if not mesh.materials:
        mesh.materials.append(None)
    mesh.use_auto_texspace = False
    mesh.texspace_location, mesh.texspace_size = request.texture_space
    if request.render_color:
        mesh.color_attributes.render_color_index = mesh.color_attributes.find(request.render_color)
    with posed(studio, obj):
        yield obj


@contextmanager
def _altered(
    obj: bpy.types.Object,
    materials: Sequence[bpy.types.Material | None],
    alter: Callable[[bpy.types.NodeTree], None],
) -> Iterator[None]:
    """Give the object copies of its materials by slot, whose node trees and groups are altered."""
    made: list[bpy.types.ID] = []
    try:
        for slot, material in enumerate(materials):
            copy = material and material.copy()
            obj.data.materials[slot] = copy
            made += [copy] if copy else []
            trees = [copy.node_tree] if copy and copy.node_tree else []
            while trees:
                tree = trees.pop()
                for node in tree.nodes:
                    if node.bl_idname == "ShaderNodeGroup" and node.node_tree:
                        node.node_tree = node.node_tree.copy()
                        made.append(node.node_tree)
                        trees.append(node.node_tree)
                alter(tree)
        yield
    finally:
        bpy.data.batch_remove(made)


def _leave_diffuse_part(tree: bpy.types.NodeTree) -> None:
    """Take away what lies over the diffuse part, which is not baked and would dim it; and all ways through, or Cycles
    would bake what is behind."""
    for node in tree.nodes:
        if node.bl_idname == "ShaderNodeBsdfPrincipled":
            for name, value in (*((name, 0.0) for name in _OVER), ("Alpha", 1.0)):
                _set(tree, node.inputs[name], value)
        if node.bl_idname == _TRANSPARENT:
            for link in list(node.outputs[0].links):
                tree.links.remove(link)


def _glow_where_open(tree: bpy.types.NodeTree) -> None:
    """Make every shader an emission: red for the share that it lets straight through, green for it where it is nothing
    but transparent."""
    for node in list(tree.nodes):
        shaders = [output for output in node.outputs if output.type == "SHADER"]
        if not shaders or any(socket.type == "SHADER" for socket in node.inputs) or node.bl_idname in _NO_SHADERS:
            continue
        glow, colour = tree.nodes.new("ShaderNodeEmission"), tree.nodes.new("ShaderNodeCombineColor")
        tree.links.new(colour.outputs[0], glow.inputs["Color"])
        if node.bl_idname == _TRANSPARENT:
            colour.inputs["Red"].default_value = colour.inputs["Green"].default_value = 1.0
        if node.bl_idname == "ShaderNodeBsdfPrincipled":
            rest, alpha = tree.nodes.new("ShaderNodeMath"), node.inputs["Alpha"]
            rest.operation, rest.use_clamp = "SUBTRACT", True
            rest.inputs[0].default_value, rest.inputs[1].default_value = 1.0, alpha.default_value
            if alpha.is_linked:
                tree.links.new(alpha.links[0].from_socket, rest.inputs[1])
            tree.links.new(rest.outputs[0], colour.inputs["Red"])
        for link in [link for output in shaders for link in output.links]:
            tree.links.new(glow.outputs[0], link.to_socket)


def _lets_through(tree: bpy.types.NodeTree | None) -> bool:
    """Whether a node tree may be less than opaque somewhere."""
    for node in tree.nodes if tree else ():
        if node.bl_idname == _TRANSPARENT:
            return True
        if node.bl_idname == "ShaderNodeBsdfPrincipled":
            alpha = node.inputs["Alpha"]
            if alpha.is_linked or alpha.default_value < 1.0:
                return True
        if node.bl_idname == "ShaderNodeGroup" and _lets_through(node.node_tree):
            return True
    return False


def _set(tree: bpy.types.NodeTree, socket: bpy.types.NodeSocket, value: float) -> None:
    for link in list(socket.links):
        tree.links.remove(link)
    socket.default_value = value


class Lattice:
    """Every triangle cut along each edge into as many parts as cuts (t,) says, and its points as pixels of a texture.

    parent (p,) int32: the triangle of each part; barycentric (p, 3, 3): the parts' corners, moved inward a little;
    uv (t, 3, 2): the triangles in the texture.
    """

    def __init__(self, cuts: Int32) -> None:
        self._height = 0
        parents, barycentric, corner_pixels, beyond = [], [], [], []
        places = np.empty((len(cuts), 3), dtype=np.int64)
        for n in np.unique(cuts).tolist():
            own = np.flatnonzero(cuts == n)
            block = _Block(n, len(own), self._height)
            self._height = block.end
            parts = _parts(n)
            weights = np.concatenate([n - parts.sum(axis=2, keepdims=True), parts], axis=2) / n
            inward = (1.0 - _INWARD) * weights + _INWARD * weights.mean(axis=1, keepdims=True)
            parents.append(np.repeat(own, len(parts)))
            barycentric.append(np.tile(inward, (len(own), 1, 1)))
            corner_pixels.append(block.pixels(parts.reshape(-1, 2)).ravel())
            places[own] = block.pixels(np.array([(0, 0), (n, 0), (0, n)]))
            outer = np.stack([np.arange(1, n + 1), np.arange(n, 0, -1)], axis=1)
            beyond.append(np.stack([block.pixels(outer - step) for step in ((0, 0), (1, 0), (0, 1), (1, 1))]))
        self.parent = np.concatenate(parents).astype(np.int32)
        self.barycentric = np.concatenate(barycentric)
        self.uv = (np.stack([places % _WIDTH + 0.5, places // _WIDTH + 0.5], axis=2) / (_WIDTH, self._height)).astype(
            np.float32
        )
        self._corner_pixel = np.concatenate(corner_pixels)
        self._beyond = [b.reshape(4, -1) for b in beyond]

    def texture(self, values: Float32) -> Texture:
        """The texture of values (3 p, 3) at the corners of the parts."""
        # What was sampled a little inside goes on evenly to the corners.
        parts = values.reshape(-1, 3, 3)
        middle = parts.mean(axis=1, keepdims=True)
        values = (middle + (parts - middle) / (1.0 - _INWARD)).reshape(-1, 3)
        size = _WIDTH * self._height
        count = np.maximum(np.bincount(self._corner_pixel, minlength=size), 1)
        pixels = np.stack([np.bincount(self._corner_pixel, v, size) / count for v in values.T], axis=1)
        # Look-ups mix four pixels. Along the third side of a triangle one of them lies beyond it: it goes on evenly.
        for pixel, left, below, across in self._beyond:
            pixels[pixel] = pixels[left] + pixels[below] - pixels[across]
        pixels = np.maximum(pixels, 0.0)
        shape = (self._height, _WIDTH, 3)
        return Texture(pixels.astype(np.float32).reshape(shape), "extend", "linear", separate=True)


class _Block:
    """Pixels of `count` triangles with n parts along their edges, from row `begin` to `end`.

    Two of them share n + 2 by n + 3 pixels, the second turned by half, each with one more diagonal beyond its own.
    """

    def __init__(self, n: int, count: int, begin: int) -> None:
        self._n = n
        pair, turned = np.divmod(np.arange(count), 2)
        row, column = np.divmod(pair, _WIDTH // (n + 2))
        self._turned = turned[:, None] == 1
        self._left, self._bottom = (column * (n + 2))[:, None], (begin + row * (n + 3))[:, None]
        self.end = begin + (int(row.max(initial=0)) + 1) * (n + 3)

    def pixels(self, points: Values) -> Values:
        """Number (count, q) of the pixels of points (q, 2) given in steps along the triangle's first and third edge."""
        i, j = points.T
        x = self._left + np.where(self._turned, self._n + 1 - i, i)
        y = self._bottom + np.where(self._turned, self._n + 2 - j, j)
        return np.asarray(y * _WIDTH + x)


def _parts(n: int) -> Values:
    """(n * n, 3, 2) corners of the parts of a triangle, in steps along its first and third edge."""
    i, j = (v.ravel() for v in np.indices((n, n)))
    upright, turned = np.array([(0, 0), (1, 0), (0, 1)]), np.array([(1, 1), (0, 1), (1, 0)])
    start = np.stack([i, j], axis=1)[:, None]
    return np.concatenate([(start + upright)[i + j < n], (start + turned)[i + j < n - 1]])


def _cuts(triangles: Float64, parts: float) -> Int32:
    """Into how many parts the edges of each triangle (t, 3, 3) are cut, for about `parts` of one size in all."""
    longest = np.linalg.norm(triangles - np.roll(triangles, -1, axis=1), axis=2).max(axis=1)
    size = np.sqrt(float((longest**2).sum()) / parts)
    return np.clip(np.ceil(longest / max(size, 1e-30)), 1, _FINEST).astype(np.int32)


def _triangles(mesh: bpy.types.Mesh) -> tuple[Int32, Int32]:
    """Corners (t, 3) and face (t,) of each triangle."""
    mesh.calc_loop_triangles()
    corners = np.empty(len(mesh.loop_triangles) * 3, np.int32)
    mesh.loop_triangles.foreach_get("loops", corners)
    polygons = np.empty(len(mesh.loop_triangles), np.int32)
    mesh.loop_triangle_polygons.foreach_get("value", polygons)
    return corners.reshape(-1, 3), polygons
