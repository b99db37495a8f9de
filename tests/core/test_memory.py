"""A bake that goes on from the last one gives what one from the start would give, and casts only the rays it needs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from radiosity_baker.core import layers
from radiosity_baker.core import memory as memory_module
from radiosity_baker.core.accuracy import ErrorEstimate
from radiosity_baker.core.bake import bake
from radiosity_baker.core.memory import Memory, lamp_changes, same
from radiosity_baker.core.scene import AreaLamp, PointLamp, Scene
from radiosity_baker.core.settings import Settings

BULB = PointLamp("bulb", (0.5, 0.2, 1.5), (3.0, 3.0, 3.0), radius=0.05)
PANEL = AreaLamp("panel", (0, 0, 1.9), (0.3, 0, 0), (0, 0.3, 0), (0, 0, -1), (5.0, 5.0, 5.0))
SETTINGS = Settings(triangles=800, error=0.1)


@pytest.fixture(scope="module")
def room(build) -> Scene:
    return replace(build.furnished_room(), lamps=(BULB, PANEL))


def combined(result) -> np.ndarray:
    return np.concatenate([o.layers["combined"].reshape(-1, 3) for o in result.objects])


def weights(result) -> np.ndarray:
    corners = np.concatenate([o.vertices[o.triangles] for o in result.objects])
    return np.repeat(np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1), 3)


def with_bulb(room: Scene, *intensity: float) -> Scene:
    return replace(room, lamps=(replace(BULB, intensity=intensity), PANEL))


@pytest.mark.parametrize("intensity", [(1.0, 3.0, 6.0), (0.0, 0.0, 0.0)])
def test_a_lamp_that_has_changed_lights_as_if_baked_anew(room, intensity):
    """The triangles of the two may differ, so that means over the objects are compared: by what both bakes state."""
    memory = Memory()
    bake(room, SETTINGS, memory=memory)
    relit = bake(with_bulb(room, *intensity), SETTINGS, memory=memory)
    anew = bake(with_bulb(room, *intensity), SETTINGS)
    stated = np.hypot(relit.report.estimated_error["total"], anew.report.estimated_error["total"])
    mean = np.average(combined(anew), axis=0, weights=weights(anew)).mean()
    for one, other in zip(relit.objects, anew.objects, strict=True):
        of_one, of_other = (
            np.average(combined(replace(r, objects=(o,))), axis=0, weights=weights(replace(r, objects=(o,))))
            for r, o in ((relit, one), (anew, other))
        )
        assert of_one == pytest.approx(of_other, abs=3 * stated * mean)


@pytest.mark.parametrize("factor", [0.0, 2.0])
def test_the_ledger_is_that_of_the_lamps_there_are(room, factor):
    """All lamps dimmed alike, and so is what they give and where it goes. Seen to fail: the ledger of the last bake."""
    memory = Memory()
    first = bake(room, SETTINGS, memory=memory).report.energy
    dimmed = tuple(
        replace(lamp, **{name: tuple(factor * channel for channel in getattr(lamp, name))})
        for lamp, name in zip(room.lamps, ("intensity", "radiance"), strict=True)
    )
    relit = bake(replace(room, lamps=dimmed), SETTINGS, memory=memory).report.energy
    off = 0.02 * first["emitted"]  # each lamp alone draws other rays than all together
    for account in ("emitted", "absorbed", "escaped"):
        assert relit[account] == pytest.approx(factor * first[account], abs=off)
    assert relit["residual"] == pytest.approx(0.0, abs=2e-3 * first["emitted"])


def test_the_second_change_of_a_lamp_casts_no_ray(room):
    memory = Memory()
    first = bake(room, SETTINGS, memory=memory)
    dimmed = bake(with_bulb(room, 1.0, 1.0, 1.0), SETTINGS, memory=memory)
    assert 0 < dimmed.report.rays["total"] < first.report.rays["total"]
    assert "transport" not in dimmed.report.rays
    again = bake(with_bulb(room, 2.0, 1.0, 0.5), SETTINGS, memory=memory)
    assert again.report.rays == {"total": 0}


def test_a_lamp_put_back_shows_what_it_showed(room):
    memory = Memory()
    first = bake(room, SETTINGS, memory=memory)
    bake(with_bulb(room, 1.0, 2.0, 1.0), SETTINGS, memory=memory)
    assert (combined(bake(room, SETTINGS, memory=memory)) == combined(first)).all()


def test_what_a_lamp_brings_is_in_proportion_to_it(room, monkeypatch):
    """Where nothing is cut off at zero, the light is linear in the lamp's change, to single precision: at the vertices,
    for which of them make a triangle, the light says."""
    monkeypatch.setattr(layers, "turn_diagonals", lambda *_: None)
    memory = Memory()
    one = combined(bake(room, SETTINGS, memory=memory)).astype(np.float64)
    two, three = (combined(bake(with_bulb(room, k, k, k), SETTINGS, memory=memory)) for k in (6.0, 9.0))
    assert three - one == pytest.approx(2 * (two - one), abs=1e-5 * one.max())


def test_a_smaller_error_goes_on_where_the_bake_stood(room, monkeypatch):
    monkeypatch.setattr(memory_module, "_sampling_would_help", lambda _: True)
    memory = Memory()
    first = bake(room, SETTINGS, memory=memory)
    better = bake(room, replace(SETTINGS, error=0.03), memory=memory)
    assert better.report.estimated_error["sampling"] < first.report.estimated_error["sampling"]
    assert "transport" not in better.report.rays
    assert [len(o.triangles) for o in better.objects] == [len(o.triangles) for o in first.objects]


@pytest.mark.parametrize(("sampling", "resolution", "helps"), [(0.02, 0.01, True), (0.02, 0.03, False)])
def test_more_samples_help_where_they_are_most_of_the_error(sampling, resolution, helps):
    assert memory_module._sampling_would_help(ErrorEstimate(sampling, 0.001, resolution)) is helps


@pytest.mark.parametrize(
    "change",
    [
        lambda room: replace(room, lamps=(replace(BULB, position=(0.4, 0.2, 1.5)), PANEL)),
        lambda room: replace(room, lamps=(BULB,)),
        lambda room: replace(room, sky=(0.1, 0.1, 0.1)),
        lambda room: replace(room, surfaces=tuple(replace(s, albedo=(0.1, 0.1, 0.1)) for s in room.surfaces)),
        lambda room: replace(room, objects=tuple(replace(o, vertices=o.vertices * 1.01) for o in room.objects)),
        lambda room: with_bulb(room, 30.0, 3.0, 3.0),
    ],
)
def test_any_other_change_is_baked_from_the_start(room, change):
    memory = Memory()
    bake(room, SETTINGS, memory=memory)
    changed = bake(change(room), SETTINGS, memory=memory)
    assert changed.report.rays["transport"] > 0
    assert (combined(changed) == combined(bake(change(room), SETTINGS))).all()


def test_changes_of_lamps_are_told_by_name(room):
    changes = lamp_changes(room, with_bulb(room, 1.0, 3.0, 6.0))
    assert {name: change.tolist() for name, change in changes.items()} == {"bulb": [-2.0, 0.0, 3.0]}
    assert lamp_changes(room, room) == {}


def test_equality_looks_into_arrays(build):
    assert same((1, np.ones(3)), (1, np.ones(3)))
    assert not same((1, np.ones(3)), (1, np.array([1.0, 1.0, 2.0])))
    assert not same(build.box(), replace(build.box(), name="other"))
    assert same(build.box(), build.box())
