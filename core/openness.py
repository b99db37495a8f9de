"""Which share of what surrounds a receiver is nothing: where the scene is open, and where it leaks."""

from __future__ import annotations

import numpy as np

from .gather import Points, gather_indirect
from .hemisphere import Hemispheres
from .parallel import Workers
from .patches import Patches
from .receivers import Receivers
from .sampling import stream
from .scene import Float64
from .visibility import Visibility


def escaped_share(
    receivers: Receivers, patches: Patches, visibility: Visibility, rays: int, seed: int, workers: Workers
) -> tuple[Float64, int]:
    """Form factor (v,) of the fit vertices to the void, 0 to 1: the mean of the cells around each, by area; and how
    many rays it took, `rays` from a point in each cell. Raises Cancelled."""
    cells = receivers.cells
    hemispheres = Hemispheres(patches, visibility, rays, stream(seed, "escaped patterns"))
    brings = np.zeros((hemispheres.code_count, 1), dtype=np.float32)
    brings[hemispheres.codes.escaped :] = 1.0
    points = Points.of_pass(cells, np.arange(len(cells)), 0, stream(seed, "escaped").random((len(cells), 2)))
    share, _, _, cast = gather_indirect(points, hemispheres, brings, seed, 0, workers)
    return receivers.vertex_means(share[:, 0]), cast.total()
