"""The centroid formula, the baseline that everything else is measured against, never a default.

F = cos cos A / (pi d^2) between centroids is wrong on every closed mesh at every resolution: two triangles that share
an edge look the same at any scale, so tessellation never cures it, and rows may sum to more than one.
"""

from __future__ import annotations

from typing import cast

import numpy as np

from ..parallel import Workers
from ..patches import Patches
from ..scene import Float64
from ..sky import DARK, Sky
from ..visibility import Visibility
from .pairs import QUARTERS, Estimate, Faces, Index, rows_by_pairs


def centroid_rows(
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
        centroid_exchange,
        quarters_share,
        threshold=threshold,
        seed=seed,
        purpose=purpose,
        sky=sky,
    )


def centroid_exchange(faces: Faces, p: Index, q: Index) -> Float64:
    """A_p A_q cos cos / (pi d^2) (m,) between the centroids of pairs of faces."""
    way = faces.centroid[q] - faces.centroid[p]
    square = np.einsum("mk,mk->m", way, way)
    cosines = np.maximum(np.einsum("mk,mk->m", way, faces.normals[p]), 0.0)
    cosines *= np.maximum(-np.einsum("mk,mk->m", way, faces.normals[q]), 0.0)
    return cast(Float64, faces.area[p] * faces.area[q] * cosines / (np.pi * square * square))


def quarters_share(
    faces: Faces, visibility: Visibility, p: Index, q: Index, _rng: np.random.Generator
) -> tuple[Float64, int]:
    """Visible share (m,): how many of the four rays between the centroids of the triangles' quarters are free."""
    centers = QUARTERS.mean(axis=1)
    free = np.zeros(len(p))
    for center in centers:
        weights = np.broadcast_to(center, (len(p), 3))
        free += faces.connect(visibility, p, q, weights, weights)[1]
    return free / len(centers), len(centers) * len(p)
