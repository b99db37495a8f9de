"""Exchange areas of polygons near each other, touching included, by a double integral around their contours.

By Stokes' theorem A_i F_ij is the integral of ln r over both contours, / (2 pi) (E. M. Sparrow 1963). Along an edge the
inner integral has a closed form (G. P. Mitalas and D. G. Stephenson 1966), which leaves a smooth function of one
variable: no singularity where polygons touch, at whatever angle.
"""

from __future__ import annotations

from typing import cast

import numpy as np

from ..scene import Bool, Float64

#: Gauss-Legendre points per piece of an edge: with 8, form factors of touching wedges are wrong by less than 1e-5.
_POINTS = 8
_TINY = 1e-300


def _end_crowded_rule() -> tuple[Float64, Float64]:
    """Nodes and weights on [0, 1], crowded to the ends (s = 3 t^2 - 2 t^3), where touching edges behave like s ln s."""
    node, weight = np.polynomial.legendre.leggauss(_POINTS)  # type: ignore[no-untyped-call]
    t = (node + 1) / 2
    return t * t * (3 - 2 * t), 3 * t * (1 - t) * weight


_NODES, _WEIGHTS = _end_crowded_rule()


def exchange_area(first: Float64, second: Float64) -> Float64:
    """A_i F_ij (m,) of polygons (m, v, 3) and (m, w, 3), unoccluded.

    Vertices run counter-clockwise seen from the side that exchanges light, and each polygon lies on that side of the
    other's plane: cut off what does not (see `in_front`). Repeated vertices are harmless.
    """
    # Logarithms of large or tiny lengths cancel over the contours, but only to rounding: work in lengths of about one.
    size = np.abs(first - first[:, :1]).max(axis=(1, 2)) + np.abs(second - first[:, :1]).max(axis=(1, 2)) + _TINY
    p, q = ((polygon - first[:, :1]) / size[:, None, None] for polygon in (first, second))
    total = np.zeros(len(p))
    for k in range(p.shape[1]):
        x, e = p[:, k], p[:, (k + 1) % p.shape[1]] - p[:, k]
        for i in range(q.shape[1]):
            y, f = q[:, i], q[:, (i + 1) % q.shape[1]] - q[:, i]
            total += _edges(x, e, y, f)
    return cast(Float64, np.maximum(total * size * size / (2 * np.pi), 0.0))


def in_front(polygon: Float64, point: Float64, normal: Float64) -> Float64:
    """The part of triangles (m, 3, 3) in front of planes through point (m, 3) with normal (m, 3), as (m, 4, 3).

    Vertices are repeated where fewer than four are left (Sutherland and Hodgman 1974).
    """
    height = np.einsum("mvk,mk->mv", polygon - point[:, None], normal)
    count = np.zeros(len(polygon), dtype=np.int64)
    result = np.zeros((len(polygon), 4, 3))

    def append(vertices: Float64, chosen: Bool) -> None:
        chosen = chosen & (count < 4)
        result[chosen, count[chosen]] = vertices[chosen]
        count[chosen] += 1

    for k in range(3):
        here, there = height[:, k], height[:, (k + 1) % 3]
        append(polygon[:, k], here > 0)
        crossing = (here > 0) != (there > 0)
        cut = here / np.where(crossing, here - there, 1.0)
        append(polygon[:, k] + cut[:, None] * (polygon[:, (k + 1) % 3] - polygon[:, k]), crossing)
    last = result[np.arange(len(result)), np.maximum(count - 1, 0)]
    return np.where((np.arange(4) < count[:, None])[..., None], result, last[:, None])


def _dot(a: Float64, b: Float64) -> Float64:
    return cast(Float64, np.einsum("mk,mk->m", a, b))


def _edges(x: Float64, e: Float64, y: Float64, f: Float64) -> Float64:
    """Integral of ln r dx.dy over edges x + s e and y + t f, s and t in [0, 1], without what cancels over a contour."""
    w = x - y
    ee, ff, ef, we, wf, ww = _dot(e, e), _dot(f, f), _dot(e, f), _dot(w, e), _dot(w, f), _dot(w, w)
    length = np.sqrt(ff) + _TINY
    # The function of s bends where it passes the ends of the other edge: integrate piece by piece.
    bends = np.clip(np.stack([-we, ef - we]) / (ee + _TINY), 0.0, 1.0)
    low, high = bends.min(axis=0), bends.max(axis=0)
    starts = np.stack([np.zeros_like(low), low, high], axis=1)[:, :, None]
    steps = np.stack([low, high - low, 1.0 - high], axis=1)[:, :, None]
    s = (starts + steps * _NODES).reshape(len(x), 3 * _POINTS)
    # Along the other edge: a is the foot of the point, h its distance from the line, r the distances from the ends.
    a = (wf[:, None] + s * ef[:, None]) / length[:, None]
    start = np.maximum(ww[:, None] + s * (2 * we[:, None] + s * ee[:, None]), 0.0)
    h = np.sqrt(np.maximum(start - a * a, 0.0))
    b = length[:, None] - a
    end = b * b + h * h
    value = 0.5 * (b * np.log(end + _TINY) + a * np.log(start + _TINY)) + h * np.arctan2(
        h * length[:, None], h * h - a * b
    )
    return cast(Float64, ef / length * ((steps * _WEIGHTS).reshape(s.shape) * value).sum(axis=1))
