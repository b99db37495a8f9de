"""Patches: the pieces of surface that exchange light, and the triangles a ray can meet.

Coordinates are centred and scaled to [-1, 1] so that single-precision rays are good everywhere; irradiance and radiance
do not depend on scale, and areas turn back into m^2 by `metres ** 2`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .optics import Optics, make_optics, stopping_share
from .scene import Bool, Float32, Float64, Int32, Scene, SceneObject
from .sorting import distinct, renumbered, stable_order
from .tessellation import Int64, Tessellation, edge_for_count, triform, whole
from .textures import Colours, constant_colours, even_points, mean_colours, varies

#: A triangle smaller than this share of a full-sized one joins its neighbours in one patch.
_SMALL = 0.3
#: Points of a triangle that tell how much of it a texture cuts away.
_HOLE_POINTS = 64


@dataclass(frozen=True, eq=False)
class Space:
    """From metres to the unit box of the rays: (x - center) / metres."""

    center: Float64
    metres: float

    def normalise(self, points: Float64) -> Float64:
        return (points - self.center) / self.metres


@dataclass(frozen=True, eq=False)
class Cells:
    """Where light is sampled on the receivers: c small triangles, each inside one triangle of the output.

    corners (c, 3, 3), normals (c, 3), area (c,) in the unit box; shading (c, 3, 3) normals at the corners or None when
    all is flat; element (c,) the output triangle; barycentric (c, 3, 3) the cell's corners in the output triangle, or
    None when each is one; surface (c,) into Scene.surfaces. front (surfaces, 3): Surface.front_share, None when all are
    one.
    """

    corners: Float64
    normals: Float64
    area: Float64
    shading: Float64 | None
    element: Int32
    barycentric: Float64 | None
    surface: Int32
    front: Float64 | None = None

    def __len__(self) -> int:
        return len(self.area)


@dataclass(frozen=True, eq=False)
class Patches:
    """t triangles grouped into p patches.

    corners (t, 3, 3), normals (t, 3) and area (t,) in the unit box; triangle (t,): its number in the split meshes,
    which may hold degenerate ones besides; patch (t,): the patch of each triangle; members (t,): the triangles patch by
    patch, from first (p + 1,) on. patch_area (p,), surface (p,) into Scene.surfaces, albedo (p, 3), emission (p, 3)
    radiance W/(m^2 sr). transmission (p, 3): share that leaves on the other side, None if nothing transmits. optics:
    where rays go on, None if nowhere; then a patch's light is that of the share of it where rays stop: coverage (p,),
    None if that is all of it. one_sided (p,): patches whose back emits nothing; None if there are none. parted
    (p,): those that something stands between and the largest of their coarser group; None if nobody has looked.
    """

    space: Space
    corners: Float64
    normals: Float64
    area: Float64
    triangle: Int64
    patch: Int32
    members: Int32
    first: Int32
    patch_area: Float64
    surface: Int32
    albedo: Float32
    emission: Float32
    transmission: Float32 | None = None
    optics: Optics | None = None
    coverage: Float64 | None = None
    one_sided: Bool | None = None
    parted: Bool | None = None

    def emission_of(self, side: Int32) -> Float32:
        """Radiance (..., 3) that sides emit: patch numbers (...) for fronts, those plus the number of patches for
        backs."""
        patch = side % len(self)
        if self.one_sided is None:
            return self.emission[patch]
        dark = self.one_sided[patch] & (side >= len(self))
        return np.where(dark[..., None], np.float32(0.0), self.emission[patch])

    def __len__(self) -> int:
        return len(self.patch_area)

    @property
    def centres(self) -> tuple[Float64, Float64]:
        """The centre (p, 3) of each patch, and the mean (p, 3) of its triangles' normals, by area."""
        weight = self.area / self.patch_area[self.patch]
        centres = (self.corners[:, 0] + self.corners[:, 1] + self.corners[:, 2]) / 3.0
        center, facing = (
            np.stack([np.bincount(self.patch, weight * values[:, k], len(self)) for k in range(3)], axis=1)
            for values in (centres, self.normals)
        )
        return np.asarray(center), np.asarray(facing)

    @cached_property
    def coarser_groups(self) -> Int32:
        """The group (p,) of each patch when about four neighbours of its size that face the same way, of one surface,
        become one: those whose centres lie in one cube of a grid, each side of it as large as four of them; and apart
        from these, those of them that something parts from the largest."""
        center, facing = self.centres
        median = np.median(self.patch_area)
        level = np.rint(np.log2(self.patch_area / median) / 2.0)[:, None]
        edge = 2.0 * np.sqrt(median) * 2.0**level
        parted = np.zeros(len(self)) if self.parted is None else self.parted
        key = np.column_stack([np.floor(center / edge), level, np.rint(facing * 1.5), self.surface, parted])
        return distinct(row_numbers(key.astype(np.int64)))[2].astype(np.int32)

    @property
    def coloured(self) -> bool:
        """Whether rays may bring light that was tinted on its way, or lost by different shares of its channels."""
        return self.transmission is not None or (self.optics is not None and self.optics.tinted)

    def as_cells(self) -> Cells:
        """The triangles, to sample light on as on a receiver."""
        every = np.arange(len(self.area), dtype=np.int32)
        return Cells(self.corners, self.normals, self.area, None, every, None, every)


