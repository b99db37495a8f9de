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
from .surroundings import Surroundings

#: Share of the asked error that patches may leave.
_SHARE = 0.5
#: How many times as many there may be at most, and are at least: they come in leaps of that.
_MOST, _LEAST = 8.0, 2.0
#: Points of the receivers that are drawn, those of them that tell, and the rays of each.
_DRAWN, _POINTS, _RAYS = 16_384, 4096, 16
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
    """Root mean square error of the radiance that patches leave on the receivers, relative to its mean; and the rays it
    took.

    Of points at random those are looked from that get much light straight, and fewer of the others, which count for
    more: what shines most may be small.
    """
    cells, rng = receivers.cells, stream(seed, "patch count")
    drawn = rng.choice(len(cells), _DRAWN, p=cells.area / cells.area.sum())
    points = Points(cells, drawn, rng.dirichlet((1.0, 1.0, 1.0), _DRAWN))
    direct = gather_direct(points, direct_light, 1, seed, _STREAM, workers)
    straight, rays = direct.irradiance.mean(axis=1), direct.rays
    # Direct light may be below zero where it is mostly noise.
    light = np.maximum(straight, 0.0) + max(float(straight.mean()), np.finfo(float).tiny)
    chosen = rng.choice(_DRAWN, _POINTS, p=light / light.sum())
    weight = float(light.mean()) / light[chosen]
    around, changes, arriving = surroundings.with_rays(_RAYS, rng), [], straight[chosen]
    for half, table in enumerate(around.tables):
        found, _, _, cast = gather_indirect(
            points.only(chosen), around.hemispheres, table, seed, _STREAM + half, workers
        )
        indirect, coarser = found[:, :-1], found[:, -1]
        changes.append(coarser - indirect[:, around.reflected].mean(axis=1))
        arriving = arriving + indirect @ around.to_grey / len(around.tables)
        rays = rays + cast
    colours = cell_colours(scene, receivers)
    albedo, emission = (values[drawn[chosen]].mean(axis=1) for values in (colours.albedo, colours.emission))
    mean = float(np.mean(weight * (emission + albedo * arriving / np.pi)))
    squared = float(np.mean(weight * (albedo / np.pi) ** 2 * changes[0] * changes[1])) / COARSENING**2
    return float(np.sqrt(max(squared, 0.0))) / mean if mean > 0.0 else 0.0, rays
