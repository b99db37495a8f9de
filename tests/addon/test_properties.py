"""Every setting of the panel means exactly one setting of the core."""

from dataclasses import fields, replace

import bpy
import pytest

from radiosity_baker.addon import properties
from radiosity_baker.core.settings import LAYERS, Estimator, Settings


@pytest.fixture(autouse=True)
def asked(registered):  # noqa: ARG001 - without it there is nothing to ask
    return bpy.context.scene.radiosity_baker


def test_untouched_settings_are_the_defaults_of_the_core(asked):
    assert asked.to_core() == Settings()


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ({"error": 0.5}, {"error": 0.005}),
        ({"goal": "SECONDS", "seconds": 3.0}, {"error": None, "seconds": 3.0}),
        ({"result": "REPLACE"}, {}),
        ({"result": "KEEP"}, {"tessellate": False}),
        ({"triangles": 1234}, {"triangles": 1234}),
        ({"density": "SIZE", "size": 0.25}, {"size": 0.25}),
        ({"estimator": "analytic"}, {"estimator": "analytic"}),
        ({"seed": 7}, {"seed": 7}),
        ({"threads": 2}, {"threads": 2}),
        ({"layers": {"error", "direct"}}, {"layers": ("combined", "direct", "error")}),
        ({"layers": set()}, {"layers": ("combined",)}),
    ],
)
def test_each_setting_reaches_the_core(asked, given, expected):
    for name, value in given.items():
        setattr(asked, name, value)
    settings = asked.to_core()
    assert settings.error == pytest.approx(expected.get("error", 0.02))
    assert settings == replace(Settings(), **expected | {"error": settings.error})


def test_no_setting_of_the_core_is_out_of_reach(asked):
    changed = {"goal": "SECONDS", "result": "KEEP", "density": "SIZE", "triangles": 1, "estimator": "centroid"}
    for name, value in (changed | {"seed": 1, "threads": 1, "layers": {"sky"}}).items():
        setattr(asked, name, value)
    asked.switch_effect("sky", True)
    ours, default = asked.to_core(), Settings()
    same = [field.name for field in fields(Settings) if getattr(ours, field.name) == getattr(default, field.name)]
    assert same == []


def test_choices_are_those_of_the_core():
    assert [item[0] for item in properties.LAYER_ITEMS] == list(LAYERS)
    assert {item[0] for item in properties.ESTIMATOR_ITEMS} == set(Estimator.__args__)


def test_every_setting_has_a_tooltip(asked):
    own = [
        prop for prop in asked.bl_rna.properties if prop.identifier not in {"rna_type", "name"} and not prop.is_hidden
    ]
    assert len(own) > 10
    for prop in own:
        assert prop.description, prop.identifier
        assert not prop.description.endswith("."), prop.identifier
        for item in getattr(prop, "enum_items", ()):
            assert item.description, f"{prop.identifier} {item.identifier}"


def test_report_stays_with_the_scene(asked):
    assert asked.last_report() is None
    asked.remember({"objects": [], "warnings": ["Dim"]})
    assert asked.last_report()["warnings"] == ["Dim"]


def test_plan_is_shown_until_a_bake_is_done(asked):
    assert asked.last_plan() == {}
    asked.plan = '{"seconds": 3.0}'
    assert asked.last_plan() == {"seconds": 3.0}
    asked.remember({"objects": [], "effects": [], "seconds": {"total": 2.0}})
    assert asked.last_plan() == {"effects": []}
