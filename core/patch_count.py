"""How many patches a scene calls for.

Patches begin as many as most scenes need. What they leave of an error shows once they are solved, by how much the light
on the receivers changes if they are coarser: in folds and shades, where one patch lights the next from as near as it is
large, by far more than is asked for.
"""

from __future__ import annotations

from collections import Counter

import numpy as np

from .accuracy import COARSENING
from .cost import patches_that_fit
from .direct.illumination import DirectLight
from .gather import Points, gather_direct, gather_indirect
from .parallel import Workers
from .plan import Effort
from .receivers import Receivers, cell_colours
from .sampling import stream
from .scene import Scene
from .survey import Surroundings

#: Share of the asked error that patches may leave.
_SHARE = 0.5
#: How many times as many there may be at most, and are at least, for less is not worth solving anew.
_MOST, _LEAST = 8.0, 1.5
#: Points of the receivers that tell, and the rays of each.
_POINTS, _RAYS = 4096, 16
#: A number of streams that nothing else uses.
_STREAM = 5_000_000


def patches_wanted(
    scene: Scene,
    receivers: Receivers,
    direct_light: DirectLight,
    surroundings: Surroundings | None,
    effort: Effort,
    seed: int,
    workers: Workers,
) -> tuple[int, Counter[str]]:
    """How many patches leave no more than their share of the asked error, as far as so many may be and fit into memory;
    and the rays that it took to tell.

    The error falls with the length of patches to the power of 1.5 (see `accuracy.COARSENING`), so with their number to
    the power of 3/4.
    """
    if surroundings is None or effort.most_patches < _LEAST * effort.patches:
        return effort.patches, Counter()
    error, rays = transport_error(scene, receivers, direct_light, surroundings, seed, workers)
    called = effort.patches * min((error / (_SHARE * effort.error)) ** (4.0 / 3.0), _MOST)
    wanted = int(min(called, effort.most_patches, patches_that_fit()))
    return (wanted if wanted >= _LEAST * effort.patches else effort.patches), rays


def transport_error(
    scene: Scene,
    receivers: Receivers,
    direct_light: DirectLight,
    surroundings: Surroundings,
    seed: int,
    workers: Workers,
) -> tuple[float, Counter[str]]:
    """Root mean square error of the radiance that patches leave on the receivers, relative to its mean, from points at
    random; and the rays it took."""
    cells, rng = receivers.cells, stream(seed, "patch count")
    chosen = rng.choice(len(cells), _POINTS, p=cells.area / cells.area.sum())
    points = Points(cells, chosen, rng.dirichlet((1.0, 1.0, 1.0), _POINTS))
    direct = gather_direct(points, direct_light, 1, seed, _STREAM, workers)
    around, rays = surroundings.with_rays(_RAYS, rng), direct.rays
    changes, arriving = [], direct.irradiance.mean(axis=1)
    for half, table in enumerate(around.tables):
        found, _, _, cast = gather_indirect(points, around.hemispheres, table, seed, _STREAM + half, workers)
        rays = rays + cast
        light, coarser = found[:, :-1], found[:, -1]
        changes.append(coarser - light[:, around.reflected].mean(axis=1))
        arriving = arriving + light @ around.to_grey / len(around.tables)
    colours = cell_colours(scene, receivers)
    albedo, emission = (values[chosen].mean(axis=1) for values in (colours.albedo, colours.emission))
    mean = float(np.mean(emission + albedo * arriving / np.pi))
    squared = float(np.mean((albedo / np.pi) ** 2 * changes[0] * changes[1])) / COARSENING**2
    return float(np.sqrt(max(squared, 0.0))) / mean if mean > 0.0 else 0.0, rays
