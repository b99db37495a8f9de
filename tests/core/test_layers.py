"""The views of how a bake went: what nobody sees, what is open, and how it was split."""

import numpy as np
import pytest

from radiosity_baker.core import openness
from radiosity_baker.core.bake import bake
from radiosity_baker.core.scene import Scene, Surface
from radiosity_baker.core.settings import Settings

GREY = Surface("grey", (0.5, 0.5, 0.5))
GLOWING = Surface("glowing", (0.5, 0.5, 0.5), emission=(1.0, 1.0, 1.0))
MAGENTA, RED = (1.0, 0.0, 1.0), (1.0, 0.0, 0.0)


@pytest.fixture
def run():
    def run(scene, *layers, **asked):
        return bake(scene, Settings(**({"triangles": 300, "error": 0.1, "threads": 2, "layers": layers} | asked)))

    return run


def test_escaped_is_the_form_factor_to_the_void(build, run):
    """A unit square faces another at distance one: the void is what is left, on average over the square 0.800175."""
    below = build.quad("below")
    above = build.quad("above", (0, 0, 1), (0, 1, 0), (1, 0, 0))
    result = run(Scene((below, above), (GLOWING,)), "escaped", size=0.08)

    for baked in result.objects:
        share = baked.layers["escaped"]
        assert (share == share[..., :1]).all()
        corners = baked.vertices[baked.triangles]
        area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
        mean = area @ share[..., 0].mean(axis=1) / area.sum()
        # 300 triangles of 32 rays or more: plain sampling's deviation is sqrt(0.2 * 0.8 / n) = 0.004; four of them.
        assert len(share) > 300
        assert mean == pytest.approx(1 - 0.199824896, abs=0.016)
    assert result.report.rays["escaped"] > 0


def test_a_closed_room_lets_nothing_out(build, run):
    (room,) = run(Scene((build.box("room", inward=True),), (GLOWING,)), "escaped").objects
    np.testing.assert_array_equal(room.layers["escaped"], 0.0)


def test_nobody_asks_for_what_escapes_unless_told_to(build, run, monkeypatch):
    monkeypatch.setattr(openness, "gather_indirect", lambda *_: pytest.fail("rays were cast"))
    assert "escaped" not in run(Scene((build.quad(),), (GLOWING,)), "combined", "unreached").report.rays


def test_unreached_is_loud_inside_solids_only(build, run):
    """A box stands in the middle of a floor, sunk into it: what it hides is loud, and counted in the report."""
    floor = build.quad("floor", (-2, -2, 0), (4, 0, 0), (0, 4, 0))
    block = build.box("block", (-1, -1, -1), (1, 1, 1))
    result = run(Scene((floor, block), (GREY,), sky=(1.0, 1.0, 1.0)), "unreached", size=0.2)

    (seen,) = [item for item in result.objects if item.name == "floor"]
    place = seen.vertices[seen.triangles]
    within = np.abs(place[..., :2]).max(axis=2)
    edge = np.linalg.norm(place - np.roll(place, 1, axis=1), axis=2).max()
    colours = seen.layers["unreached"]
    loud = (colours == MAGENTA).all(axis=2) | (colours == RED).all(axis=2)
    assert loud[within < 1.0 - 2 * edge].all()
    assert not loud[within > 1.0 + edge].any()
    assert np.unique(colours[~loud]).tolist() == [np.float32(0.05)]
    assert result.report.vertices["hidden"] > 0
    # Along the outline it has vertices of its own: nothing of what is seen reaches under the box.
    assert result.report.vertices["filled"] == 0


def test_each_triangle_has_a_colour_of_its_own(build, run):
    (baked,) = run(Scene((build.quad(),), (GREY,), sky=(1.0, 1.0, 1.0)), "triangles", size=0.1).objects
    colours = baked.layers["triangles"]
    assert (colours == colours[:, :1]).all()
    assert len(np.unique(colours[:, 0], axis=0)) == len(colours) > 100
    assert colours.min() >= 0.0
    assert colours.max() <= 1.0
