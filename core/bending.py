"""Finer cells where the light needs them, and no finer where it is flat.

The receivers start coarse. A few samples and a first fit say how far linear elements of this size are from the light,
cell by cell: beside shadow edges, near lamps, in corners. The worst cells are split into four, and so on, until what is
left is within the asked error. Where light is flat the coarse triangles stay.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np

from .direct.illumination import DirectLight
from .parallel import Workers
from .plan import Effort
from .receivers import Receivers, split_cells
from .refinement import fit_samples
from .sampling import stream, subseed
from .scene import Bool, Scene
from .survey import Surroundings, Survey

#: How often cells are split at most; passes over them before each time, and rays of each point that look around.
_ROUNDS, _PASSES, _RAYS = 4, 4, 16
#: Share of the asked error that may be left to the triangles.
_SHARE = 0.7
#: The smallest cell that is split, as a share of the area that each of the allowed number of equal cells would have.
_SMALLEST = 4.0**-3


class Bends:
    """Splits triangles where light bends. rays: cast so far, by purpose."""

    def __init__(
        self, direct_light: DirectLight, around: Surroundings | None, effort: Effort, seed: int, workers: Workers
    ) -> None:
        self.rays: Counter[str] = Counter()
        self._light = direct_light
        self._around = around and replace(
            around, hemispheres=around.hemispheres.with_rays(_RAYS, stream(seed, "bend patterns"))
        )
        self._effort = effort
        self._seed = seed
        self._workers = workers

    def refine(self, scene: Scene, receivers: Receivers, limit: int) -> Receivers:
        """The receivers with at most about `limit` cells, finer where light bends by more than is allowed."""
        for number in range(_ROUNDS):
            # Other samples than those of the bake: its noise must not depend on which cells theirs has split.
            seed = subseed(self._seed, f"bends {number}")
            survey = Survey(receivers, self._light, self._around, self._effort, seed, self._workers)
            for _ in range(_PASSES):
                survey.run_pass()
            self.rays += survey.rays
            chosen = self._worst(scene, survey, limit)
            if not chosen.any():
                break
            receivers = split_cells(receivers, chosen)[0]
        return receivers

    def _worst(self, scene: Scene, survey: Survey, limit: int) -> Bool:
        """The cells (c,) of the largest squared error, so many that what is left is allowed, while there is room."""
        cells = survey.receivers.cells
        found = fit_samples(survey, scene, self._workers)
        squared = found.area * found.shown * np.sum([fitted.resolution for fitted in found.fits], axis=0)
        allowed = (_SHARE * self._effort.error * found.radiance) ** 2 * float(cells.area.sum())
        # A split cell becomes four, and makes its neighbours become two or three.
        room = max((limit - len(cells)) // 5, 0)
        large = cells.area > _SMALLEST * cells.area.sum() / limit
        order = np.argsort(np.where(large, -squared, 0.0), kind="stable")
        positive = np.maximum(squared[order], 0.0)
        left = positive.sum() - np.cumsum(positive)
        wanted = int(np.count_nonzero(left > allowed)) + 1 if squared.sum() > allowed else 0
        chosen = np.zeros(len(cells), dtype=bool)
        chosen[order[: min(wanted, room)]] = True
        return np.asarray(chosen & large & (squared > 0.0))
