"""As many patches as a scene calls for: few where light comes from far, more where they leave too much of an error."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import pytest

from radiosity_baker.core import cost, patch_count
from radiosity_baker.core.bake import bake
from radiosity_baker.core.gather import gather_direct
from radiosity_baker.core.patch_count import patches_wanted, transport_error
from radiosity_baker.core.plan import choose_effort
from radiosity_baker.core.settings import Settings

ASKED = Settings(triangles=40_000, error=0.02)


@pytest.fixture
def left(monkeypatch):
    """Say what error patches leave, instead of looking."""
    return lambda error: monkeypatch.setattr(patch_count, "transport_error", lambda *_: (error, Counter(gather=7)))


def wanted(scene, settings=ASKED) -> int:
    return patches_wanted(scene, None, None, "something", choose_effort(scene, settings), 0, None)[0]


def test_they_bring_the_error_under_half_of_what_is_asked(build, left):
    scene = build.furnished_room()
    usual = choose_effort(scene, ASKED).patches
    for error, times in ((0.0, 1.0), (0.01, 1.0), (0.016, 1.0), (0.02, 2.0 ** (4 / 3))):
        left(error)
        assert wanted(scene) == int(times * usual)
    left(0.5)
    assert wanted(scene) == 40_000, "there are no more than triangles"
    assert wanted(scene, replace(ASKED, triangles=10**6)) == 8 * usual


def test_there_are_no_more_than_fit_into_memory(build, left, monkeypatch):
    left(0.5)
    monkeypatch.setattr(cost, "free_memory_mb", lambda: 720.0)
    assert wanted(build.furnished_room()) == 24_000
    monkeypatch.setattr(cost, "free_memory_mb", lambda: 30.0)
    assert wanted(build.furnished_room()) == choose_effort(build.furnished_room(), ASKED).patches
    monkeypatch.setattr(cost, "free_memory_mb", lambda: None)
    assert wanted(build.furnished_room()) == 40_000


def test_a_bake_takes_as_many_and_counts_all_rays(build, left):
    scene = build.furnished_room()
    few = replace(choose_effort(scene, ASKED), patches=1000, most_patches=2200)
    left(0.0)
    usual = bake(scene, ASKED, effort=few).report
    left(0.05)
    finer = bake(scene, ASKED, effort=few).report
    assert finer.patches > 1.6 * usual.patches
    assert finer.rays["transport"] > usual.rays["transport"] * (1.0 + 0.9 * finer.patches / usual.patches)
    assert finer.estimated_error["transport"] < usual.estimated_error["transport"]


def test_what_they_leave_falls_with_their_number(build, monkeypatch):
    """By less than the power of 3/4, for where direct light varies the few are split more often."""
    found = []

    def looked(*given):
        found.append(transport_error(*given))
        return found[-1]

    monkeypatch.setattr(patch_count, "transport_error", looked)
    scene = build.furnished_room()
    for patches in (250, 2000):
        few = replace(choose_effort(scene, ASKED), patches=patches, most_patches=2 * patches)
        bake(scene, ASKED, effort=few)
    (coarse, rays), (fine, _) = found
    assert 1.3 < coarse / fine < 8.0
    assert set(rays) >= {"gather", "shadow"}


def test_light_below_zero_is_noise(build, monkeypatch):
    """Seen to fail: a soft shadow's points had negative chances to be looked from."""
    monkeypatch.setattr(patch_count, "gather_direct", lambda *given: noisy(gather_direct(*given)))
    found = []
    monkeypatch.setattr(
        patch_count, "transport_error", lambda *given: found.append(transport_error(*given)) or found[-1]
    )
    bake(build.furnished_room(), ASKED)
    assert found[0][0] > 0.0


def noisy(light):
    irradiance = light.irradiance.copy()
    irradiance[:10] -= 2.0 * irradiance.mean()
    return replace(light, irradiance=irradiance)


@pytest.mark.parametrize(
    "asked",
    [Settings(error=0.1), Settings(error=None, seconds=5.0), Settings(error=None), Settings(estimator="analytic")],
)
def test_nobody_looks_where_it_would_not_pay_or_there_is_no_time(build, left, asked):
    left(0.5)
    usual = choose_effort(build.furnished_room(), asked)
    assert usual.most_patches == 0
    assert wanted(build.furnished_room(), asked) == usual.patches
    assert patches_wanted(None, None, None, None, replace(usual, most_patches=10**6), 0, None)[0] == usual.patches