def bounds(objects: Sequence[SceneObject]) -> tuple[Float64, Float64]:
    """Least and largest coordinates (o, 3) of each object's faces, metres; loose vertices do not count."""
    used = [o.vertices[np.bincount(o.triangles.ravel(), minlength=len(o.vertices)) > 0] for o in objects]
    return np.stack([v.min(axis=0) for v in used]), np.stack([v.max(axis=0) for v in used])


def unit_space(scene: Scene) -> Space:
    """The smallest cube around all objects, blown up by nothing: its half edge becomes one."""
    lows, highs = bounds(scene.objects)
    low, high = lows.min(axis=0), highs.max(axis=0)
    return Space((low + high) / 2, max(float((high - low).max()) / 2, 1e-30))


def triangle_geometry(corners: Float64) -> tuple[Float64, Float64]:
    """Unit normals (t, 3) and areas (t,) of corners (t, 3, 3); the normal of a degenerate triangle is zero."""
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1)
    return normals / np.maximum(length, np.finfo(np.float64).tiny)[:, None], length / 2


@dataclass(frozen=True, eq=False)
class PatchMeshes:
    """The objects' triangles split to about the size of a patch: one mesh for each object, and that size in metres.

    halvings (t,): where an object is denser than patches are, how often the size of a patch is halved at each triangle
    of all meshes.
    """

    meshes: tuple[Tessellation, ...]
    edge: float
    halvings: Int64

    def same_triangles(self, other: PatchMeshes) -> bool:
        """Whether the other's are those of the same meshes, and nothing was split in either."""
        pairs = zip(self.meshes, other.meshes, strict=True)
        return all(m.triangles is o.triangles and m.vertices is o.vertices for m, o in pairs)


def split_objects(scene: Scene, wanted: int) -> PatchMeshes:
    """Split the triangles of all objects so that about `wanted` of one size would cover them."""
    edge = edge_for_count([o.vertices for o in scene.objects], [o.triangles for o in scene.objects], wanted)
    meshes = tuple(triform(whole(o.vertices, o.triangles), edge) for o in scene.objects)
    return PatchMeshes(meshes, edge, np.zeros(sum(len(m.triangles) for m in meshes), dtype=np.int64))


def make_patches(scene: Scene, space: Space, split: PatchMeshes, like: Patches | None = None) -> Patches:
    """A patch for each triangle; where an object is denser than patches are, one for several neighbours.

    like: patches of the same triangles, if there are any: what shape these have is known then.
    """
    if like is None:
        corners = space.normalise(np.concatenate([m.vertices[m.triangles] for m in split.meshes]))
        normals, area = triangle_geometry(corners)
        solid = np.flatnonzero(area > 0)
        corners, normals, area = corners[solid], normals[solid], area[solid]
    else:
        corners, normals, area, solid = like.corners, like.normals, like.area, like.triangle
    surface = np.concatenate([o.surface[m.parent] for o, m in zip(scene.objects, split.meshes, strict=True)])[solid]
    number = np.repeat(np.arange(len(split.meshes)), [len(m.triangles) for m in split.meshes])[solid]
    entire = np.concatenate([np.bincount(m.parent)[m.parent] == 1 for m in split.meshes])[solid]
    halvings = split.halvings[solid]
    edge = split.edge / space.metres / 2.0**halvings
    small = np.flatnonzero(entire & (area < _SMALL * edge * edge / 2))
    grouped = corners[small]
    centre = (grouped[:, 0] + grouped[:, 1] + grouped[:, 2]) / 3.0  # four times as fast as a mean over so short an axis
    cube, facing = np.floor(centre / (0.8 * edge[small])[:, None]), np.rint(normals[small] * 1.5)
    alike = np.column_stack([number[small], surface[small], halvings[small], cube, facing]).astype(np.int64)
    patch = renumbered(group_alike(len(area), small, alike))
    members = stable_order(patch).astype(np.int32)
    count = int(patch.max()) + 1
    patch_surface = np.empty(count, dtype=np.int32)
    patch_surface[patch] = surface
    patch_area = np.bincount(patch, weights=area, minlength=count).astype(np.float64)
    colours = constant_colours(scene, patch_surface)
    if any(varies(scene, o) for o in scene.objects):
        colours = _mean_colours(scene, split, solid, patch, area / patch_area[patch])
    coverage = np.array([s.opacity * stopping_share(s) for s in scene.surfaces])[patch_surface]
    front = np.array([s.front_share for s in scene.surfaces])[patch_surface]
    one_sided = np.array([s.one_sided and max(s.emission) > 0 for s in scene.surfaces])[patch_surface]
    diffuse = colours.albedo / np.maximum(coverage, 1e-12)[:, None]
    shadowless = np.concatenate(
        [np.full(len(m.triangles), not o.casts_shadow) for o, m in zip(scene.objects, split.meshes, strict=True)]
    )
    uv = _opacity_uv(scene, split)
    optics = make_optics(
        scene,
        surface.astype(np.int32),
        shadowless[solid],
        corners,
        normals,
        None if uv is None else uv[solid],
    )
    filled = np.ones(count)
    if optics is not None and uv is not None:
        filled = np.bincount(patch, area / patch_area[patch] * _filled(optics), count).astype(np.float64)
    return Patches(
        space=space,
        corners=corners,
        normals=normals,
        area=area,
        triangle=solid,
        patch=patch,
        members=members,
        first=np.concatenate([[0], np.cumsum(np.bincount(patch, minlength=count))]).astype(np.int32),
        patch_area=patch_area,
        surface=patch_surface,
        albedo=(diffuse * front).astype(np.float32),
        emission=(colours.emission / np.maximum(coverage, 1e-12)[:, None]).astype(np.float32),
        transmission=(diffuse * (1.0 - front)).astype(np.float32) if (front < 1.0).any() else None,
        optics=optics,
        coverage=None if optics is None else coverage * filled,
        one_sided=one_sided if one_sided.any() else None,
    )


