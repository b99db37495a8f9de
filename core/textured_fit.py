"""Vertex values that show light on a textured surface as well as the output triangles can.

Textures hold more detail than vertices. The value at a vertex is not that of the texture there, which would alias, but
comes from the same least squares as the light (`core/reconstruction.py`), here onto albedo times fitted irradiance at
many points of every cell. Corners share a value only where the texture goes on over the edge between them.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .receivers import Receivers
from .reconstruction import Fit, Samples
from .scene import Bool, Float64, Scene, SceneObject
from .tessellation import Tessellation
from .textures import Colours, even_points, point_colours, varies

#: Points of a cell at which colours are looked up, and how much the fit weighs smoothness.
_POINTS, _SMOOTHNESS = 16, 1e-3


class TexturedFit:
    """elements (e,): output triangles on objects whose colours vary."""

    def __init__(self, scene: Scene, receivers: Receivers) -> None:
        varying = np.array([varies(scene, o) for o in receivers.objects])
        self.elements: Bool = np.repeat(varying, np.diff(receivers.first))
        self._receivers = receivers
        own = replace(receivers, places=_places(scene, receivers))
        cells = len(receivers.cells)
        self._fit = Fit(own, np.ones((cells, 3)), np.zeros(cells, dtype=bool))
        self._corner = own.corner_vertex
        points = even_points(_POINTS)
        self._weights = [_in_elements(receivers, point) for point in points]
        self._colours = [_colours_at(scene, receivers, point) for point in points]

    def shown(self, irradiance: Float64, *, emits: bool) -> Float64:
        """Radiance (e, 3, 3), W/(m^2 sr), of irradiance (v, 3) at the vertices of the receivers."""
        corners = irradiance[self._receivers.corner_vertex[self._receivers.cells.element]] / np.pi
        samples = Samples(len(corners), np.full(3, 1 / 3))
        every, exact = np.ones(len(corners), dtype=bool), np.zeros(len(corners))
        for weights, colours in zip(self._weights, self._colours, strict=True):
            value = colours.albedo * np.einsum("ck,ckj->cj", weights, corners)
            if emits:
                value += colours.emission
            samples.add(slice(None), weights, value, exact, every)
        fitted = self._fit.solve(self._fit.system(samples), _SMOOTHNESS)
        return np.maximum(fitted, 0.0)[self._corner]


def _colours_at(scene: Scene, receivers: Receivers, point: Float64) -> Colours:
    """Colours at one point (3,) of every cell."""
    parts = [
        point_colours(scene, o, m.parent, m.barycentric, point, 1.0 / _POINTS)
        for o, m in zip(receivers.objects, receivers.fine, strict=True)
    ]
    return Colours(np.concatenate([p.albedo for p in parts]), np.concatenate([p.emission for p in parts]))


def _in_elements(receivers: Receivers, point: Float64) -> Float64:
    """(c, 3) weights in its output triangle of one point (3,) of every cell."""
    if receivers.cells.barycentric is None:
        return np.broadcast_to(point, (len(receivers.cells), 3))
    return np.asarray(np.einsum("k,ckj->cj", point, receivers.cells.barycentric))


def _places(scene: Scene, receivers: Receivers) -> Float64:
    """(e, 3, 5): where the corners of the output triangles are in their textures, and their colours."""
    return np.concatenate([_places_of(scene, o, m) for o, m in zip(receivers.objects, receivers.meshes, strict=True)])


def _places_of(scene: Scene, scene_object: SceneObject, mesh: Tessellation) -> Float64:
    places = np.zeros((len(mesh.triangles), 3, 5))
    for values, columns in ((scene_object.uv, slice(0, 2)), (scene_object.colors, slice(2, 5))):
        if values is not None:
            places[..., columns] = mesh.barycentric @ values[mesh.parent]
    # Where each triangle has pixels of its own, the colours go on over its edges, but the places do not.
    separate = [any(t and t.separate for t in (s.albedo_texture, s.emission_texture)) for s in scene.surfaces]
    places[np.array(separate)[scene_object.surface[mesh.parent]], :, :2] = 0.0
    return places
