"""Albedo and emission that vary over a surface: textures placed by UV coordinates, and corner colours.

What a triangle reflects is the mean over even points of it. Each point stands for its share of the triangle, and looks
up the image at the size where that share is about one pixel (mip-mapping: Williams 1983, "Pyramidal parametrics"), so
that detail finer than the points does not alias. Where nothing varies, all this is one look-up by surface.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .scene import ALBEDO_LIMIT, Float32, Float64, Int32, Scene, SceneError, SceneObject, Surface, Texture

#: Look-ups that the means of some triangles are worth, and how many points each triangle gets at least and at most.
_LOOK_UPS, _FEWEST_POINTS, MOST_POINTS = 200_000, 16, 256
#: Look-ups at a time: few enough to stay in the processor's caches.
_CHUNK = 32768

Int64 = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Colours:
    """Of n places: albedo (n, 3), all that leaves diffusely on either side, and emission (n, 3) in W/(m^2 sr)."""

    albedo: Float64
    emission: Float64

    @property
    def shown_in_white(self) -> Float64:
        """(n,) what a squared error of white irradiance counts in radiance, mean square over the channels."""
        return np.asarray(np.mean((self.albedo / np.pi) ** 2, axis=1))


def even_points(count: int) -> Float64:
    """(count, 3) barycentric centroids of the parts of a triangle whose edges are cut alike; count a square number."""
    cuts = round(count**0.5)
    i, j = np.divmod(np.arange(cuts * cuts), cuts)
    turned = i + j >= cuts
    first, second = np.where(turned, cuts - 1 - i, i), np.where(turned, cuts - 1 - j, j)
    third = np.where(turned, 2 / 3, 1 / 3)
    # Upright parts begin at (first, second); turned ones fill the gaps between them.
    weights = np.stack([first + third, second + third], axis=1) / cuts
    return np.column_stack([weights, 1.0 - weights.sum(axis=1)])


def mean_colours(
    scene: Scene, scene_object: SceneObject, parent: Int32, barycentric: Float64, points: int | None = None
) -> Colours:
    """Mean colours of m triangles: parts (m, 3, 3), by the corners' weights, of the object's triangles parent (m,).

    points: of each, a square number; by default the more the fewer triangles there are.
    """
    if not varies(scene, scene_object):
        return constant_colours(scene, scene_object.surface[parent])
    if points is None:
        points = int((_LOOK_UPS / max(len(parent), 1)) ** 0.5) ** 2
        points = min(max(points, _FEWEST_POINTS), MOST_POINTS)
    # So many points at once that few triangles do not take a call for each.
    groups = np.array_split(even_points(points), -(-points * max(len(parent), 1) // _CHUNK))
    albedo, emission = np.zeros((2, len(parent), 3))
    for group in (group for group in groups if len(group)):
        own, parts = np.tile(parent, len(group)), np.tile(barycentric, (len(group), 1, 1))
        found = point_colours(scene, scene_object, own, parts, np.repeat(group, len(parent), axis=0), 1.0 / points)
        albedo += found.albedo.reshape(len(group), -1, 3).sum(axis=0)
        emission += found.emission.reshape(len(group), -1, 3).sum(axis=0)
    return Colours(albedo / points, emission / points)


def constant_colours(scene: Scene, surface: Int32) -> Colours:
    """Colours of surfaces (n,) that do not vary."""
    albedo, emission = (np.array([getattr(s, name) for s in scene.surfaces]) for name in ("scattered", "emitted"))
    return Colours(albedo[surface], emission[surface])


def point_colours(
    scene: Scene, scene_object: SceneObject, parent: Int32, barycentric: Float64, point: Float64, share: float
) -> Colours:
    """Colours at a point (3,), or a point each (m, 3), by barycentric weights, of m parts of triangles, as in
    `mean_colours`.

    share: of the part's area that the point stands for; 0 takes single pixels.
    """
    weights = np.einsum("mc,mck->mk", np.broadcast_to(point, (len(parent), 3)), barycentric)
    surface = scene_object.surface[parent]
    colours = constant_colours(scene, surface)
    if scene_object.colors is not None:
        colours.albedo[:] *= np.einsum("mk,mkc->mc", weights, scene_object.colors[parent])
    for number in np.unique(surface):
        own = scene.surfaces[number]
        placed = ((own.albedo_texture, colours.albedo), (own.emission_texture, colours.emission))
        if own.albedo_texture is own.emission_texture is None:
            continue
        chosen = np.flatnonzero(surface == number)
        for begin in range(0, len(chosen), _CHUNK):
            some = chosen[begin : begin + _CHUNK]
            corners = _placement(scene_object)[parent[some]]
            uv = np.einsum("mk,mkc->mc", weights[some], corners)
            footprint = share * _area(np.einsum("mik,mkc->mic", barycentric[some], corners)) if share else None
            for texture, colour in placed:
                if texture is not None:
                    colour[some] *= look_up(texture, uv, footprint)
    np.clip(colours.albedo, 0.0, ALBEDO_LIMIT, out=colours.albedo)
    return colours


def look_up(texture: Texture, uv: Float64, footprint: Float64 | None = None) -> Float32:
    """Colours (n, 3) at points (n, 2) of a texture, as Blender places its pixels.

    footprint (n,): area in UV that each point stands for; the pixel itself where that is smaller, or None.
    """
    colour = np.zeros((len(uv), 3), dtype=np.float32)
    if footprint is None:
        return _look_up_level(texture, 0, uv)
    pixels = footprint * texture.pixels.shape[0] * texture.pixels.shape[1]
    level = np.ceil(np.log2(np.maximum(pixels, 1.0)) / 2 - 1e-6).astype(np.int64).clip(0, len(texture.levels) - 1)
    for number in np.unique(level):
        own = level == number
        colour[own] = _look_up_level(texture, int(number), uv[own])
    return colour


def _look_up_level(texture: Texture, level: int, uv: Float64) -> Float32:
    pixels = texture.levels[level]
    height, width = pixels.shape[:2]
    x, y = uv[:, 0] * width, uv[:, 1] * height
    if texture.interpolation == "closest" and level == 0:
        column, row = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
        return _pixels(texture, pixels, column, row)
    left, below = np.floor(x - 0.5), np.floor(y - 0.5)
    across = (x - 0.5 - left).astype(np.float32)[:, None]
    up = (y - 0.5 - below).astype(np.float32)[:, None]
    column, row = left.astype(np.int64), below.astype(np.int64)
    lower = _pixels(texture, pixels, column, row) * (1 - across) + _pixels(texture, pixels, column + 1, row) * across
    upper = _pixels(texture, pixels, column, row + 1) * (1 - across)
    upper += _pixels(texture, pixels, column + 1, row + 1) * across
    return np.asarray(lower * (1 - up) + upper * up)


def _pixels(texture: Texture, pixels: Float32, column: Int64, row: Int64) -> Float32:
    """Pixels (n, 3) at columns and rows (n,), which may lie beyond the image."""
    height, width = pixels.shape[:2]
    extend = _EXTENSIONS[texture.extension]
    colour = pixels[extend(row, height), extend(column, width)]
    if texture.extension == "clip":
        colour[(row < 0) | (row >= height) | (column < 0) | (column >= width)] = 0.0
    return colour


def _mirrored(index: Int64, count: int) -> Int64:
    within = index % (2 * count)
    return np.asarray(np.where(within < count, within, 2 * count - 1 - within))


_EXTENSIONS: dict[str, Callable[[Int64, int], Int64]] = {
    "repeat": lambda index, count: index % count,
    "extend": lambda index, count: index.clip(0, count - 1),
    "clip": lambda index, count: index.clip(0, count - 1),
    "mirror": _mirrored,
}


def varies(scene: Scene, scene_object: SceneObject) -> bool:
    """Whether the colours change within the triangles of an object."""
    return varying_albedo(scene, scene_object) or varying_emission(scene, scene_object)


def varying_albedo(scene: Scene, scene_object: SceneObject) -> bool:
    return scene_object.colors is not None or _some(scene, scene_object, lambda s: s.albedo_texture is not None)


def varying_emission(scene: Scene, scene_object: SceneObject) -> bool:
    return _some(scene, scene_object, lambda s: s.emission_texture is not None and max(s.emission) > 0)


def shines(scene: Scene, scene_object: SceneObject) -> bool:
    """Whether anything of an object may emit light."""
    return _some(scene, scene_object, lambda s: max(s.emitted) > 0)


def triangle_colours(scene: Scene, scene_object: SceneObject) -> Colours:
    """Mean colours of each triangle of an object."""
    every = np.arange(len(scene_object.triangles), dtype=np.int32)
    return mean_colours(scene, scene_object, every, np.broadcast_to(np.eye(3), (len(every), 3, 3)))


def triangle_emission(scene: Scene, scene_object: SceneObject) -> Float64:
    """Mean emission (t, 3) of each triangle of an object, W/(m^2 sr). Looks nothing up where none shines unevenly."""
    if varying_emission(scene, scene_object):
        return triangle_colours(scene, scene_object).emission
    return constant_colours(scene, scene_object.surface).emission


def _some(scene: Scene, scene_object: SceneObject, holds: Callable[[Surface], bool]) -> bool:
    """Whether some surface of an object is such. Where none of the scene is, nobody looks at the triangles."""
    such = np.array([holds(surface) for surface in scene.surfaces])
    return bool(such.any() and such[scene_object.surface].any())


def _placement(scene_object: SceneObject) -> Float32:
    if scene_object.uv is None:
        raise SceneError(f"'{scene_object.name}' has a textured material but no UV map: unwrap it, and bake again.")
    return scene_object.uv


def _area(uv: Float64) -> Float64:
    """(m,) of triangles (m, 3, 2)."""
    a, b = (uv[:, 1] - uv[:, 0]), (uv[:, 2] - uv[:, 0])
    return np.asarray(np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2)
