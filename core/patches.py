"""Patches: the pieces of surface that exchange light, and the triangles a ray can meet.

Coordinates are centred and scaled to [-1, 1] so that single-precision rays are good everywhere; irradiance and radiance
do not depend on scale, and areas turn back into m^2 by `metres ** 2`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .scene import Float32, Float64, Int32, Scene, SceneObject
from .tessellation import edge_for_count, triform, whole

#: A triangle smaller than this share of a full-sized one joins its neighbours in one patch.
_SMALL = 0.3


@dataclass(frozen=True, eq=False)
class Space:
    """From metres to the unit box of the rays: (x - center) / metres."""

    center: Float64
    metres: float

    def normalise(self, points: Float64) -> Float64:
        return (points - self.center) / self.metres


@dataclass(frozen=True, eq=False)
class Patches:
    """t triangles grouped into p patches.

    corners (t, 3, 3), normals (t, 3) and area (t,) in the unit box; patch (t,) is the patch of each triangle;
    members (t,) lists the triangles patch by patch, from first (p + 1,) on. patch_area (p,), albedo (p, 3),
    emission (p, 3) radiance W/(m^2 sr).
    """

    space: Space
    corners: Float64
    normals: Float64
    area: Float64
    patch: Int32
    members: Int32
    first: Int32
    patch_area: Float64
    albedo: Float32
    emission: Float32

    def __len__(self) -> int:
        return len(self.patch_area)


def unit_space(scene: Scene) -> Space:
    """The smallest cube around all objects, blown up by nothing: its half edge becomes one."""
    low = np.min([o.vertices[o.triangles].min(axis=(0, 1)) for o in scene.objects], axis=0)
    high = np.max([o.vertices[o.triangles].max(axis=(0, 1)) for o in scene.objects], axis=0)
    return Space((low + high) / 2, max(float((high - low).max()) / 2, 1e-30))


def triangle_geometry(corners: Float64) -> tuple[Float64, Float64]:
    """Unit normals (t, 3) and areas (t,) of corners (t, 3, 3); the normal of a degenerate triangle is zero."""
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1)
    return normals / np.maximum(length, np.finfo(np.float64).tiny)[:, None], length / 2


def make_patches(scene: Scene, space: Space, wanted: int) -> Patches:
    """Split and group the triangles of all objects into about `wanted` patches of about one size."""
    edge = edge_for_count([o.vertices for o in scene.objects], [o.triangles for o in scene.objects], wanted)
    corners, surface, key = [], [], []
    for number, scene_object in enumerate(scene.objects):
        mesh = triform(whole(scene_object.vertices, scene_object.triangles), edge)
        corners.append(mesh.vertices[mesh.triangles])
        surface.append(scene_object.surface[mesh.parent])
        key.append(np.full(len(mesh.triangles), number))
    all_corners = space.normalise(np.concatenate(corners))
    all_surface = np.concatenate(surface)
    normals, area = triangle_geometry(all_corners)
    solid = area > 0
    all_corners, all_surface, normals, area = all_corners[solid], all_surface[solid], normals[solid], area[solid]
    patch = _group(all_corners, normals, area, all_surface, np.concatenate(key)[solid], edge / space.metres)
    members = np.argsort(patch, kind="stable").astype(np.int32)
    count = int(patch.max()) + 1
    patch_surface = np.empty(count, dtype=np.int64)
    patch_surface[patch] = all_surface
    return Patches(
        space=space,
        corners=all_corners,
        normals=normals,
        area=area,
        patch=patch,
        members=members,
        first=np.concatenate([[0], np.cumsum(np.bincount(patch, minlength=count))]).astype(np.int32),
        patch_area=np.bincount(patch, weights=area, minlength=count).astype(np.float64),
        albedo=np.array([s.albedo for s in scene.surfaces], dtype=np.float32)[patch_surface],
        emission=np.array([s.emission for s in scene.surfaces], dtype=np.float32)[patch_surface],
    )


def _group(
    corners: Float64, normals: Float64, area: Float64, surface: np.ndarray, number: np.ndarray, edge: float
) -> Int32:
    """The patch of each triangle: its own, or for small ones that of all small ones of the same object and surface
    that share a cell of the grid and look the same way."""
    small = area < _SMALL * edge * edge / 2
    cell = np.floor(corners.mean(axis=1) / (0.8 * edge)).astype(np.int64)
    facing = np.rint(normals * 1.5).astype(np.int64)
    own = np.where(small, -1, np.arange(len(area)))
    key = np.column_stack([own, number, surface, np.where(small[:, None], np.hstack([cell, facing]), 0)])
    _, first, patch = np.unique(key, axis=0, return_index=True, return_inverse=True)
    # Number the patches by their first triangle, so that neighbours in space stay neighbours in memory.
    rank = np.empty(len(first), dtype=np.int32)
    rank[np.argsort(first)] = np.arange(len(first), dtype=np.int32)
    return rank[patch.reshape(-1)]


def coarser_groups(patches: Patches) -> Int32:
    """The group (p,) of each patch when about four neighbours that face the same way and look alike become one."""
    weight = patches.area / patches.patch_area[patches.patch]
    count = len(patches)
    center, facing = (
        np.stack([np.bincount(patches.patch, weight * values[:, k], count) for k in range(3)], axis=1)
        for values in (patches.corners.mean(axis=1), patches.normals)
    )
    edge = 2.0 * np.sqrt(2.0 * np.median(patches.patch_area))
    look = np.hstack([patches.albedo, patches.emission])
    key = np.hstack([np.floor(center / edge), np.rint(facing * 1.5), look])
    return np.unique(key, axis=0, return_inverse=True)[1].reshape(-1).astype(np.int32)


@dataclass(frozen=True, eq=False)
class Cells:
    """Where light is sampled on the receivers: c small triangles, each inside one triangle of the output.

    corners (c, 3, 3), normals (c, 3), area (c,) in the unit box; shading (c, 3, 3) normals at the corners or None when
    all is flat; element (c,) the output triangle; barycentric (c, 3, 3) the cell's corners in the output triangle;
    surface (c,) into Scene.surfaces.
    """

    corners: Float64
    normals: Float64
    area: Float64
    shading: Float64 | None
    element: Int32
    barycentric: Float64
    surface: Int32

    def __len__(self) -> int:
        return len(self.area)


def shading_normals(receiver: SceneObject, parent: Int32, barycentric: Float64, normals: Float64) -> Float64:
    """Corner normals interpolated from the parents' (t, 3, 3); never on the back of the triangle itself."""
    if receiver.corner_normals is None:
        return np.repeat(normals[:, None], 3, axis=1)
    blended = barycentric @ receiver.corner_normals[parent].astype(np.float64)
    length = np.linalg.norm(blended, axis=2, keepdims=True)
    usable = (length > 1e-6) & (np.einsum("tij,tj->ti", blended, normals) > 1e-3)[:, :, None]
    return np.where(usable, blended / np.maximum(length, 1e-6), normals[:, None])
