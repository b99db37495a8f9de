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
        along = np.stack([points.T, normals.T, shading.T]).astype(np.float32)
        for light, name in zip(self.lights, self._names, strict=True):
            share = light.share(points, shading)
            lit = np.flatnonzero(share * light.color.max() > _NEGLIGIBLE * irradiance.max(axis=1, initial=0.0))
            if not len(lit):
                continue
            # Two independent halves of the ways: how much they differ is how far their mean can be trusted.
            halves, per_half = (2, max(1, rays // 2)) if light.sized else (1, 1)
            unit = _lattices(halves, per_half, len(lit), rng)
            free, weights, gains = self._look(light, along[:, :, lit], origins[lit], unit)
            cast += free.size
            arrived = weights * free if gains is None else weights * gains * free
            shape = (halves, per_half, len(lit))
            seen = _seen(share[lit], weights.reshape(shape).mean(axis=1), arrived.reshape(shape).mean(axis=1))
            irradiance[lit] += seen.mean(axis=0)[:, None] * light.color
            if halves == 2:
                variance[lit] += ((seen[0] - seen[1])[:, None] * light.color) ** 2 / 4.0
            whole = free.all(axis=0)
            signature[lit] += np.where(whole, name, 0)
            partly[lit] |= free.any(axis=0) & ~whole
        signature[partly] = -1
        return Illumination(irradiance, variance, signature, cast)

    def _look(
        self, light: Light, along: Float32, origins: Float32, unit: Float32
    ) -> tuple[Bool, Float32, Float32 | None]:
        """Which of the ways (r, n) to a light are free, what each counts, and the light's gain along it.

        along (3, 3, n): points, normals and shading normals, components first. Ways that bring nothing count as free,
        for no ray is cast along them.
        """
        points, normals, shading = along
        ways = light.aim(points, unit)
        towards = ways.towards
        weights = np.maximum((towards * shading[:, None]).sum(axis=0), 0) * ways.inverse * ways.solid
        gains = light.gain(ways)
        free = weights == 0 if gains is None else weights * gains == 0
        # What lies below the surface itself is blocked by it, whatever the shading normal says.
        above = (towards * normals[:, None]).sum(axis=0) > 0
        sample, point = np.nonzero(above & ~free)
        directions = np.ascontiguousarray(towards[:, sample, point].T)
        free[sample, point] = self._visibility.unblocked_along(origins[point], directions)
        return free, weights, gains


def _seen(share: Float64, weights: Float32, arrived: Float32) -> Float64:
    """How much of a light is seen, (h, n), by each half of the ways: mean weights (h, n), of which so much arrived.

    share (n,) is what the weights are on average, and the difference corrects what arrived, as far as the light is
    free: exactly the share where nothing is in the way, and exactly nothing where everything is. How far it is free the
    other half tells (control variates; A. Owen, Monte Carlo theory, methods and examples, chapter 8.9), so the answer
    is right on average, which the ratio of the two sums is not. A single way has no other half.
    """
    free = np.divide(arrived, weights, out=np.ones_like(weights), where=weights > 0)
    if len(free) == 1:
        return share * free
    other = free[::-1].astype(np.float64)
    return other * share + (arrived - other * weights)


def _lattices(halves: int, count: int, points: int, rng: np.random.Generator) -> Float32:
    """(2, halves * count, points): even sets of the unit square, each shifted by itself."""
    lattice = np.stack([(np.arange(count) + 0.5) / count, np.arange(count) * GOLDEN]).astype(np.float32)
    unit = lattice[:, None, :, None] + rng.random((2, halves, 1, points), dtype=np.float32)
    return (unit - np.floor(unit)).reshape(2, halves * count, points)
