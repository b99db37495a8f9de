"""Places on a flat lamp, spread evenly over the solid angle under which a point sees it.

Seen from nearby, the parts of a lamp count very differently: places spread evenly over its area then miss what matters.
Everything here is seen from the origin, components first, in double precision.
"""

from __future__ import annotations

import numpy as np

from ..scene import Float64


def rectangle_places(low: Float64, high: Float64, depth: Float64, unit: Float64) -> tuple[Float64, Float64]:
    """Coordinates (2, r, n) on rectangles in planes at depth (n,) > 0, from low to high (2, n), for points (2, r, n) of
    the unit square; and the solid angles (n,).

    C. Urena, M. Fajardo, A. King, An area-preserving parametrization for spherical rectangles (2013), listing 2.
    """
    (x0, y0), (x1, y1), z = low, high, -depth
    width, height = x1 - x0, y1 - y0
    # Of the unit normals of the four planes through the origin and an edge, the component along the depth.
    bottom, right, top, left = (
        edge * side / np.sqrt((z * side) ** 2 + (edge * side) ** 2)
        for edge, side in ((-y0, width), (x1, height), (y1, width), (-x0, height))
    )
    angles = [np.arccos(-one * other) for one, other in ((bottom, right), (right, top), (top, left), (left, bottom))]
    rest = 2 * np.pi - angles[2] - angles[3]
    solid = angles[0] + angles[1] - rest

    turn = unit[0] * solid + rest
    sine = np.sin(turn)
    f = (np.cos(turn) * bottom - top) / np.where(sine == 0, 1e-30, sine)
    cosine = np.clip(np.copysign(1 / np.sqrt(f * f + bottom * bottom), f), -1 + 1e-12, 1 - 1e-12)
    x = np.clip(-cosine * z / np.sqrt(1 - cosine * cosine), x0, x1)
    far = np.sqrt(x * x + z * z)
    h0, h1 = y0 / np.sqrt(far * far + y0 * y0), y1 / np.sqrt(far * far + y1 * y1)
    h = h0 + unit[1] * (h1 - h0)
    y = np.clip(h * far / np.sqrt(np.maximum(1 - h * h, 1e-12)), y0, y1)
    return np.stack([x, y]), solid


def triangle_directions(corners: Float64, unit: Float64) -> tuple[Float64, Float64]:
    """Unit vectors (3, r, n) towards triangles with corners (3, 3, n) [corner, component], for points (2, r, n) of the
    unit square; and the solid angles (n,).

    J. Arvo, Stratified sampling of spherical triangles (1995).
    """
    a, b, c = (corner / _length(corner) for corner in corners)
    ab, bc, ca = _cross(a, b), _cross(b, c), _cross(c, a)
    alpha, beta, gamma = _angle(ab, -ca), _angle(bc, -ab), _angle(ca, -bc)
    solid = alpha + beta + gamma - np.pi

    part = unit[0] * solid - alpha
    s, t = np.sin(part), np.cos(part)
    u = t - np.cos(alpha)
    v = s + np.sin(alpha) * _dot(a, b)
    below = (v * s + u * t) * np.sin(alpha)
    q = np.clip(((v * t - u * s) * np.cos(alpha) - v) / np.where(below == 0, 1e-30, below), -1, 1)
    third = q * a[:, None] + np.sqrt(1 - q * q) * _orthogonal(c, a)[:, None]
    z = 1 - unit[1] * (1 - _dot(third, b[:, None]))
    return z * b[:, None] + np.sqrt(np.maximum(1 - z * z, 0)) * _orthogonal(third, b[:, None]), solid


def _dot(a: Float64, b: Float64) -> Float64:
    return np.asarray((a * b).sum(axis=0))


def _length(a: Float64) -> Float64:
    return np.maximum(np.sqrt(_dot(a, a)), 1e-30)


def _cross(a: Float64, b: Float64) -> Float64:
    return np.asarray(np.cross(a, b, axis=0))


def _angle(a: Float64, b: Float64) -> Float64:
    return np.asarray(np.arccos(np.clip(_dot(a, b) / (_length(a) * _length(b)), -1, 1)))


def _orthogonal(a: Float64, b: Float64) -> Float64:
    """What is left of a (3, ...) at right angles to the unit vectors b, made a unit vector."""
    rest = a - _dot(a, b) * b
    return np.asarray(rest / _length(rest))
