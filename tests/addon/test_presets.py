"""Presets: those that come along, and a person's own."""

import bpy
import pytest

from radiosity_baker.addon import presets

pytestmark = pytest.mark.usefixtures("registered")


@pytest.mark.parametrize("name", presets.PRESETS)
def test_a_preset_sets_what_it_says(name):
    bpy.ops.radiosity.choose_preset(preset=name)
    asked = bpy.context.scene.radiosity_baker
    for setting, value in presets.PRESETS[name][1].items():
        assert getattr(asked, setting) == (pytest.approx(value) if isinstance(value, float) else value)


def test_a_preset_of_ones_own_is_kept_and_used_again(tmp_path, monkeypatch):
    monkeypatch.setattr(bpy.utils, "user_resource", lambda *_, **__: str(tmp_path))
    asked = bpy.context.scene.radiosity_baker
    mine = {"goal": "SECONDS", "seconds": 7.0, "result": "KEEP", "layers": {"combined", "light"}, "domain": "POINT"}
    mine |= {"data_type": "BYTE_COLOR", "exposure": -1.5, "density": "SIZE", "size": 0.25, "estimator": "analytic"}
    for setting, value in mine.items():
        setattr(asked, setting, value)
    assert bpy.ops.radiosity.add_preset(name="For the Engine") == {"FINISHED"}
    (kept,) = tmp_path.glob("*.py")

    for setting in mine:
        asked.property_unset(setting)
    assert asked.result == "NEW"
    bpy.ops.script.execute_preset(filepath=str(kept), menu_idname="RADIOSITY_MT_presets")
    assert {setting: getattr(asked, setting) for setting in mine} == mine