def _opacity_uv(scene: Scene, split: PatchMeshes) -> Float64 | None:
    """(t, 3, 2) places of the split triangles' corners in their textures; None where no texture cuts holes."""
    if all(s.opacity_texture is None for s in scene.surfaces):
        return None
    places = []
    for scene_object, mesh in zip(scene.objects, split.meshes, strict=True):
        uv = np.zeros((len(scene_object.triangles), 3, 2)) if scene_object.uv is None else scene_object.uv
        places.append(np.einsum("tij,tjk->tik", mesh.barycentric, uv[mesh.parent]))
    return np.concatenate(places)


def _filled(optics: Optics) -> Float64:
    """Mean (t,) over each triangle of what its texture leaves of the opacity; a trifle where it leaves nothing, so that
    a ray that stops there all the same finds a patch."""
    every = np.arange(len(optics.surface), dtype=np.int32)
    whole = np.maximum(optics.opacity[optics.surface], 1e-12)
    points = [np.einsum("c,tck->tk", point, optics.corners) for point in even_points(_HOLE_POINTS)]
    return np.maximum(np.mean([optics.opacity_at(every, p) for p in points], axis=0) / whole, 1e-3)


def _mean_colours(scene: Scene, split: PatchMeshes, solid: Int64, patch: Int32, weight: Float64) -> Colours:
    """Of each patch: means over its triangles `solid`, each counting weight (t,)."""
    parts = [mean_colours(scene, o, m.parent, m.barycentric) for o, m in zip(scene.objects, split.meshes, strict=True)]

    def of_patches(values: list[Float64]) -> Float64:
        weighted = weight[:, None] * np.concatenate(values)[solid]
        return np.stack([np.bincount(patch, channel) for channel in weighted.T], axis=1)

    return Colours(of_patches([part.albedo for part in parts]), of_patches([part.emission for part in parts]))


def group_alike(count: int, chosen: Int64, key: Int64) -> Int64:
    """(count,) the first of the chosen items with the same row of key (n, k); items that are not chosen stand alone."""
    group = np.arange(count)
    if len(chosen):
        _, first, same = distinct(row_numbers(key))
        group[chosen] = chosen[first][same]
    return group


def row_numbers(key: Int64) -> Int64:
    """(n,) one number for each row of key (n, k): equal, and in the same order, as the rows are."""
    number, count = np.zeros(len(key), dtype=np.int64), 1
    for column in key.T if len(key) else ():
        least = int(column.min())
        span = int(column.max()) - least + 1
        if count * span >= 2**63:
            number = distinct(number)[2]
            count = int(number.max()) + 1
        number = number * span + (column - least)
        count *= span
    return number


def shading_normals(receiver: SceneObject, parent: Int32, barycentric: Float64, normals: Float64) -> Float64:
    """Corner normals interpolated from the parents' (t, 3, 3); never on the back of the triangle itself."""
    if receiver.corner_normals is None:
        return np.repeat(normals[:, None], 3, axis=1)
    blended = barycentric @ receiver.corner_normals[parent].astype(np.float64)
    length = np.linalg.norm(blended, axis=2, keepdims=True)
    usable = (length > 1e-6) & (np.einsum("tij,tj->ti", blended, normals) > 1e-3)[:, :, None]
    return np.where(usable, blended / np.maximum(length, 1e-6), normals[:, None])
