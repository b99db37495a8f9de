"""As many patches as a scene calls for: few where light comes from far, many in a shade around a bulb."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import pytest

from radiosity_baker.core import bake as pipeline
from radiosity_baker.core import cost
from radiosity_baker.core.accuracy import COARSENING
from radiosity_baker.core.bake import bake
from radiosity_baker.core.patch_count import patches_wanted
from radiosity_baker.core.plan import choose_effort
from radiosity_baker.core.scene import PointLamp, Scene, Surface
from radiosity_baker.core.settings import Settings
from radiosity_baker.core.shapes import box, quad

WHITE = Surface("white", (0.8, 0.8, 0.8))


def shaded_lamp() -> Scene:
    """A lamp in a shade of 20 cm that is open below, over a floor of 6 m: what is brightest is small and near."""
    shade = box("shade", (-0.1, -0.1, 1.0), (0.1, 0.1, 1.3), inward=True)
    shade = replace(shade, triangles=shade.triangles[2:], surface=shade.surface[2:])
    lamp = PointLamp("lamp", (0, 0, 1.15), (10.0, 10.0, 10.0), 0.0)
    return Scene((quad("floor", (-3, -3, 0), (6, 0, 0), (0, 6, 0)), shade), (WHITE,), (lamp,))


def counted(monkeypatch, scene: Scene, settings: Settings) -> tuple[list[int], int]:
    """What the bake of a scene wanted, and how many patches it had."""
    wanted = []

    def asked(*arguments):
        found = patches_wanted(*arguments)
        wanted.append(found[0])
        return found

    monkeypatch.setattr(pipeline, "patches_wanted", asked)
    return wanted, bake(scene, settings).report.patches


def test_a_shade_around_a_lamp_calls_for_more_patches_and_a_room_does_not(build, monkeypatch):
    settings = Settings(triangles=20_000, error=0.01)
    usual = choose_effort(shaded_lamp(), settings).patches
    (wanted,), patches = counted(monkeypatch, shaded_lamp(), settings)
    assert 1.5 * usual < wanted <= 20_000
    assert patches > 1.2 * usual
    assert counted(monkeypatch, build.furnished_room(), settings)[0] == [usual]


def test_they_bring_the_error_of_transport_down(monkeypatch):
    """By the power of 3/4 of their number, as far as its estimate is known."""
    settings = Settings(triangles=20_000, error=0.01, seed=3)
    finer = bake(shaded_lamp(), settings).report
    monkeypatch.setattr(pipeline, "patches_wanted", lambda *given: (given[4].patches, Counter()))
    usual = bake(shaded_lamp(), settings).report
    assert finer.rays["transport"] > 64 * 2 * (finer.patches + usual.patches)
    expected = (finer.patches / usual.patches) ** -0.75
    ratio = finer.estimated_error["transport"] / usual.estimated_error["transport"]
    assert ratio < expected * COARSENING


@pytest.mark.parametrize(
    "asked",
    [Settings(error=0.1), Settings(error=None, seconds=5.0), Settings(error=None), Settings(estimator="analytic")],
)
def test_nobody_looks_where_it_would_not_pay_or_there_is_no_time(asked):
    assert choose_effort(shaded_lamp(), asked).most_patches == 0


def test_there_are_no_more_than_fit_into_memory(monkeypatch):
    settings = Settings(triangles=20_000, error=0.01)
    monkeypatch.setattr("radiosity_baker.core.patch_count.patches_that_fit", lambda: 10.0)
    usual = choose_effort(shaded_lamp(), settings).patches
    assert counted(monkeypatch, shaded_lamp(), settings)[0] == [usual]
    monkeypatch.setattr(cost, "free_memory_mb", lambda: 300.0)
    assert cost.patches_that_fit() == pytest.approx(10_000.0)
    monkeypatch.setattr(cost, "free_memory_mb", lambda: None)
    assert cost.patches_that_fit() > 1e300
