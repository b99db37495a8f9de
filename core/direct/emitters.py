"""Emitting surfaces as lamps: each triangle a panel that shines from both sides, or from its front.

A panel shines alike all over. A triangle whose emission is textured is split, where that varies most, into smaller
panels of the mean emission each: detail finer than that shows only nearer to the surface than a panel is wide.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..effects import MOST_PANELS, emitters_by_rays, emitting_triangles
from ..patches import Space, triangle_geometry
from ..scene import Float64, Scene, SceneObject
from ..tessellation import quarters
from ..textures import MOST_POINTS, even_points, point_colours, shines, triangle_emission
from .emitter_tree import EmitterTree
from .illumination import Source
from .lamps import Panel

#: Panels up to which textured emission is split, and the standard deviation within them, as a share of the light, that
#: is even enough.
_MOST_PIECES, _EVEN = 32, 0.05


@dataclass(frozen=True, eq=False)
class Piece:
    """Part of an emitting triangle: name of its surface, weights (3, 3) of the triangle's corners at its own, corners
    (3, 3) and area in metres, radiance (3,) W/(m^2 sr), of both sides or of the front. uneven: the radiance's standard
    deviation within it."""

    name: str
    scene_object: SceneObject
    triangle: int
    weights: Float64
    corners: Float64
    area: float
    radiance: Float64
    two_sided: bool
    uneven: float


def emitting_panels(scene: Scene, space: Space) -> list[Source]:
    """A light for each emitting piece, or one for all of many; none where rays that look around find them better."""
    if emitters_by_rays(scene):
        return []
    if emitting_triangles(scene) > MOST_PANELS:
        return [_tree(scene, space)]
    placed = [(piece, space.normalise(piece.corners)) for piece in emitting_pieces(scene)]
    # What rounding gives an area far from the origin may have none at home.
    solid = [(piece, corners) for piece, corners in placed if triangle_geometry(corners[None])[1][0] > 0]
    return [Panel(piece.name, corners, piece.radiance, two_sided=piece.two_sided) for piece, corners in solid]


def _tree(scene: Scene, space: Space) -> EmitterTree:
    corners, radiance, one_sided = [], [], []
    of_surfaces = np.array([surface.one_sided for surface in scene.surfaces])
    for scene_object in scene.objects:
        emission = triangle_emission(scene, scene_object)
        own = space.normalise(scene_object.vertices[scene_object.triangles])
        emits = (emission.max(axis=1) > 0) & (triangle_geometry(own)[1] > 0)
        corners.append(own[emits])
        radiance.append(emission[emits])
        one_sided.append(of_surfaces[scene_object.surface[emits]])
    return EmitterTree(np.concatenate(corners), np.concatenate(radiance), np.concatenate(one_sided))


def emitting_pieces(scene: Scene) -> list[Piece]:
    """What is sampled as lamps: emitting triangles, split where their emission varies."""
    if emitting_triangles(scene) > MOST_PANELS:
        return []
    pieces = []
    for scene_object in (o for o in scene.objects if shines(scene, o)):
        emits = triangle_emission(scene, scene_object).max(axis=1) > 0
        pieces += [_piece(scene, scene_object, int(triangle), np.eye(3)) for triangle in np.flatnonzero(emits)]
    pieces = [piece for piece in pieces if piece.area > 0]
    while len(pieces) < _MOST_PIECES:
        worst = max(pieces, key=lambda piece: piece.area * piece.uneven, default=None)
        power = sum(piece.area * piece.radiance.mean() for piece in pieces)
        if worst is None or sum(piece.area * piece.uneven for piece in pieces) <= _EVEN * power:
            break
        parts = [_piece(scene, worst.scene_object, worst.triangle, part) for part in quarters(worst.weights)]
        place = pieces.index(worst)
        pieces[place : place + 1] = [part for part in parts if part.radiance.max() > 0]
    return pieces


def _piece(scene: Scene, scene_object: SceneObject, triangle: int, weights: Float64) -> Piece:
    corners = weights @ scene_object.vertices[scene_object.triangles[triangle]]
    surface = scene.surfaces[scene_object.surface[triangle]]
    if surface.emission_texture is None:
        radiance = np.array([surface.emitted])
    else:
        parent = np.full(MOST_POINTS, triangle, dtype=np.int32)
        part = np.broadcast_to(weights, (MOST_POINTS, 3, 3))
        points = even_points(MOST_POINTS)
        radiance = point_colours(scene, scene_object, parent, part, points, 1.0 / MOST_POINTS).emission
    return Piece(
        surface.name,
        scene_object,
        triangle,
        weights,
        corners,
        float(triangle_geometry(corners[None])[1][0]),
        radiance.mean(axis=0),
        not surface.one_sided,
        float(radiance.mean(axis=1).std()),
    )
