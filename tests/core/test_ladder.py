"""The ladder's rungs, and the frontier and the knee among its steps."""

from __future__ import annotations

import pytest

from radiosity_baker.core import bake as pipeline
from radiosity_baker.core.ladder import KNOBS, MOST_BY_PAIRS, QUICK, Scale, Step, frontier, knee, rungs
from radiosity_baker.core.plan import choose_effort
from radiosity_baker.core.scene import Scene
from radiosity_baker.core.settings import Settings


def step(seconds, error, **more) -> Step:
    figures = dict.fromkeys(Step.__dataclass_fields__, 0.0)
    return Step(**{**figures, "seconds": seconds, "surface_error": error, "estimated_error": None, **more})


def test_the_frontier_holds_what_nothing_else_beats():
    good = [step(1.0, 0.3), step(2.0, 0.2), step(8.0, 0.1)]
    beaten = [step(1.0, 0.4), step(3.0, 0.2), step(9.0, 0.15)]
    # An error below what the reference can resolve is not the smallest.
    unknown = [step(0.5, 0.0), step(9.0, 0.05, uncertainty=0.03)]
    assert frontier([*beaten, *unknown, *good[::-1]]) == good


def test_the_frontier_is_that_of_the_asked_error_and_clock():
    one = step(1.0, 0.3, typical_error=0.1, processor_seconds=4.0)
    two = step(2.0, 0.2, typical_error=0.2, processor_seconds=3.0)
    assert frontier([one, two]) == [one, two]
    assert frontier([one, two], "typical_error") == [one]
    assert frontier([one, two], clock="processor_seconds") == [two]


def test_the_knee_is_where_the_error_stops_falling():
    # Half the error for twice the time down to 8 s, then hardly any gain.
    steep = [step(t, 0.4 / t) for t in (1.0, 2.0, 4.0, 8.0)]
    flat = [step(t, 0.05 * (8.0 / t) ** 0.1) for t in (16.0, 32.0, 64.0)]
    assert knee([*steep, *flat]) is steep[-1]


@pytest.mark.parametrize("power", [0.5, 1.0])
def test_an_even_trade_has_no_knee(power):
    assert knee([step(t, t**-power) for t in (1.0, 2.0, 4.0, 8.0)]) is None
    assert knee([step(1.0, 0.5), step(2.0, 0.1)]) is None


def test_honesty_is_stated_over_true():
    assert step(1.0, 0.2, estimated_error=0.1).honesty == pytest.approx(0.5)
    assert step(1.0, 0.2).honesty is None
    assert step(1.0, 0.0, estimated_error=0.1).honesty is None
    assert step(1.0, 0.2, estimated_error=0.1, uncertainty=0.11).honesty is None


@pytest.mark.parametrize("scale", [Scale(1000), QUICK])
def test_every_rung_can_be_climbed(build, scale):
    scene = build.furnished_room()
    ladder = rungs(scene, scale, Settings(threads=1, seed=5))
    assert len({(rung.series, rung.label) for rung in ladder}) == len(ladder)
    for rung in ladder:
        assert (rung.settings.threads, rung.settings.seed, rung.settings.seconds) == (1, 5, None)
        effort = rung.effort(scene)
        # The settings alone decide where an error is asked; elsewhere passes stay as they are set.
        assert (effort is None) == (rung.settings.error is not None)
        for name, value in rung.changes.items():
            assert getattr(effort, name) == value


def test_pairs_are_not_taken_where_there_are_too_many(build):
    few, many = (Scene((build.sphere(level=level),), (build.grey,)) for level in (4, 5))
    assert len(few.objects[0].triangles) < MOST_BY_PAIRS < len(many.objects[0].triangles)
    series = [{rung.series for rung in rungs(scene, Scale(1000), Settings())} for scene in (few, many)]
    assert series[0] - series[1] == {"analytic", "centroid"}
    assert "hemisphere" in series[1]


def test_knobs_are_turned_away_from_the_usual_to_both_sides(build):
    usual = choose_effort(build.furnished_room(), Settings(error=None))
    for name, values in KNOBS.items():
        assert min(values) < getattr(usual, name) < max(values)


def test_a_forced_effort_is_the_effort_of_the_bake(build):
    scene = build.furnished_room()
    rung = rungs(scene, Scale(100, passes=(2, 4)), Settings(threads=1))[0]
    few = pipeline.bake(scene, rung.settings, effort=build.effort(patches=60, passes=2)).report
    more = pipeline.bake(scene, rung.settings, effort=build.effort(patches=240, passes=4)).report
    assert few.patches < more.patches / 2
    assert few.rays["gather"] < more.rays["gather"]
