"""Light that arrives straight from lamps and emitting surfaces, with soft shadows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..sampling import GOLDEN, stream
from ..scene import Bool, Float32, Float64
from ..visibility import Visibility, offset_along
from .lamps import Light

#: A light this far under the brightest one at a point, relatively, is not worth a shadow ray there.
_NEGLIGIBLE = 1e-7


@dataclass(frozen=True, eq=False)
class Illumination:
    """irradiance (n, 3) W/m^2 and its variance (n, 3); signature (n,) int64: equal numbers see the same lights whole,
    and -1 sees some light in part; rays cast."""

    irradiance: Float64
    variance: Float64
    signature: np.ndarray
    rays: int


class DirectLight:
    """All sources that are sampled as lights, and the occluders between."""

    def __init__(self, lights: list[Light], visibility: Visibility, seed: int) -> None:
        self.lights = lights
        self._visibility = visibility
        # A random bit pattern for each light: the sum over the lights seen names their set.
        self._names = stream(seed, "light names").integers(1, 2**40, size=len(lights))

    def at(
        self, points: Float64, normals: Float64, shading: Float64, rays: int, rng: np.random.Generator
    ) -> Illumination:
        """At points (n, 3) with geometric and shading normals (n, 3), `rays` shadow rays to each sized light."""
        irradiance, variance = np.zeros((2, len(points), 3))
        signature = np.zeros(len(points), dtype=np.int64)
        partly = np.zeros(len(points), dtype=bool)
        cast = 0
        origins = offset_along(points, normals)
        for light, name in zip(self.lights, self._names, strict=True):
            share = light.unoccluded(points, shading)
            lit = np.flatnonzero(share * light.color.max() > _NEGLIGIBLE * irradiance.max(axis=1, initial=0.0))
            if not len(lit):
                continue
            # Two independent halves of the targets: how much they differ is how far their mean can be trusted.
            halves = 2 if light.sized else 1
            per_half = max(1, rays // 2) if light.sized else 1
            unit = _lattices(len(lit), halves, per_half, rng)
            targets, weights, gain = light.aim(points[lit], shading[lit], unit.reshape(len(lit), -1, 2))
            free = self._free(points[lit], normals[lit], origins[lit], targets, weights * gain)
            cast += free.size
            shape = (-1, halves, per_half)
            visible = _weighted_mean((free * gain).reshape(shape), weights.reshape(shape))
            arriving = (share[lit, None] * visible)[:, :, None] * light.color
            irradiance[lit] += arriving.mean(axis=1)
            if halves == 2:
                variance[lit] += (arriving[:, 0] - arriving[:, 1]) ** 2 / 4.0
            all_of_it = free.all(axis=1)
            signature[lit] += np.where(all_of_it, name, 0)
            partly[lit] |= free.any(axis=1) & ~all_of_it
        signature[partly] = -1
        return Illumination(irradiance, variance, signature, cast)

    def _free(self, points: Float64, normals: Float64, origins: Float32, targets: Float64, weights: Float64) -> Bool:
        """Which targets (n, r, 3) can be seen; those that shed nothing count as seen."""
        # What lies below the surface itself is blocked by it, whatever the shading normal says.
        above = np.einsum("nrk,nk->nr", targets - points[:, None], normals) > 0
        free = weights == 0
        index = np.nonzero(above & ~free)
        free[index] = self._visibility.unblocked(origins[index[0]], targets[index].astype(np.float32))
        return free


def _lattices(points: int, halves: int, count: int, rng: np.random.Generator) -> Float64:
    """(points, halves, count, 2): even sets of the unit square, each shifted by itself."""
    lattice = np.column_stack([(np.arange(count) + 0.5) / count, np.arange(count) * GOLDEN])
    return np.asarray((lattice + rng.random((points, halves, 1, 2))) % 1.0)


def _weighted_mean(values: Float64, weights: Float64) -> Float64:
    """(n, halves): the mean of values (n, halves, r) by their weights."""
    total = weights.sum(axis=2)
    return np.divide((weights * values).sum(axis=2), total, out=np.zeros_like(total), where=total > 0)
