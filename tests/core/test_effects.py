"""Overrides: what a person switches off is gone, what they switch on changes nothing that is not there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from radiosity_baker.core import bake as pipeline
from radiosity_baker.core.bake import bake
from radiosity_baker.core.convexity import nothing_stands_between
from radiosity_baker.core.effects import EFFECTS, choose_effects
from radiosity_baker.core.plan import choose_effort
from radiosity_baker.core.scene import (
    AreaLamp,
    PointLamp,
    Portal,
    Scene,
    SceneError,
    SkyMap,
    SpotLamp,
    SunLamp,
    Surface,
    Texture,
)
from radiosity_baker.core.settings import Settings
from radiosity_baker.core.survey import Survey

#: Looks down from below, so that it shines on nothing and no cell is split for it.
PORTAL = Portal("window", (0, 0, -5), (0.3, 0, 0), (0, 0.3, 0), (0, 0, -1))
AXES = ((1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0))
COLOR = (1.0, 1.0, 1.0)
LAMP = PointLamp("bulb", (0.2, 0.1, 1), COLOR)
QUICK = Settings(size=0.2, error=None, threads=1)


@pytest.fixture
def everything(build) -> Scene:
    """A scene with all effects, each of its lights with a colour of its own."""
    lamps = (
        PointLamp("bulb", (0, 0, 1), (1.0, 0, 0), radius=0.1),
        SpotLamp("torch", (0, 0, 1), (0, 1.0, 0), AXES, 2.0, 0.1, radius=0.1),
        SunLamp("noon", (0, 0, -1), (0, 0, 1.0), angle=0.1),
        AreaLamp("softbox", (0, 0, 1), (0.1, 0, 0), (0, 0.1, 0), (0, 0, -1), (9.0, 9.0, 0)),
    )
    glow = build.quad("glow", (-1, -1, 2), (0, 0.5, 0), (0.5, 0, 0), surface=1, receives=False)
    floor = build.quad("floor", (-1, -1, 0), (2, 0, 0), (0, 2, 0))
    veil = build.quad("veil", (0.9, -1, 0), (0, 0.2, 0), (0, 0, 0.2), surface=2, receives=False)
    image = Texture(np.random.default_rng(1).random((4, 4, 3), dtype=np.float32))
    quarter = (0.25, 0.25, 0.25)
    surfaces = (
        replace(build.grey, albedo_texture=image),
        Surface("glow", (0, 0, 0), (0, 5.0, 5.0), emission_texture=image),
        Surface("veil", quarter, opacity=0.5, transmission=quarter, mirror=quarter, glass=quarter),
    )
    uv = np.array([[(0, 0), (1, 0), (1, 1)], [(0, 0), (1, 1), (0, 1)]], dtype=np.float32)
    return Scene(
        (replace(floor, uv=uv), replace(glow, uv=uv), veil), surfaces, lamps, sky=sky_with_a_spot(), portals=(PORTAL,)
    )


def sky_with_a_spot() -> SkyMap:
    pixels = np.full((16, 32, 3), (0.5, 0, 0.5), dtype=np.float32)
    pixels[12, 5:7] = (50, 0, 0)
    return SkyMap(pixels)


def baked(scene, **asked):
    settings = replace(QUICK, **asked)
    effort = replace(choose_effort(scene, settings), patches=100)
    return bake(scene, settings, effort=effort).objects[0]


def light(scene, **asked):
    return baked(scene, **asked).layers["combined"].astype(float)


@pytest.mark.parametrize("name", EFFECTS)
def test_an_effect_that_is_switched_off_is_off_and_says_by_whom(everything, name):
    chosen, _ = choose_effects(everything, Settings(effects={name: False}))
    own = next(effect for effect in chosen if effect.name == name)
    assert not own.active
    assert own.reason.startswith("switched off by hand; ")


def test_without_all_sources_the_scene_is_dark(everything):
    sources = [name for name in EFFECTS if name not in ("bounces", "shadows", "soft shadows")]
    assert light(everything, effects=dict.fromkeys(sources, False)).max() == 0


@pytest.mark.parametrize("name", ["point lamps", "spot lamps", "sun", "area lamps", "emitting surfaces", "sky"])
def test_the_light_of_all_sources_is_the_sum_of_what_each_gives_alone(everything, name, build):
    """A source that is switched off takes its own light away and no other."""
    sources = ("point lamps", "spot lamps", "sun", "area lamps", "emitting surfaces", "sky")
    alone = build.mean_light(baked(everything, effects={other: other == name for other in sources}))
    rest = build.mean_light(baked(everything, effects={name: False}))
    assert alone.max() > 0
    assert alone + rest == pytest.approx(build.mean_light(baked(everything)), rel=0.05)


def test_without_bounces_only_straight_light_arrives(build):
    room = build.furnished_room()
    asked = {"layers": ("combined", "indirect")}
    straight = bake(room, replace(QUICK, effects={"bounces": False}, **asked))
    assert all(o.layers["indirect"].max() == 0 for o in straight.objects)
    assert any(o.layers["combined"].max() > 0 for o in straight.objects)
    assert straight.report.rays.get("gather", 0) == 0


def test_hard_shadows_keep_the_power(everything):
    _, scene = choose_effects(everything, Settings(effects={"soft shadows": False}))
    bulb, torch, noon, softbox = scene.lamps
    assert bulb.radius == torch.radius == noon.angle == 0
    assert softbox == everything.lamps[3]
    assert bulb.intensity == everything.lamps[0].intensity


def test_an_effect_that_is_called_for_is_not_overridden_by_asking_for_it(everything):
    plain, _ = choose_effects(everything, Settings())
    asked, _ = choose_effects(everything, Settings(effects=dict.fromkeys(EFFECTS, True)))
    assert plain == asked


def test_an_effect_that_does_not_exist_is_refused_with_those_that_do(everything):
    with pytest.raises(SceneError, match=r"no effect 'moon'.*sun.*sky"):
        choose_effects(everything, Settings(effects={"moon": True}))


def test_without_overrides_nothing_changes(everything):
    _, scene = choose_effects(everything, Settings())
    assert scene is everything
    assert np.array_equal(light(everything), light(everything, effects={"sky": True}))


def room(build, **changes):
    """A closed box of one metre with a lamp in the middle: convex, so nothing can stand between."""
    lamp = PointLamp("bulb", (0.4, 0.5, 0.6), COLOR, **changes)
    return Scene((build.box(inward=True),), (build.grey,), (lamp,))


def test_a_convex_room_needs_no_shadow_ray(build):
    """And shadows switched on change nothing: no ray is ever blocked."""
    scene = room(build, radius=0.1)
    without, forced = (bake(scene, replace(QUICK, effects=asked)) for asked in ({}, {"shadows": True}))
    assert not next(e for e in without.report.effects if e.name == "shadows").active
    assert without.report.rays.get("shadow", 0) == 0
    assert forced.report.rays["shadow"] > 0
    shown, same = (r.objects[0].layers["combined"] for r in (without, forced))
    assert shown == pytest.approx(same, rel=1e-5)


@pytest.mark.parametrize(
    "lamp",
    [
        PointLamp("outside", (2, 0.5, 0.5), COLOR),
        PointLamp("half outside", (0.9, 0.5, 0.5), COLOR, radius=0.2),
        SunLamp("noon", (0, 0, -1), COLOR),
        AreaLamp("through the wall", (0.9, 0.5, 0.5), (0.2, 0, 0), (0, 0.2, 0), (0, 0, -1), COLOR),
    ],
)
def test_a_lamp_that_is_not_within_the_room_casts_shadows(build, lamp):
    assert not nothing_stands_between(replace(room(build), lamps=(lamp,)))


def test_a_sun_over_a_floor_has_nothing_in_its_way_and_behind_a_box_it_has(build):
    noon = SunLamp("noon", (0.1, 0, -1), COLOR, angle=0.1)
    floor = build.quad("floor", (-1, -1, 0), (2, 0, 0), (0, 2, 0))
    assert nothing_stands_between(Scene((floor,), (build.grey,), (noon,)))
    standing = build.box("box", (-0.2, -0.2, 0), (0.2, 0.2, 0.5))
    assert not nothing_stands_between(Scene((floor, standing), (build.grey,), (noon,)))


def test_lamps_that_cast_no_shadow_shine_through(build):
    roof = build.quad("roof", (-1, -1, 1), (2, 0, 0), (0, 2, 0), receives=False)
    floor = build.quad("floor", (-1, -1, 0), (2, 0, 0), (0, 2, 0))
    black = Surface("black", (0.5, 0, 0))
    lamp = PointLamp("bulb", (0, 0, 2), COLOR)
    dark = light(Scene((floor, roof), (black,), (lamp,)))[..., 0]
    through = light(Scene((floor, roof), (black,), (replace(lamp, casts_shadow=False),)))[..., 0]
    assert dark.max() < 0.01 * through.max()
    assert through.min() > 0


def in_grey(scene: Scene) -> Scene:
    return choose_effects(scene, Settings(effects={"colour": False}))[1]


def test_without_colour_everything_is_the_mean_of_its_channels(everything):
    """The light too, since it is linear in each colour; up to what two colours at once differ by from their means."""
    effects, scene = choose_effects(everything, Settings(effects={"colour": False}))
    colour, grey = light(everything), light(scene)
    assert grey[..., 0] == pytest.approx(grey[..., 2], rel=1e-6)
    assert next(e for e in effects if e.name == "colour").reason.startswith("switched off by hand")
    assert grey.mean() == pytest.approx(colour.mean(), rel=0.25)


def test_one_channel_where_everything_is_grey_gives_the_same_light_from_a_third_of_the_numbers(build, monkeypatch):
    """To the last bit but for solvers that end a step earlier, and for a vertex here and there where two smoothings are
    as good as each other: there the two may differ by as much as both are off. Nobody looks longer where noise would
    show, for one such vertex changes where that is."""
    scene = in_grey(build.furnished_room())
    kept = []

    def remembering(*given, **named):
        made = Survey(*given, **named)
        kept.append(made)
        return made

    monkeypatch.setattr(pipeline, "Survey", remembering)
    one, three = (bake(scene, replace(QUICK, error=0.1, effects=asked)) for asked in ({}, {"colour": True}))
    reasons = {effect.name: effect for effect in one.report.effects}
    assert reasons["colour"].reason == "one channel: all light and all surfaces are grey"
    # The first survey of each bake tells where cells are to be split; the light is that of the last.
    first, second = kept[len(kept) // 2 - 1], kept[-1]
    assert 3 * first.direct[0].light.nbytes == 3 * first.indirect[0].light.nbytes == second.direct[0].light.nbytes
    assert first.rays == second.rays
    grey, same = (np.concatenate([o.layers["combined"].ravel() for o in baked.objects]) for baked in (one, three))
    assert np.mean(np.abs(grey - same) <= 1e-4 * same) > 0.98
    assert np.abs(grey - same).max() <= one.report.estimated_error["sampling"] * same.mean()


@pytest.mark.parametrize(
    ("change", "name"),
    [
        ({"sky": (0.1, 0.1, 0.2)}, "the sky"),
        ({"lamps": (replace(LAMP, intensity=(1.0, 0.9, 1.0)),)}, "bulb"),
        ({"surfaces": (Surface("paint", (0.5, 0.4, 0.5)),)}, "paint"),
        ({"surfaces": (Surface("picture", albedo_texture=Texture(np.array([[[1, 0, 0]]], np.float32))),)}, "picture"),
    ],
)
def test_anything_coloured_takes_three_channels_and_is_named(build, change, name):
    floor = replace(build.quad("floor", (-1, -1, 0), (2, 0, 0), (0, 2, 0)), uv=np.zeros((2, 3, 2), np.float32))
    grey = Scene((floor,), (build.grey,), (LAMP,))
    colour = {e.name: e for e in choose_effects(replace(grey, **change), Settings())[0]}["colour"]
    assert (colour.active, colour.reason) == (True, f"{name} is coloured")
    assert not {e.name: e for e in choose_effects(grey, Settings())[0]}["colour"].active


def test_forcing_an_effect_on_that_is_not_there_changes_nothing(build):
    """Neither the light nor, where no ray can tell anything, the rays; whichever effect it is."""
    bare = Scene((build.quad("floor", (-1, -1, 0), (2, 0, 0), (0, 2, 0)),), (build.grey,), (LAMP,))
    plain = bake(bare, QUICK)
    absent = [effect.name for effect in plain.report.effects if not effect.active]
    assert len(absent) > 8
    forced = bake(bare, replace(QUICK, effects=dict.fromkeys(absent, True)))
    shown, same = (r.objects[0].layers["combined"] for r in (plain, forced))
    assert shown == pytest.approx(same, rel=1e-5)
    more = {purpose for purpose, count in forced.report.rays.items() if count > plain.report.rays.get(purpose, 0)}
    assert more <= {"shadow", "total"}
