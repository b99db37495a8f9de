"""The analytic estimator: exact unoccluded form factors, times a visible share found by rays.

Smooth and, where nothing stands between, exact to 1e-4 of each pair; quadratic in patches. Far pairs use Lambert's
formula at a few points of the smaller triangle, near and touching ones the contour integral.
"""

from __future__ import annotations

from typing import cast

import numpy as np

from ..parallel import Workers
from ..patches import Patches
from ..sampling import triangle_points
from ..scene import Float64
from ..sky import DARK, Sky
from ..visibility import Visibility
from .contour import exchange_area, in_front
from .pairs import QUARTERS, Estimate, Faces, Index, rows_by_pairs
from .polygon import polygon_irradiance

#: Quadrature rules on the triangle, barycentric points and weights: of degree 1, 2 and 5 (Radon 1948).
_ROOT = np.sqrt(15.0)
_NEAR, _FAR = (6.0 - _ROOT) / 21.0, (6.0 + _ROOT) / 21.0
_CENTER: Float64 = np.full((1, 3), 1 / 3)


def _about(a: float) -> Float64:
    """Three symmetric points: barycentric (1 - 2a, a, a) and its turns."""
    return cast(Float64, a + (1 - 3 * a) * np.eye(3))


_RULES: tuple[tuple[float, Float64, Float64], ...] = (
    # Largest radius of the smaller triangle / gap between the balls about both, points, weights. Root mean square
    # error of a pair at that limit, measured on random pairs: 1e-3, 2e-4, 1e-4; the errors' mean is 1e-5 or less.
    (0.03, _CENTER, np.ones(1)),
    (0.15, _about(1 / 6), np.full(3, 1 / 3)),
    (
        1.0,
        np.concatenate([_CENTER, _about(_NEAR), _about(_FAR)]),
        np.repeat([9 / 40, (155 - _ROOT) / 1200, (155 + _ROOT) / 1200], [1, 3, 3]),
    ),
)
#: Radii of the balls about both triangles / distance, up to which one and four rays are enough.
_ONE_RAY, _FOUR_RAYS = 0.2, 0.5
#: Between which parts of the two triangles rays run, from the farthest to the nearest pairs.
_WHOLE: Float64 = np.eye(3)[None]
_WAYS = (
    (_WHOLE, _WHOLE),
    (QUARTERS, QUARTERS),
    (np.repeat(QUARTERS, 4, axis=0), np.tile(QUARTERS, (4, 1, 1))),
)
_CHUNK = 4096


def analytic_rows(
    patches: Patches,
    visibility: Visibility,
    workers: Workers,
    *,
    threshold: float,
    seed: int,
    purpose: str,
    sky: Sky = DARK,
) -> Estimate:
    """Form factors between the sides of patches; pairs below `threshold` are left out and counted as culled."""
    return rows_by_pairs(
        patches,
        visibility,
        workers,
        unoccluded_exchange,
        sampled_share,
        threshold=threshold,
        seed=seed,
        purpose=purpose,
        sky=sky,
    )


def unoccluded_exchange(faces: Faces, p: Index, q: Index) -> Float64:
    """Exchange areas A_p F_pq (m,) of pairs of faces, as if nothing stood between them."""
    smaller = faces.radius[p] <= faces.radius[q]
    a, b = np.where(smaller, p, q), np.where(smaller, q, p)
    distance = np.linalg.norm(faces.centroid[a] - faces.centroid[b], axis=1)
    gap = distance - faces.radius[a] - faces.radius[b]
    rule = np.searchsorted([limit for limit, _, _ in _RULES], faces.radius[a] / np.maximum(gap, 1e-300))
    result = np.zeros(len(p))
    for number, (_, points, weights) in enumerate(_RULES):
        chosen = np.flatnonzero(rule == number)
        for start in range(0, len(chosen), _CHUNK):
            part = chosen[start : start + _CHUNK]
            places = points @ faces.corners[a[part]]
            shed = polygon_irradiance(places, faces.normals[a[part], None], faces.corners[b[part], None])
            result[part] = faces.area[a[part]] * (shed @ weights)
    near = np.flatnonzero(rule == len(_RULES))
    for start in range(0, len(near), _CHUNK):
        part = near[start : start + _CHUNK]
        result[part] = _near_exchange(faces, a[part], b[part])
    return np.minimum(result, np.minimum(faces.area[p], faces.area[q]))


def _near_exchange(faces: Faces, a: Index, b: Index) -> Float64:
    """Contour integrals; only the parts of the triangles that are in front of each other count."""
    result = np.empty(len(a))
    over_b = np.einsum("mck,mk->mc", faces.corners[a] - faces.centroid[b, None], faces.normals[b])
    over_a = np.einsum("mck,mk->mc", faces.corners[b] - faces.centroid[a, None], faces.normals[a])
    whole = (over_b.min(axis=1) >= -1e-9) & (over_a.min(axis=1) >= -1e-9)
    result[whole] = exchange_area(faces.corners[a[whole]], faces.corners[b[whole]])
    a, b = a[~whole], b[~whole]
    result[~whole] = exchange_area(
        in_front(faces.corners[a], faces.centroid[b], faces.normals[b]),
        in_front(faces.corners[b], faces.centroid[a], faces.normals[a]),
    )
    return result


def sampled_share(
    faces: Faces, visibility: Visibility, p: Index, q: Index, rng: np.random.Generator
) -> tuple[Float64, int]:
    """Visible share (m,) of pairs of faces and the rays it took.

    One ray between random points of faces far from each other; nearer one between each quarter of p and a quarter of q,
    nearest one between every two quarters. Rays count by their kernel cos cos / r^2. How many are cast depends on
    where the faces are, never on what the first rays met: refining where they disagree would miss small blockers and
    small gaps more often than it overrates others.
    """
    distance = np.linalg.norm(faces.centroid[p] - faces.centroid[q], axis=1)
    distance = np.maximum(distance, np.finfo(float).tiny)  # Faces that cross may have the same centre.
    nearness = np.searchsorted([_ONE_RAY, _FOUR_RAYS], (faces.radius[p] + faces.radius[q]) / distance)
    share = np.zeros(len(p))
    rays = 0
    for step, (parts_p, parts_q) in enumerate(_WAYS):
        chosen = np.flatnonzero(nearness == step)
        count = len(parts_p) * len(chosen)
        # A random turn of q's parts for each pair, so that no two quarters are always neighbours.
        turn = (np.arange(len(parts_q)) + rng.integers(4, size=(len(chosen), 1))) % len(parts_q)
        weights = [
            np.einsum("nc,nck->nk", triangle_points(rng.random((count, 2))), parts.reshape(count, 3, 3))
            for parts in (np.broadcast_to(parts_p, (len(chosen), *parts_p.shape)), parts_q[turn])
        ]
        i, j = (np.repeat(face[chosen], len(parts_p)) for face in (p, q))
        kernel, free = faces.connect(visibility, i, j, *weights)
        total = kernel.reshape(len(chosen), len(parts_p)).sum(axis=1)
        lit = (kernel * free).reshape(len(chosen), len(parts_p)).sum(axis=1)
        share[chosen] = np.divide(lit, total, out=np.zeros(len(chosen)), where=total > 0.0)
        rays += count
    return share, rays
