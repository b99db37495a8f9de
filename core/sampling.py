"""Point sets, frames, and streams of random numbers."""

from __future__ import annotations

import zlib
from typing import cast

import numpy as np

from .scene import Float32, Float64

GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0
# The plastic number's powers: the most even additive recurrence in the plane (Roberts 2018).
_PLASTIC = np.array([0.7548776662466927, 0.5698402909980532])


def stream(seed: int, purpose: str, chunk: int = 0) -> np.random.Generator:
    """A counter-based stream of its own for each seed, purpose and chunk, whichever thread draws from it."""
    key = np.array([seed & 0xFFFFFFFFFFFFFFFF, zlib.crc32(purpose.encode())], dtype=np.uint64)
    return np.random.Generator(np.random.Philox(key=key, counter=[0, 0, 0, chunk]))


def subseed(seed: int, purpose: str) -> int:
    """A seed for a part of the work that draws the same streams as another."""
    return int(stream(seed, purpose).integers(2**62))


def cosine_patterns(count: int, rays: int, rng: np.random.Generator) -> Float32:
    """(count, rays, 3) sets of directions about +z with density cos/pi.

    Each set is a Fibonacci lattice on the unit disc, shifted at random, lifted to the hemisphere (Malley's method).
    """
    shift = rng.random((count, 1))
    radius = np.sqrt((np.arange(rays) + shift) / rays)
    angle = 2.0 * np.pi * (np.arange(rays) * GOLDEN + rng.random((count, 1)))
    z = np.sqrt(np.maximum(1.0 - radius * radius, 0.0))
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=-1).astype(np.float32)


def frames(normals: Float32, angle: Float32) -> Float32:
    """(n, 3, 3) rows tangent, bitangent, normal; turned about the normal by `angle` (n,) radians (Duff et al. 2017)."""
    x, y, z = normals[:, 0], normals[:, 1], normals[:, 2]
    sign = np.where(z >= 0, np.float32(1), np.float32(-1))
    a = -1.0 / (sign + z)
    b = x * y * a
    tangent = np.stack([1.0 + sign * x * x * a, sign * b, -sign * x], axis=1)
    bitangent = np.stack([b, sign + y * y * a, -y], axis=1)
    cosine, sine = np.cos(angle)[:, None], np.sin(angle)[:, None]
    turned = [cosine * tangent + sine * bitangent, cosine * bitangent - sine * tangent, normals]
    return np.stack(turned, axis=1).astype(np.float32, copy=False)


def plane_points(index: int | np.ndarray, shift: Float64) -> Float64:
    """Points index, index + 1 ... of the plastic sequence in the unit square, moved by shift (n, 2), modulo one."""
    return cast(Float64, (np.asarray(index)[..., None] * _PLASTIC + shift) % 1.0)


def triangle_points(unit: Float64) -> Float64:
    """(n, 2) points of the unit square to (n, 3) barycentric weights, uniform over the triangle, without a fold."""
    u, v = unit[..., 0], unit[..., 1]
    # Heitz 2019, "A low-distortion map between triangle and square": keeps even sets even, unlike the square root.
    lower = v > u
    first = np.where(lower, u / 2, u - v / 2)
    second = np.where(lower, v - u / 2, v / 2)
    return np.stack([first, second, 1.0 - first - second], axis=-1)
