"""How light is kept in a colour attribute: on corners or points, as floats or bytes, made brighter or darker.

Bytes are sRGB-encoded, as Blender keeps them: 255 steps from 0 to 1. What is brighter is cut off. Rounding would draw a
line wherever the light passes from one step to the next, so each vertex rounds at a threshold of its own.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import bpy
import numpy as np

from ..core.scene import Float32, Float64, Int32
from ..core.settings import VIEWS

Domain = Literal["CORNER", "POINT"]
DataType = Literal["FLOAT_COLOR", "BYTE_COLOR"]

#: Custom property of a mesh: by name, the factor that an attribute's light was multiplied with, where that is not 1.
EXPOSURE_KEY = "radiosity_baker_exposure"

_ENCODED = np.arange(256) / 255.0
#: The linear values of the bytes (IEC 61966-2-1).
_STEPS = np.where(_ENCODED <= 0.04045, _ENCODED / 12.92, ((_ENCODED + 0.055) / 1.055) ** 2.4)


@dataclass(frozen=True)
class Storage:
    """domain and data_type of the attributes; exposure: stops by which light is made brighter before it is stored."""

    domain: Domain = "CORNER"
    data_type: DataType = "FLOAT_COLOR"
    exposure: float = 0.0

    def factor(self, layer: str) -> float:
        """What a layer's light is multiplied with; the debug views are no light, and stay."""
        return 1.0 if layer in VIEWS else 2.0**self.exposure


@dataclass(frozen=True, eq=False)
class MeshCorners:
    """Where the corners of a mesh are: vertex (l,) and area of the face (l,) of each, and the number of vertices."""

    vertex: Int32
    area: Float64
    vertices: int

    @classmethod
    def of(cls, mesh: bpy.types.Mesh) -> MeshCorners:
        vertex = np.empty(len(mesh.loops), np.int32)
        mesh.loops.foreach_get("vertex_index", vertex)
        total, area = np.empty(len(mesh.polygons), np.int32), np.empty(len(mesh.polygons), np.float32)
        mesh.polygons.foreach_get("loop_total", total)
        mesh.polygons.foreach_get("area", area)
        return cls(vertex, np.repeat(area.astype(np.float64), total), len(mesh.vertices))


def encode(layers: dict[str, Float32], corners: MeshCorners, storage: Storage) -> tuple[dict[str, Float32], float]:
    """What attributes hold of each layer's light (l, 3), by element of their domain (n, 3); and the brightest value of
    all that bytes had to cut off (1 when nothing was)."""
    stored, brightest = {}, 1.0
    for layer, light in layers.items():
        values = light if storage.factor(layer) == 1.0 else light * np.float32(storage.factor(layer))
        if storage.domain == "POINT":
            values = _at_vertices(values, corners)
        if storage.data_type == "BYTE_COLOR":
            brightest = max(brightest, float(values.max(initial=0.0)))
            vertex = corners.vertex if storage.domain == "CORNER" else np.arange(corners.vertices)
            values = in_bytes(values, _threshold(vertex)[:, None])
        stored[layer] = values
    return stored, brightest


def note_factors(mesh: bpy.types.Mesh, factors: dict[str, float]) -> None:
    """Keep with the mesh what each attribute must be divided by to be light again; forget it where that is 1."""
    noted = {name: f for name, f in (dict(mesh.get(EXPOSURE_KEY) or {}) | factors).items() if f != 1.0}
    if noted:
        mesh[EXPOSURE_KEY] = noted
    elif EXPOSURE_KEY in mesh:
        del mesh[EXPOSURE_KEY]


def factor_of(mesh: bpy.types.Mesh, name: str) -> float:
    """What the light in an attribute was multiplied with."""
    return float((mesh.get(EXPOSURE_KEY) or {}).get(name, 1.0))


def cut_off_warning(brightest: Iterable[float], storage: Storage) -> list[str]:
    """What to tell the person when bytes could not hold the brightest values of the objects."""
    most = max(brightest, default=1.0)
    if most <= 1.0:
        return []
    remedy = np.floor(10.0 * (storage.exposure - np.log2(most))) / 10.0
    cut_off = f"Bytes hold values up to 1, and those from there to {most:.3g} were cut off"
    return [f"{cut_off}: bake with an exposure of {remedy:.1f} stops, or to float colours."]


def _at_vertices(values: Float32, corners: MeshCorners) -> Float32:
    """Mean (vertices, 3) of corner values (l, 3), weighted by area; loose vertices take the mean of all."""
    # Faces without area count where there are no others.
    weight = np.maximum(corners.area, 1e-30)
    total = np.bincount(corners.vertex, weight, corners.vertices)
    sums = [np.bincount(corners.vertex, weight * values[:, c], corners.vertices) for c in range(3)]
    means = np.stack(sums, axis=1) / np.where(total > 0, total, 1.0)[:, None]
    means[total == 0] = values.mean(axis=0)
    return means.astype(np.float32)


def in_bytes(values: Float32, threshold: Float64) -> Float32:
    """The 256 steps that linear values (n, 3) become: of the two around each the upper if the value's share of the way
    between them exceeds the threshold (n, 1) in [0, 1), which is right on average."""
    low = np.clip(np.searchsorted(_STEPS, values, side="right") - 1, 0, 254)
    upper = values - _STEPS[low] > threshold * (_STEPS[low + 1] - _STEPS[low])
    return _STEPS[low + upper].astype(np.float32)


def _threshold(vertex: Int32) -> Float64:
    """(n,) in [0, 1): a fixed hash of the vertex (Wang 2007), so that the corners that meet in it stay one colour."""
    h = vertex.astype(np.uint32)
    h = (h ^ np.uint32(61)) ^ (h >> np.uint32(16))
    h *= np.uint32(9)
    h ^= h >> np.uint32(4)
    h *= np.uint32(0x27D4EB2D)
    h ^= h >> np.uint32(15)
    return h / 2.0**32
