"""Samples of cells that stay as they are serve again once others have been split, and some cells get more."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from radiosity_baker.core import survey as core_survey
from radiosity_baker.core.direct.illumination import DirectLight
from radiosity_baker.core.direct.lamps import place
from radiosity_baker.core.keys import same_cells
from radiosity_baker.core.patches import unit_space
from radiosity_baker.core.pilot import Pilot
from radiosity_baker.core.plan import choose, choose_effort
from radiosity_baker.core.receivers import make_receivers, split_cells
from radiosity_baker.core.scene import AreaLamp, Scene
from radiosity_baker.core.settings import Settings
from radiosity_baker.core.sky import Sky
from radiosity_baker.core.surroundings import look_up
from radiosity_baker.core.survey import Survey
from radiosity_baker.core.transport import solve_halves
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


def test_shadow_boundaries_are_looked_at_once(surveyed):
    """Recalled cells had their turn in the earlier survey, or else have it now."""
    first, later, _, _ = surveyed
    here, _ = same_cells(later.receivers.cells, first.receivers.cells)
    later.refine_boundaries(4)
    assert later.valid_samples[here].max() == 6
    seen = first.valid_samples.sum()
    first.refine_boundaries(4)
    assert first.valid_samples.sum() > seen
    chosen = np.arange(len(first.receivers.cells)) % 7 == 0
    split, _ = split_cells(first.receivers, chosen)
    second = Survey(split, first._light, None, first._effort, 2, first.workers)
    second.recall(first)
    second.run_pass()
    second.run_pass()
    here, there = same_cells(split.cells, first.receivers.cells)
    fresh = np.setdiff1d(np.arange(len(split.cells)), here)
    again = here[first.valid_samples[there] == 6]
    second.refine_boundaries(4)
    assert len(again) > 0
    assert (second.valid_samples[again] == 6).all()
    assert second.valid_samples[fresh].max() == 6
    # From then on all are alike.
    second.refine_boundaries(2)
    assert second.valid_samples[again].max() == 8


@pytest.fixture
def looked_around(build, workers):
    """Two passes in a furnished room, direct light and what its patches reflect."""
    scene, settings = build.furnished_room(), Settings()
    space, effort = unit_space(scene), replace(choose_effort(scene, settings), patches=300)
    patches = build.patches(scene, 300)
    visibility = Visibility(patches.corners, patches.optics)
    light, sky = DirectLight([place(lamp, space) for lamp in scene.lamps], visibility, 0), Sky.of((0.0, 0.0, 0.0))
    halves = solve_halves(patches, visibility, light, sky, choose(scene, settings, Pilot(scene), effort), workers, 0)
    around = look_up(patches, visibility, halves, sky, effort, 0)
    made = Survey(make_receivers(scene, space, settings, 400), light, around, effort, 1, workers)
    made.run_pass()
    made.run_pass()
    return made


def test_some_cells_are_looked_at_longer(looked_around, monkeypatch):
    """Those have as many samples of indirect light as they should, in two halves that are alike, and the others what
    they had; a mean of sixteen times as many is four times as near."""
    survey = looked_around
    cells = len(survey.receivers.cells)
    chosen = np.arange(cells) % 2 == 0
    before = [half.mean_grey for half in survey.indirect]
    rays, numbers = survey.rays["gather"], []
    gather = core_survey.gather_indirect
    monkeypatch.setattr(core_survey, "gather_indirect", lambda *looks: numbers.append(looks[4]) or gather(*looks))
    survey.top_up(np.where(chosen, 32, 2))
    longer = chosen & ~survey.invalid
    for half in survey.indirect:
        assert np.array_equal(half.tried, np.where(longer, 16, 1))
    # Of chance alone the mean of 32 points would be off by 0.04: the variance of a barycentric weight is 1 / 18.
    seen = survey.indirect[0] + survey.indirect[1]
    full = longer & (seen.count == 32)
    assert np.std(seen.lumped[full] / 32.0) < 0.03
    # A few more tell whether what is dark is in sight.
    assert survey.rays["gather"] - rays == pytest.approx(30 * longer.sum() * survey._effort.gather_rays, rel=0.02)
    after = [half.mean_grey for half in survey.indirect]
    assert np.array_equal(after[0][~longer], before[0][~longer])
    apart = [np.std((one - other)[longer]) for one, other in (before, after)]
    assert 2.5 < apart[0] / apart[1] < 6.0
    assert len(numbers) == len(set(numbers)) >= 2, "so that the halves have random numbers of their own"
    survey.top_up(np.where(chosen, 32, 2))
    assert np.array_equal(after[0], survey.indirect[0].mean_grey)
