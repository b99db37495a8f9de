"""Samples of cells that stay as they are serve again once others have been split."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_baker.core.direct.illumination import DirectLight
from radiosity_baker.core.direct.lamps import place
from radiosity_baker.core.keys import same_cells
from radiosity_baker.core.patches import unit_space
from radiosity_baker.core.plan import choose_effort
from radiosity_baker.core.receivers import make_receivers, split_cells
from radiosity_baker.core.scene import AreaLamp, Scene
from radiosity_baker.core.settings import Settings
from radiosity_baker.core.survey import Survey
from radiosity_baker.core.visibility import Visibility


@pytest.fixture
def surveyed(build, workers):
    """Two passes over a square under a panel that a box hides in part; and a survey of what splitting makes of it."""
    panel = AreaLamp("panel", (0, 0, 2), (0.5, 0, 0), (0, 0.5, 0), (0, 0, -1), (5.0, 4.0, 3.0))
    box = build.box("box", (-0.2, -0.2, 0.3), (0.2, 0.2, 0.5), receives=False)
    scene, settings = Scene((build.quad(), box), (build.grey,), (panel,)), Settings()
    space = unit_space(scene)
    receivers = make_receivers(scene, space, settings, 200)
    corners = np.concatenate([space.normalise(o.vertices)[o.triangles] for o in scene.objects])
    light = DirectLight([place(panel, space)], Visibility(corners), 0)

    def survey(cells, seed, earlier=None):
        made = Survey(cells, light, None, choose_effort(scene, settings), seed, workers)
        if earlier is not None:
            made.recall(earlier)
        made.run_pass()
        made.run_pass()
        return made

    chosen = np.arange(len(receivers.cells)) % 7 == 0
    split, source = split_cells(receivers, chosen)
    first = survey(receivers, 1)
    return first, survey(split, 2, first), survey(split, 2), source


def test_cells_are_known_again_by_where_they_are(surveyed):
    first, second, _, source = surveyed
    here, there = same_cells(second.receivers.cells, first.receivers.cells)
    assert np.array_equal(source[here], there)
    alone = np.bincount(source)[source] == 1
    assert np.array_equal(here, np.flatnonzero(alone))
    assert 0 < len(here) < len(source)


def test_what_was_seen_is_recalled_and_only_the_rest_is_looked_at(surveyed):
    """A recalled cell has the earlier samples, a new one those that it would have had anyway up to its random numbers,
    and rays are cast for the new ones alone."""
    first, second, anew, source = surveyed
    here, there = same_cells(second.receivers.cells, first.receivers.cells)
    fresh = np.setdiff1d(np.arange(len(source)), here)
    for half, earlier, again in zip(second.direct, first.direct, anew.direct, strict=True):
        for name in ("moments", "light", "squares", "noise", "low", "high", "count", "tried"):
            assert np.array_equal(getattr(half, name)[here], getattr(earlier, name)[there])
        assert np.array_equal(half.tried, again.tried)
        assert half.light[fresh].sum() == pytest.approx(again.light[fresh].sum(), rel=0.1)
    assert second.rays["shadow"] < anew.rays["shadow"] * 1.2 * len(fresh) / len(source)


def test_nothing_is_left_to_look_at_where_all_is_recalled(surveyed, workers):
    first = surveyed[0]
    again = Survey(first.receivers, first._light, None, first._effort, 3, workers)
    again.recall(first)
    again.run_pass()
    assert not again.rays
    assert np.array_equal(again.direct[0].light, first.direct[0].light)


def test_after_the_recalled_passes_every_cell_is_looked_at_again(surveyed):
    """At new places: the sequence of points in a recalled cell goes on where the earlier survey's has stopped."""
    first, second, _, _ = surveyed
    here, there = same_cells(second.receivers.cells, first.receivers.cells)
    first.run_pass()
    second.run_pass()
    assert (second.valid_samples == 3).all()
    assert np.array_equal(second.direct[0].moments[here], first.direct[0].moments[there])
