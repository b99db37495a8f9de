"""Finer cells where the light needs them, and no finer where it is flat.

The receivers start coarse. A few samples and a first fit say how far linear elements of this size are from the light,
cell by cell: beside shadow edges, near lamps, in corners. The worst cells are split into four, and so on, until what is
left is within the asked error. Where light is flat the coarse triangles stay.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np

from .contours import Contours, Cut
from .direct.illumination import DirectLight
from .gather import Points
from .parallel import Workers
from .plan import BEND_PASSES, BEND_RAYS, BEND_ROUNDS, Effort
from .receivers import Receivers, split_cells
from .refinement import FittedSurvey, fit_samples, judge_samples
from .sampling import stream, subseed
from .scene import Bool, Float64, Scene
from .splitting import MORE, until_allowed
from .surroundings import GAP, Surroundings
from .survey import Survey
from .tessellation import Int64

#: Share of the asked error that may be left to the triangles.
_SHARE = 0.5
#: Squared error that is left of a cell once it is split: half where light steps, a sixteenth where it curves.
_KEPT = 0.25
#: Where there is no room for all, a cell is cut along a contour if the step there, squared, times its area, is this
#: share of the squared error of the worst cell that is not split: a cut makes half as many cells as a split and leaves
#: less error, and a contour in tatters is worse to see than coarse cells. A cut for all is worse again, and so is six.
_CUT = 0.25
#: What share of the squared error triangles that are split once more must take away: it takes samples and another fit.
_WORTH = 0.15
#: How many times as many cells as are allowed there are at most: what splits add is only foreseen, and contours of the
#: same worth, but for rounding, are cut together or not at all.
_ABOUT, _SAME = 1.1, 1.01
#: The smallest cell that is split, as a share of the area that each of the allowed number of equal cells would have.
_SMALLEST = 4.0**-3


@dataclass(frozen=True, eq=False)
class _Worst:
    """Which uncut cells (c,) to split; what share of all squared error they lose by that; whether what is left then is
    allowed, so that nobody need look again; and the largest squared error of those for which there is no room."""

    chosen: Bool
    gain: float
    enough: bool
    spared: float


class Bends:
    """Splits the triangles of receivers where light bends, up to about `limit` cells. rays: cast so far, by purpose."""

    def __init__(
        self,
        receivers: Receivers,
        limit: int,
        direct_light: DirectLight,
        around: Surroundings | None,
        contours: Contours,
        effort: Effort,
        seed: int,
        workers: Workers,
    ) -> None:
        self.rays: Counter[str] = Counter()
        self._limit = limit
        #: Before contours cut them, as they were cut last, and what a contour had to be worth then.
        self._uncut, self._last, self._least = receivers, Cut.none(receivers), 0.0
        self._light = direct_light
        self._around = around and around.with_rays(BEND_RAYS, stream(seed, "bend patterns"))
        self._effort = effort
        self._contours = contours
        self._seed = seed
        self._workers = workers

    def refine(self, scene: Scene) -> Receivers:
        """The receivers, cut along contours, and finer where light still bends by more than is allowed."""
        survey, least = None, 0.0
        for number in range(BEND_ROUNDS):
            trial = self._cut(least)
            survey = self._surveyed(trial, number, survey)
            found = fit_samples(survey, judge_samples(survey, scene, self._workers), self._workers)
            # The errors of small cells are known better: some room is left for those of later rounds.
            worst = self._worst(survey, found, 1.0 if number == BEND_ROUNDS - 1 else 0.5)
            least = _CUT * worst.spared
            if not worst.chosen.any() and least <= self._least:
                return trial
            self._uncut = split_cells(self._uncut, worst.chosen)[0]
            if worst.enough:
                break
        return self._cut(least)

    def finer(self, survey: Survey, found: FittedSurvey) -> tuple[Receivers, float] | None:
        """The same once more for a survey of what is there by now, and what was found in it, and what share of their
        error these triangles leave; None where splitting as many as there is room for would bring too little."""
        worst = self._worst(survey, found)
        if worst.gain < _WORTH:
            return None
        self._uncut = split_cells(self._uncut, worst.chosen)[0]
        return self._cut(_CUT * worst.spared), float(np.sqrt(1.0 - worst.gain))

    def _cut(self, least: float) -> Receivers:
        """The triangles there are by now, cut along contours; least: as there, or more where there is no room."""
        self._last = self._contours.cut(self._uncut, least)
        if len(self._last.source) > _ABOUT * self._limit:
            worth = self._last.worth
            by_worth = np.argsort(-worth, kind="stable")
            fitting = np.count_nonzero(len(worth) + np.cumsum(self._last.added[by_worth]) <= _ABOUT * self._limit)
            if fitting < len(worth):
                least = _SAME * float(worth[by_worth[fitting]])
                self._last = self._contours.cut(self._uncut, least)
        self._least = least
        return self._last.receivers

    def _surveyed(self, receivers: Receivers, number: int, earlier: Survey | None) -> Survey:
        """Samples of the receivers' cells, of those that an earlier survey had as well the same."""
        # Other samples than those of the bake: its noise must not depend on which cells theirs has split.
        seed = subseed(self._seed, f"bends {number}")
        survey = Survey(receivers, self._light, self._around, self._effort, seed, self._workers)
        if earlier is not None:
            survey.recall(earlier)
        for _ in range(BEND_PASSES):
            survey.run_pass()
        # Across soft shadows so few rays leave little but noise to choose by.
        survey.refine_boundaries(BEND_PASSES)
        self.rays += survey.rays
        return survey

    def _worst(self, survey: Survey, found: FittedSurvey, share: float = 1.0) -> _Worst:
        """The cells with the largest squared error, so many that what is left is allowed, while there is room, of which
        a share may be taken."""
        area = self._uncut.cells.area
        large = area > _SMALLEST * area.sum() / self._limit
        pieces = found.unresolved
        # Of what is over a gap nothing is known: it may be off by all of the mean light.
        gaps = self._over_gaps(survey)
        pieces[gaps] = np.maximum(pieces[gaps], survey.receivers.cells.area[gaps] * found.radiance**2)
        squared = np.bincount(self._last.source, pieces, len(large)).astype(np.float64)
        allowed = (_SHARE * self._effort.error * found.radiance) ** 2 * float(area.sum())
        chosen = np.zeros(len(large), dtype=bool)
        total = float(np.maximum(squared, 0.0).sum())
        # What is split adds to what is left; where it alone is more than is allowed, there will be another round.
        uncut = max((allowed - _KEPT * total) / (1.0 - _KEPT), allowed / 2.0)
        chosen[until_allowed(squared, uncut, self._room(squared, share))] = True
        left = np.maximum(squared[~chosen], 0.0)
        spared = float(left.max(initial=0.0)) if left.sum() > uncut else 0.0
        chosen &= large
        lost = (1.0 - _KEPT) * float(squared[chosen].sum())
        return _Worst(chosen, lost / total if total > 0.0 else 0.0, total - lost <= allowed, spared)

    def _room(self, squared: Float64, share: float) -> int:
        """For how many cells more there is room where those of the largest squared error (c,) are split, beside the
        cuts along contours that are then worth making. Splits may take a share of what cuts leave."""
        worst = -np.sort(-squared[squared > 0.0])
        # While ever smaller errors are split: a cell is cut, or it is split and some of its quarters are cut, where the
        # contour crosses more sides.
        worth, crossed = self._last.worth / _CUT, self._last.crossed
        pieces = np.maximum(self._last.added, crossed)
        begin = np.concatenate([np.maximum(worth, squared), squared, np.minimum(worth / 4.0, squared)])
        more = np.concatenate([pieces, -pieces, pieces + crossed])
        order = np.argsort(-begin, kind="stable")
        cuts = np.append(0, np.cumsum(more[order]))[np.searchsorted(-begin[order], -worst, side="right")]
        splits = MORE * np.arange(1, len(worst) + 1)
        fits = splits / share + cuts <= self._limit - len(self._uncut.cells)
        return MORE * int(np.count_nonzero(np.logical_and.accumulate(fits)))

    def _over_gaps(self, survey: Survey) -> Int64:
        """Cells of the survey that are too large for the gap that they bound: what samples there see counts for
        nothing, but finer cells will see it. Where the gap is too narrow for the finest as well, they stay as they are.
        """
        hidden = np.flatnonzero(survey.invalid)
        if self._around is None or not len(hidden):
            return hidden[:0]
        looks = self._around.hemispheres
        points = Points(survey.receivers.cells, hidden, np.full((len(hidden), 3), 1 / 3))
        where = points.positions, points.normals
        bounds, closed = (looks.covered(*where, reach * points.size) for reach in (GAP, GAP / 2**BEND_ROUNDS))
        self.rays["contact"] += 3 * len(hidden)
        return hidden[bounds & ~closed & ~looks.inside(*where)]
