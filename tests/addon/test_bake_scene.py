"""Read, bake and write in one call."""

import bpy
import pytest

from radiosity_baker.addon import bake_scene
from radiosity_baker.addon.copies import original_of
from radiosity_baker.core.progress import Progress
from radiosity_baker.core.scene import SceneError
from radiosity_baker.core.settings import Settings


@pytest.fixture
def lit_plane(add_mesh, add_lamp):
    add_lamp("POINT", {"energy": 100.0}, location=(0.5, 0.5, 1.0))
    return add_mesh("Plane")


def run(obj, mode="new", **settings):
    return bake_scene.bake_objects(
        bpy.context,
        [obj],
        Settings(tessellate=mode != "keep", triangles=64, error=None, **settings),
        result_mode=mode,
        attribute="Radiosity",
        progress=Progress(),
    )


@pytest.mark.parametrize("mode", ["keep", "replace", "new"])
def test_a_lit_plane_is_baked_and_written(lit_plane, colours, mode):
    result, (written,) = run(lit_plane, mode)

    light = colours(written.data, "Radiosity")
    # At most what straight down from the lamp gives: albedo / pi x 100 / (4 pi) / 1^2; a fit may overshoot a little.
    assert 0.0 < light.min() < light.max() < 1.1 * 0.8 * 100.0 / (4.0 * 3.14159**2)
    seconds = result.report.seconds
    assert seconds["read"] > 0.0
    assert seconds["write"] > 0.0
    assert seconds["total"] >= seconds["read"] + seconds["write"]
    assert result.report.objects[0]["name"] == written.name


def test_what_cannot_be_written_is_refused_before_the_bake(lit_plane, monkeypatch):
    lit_plane.data.attributes.new("Radiosity", "FLOAT", "POINT")
    monkeypatch.setattr(bake_scene, "bake", lambda *_: pytest.fail("the bake ran"))

    with pytest.raises(SceneError, match="did not make"):
        run(lit_plane)


@pytest.mark.parametrize("mode", ["keep", "new"])
def test_a_lamp_that_fades_gives_a_layer_for_each_frame(lit_plane, colours, mode):
    lamp = bpy.data.lights[0]
    for frame, energy in ((1, 100.0), (3, 25.0)):
        lamp.energy = energy
        lamp.keyframe_insert("energy", frame=frame)
    bpy.context.scene.frame_set(2)

    settings = Settings(tessellate=mode != "keep", triangles=64, error=None)
    result, (written,) = bake_scene.bake_frames(
        bpy.context, [lit_plane], settings, [1, 3], result_mode=mode, attribute="Light"
    )

    assert written.data.color_attributes.keys() == ["Light 0001", "Light 0003"]
    first, last = (colours(written.data, name).mean() for name in ("Light 0001", "Light 0003"))
    # A quarter of the power; between two bakes of a preview's 2 %, each.
    assert last == pytest.approx(first / 4.0, rel=0.05)
    assert [entry["attribute"] for entry in result.report.objects] == ["Light 0001", "Light 0003"]
    assert bpy.context.scene.frame_current == 2
    if mode == "new":
        assert original_of(bpy.context.view_layer, written) == lit_plane
