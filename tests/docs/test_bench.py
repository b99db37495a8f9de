"""The benchmark of `make bench`, at its smallest."""

from __future__ import annotations

import json
from dataclasses import replace

import bpy
import numpy as np
import pytest

from radiosity_baker.addon.scene_reader import read_scene
from radiosity_baker.core.scene import AreaLamp, PointLamp, SpotLamp, SunLamp
from radiosity_baker.docs.bench import __main__ as bench
from radiosity_baker.docs.bench.measure import Run
from radiosity_baker.docs.bench.scenes import SCENES, build

LAMPS = {
    "cornell_box": [AreaLamp],
    "doorway": [AreaLamp],
    "courtyard": [SunLamp],
    "curved_meshes": [PointLamp, SpotLamp],
    "white_room": [AreaLamp],
    "hall": [PointLamp] * 40,
}


@pytest.mark.parametrize("name", SCENES)
def test_each_scene_has_its_burden(name):
    objects = build(name)
    scene, _ = read_scene(bpy.context.evaluated_depsgraph_get(), objects, tessellate=True)
    assert [type(lamp) for lamp in sorted(scene.lamps, key=lambda lamp: lamp.name)] == LAMPS[name]
    assert (max(scene.sky) > 0) == (name == "courtyard")
    assert all(o.receives for o in scene.objects)
    if name == "white_room":
        assert np.array([surface.albedo for surface in scene.surfaces]) == pytest.approx(0.95)


def test_a_scene_beside_cycles_into_table_and_json(tmp_path, monkeypatch):
    monkeypatch.setattr(bench, "FOLDER", tmp_path)
    document = tmp_path / "speed.md"
    document.write_text(f"# Speed\n\nOurs.\n\n{bench.BEGIN}old\n{bench.END}\nWords.\n", encoding="utf-8")
    assert bench.main(["courtyard", "--quick", "--parts", "scenes", "--output", str(document)]) == 0
    text = document.read_text(encoding="utf-8")
    assert text.startswith("# Speed\n\nOurs.\n\n")
    assert text.endswith(f"{bench.END}\nWords.\n")
    assert "old" not in text
    assert text.count("| Courtyard |") == 1 + 2 + 2 + 2  # ratios; our bakes; Cycles'
    scene = json.loads((tmp_path / "bench.json").read_text(encoding="utf-8"))["scenes"]["courtyard"]
    for run in [*scene["kept"], *scene["own"]]:
        assert 0 < run["embree"] < run["processor"]
        assert run["rays"]["gather"] > 0
    rough, fine = scene["cycles"]
    assert rough["noise"] == pytest.approx(2 * fine["noise"])  # four times the samples
    assert rough["surface"] > fine["surface"] > scene["own"][0]["surface"] > 0
    document.write_text(text.replace("| Courtyard |", "| changed |"), encoding="utf-8")
    assert bench.main(["--tables", "--output", str(document)]) == 0
    assert document.read_text(encoding="utf-8") == text


@pytest.fixture
def runs():
    run = Run("a", 10, seconds=1.0, processor=1.0, surface=0.03, typical=0.0, bias=0.0, noise=0.02)
    return [run, replace(run, seconds=4.0, surface=0.01, noise=0.005)]


def test_how_much_sooner_is_told_by_the_fastest_that_is_as_good(runs):
    rival = replace(runs[0], seconds=100.0)
    assert bench.sooner(runs, rival, "surface") == 100.0
    assert bench.sooner(runs, replace(rival, surface=0.02), "surface") == 25.0
    assert bench.sooner(runs, replace(rival, noise=0.004), "noise") != bench.sooner(runs, rival, "noise")
    assert np.isnan(bench.sooner(runs, replace(rival, noise=0.004), "noise"))


def test_growth_is_told_as_an_exponent(runs):
    grown = replace(runs[0], triangles=100, seconds=10.0)
    assert "the power of 1.00" in bench.report({"threads": 1, "scenes": {}, "original": [], "growth": [
        replace(runs[0], rays={"total": 1}), replace(grown, rays={"total": 1})]})  # fmt: skip


def test_an_error_that_the_reference_hides_is_no_measure_of_honesty(runs):
    known, hidden = (replace(run, stated=0.03, predicted=1.0, embree=1.0, rays={"total": 1}) for run in runs)
    beside = bench.Beside((0.0, 0.0), [known], [replace(hidden, surface=0.0)], runs)
    text = bench.report({"threads": 1, "scenes": {"courtyard": beside}, "original": [], "growth": []})
    assert "1 of 1 within 0.7 to 1.5" in text
