"""From fitted light to what each layer of the result holds."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cached_property

import numpy as np

from .diagonals import turn_diagonals
from .receivers import Receivers
from .refinement import Light
from .result import BakedObject
from .scene import Float32, Float64, Scene, SceneError
from .settings import LAYERS
from .tessellation import Int64
from .textured_fit import TexturedFit
from .textures import constant_colours, varies

#: Colours of vertices in the layer `unreached`.
_REACHED, _FILLED, _HIDDEN = (0.05, 0.05, 0.05), (1.0, 0.0, 1.0), (1.0, 0.0, 0.0)
#: Powers of the root of x^4 = x + 1, inverted: steps of the sequence that fills a cube most evenly.
_R3 = 1.2207440846057596 ** -np.arange(1.0, 4.0)


def baked_objects(receivers: Receivers, layers: Layers, names: tuple[str, ...]) -> Iterator[BakedObject]:
    """The receivers with the asked layers, values at every corner.

    Raises SceneError for a layer that does not exist.
    """
    values = {name: layers.values(name) for name in names}
    for number, (receiver, mesh) in enumerate(zip(receivers.objects, receivers.meshes, strict=True)):
        part = slice(receivers.first[number], receivers.first[number + 1])
        triangles, barycentric = mesh.triangles, mesh.barycentric
        if layers.corners is not None:
            own = layers.corners[part] - 3 * receivers.first[number]
            triangles, barycentric = triangles.ravel()[own], barycentric.reshape(-1, 3)[own]
        yield BakedObject(
            receiver.name,
            mesh.vertices,
            triangles,
            mesh.parent,
            barycentric,
            {name: layer[part] for name, layer in values.items()},
        )


class Layers:
    """Fitted light, colour by colour and source by source. escaped: asked for the share (v,) open to the void, if a
    layer shows it."""

    def __init__(self, scene: Scene, receivers: Receivers, light: Light, escaped: Callable[[], Float64]) -> None:
        self._receivers = receivers
        self._light = light
        self._escaped = escaped
        self._straight = light.lamps + light.emitted + light.sky
        self._colours = constant_colours(scene, receivers.element_surface)
        self._textured = TexturedFit(scene, receivers) if any(varies(scene, o) for o in receivers.objects) else None

    @cached_property
    def corners(self) -> Int64 | None:
        """(e, 3) the corner that each corner of the output triangles becomes when diagonals are turned; None where all
        stay: in meshes that are kept, and in light that is still rough. Textures were fitted to triangles as they are.
        """
        if not (self._receivers.tessellated and self._light.alphas):
            return None
        everything = (self._straight + self._light.reflected).mean(axis=1)
        textured = False if self._textured is None else self._textured.elements
        return turn_diagonals(self._receivers, everything, self._light.buried | textured)

    def values(self, name: str) -> Float32:
        """One layer (e, 3, 3) over all output triangles, as settings.LAYERS describes it: radiance in W/(m^2 sr), or a
        view of how the bake went. Raises SceneError for a layer that does not exist."""
        light, dark = self._light, np.zeros_like(self._light.sky)
        everything = self._straight + light.reflected
        layers: dict[str, Callable[[], Float64]] = {
            "combined": lambda: self._shown(everything, emits=True),
            "light": lambda: self._at_corners(everything) / np.pi,
            "direct": lambda: self._shown(self._straight),
            "indirect": lambda: self._shown(light.reflected),
            "emission": lambda: self._shown(dark, emits=True),
            "sky": lambda: self._shown(light.sky),
            "error": lambda: np.repeat(_standard_error(self._receivers, light)[:, :, None], 3, axis=2),
            "unreached": lambda: _unreached(light)[self._receivers.corner_vertex],
            "escaped": lambda: np.repeat(self._escaped()[self._receivers.corner_vertex][:, :, None], 3, axis=2),
            "triangles": lambda: _own_colours(len(self._receivers.corner_vertex)),
        }
        if name not in layers:
            raise SceneError(f"There is no layer '{name}': choose from {', '.join(LAYERS)}.")
        values = layers[name]()
        if self.corners is not None and name != "triangles":
            values = values.reshape(-1, 3)[self.corners]
        return np.ascontiguousarray(values, dtype=np.float32)

    def _shown(self, irradiance: Float64, *, emits: bool = False) -> Float64:
        """What (e, 3, 3) the surfaces make of the irradiance (v, 3) at the vertices, with or without what they emit."""
        shown = self._colours.albedo[:, None] * self._at_corners(irradiance) / np.pi
        if emits:
            shown = self._colours.emission[:, None] + shown
        if self._textured is not None:
            textured = self._textured.elements
            shown[textured] = self._textured.shown(irradiance, emits=emits)[textured]
            buried = textured & self._light.buried
            if buried.any():
                shown[buried] = self._textured.shown(np.zeros_like(irradiance), emits=emits)[buried]
        return shown

    def _at_corners(self, irradiance: Float64) -> Float64:
        """Values (e, 3, 3) at the corners from those at the vertices (v, 3). A vertex where a surface goes out of sight
        belongs to what is seen; the triangle on its other side is dark in spite of it."""
        values = irradiance[self._receivers.corner_vertex]
        values[self._light.buried] = 0.0
        return values


def _standard_error(receivers: Receivers, light: Light) -> Float64:
    """(e, 3): root of the mean square error of the cells around each vertex, W/(m^2 sr)."""
    return np.asarray(np.sqrt(receivers.vertex_means(light.cell_error)))[receivers.corner_vertex]


def _unreached(light: Light) -> Float64:
    """(v, 3): loud where the light of a vertex is not its own."""
    colours = np.full((len(light.filled), 3), _REACHED)
    colours[light.filled], colours[light.hidden] = _FILLED, _HIDDEN
    return colours


def _own_colours(count: int) -> Float64:
    """(count, 3, 3): a colour for each triangle, far from those of the triangles before and after it: points of
    Roberts' sequence R3 in the cube of colours."""
    colours = (np.arange(count)[:, None] + 1) * _R3 % 1.0
    return np.repeat(colours[:, None], 3, axis=1)
