"""From fitted light to what each layer of the result holds."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from .receivers import Receivers
from .refinement import Light
from .result import BakedObject
from .scene import Float32, Float64, Scene, SceneError
from .settings import LAYERS


def baked_objects(scene: Scene, receivers: Receivers, light: Light, names: tuple[str, ...]) -> Iterator[BakedObject]:
    """The receivers with the asked layers, radiance in W/(m^2 sr) at every corner."""
    layers = {name: radiance(name, scene, receivers, light) for name in names}
    for number, (receiver, mesh) in enumerate(zip(receivers.objects, receivers.meshes, strict=True)):
        part = slice(receivers.first[number], receivers.first[number + 1])
        yield BakedObject(
            receiver.name,
            mesh.vertices,
            mesh.triangles,
            mesh.parent,
            mesh.barycentric,
            {name: values[part] for name, values in layers.items()},
        )


def radiance(name: str, scene: Scene, receivers: Receivers, light: Light) -> Float32:
    """One layer (e, 3, 3) over all output triangles. Raises SceneError for a layer that does not exist."""
    albedo = np.array([s.albedo for s in scene.surfaces])[receivers.element_surface][:, None]
    emission = np.array([s.emission for s in scene.surfaces])[receivers.element_surface][:, None]
    sky = light.open_sky[:, None] * np.pi * np.array(scene.sky)
    straight = light.lamps + light.emitted + sky

    def reflect(irradiance: Float64) -> Float64:
        return albedo * irradiance[receivers.corner_vertex] / np.pi

    shape = (*receivers.corner_vertex.shape, 3)
    layers: dict[str, Callable[[], Float64]] = {
        "combined": lambda: emission + reflect(straight + light.reflected),
        "light": lambda: (straight + light.reflected)[receivers.corner_vertex] / np.pi,
        "direct": lambda: reflect(straight),
        "indirect": lambda: reflect(light.reflected),
        "emission": lambda: np.broadcast_to(emission, shape),
        "sky": lambda: reflect(sky),
        "error": lambda: np.broadcast_to(_standard_error(receivers, light)[:, :, None], shape),
    }
    if name not in layers:
        raise SceneError(f"There is no layer '{name}': choose from {', '.join(LAYERS)}.")
    return np.ascontiguousarray(layers[name](), dtype=np.float32)


def _standard_error(receivers: Receivers, light: Light) -> Float64:
    """(e, 3): root of the mean square error of the cells around each vertex, W/(m^2 sr)."""
    cells = receivers.cells
    corner = receivers.corner_vertex[cells.element].ravel()
    weight = np.repeat(cells.area, 3)
    total = np.bincount(corner, weight * np.repeat(light.cell_error, 3), receivers.vertices)
    share = np.bincount(corner, weight, receivers.vertices)
    return np.asarray(np.sqrt(total / np.maximum(share, np.finfo(float).tiny)))[receivers.corner_vertex]
