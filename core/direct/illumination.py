"""Light that arrives straight from lamps and emitting surfaces, with soft shadows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..sampling import GOLDEN, stream
from ..scene import Bool, Float64
from ..visibility import Visibility, offset_along
from .lamps import Light

#: A light this far under the brightest one at a point, relatively, is not worth a shadow ray there.
_NEGLIGIBLE = 1e-7


@dataclass(frozen=True, eq=False)
class Illumination:
    """irradiance (n, 3) W/m^2; signature (n,) int64: equal numbers see the same lights whole, and -1 sees some light
    in part; rays cast."""

    irradiance: Float64
    signature: np.ndarray
    rays: int


class DirectLight:
    """All sources that are sampled as lights, and the occluders between."""

    def __init__(self, lights: list[Light], visibility: Visibility, seed: int) -> None:
        self.lights = lights
        self._visibility = visibility
        # A random bit pattern for each light: the sum over the lights seen names their set.
        self._names = stream(seed, "light names").integers(1, 2**40, size=len(lights))

    def at(self, points: Float64, normals: Float64, shading: Float64, rays: int, rng: np.random.Generator) -> Illumination:
        """At points (n, 3) with geometric and shading normals (n, 3), `rays` shadow rays to each sized light."""
        irradiance = np.zeros((len(points), 3))
        signature = np.zeros(len(points), dtype=np.int64)
        partly = np.zeros(len(points), dtype=bool)
        cast = 0
        origins = offset_along(points, normals)
        for light, name in zip(self.lights, self._names, strict=True):
            share = light.unoccluded(points, shading)
            lit = np.flatnonzero(share * light.color.max() > _NEGLIGIBLE * irradiance.max(axis=1, initial=0.0))
            lit = lit[share[lit] > 0]
            if not len(lit):
                continue
            count = rays if light.sized else 1
            free, weights = self._free(light, points[lit], normals[lit], shading[lit], origins[lit], count, rng)
            cast += free.size
            total = weights.sum(axis=1)
            visible = np.where(total > 0, (weights * free).sum(axis=1) / np.maximum(total, 1e-300), 0.0)
            irradiance[lit] += (share[lit] * visible)[:, None] * light.color
            some, all_of_it = free.any(axis=1), free.all(axis=1)
            signature[lit] += np.where(all_of_it, name, 0)
            partly[lit] |= some & ~all_of_it
        signature[partly] = -1
        return Illumination(irradiance, signature, cast)

    def _free(
        self,
        light: Light,
        points: Float64,
        normals: Float64,
        shading: Float64,
        origins: np.ndarray,
        count: int,
        rng: np.random.Generator,
    ) -> tuple[Bool, Float64]:
        """Which of `count` targets spread over the light are free (n, count), and the weight of each."""
        shift = rng.random((len(points), 1, 2))
        lattice = np.column_stack([(np.arange(count) + 0.5) / count, np.arange(count) * GOLDEN])
        targets, weights = light.aim(points, shading, (lattice + shift) % 1.0)
        # What lies below the surface itself is blocked by it, whatever the shading normal says.
        above = np.einsum("nrk,nk->nr", targets - points[:, None], normals) > 0
        free = np.zeros(above.shape, dtype=bool)
        index = np.nonzero(above & (weights > 0))
        free[index] = self._visibility.unblocked(origins[index[0]], targets[index].astype(np.float32))
        return free | (weights == 0), weights
