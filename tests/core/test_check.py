"""What cannot be baked is refused by name, before any work; what is doubtful is baked with a warning."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from radiosity_baker.core.bake import bake
from radiosity_baker.core.check import check_scene
from radiosity_baker.core.scene import (
    ALBEDO_LIMIT,
    AreaLamp,
    PointLamp,
    Scene,
    SceneError,
    SceneObject,
    SkyMap,
    Surface,
)
from radiosity_baker.core.settings import Settings

NAN = float("nan")
LAMP = PointLamp("Bulb", (0, 0, 1), (1.0, 1.0, 1.0))


@pytest.fixture
def good(build) -> Scene:
    return Scene((build.quad("Floor"),), (build.grey,), (LAMP,), (1.0, 1.0, 1.0))


def with_object(scene, **changes) -> Scene:
    return replace(scene, objects=(replace(scene.objects[0], **changes),))


def with_vertex(scene, value) -> Scene:
    vertices = scene.objects[0].vertices.copy()
    vertices[2, 1] = value
    return with_object(scene, vertices=vertices)


BAD = {
    "no objects": (lambda s: replace(s, objects=()), "Nothing to bake"),
    "no faces": (
        lambda s: with_object(s, triangles=np.zeros((0, 3), np.int32), surface=np.zeros(0, np.int32)),
        "Nothing",
    ),
    "no area": (lambda s: with_object(s, vertices=s.objects[0].vertices * 0), "'Floor' have no area"),
    "lost beside what flew off": (
        lambda s: replace(
            s, objects=(*s.objects, replace(s.objects[0], name="Kite", vertices=s.objects[0].vertices + 1e20))
        ),
        "'Floor' is lost in a scene of 1e[+]20 m.*'Kite'",
    ),
    "no receiver": (lambda s: with_object(s, receives=False), "Nothing to bake"),
    "vertex too high": (lambda s: with_object(s, triangles=np.array([[0, 1, 4], [0, 2, 3]], np.int32)), "'Floor'"),
    "vertex negative": (lambda s: with_object(s, triangles=np.array([[0, 1, -1], [0, 2, 3]], np.int32)), "'Floor'"),
    "sky not a number": (lambda s: replace(s, sky=(0.0, NAN, 0.0)), "The sky"),
    "sky map negative": (lambda s: replace(s, sky=SkyMap(np.full((2, 4, 3), -1, np.float32))), "The sky"),
    "no such material": (lambda s: with_object(s, surface=np.array([0, 1], np.int32)), "'Floor'"),
    "too few materials": (lambda s: with_object(s, surface=np.zeros(1, np.int32)), "'Floor'"),
    "vertex not a number": (lambda s: with_vertex(s, NAN), "'Floor'"),
    "vertex infinite": (lambda s: with_vertex(s, np.inf), "'Floor'"),
    "albedo negative": (lambda s: replace(s, surfaces=(Surface("Paint", (-0.1, 0, 0)),)), "'Paint'"),
    "albedo not a number": (lambda s: replace(s, surfaces=(Surface("Paint", (NAN, 0, 0)),)), "'Paint'"),
    "emission infinite": (lambda s: replace(s, surfaces=(Surface("Paint", emission=(np.inf, 0, 0)),)), "'Paint'"),
    "emission negative": (lambda s: replace(s, surfaces=(Surface("Paint", emission=(-1, 0, 0)),)), "'Paint'"),
    "lamp not a number": (lambda s: replace(s, lamps=(replace(LAMP, intensity=(NAN, 0, 0)),)), "'Bulb'"),
    "lamp without area": (
        lambda s: replace(s, lamps=(AreaLamp("Tube", (0, 0, 1), (1, 0, 0), (0, 0, 0), (0, 0, -1), (1.0,) * 3),)),
        "'Tube'",
    ),
    "lamp nowhere": (lambda s: replace(s, lamps=(replace(LAMP, position=(0, 0, np.inf)),)), "'Bulb'"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_refused_by_name(good, case):
    spoil, message = BAD[case]
    for act in (check_scene, lambda scene: bake(scene, Settings(triangles=10, error=0.08, threads=1))):
        with pytest.raises(SceneError, match=message):
            act(spoil(good))


@pytest.mark.parametrize("case", BAD)
def test_messages_say_what_to_do(good, case):
    """More than what is wrong: after a colon, or in a sentence of its own, the remedy."""
    with pytest.raises(SceneError) as refused:
        check_scene(BAD[case][0](good))
    remedy = str(refused.value).partition(":" if ":" in str(refused.value) else ". ")[2]
    assert len(remedy.split()) >= 2


def test_an_unknown_layer_is_refused_by_name(good):
    with pytest.raises(SceneError, match="'shiny'"):
        bake(good, Settings(triangles=10, error=0.08, layers=("shiny",)))


def test_good_input_passes_unchanged(good):
    checked = check_scene(good)
    assert checked.objects == good.objects
    assert checked.surfaces == good.surfaces
    assert checked.warnings == ()


def test_empty_objects_are_left_out(good):
    empty = SceneObject("Empty", np.zeros((0, 3)), np.zeros((0, 3), np.int32), np.zeros(0, np.int32))
    assert [o.name for o in check_scene(replace(good, objects=(empty, *good.objects))).objects] == ["Floor"]


def test_an_object_that_was_scaled_to_nothing_hinders_no_other(build, good):
    point = replace(build.quad("Point"), vertices=np.zeros((4, 3)))
    assert len(check_scene(replace(good, objects=(*good.objects, point))).objects) == 2


def test_objects_and_lamps_come_in_the_order_of_their_names(build, good):
    others = tuple(build.quad(name) for name in ("b", "a", "c"))
    lamps = tuple(replace(LAMP, name=name) for name in ("z", "y"))
    checked = check_scene(replace(good, objects=others, lamps=lamps))
    assert [o.name for o in checked.objects] == ["a", "b", "c"]
    assert [lamp.name for lamp in checked.lamps] == ["y", "z"]


def test_albedo_over_the_limit_is_lowered_with_a_warning(good):
    checked = check_scene(replace(good, surfaces=(Surface("Snow", (2.0, 1.0, 0.3), (1, 1, 1)),)))
    assert checked.surfaces[0] == Surface("Snow", (ALBEDO_LIMIT, ALBEDO_LIMIT, 0.3), (1, 1, 1))
    assert len(checked.warnings) == 1
    assert "'Snow'" in checked.warnings[0]


def test_earlier_warnings_are_kept(good):
    assert check_scene(replace(good, warnings=("read with care",))).warnings == ("read with care",)


def test_only_a_scene_very_far_away_is_warned_of(good):
    for away, warned in ((9e4, False), (1.1e5, True)):
        moved = with_object(good, vertices=good.objects[0].vertices + np.array([away, 0, 0]))
        assert bool(check_scene(moved).warnings) == warned


def test_area_lamps_pass_though_their_shape_is_a_word(good):
    lamp = AreaLamp("panel", (0, 0, 1), (1, 0, 0), (0, 1, 0), (0, 0, -1), (1.0, 1.0, 1.0))
    assert check_scene(replace(good, lamps=(lamp,))).lamps == (lamp,)
