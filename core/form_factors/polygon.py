"""Lambert's formula: light from a uniform, planar, convex polygon at a point, exact and without occlusion.

J. H. Lambert, Photometria (1760); in this notation P. S. Heckbert and J. Winget, Finite element methods for global
illumination (1991). The irradiance is a sum over the polygon's edges of the angle each subtends times the sine of the
height of its plane: no singularity, no sampling. What lies below the receiver's horizon is cut off edge by edge, and
the cut itself is an edge in the horizon plane, whose term is simply its angle.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from ..scene import Float64

#: Sine of the height over the horizon under which a vertex counts as on it. It makes coplanar neighbours see exactly
#: nothing of each other, whatever the rounding of their float32 vertices; the form factor moves by no more than this.
_ON_HORIZON = 1e-7
_TINY = 1e-300
#: Results per pass: intermediate arrays then stay in the processor's cache.
_CHUNK = 16384

Components = tuple[Float64, Float64, Float64]


def polygon_irradiance(
    points: ArrayLike, normals: ArrayLike, polygon: ArrayLike, *, two_sided: bool = False
) -> Float64:
    """Form factor from surface elements to convex polygons: irradiance / (pi * radiance), 0 to 1.

    points, normals (..., 3): where, and the unit normal light is weighed by (a shading normal may differ from the
    geometry's). polygon (..., v, 3): vertices counter-clockwise seen from the emitting side, v >= 3, broadcast against
    the points' leading axes: (n, 3) with (v, 3) or (n, v, 3), or (n, 1, 3) with (m, v, 3) for a table (n, m).
    A point behind the emitting side receives 0, unless two_sided. Computed and returned in float64: the terms of a
    polygon of angular size s cancel to order s^2, which float32 does not survive.
    """
    x, n, corners = (np.asarray(a, dtype=np.float64) for a in (points, normals, polygon))
    shape = np.broadcast_shapes(x.shape[:-1], n.shape[:-1], corners.shape[:-2])
    if not shape:
        return np.asarray(polygon_irradiance(x, n, corners[None], two_sided=two_sided)[0])
    result = np.empty(shape)
    rows = max(1, _CHUNK // max(1, math.prod(shape[1:])))
    for start in range(0, len(result), rows):
        part = slice(start, start + rows)
        result[part] = _lambert(
            _rows(x, 1, shape, part), _rows(n, 1, shape, part), _rows(corners, 2, shape, part), two_sided
        )
    return result


def _dot(a: Float64, b: Float64) -> Float64:
    return np.asarray(np.einsum("...i,...i->...", a, b))


def _rows(array: Float64, own: int, shape: tuple[int, ...], part: slice) -> Float64:
    """The rows of an array that broadcasts over its first result axis, without copying it out to full shape."""
    leading = array.ndim - own
    return array[part] if leading == len(shape) and array.shape[0] == shape[0] else array


def _components(a: Float64) -> Components:
    return a[..., 0], a[..., 1], a[..., 2]


def _lambert(x: Float64, n: Float64, corners: Float64, two_sided: bool) -> Float64:
    """polygon_irradiance for one chunk. Points are relative to x; a is an edge's start, e its vector, z heights."""
    count = corners.shape[-2]
    vertices = [corners[..., i, :] for i in range(count)]
    (nx, ny, nz), (xx, xy, xz) = _components(n), _components(x)
    starts: list[Components] = [(v[..., 0] - xx, v[..., 1] - xy, v[..., 2] - xz) for v in vertices]
    squares = [ax * ax + ay * ay + az * az for ax, ay, az in starts]
    heights = []
    for (ax, ay, az), square in zip(starts, squares, strict=True):
        z = ax * nx + ay * ny + az * nz
        z[z * z <= _ON_HORIZON**2 * square] = 0.0
        heights.append(z)

    total = np.zeros_like(squares[0])
    leaving: Components = tuple(np.zeros((3, *total.shape)))
    entering: Components = tuple(np.zeros((3, *total.shape)))
    clipped = False
    for i in range(count):
        j = (i + 1) % count
        (ax, ay, az), za, zb = starts[i], heights[i], heights[j]
        # The edge comes from the corners themselves: exact where their difference from x is not.
        ex, ey, ez = _components(vertices[j] - vertices[i])
        cx, cy, cz = ay * ez - az * ey, az * ex - ax * ez, ax * ey - ay * ex
        sine = np.sqrt(cx * cx + cy * cy + cz * cz)
        sine += _TINY
        sloping = (cx * nx + cy * ny + cz * nz) / sine
        along = ax * ex + ay * ey + az * ez
        above, next_above = za > 0.0, zb > 0.0
        crossing = above != next_above
        if not crossing.any():
            total += np.arctan2(sine, squares[i] + along) * sloping * above
            continue
        clipped = True
        cut = za / np.where(crossing, za - zb, 1.0)
        first = np.where(crossing & next_above, cut, 0.0)
        last = np.where(crossing & above, cut, 1.0)
        # The ends are a + first e and a + last e; their cross product is (last - first) cross(a, e).
        cosine = squares[i] + (first + last) * along + first * last * (ex * ex + ey * ey + ez * ez)
        total += np.arctan2((last - first) * sine, cosine) * sloping * (above | next_above)
        for horizon, crosses in ((leaving, crossing & above), (entering, crossing & next_above)):
            for h, a, e in zip(horizon, (ax, ay, az), (ex, ey, ez), strict=True):
                np.copyto(h, a + cut * e, where=crosses)
    if clipped:
        (px, py, pz), (qx, qy, qz) = leaving, entering
        turn = (py * qz - pz * qy) * nx + (pz * qx - px * qz) * ny + (px * qy - py * qx) * nz
        total += np.arctan2(turn, px * qx + py * qy + pz * qz)
    total *= -0.5 / np.pi
    return np.asarray(np.clip(np.abs(total) if two_sided else total, 0.0, 1.0))
