"""A few of the scenes that `make effects` compares with Cycles, coarsely; and that the catalogue is in order."""

from __future__ import annotations

import bpy
import pytest

from radiosity_baker.core.effects import EFFECTS
from radiosity_baker.core.settings import Settings
from radiosity_baker.docs.effects import together
from radiosity_baker.docs.effects.__main__ import document
from radiosity_baker.docs.effects.catalogue import all_scenes, built
from radiosity_baker.docs.effects.measure import QUICK, measure

SCENES = all_scenes()
#: One of each kind, chosen for being quick.
FEW = ("square area lamp",)


@pytest.mark.parametrize("name", FEW)
def test_a_scene_of_each_kind_agrees_with_cycles(name, tmp_path):
    """By chance, the mean over the points is off by more than four of its standard errors once in 16,000 times."""
    measured = measure(SCENES[name], QUICK, tmp_path)
    assert measured.complaints(slack=4.0) == []
    assert measured.noise < 0.05


@pytest.mark.parametrize("name", SCENES)
def test_scenes_show_effects_that_exist(name):
    assert SCENES[name].shows
    assert set(SCENES[name].shows) <= set(EFFECTS)


def test_a_reference_is_kept_until_its_scene_changes(tmp_path, monkeypatch):
    scene = SCENES["square area lamp"]
    first = measure(scene, QUICK, tmp_path)
    assert len(list(tmp_path.iterdir())) == 1
    monkeypatch.setattr("radiosity_baker.docs.effects.measure.true_radiance", None)
    assert measure(scene, QUICK, tmp_path).typical == first.typical
    monkeypatch.setattr("radiosity_baker.docs.effects.lamps.COLD", (1.0, 0.0, 0.0))
    with pytest.raises(TypeError):
        measure(scene, QUICK, tmp_path)


def test_every_scene_starts_from_nothing():

    for _ in range(2):
        built(SCENES["square area lamp"])
        assert len(bpy.context.scene.objects) == 4


def test_the_document_keeps_its_words_and_the_rows_that_were_not_measured(tmp_path):
    measured = measure(SCENES["square area lamp"], QUICK, tmp_path)
    rows = "| sun of five degrees | was | good |\n| gone | x | good |\n"
    before = f"# Title\n\nWords.\n\n**Result.** old\n\n## Lamps\n\n{rows}"
    text = document(before, SCENES, [measured])
    assert text.startswith("# Title\n\nWords.\n\n**Result.** ")
    assert "| sun of five degrees | was | good |" in text
    assert "| square area lamp | area lamps" in text
    assert "gone" not in text
    assert document(text, SCENES, [measured]) == text
    with_costs = document(text, SCENES, [], ["| Thing | Alone |", "| --- | --- |", "| a sun | +1.0 |"])
    assert with_costs.startswith(text.rstrip())
    assert with_costs.endswith("| a sun | +1.0 |\n")
    assert document(with_costs, SCENES, [measured]) == with_costs


def test_what_is_added_to_the_stage_together_costs_its_rays(monkeypatch):
    """A sun alone asks for shadow rays, and the sum of the parts is that of seconds and rays apart."""
    monkeypatch.setattr(together, "SETTINGS", Settings(size=0.8, error=None, threads=1))
    monkeypatch.setattr(together, "_TIMES", 1)
    nothing, sun = together.cost([]), together.cost(["a sun"])
    assert (sun - nothing).rays > 0
    assert (sun - nothing + nothing).rays == sun.rays
