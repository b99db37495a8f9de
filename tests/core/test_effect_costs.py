"""An effect that a scene does not have costs nothing: what would work for it is never called, and no ray is cast."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from radiosity_baker.core import effects, transport
from radiosity_baker.core import plan as planning
from radiosity_baker.core.bake import bake
from radiosity_baker.core.comparison import radiance_at, scatter
from radiosity_baker.core.direct import emitters as direct_emitters
from radiosity_baker.core.direct import illumination, lamps
from radiosity_baker.core.direct import sky as direct_sky
from radiosity_baker.core.direct.illumination import DirectLight
from radiosity_baker.core.direct.lamps import place
from radiosity_baker.core.gather import Points
from radiosity_baker.core.patches import Patches
from radiosity_baker.core.sampling import stream
from radiosity_baker.core.scene import AreaLamp, PointLamp, Portal, Scene, SkyMap, SpotLamp, SunLamp, Surface, Texture
from radiosity_baker.core.settings import Settings
from radiosity_baker.core.visibility import Visibility

QUICK = Settings(size=1.0, error=None, threads=1)
LAMP = PointLamp("bulb", (0.2, 0.1, 1.0), (1.0, 1.0, 1.0))
PORTAL = Portal("window", (0, 0, 2), (0.3, 0, 0), (0, 0.3, 0), (0, 0, -1))
UNEVEN = SkyMap(np.random.default_rng(2).uniform(0.5, 1.0, (8, 16, 3)).astype(np.float32))
IMAGE = Texture(np.random.default_rng(1).random((4, 4, 3), dtype=np.float32))
UV = np.array([[(0, 0), (1, 0), (1, 1)], [(0, 0), (1, 1), (0, 1)]], dtype=np.float32)
TENTH = (0.1, 0.1, 0.1)


def scene(build, veil=None, **changes) -> Scene:
    """A floor under a bulb, and a second sheet above it."""
    floor = replace(build.quad("floor", (-1, -1, 0), (2, 0, 0), (0, 2, 0)), uv=UV)
    sheet = replace(build.quad("sheet", (-1, -1, 0.5), (1, 0, 0), (0, 1, 0), 1, receives=False), uv=UV)
    return replace(Scene((floor, sheet), (build.grey, veil or build.grey), (LAMP,)), **changes)


SPOT = SpotLamp("torch", (0, 0, 1), (1.0, 1.0, 1.0), ((1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0)), 1.0, 0.1)
SUN = SunLamp("noon", (0.1, 0, -1), (1.0, 1.0, 1.0))
AREA = AreaLamp("softbox", (0, 0, 1), (0.1, 0, 0), (0, 0.1, 0), (0, 0, -1), (1.0, 1.0, 1.0))
BRIGHT = SkyMap(np.where(np.arange(128).reshape(8, 16, 1) == 100, 500.0, UNEVEN.pixels).astype(np.float32))

#: By effect: what only works for it, and a scene that has the effect.
WORK = {
    "spot lamps": ((lamps, "Spot"), lambda build: scene(build, lamps=(SPOT,))),
    "sun": ((lamps, "Sun"), lambda build: scene(build, lamps=(SUN,))),
    "area lamps": ((lamps.Panel, "from_area_lamp"), lambda build: scene(build, lamps=(AREA,))),
    "many lamps": ((illumination, "Crowd"), lambda build: scene(build, lamps=(LAMP,) * 30)),
    "sky lights": ((direct_sky, "place"), lambda build: scene(build, sky=BRIGHT)),
    "sky": ((planning, "look_for_sky"), lambda build: scene(build, sky=TENTH)),
    "sky map": ((effects, "split_bright"), lambda build: scene(build, sky=UNEVEN)),
    "portals": ((direct_sky, "Window"), lambda build: scene(build, sky=TENTH, portals=(PORTAL,))),
    "emitting surfaces": ((direct_emitters, "Panel"), lambda build: scene(build, Surface("glow", emission=TENTH))),
    "transparency": ((Visibility, "_follow_on"), lambda build: scene(build, Surface("veil", opacity=0.5))),
    "veils before lamps": ((Visibility, "veiled_along"), lambda build: scene(build, Surface("veil", opacity=0.5))),
    "mirrors": ((Visibility, "_follow_on"), lambda build: scene(build, Surface("mirror", mirror=TENTH))),
    "clear glass": ((Visibility, "_follow_on"), lambda build: scene(build, Surface("pane", TENTH, glass=TENTH))),
    "diffuse transmission": (
        (transport, "solve_both_sides"),
        lambda build: scene(build, Surface("leaf", TENTH, transmission=TENTH)),
    ),
    "light from behind": (
        (Points, "behind"),
        lambda build: scene(build, surfaces=(Surface("leaf", TENTH, transmission=TENTH), build.grey)),
    ),
    "albedo textures": (
        ("radiosity_baker.core.layers.TexturedFit", None),
        lambda build: scene(build, surfaces=(replace(build.grey, albedo_texture=IMAGE), build.grey)),
    ),
    "textured emission": (
        ("radiosity_baker.core.patches.mean_colours", None),
        lambda build: scene(build, Surface("film", emission=TENTH, emission_texture=IMAGE)),
    ),
}


class CalledError(Exception):
    """What an effect needs was called."""


def refuse(monkeypatch, work) -> None:
    def called(*_, **__):
        raise CalledError

    owner, name = work
    monkeypatch.setattr(*((owner, called) if name is None else (owner, name, called)))


def test_a_scene_without_effects_calls_nothing_that_works_for_them(build, monkeypatch):
    for work, _ in WORK.values():
        refuse(monkeypatch, work)
    rays = bake(scene(build), QUICK).report.rays
    assert set(rays) == {"total", "shadow", "contact", "gather", "transport"}


@pytest.mark.parametrize("effect", WORK)
def test_a_scene_with_the_effect_does_call_it(build, monkeypatch, effect):
    work, made = WORK[effect]
    refuse(monkeypatch, work)
    with pytest.raises(CalledError):
        bake(made(build), QUICK)


@pytest.mark.parametrize(("radius", "rays"), [(0.0, 1), (0.05, 4)])
def test_only_soft_shadows_take_more_than_one_ray(build, radius, rays):
    """From each of a hundred points that see the whole lamp: one, or the four that are asked for."""
    given = scene(build, lamps=(replace(LAMP, radius=radius),))
    patches = build.patches(given, 10)
    light = DirectLight([place(given.lamps[0], patches.space)], Visibility(patches.corners), 0)
    points = np.column_stack([np.random.default_rng(3).uniform(-0.5, 0.5, (100, 2)), np.full(100, -0.25)])
    up = np.broadcast_to([0.0, 0.0, 1.0], (100, 3))
    assert light.at(points, up, up, 4, stream(0, "test")).rays["shadow"] == 100 * rays


def test_nothing_is_held_for_what_is_not_there(build, monkeypatch):
    made = []
    monkeypatch.setattr(Patches, "__init__", remembering(Patches.__init__, made))
    bake(scene(build), QUICK)
    patches = made[-1]
    assert patches.optics is patches.transmission is patches.coverage is None


def remembering(method, made):
    def remember(self, *given, **named):
        method(self, *given, **named)
        made.append(self)

    return remember


#: Scenes with an effect that the plan leaves out, or in one channel, although it is there.
UNNEEDED = {
    "a sky that no ray finds": ("sky", lambda build: closed(build, sky=(0.5, 0.5, 0.5))),
    "shadows where nothing stands between": ("shadows", lambda build: closed(build, sky=(0.0, 0.0, 0.0))),
    "bounces between surfaces that are nearly black": (
        "bounces",
        lambda build: replace(scene(build), surfaces=(Surface("soot", (0.0019, 0.0019, 0.0019)),) * 2),
    ),
    "three channels of grey": ("colour", lambda build: scene(build, sky=(0.0, 0.0, 0.0))),
}


def closed(build, **changes) -> Scene:
    """A lamp in a room without windows."""
    lamp = AreaLamp("softbox", (0.5, 0.5, 0.9), (0.2, 0, 0), (0, 0.2, 0), (0, 0, -1), (3.0, 3.0, 3.0))
    return replace(Scene((build.box(inward=True),), (build.grey,), (lamp,)), **changes)


@pytest.mark.parametrize("what", UNNEEDED)
def test_leaving_out_what_the_plan_calls_unneeded_changes_at_most_a_tenth_of_the_asked_error(build, what):
    """The same bake with the effect forced on draws the same random numbers, so only the effect itself differs."""
    effect, made = UNNEEDED[what]
    given = made(build)
    settings = Settings(size=0.5, error=0.02, threads=2)
    without, forced = (bake(given, replace(settings, effects=asked)) for asked in ({}, {effect: True}))
    assert [e.active for r in (without, forced) for e in r.report.effects if e.name == effect] == [False, True]
    points = scatter(given, 2000, seed=1)
    shown, full = (radiance_at(result.objects, points) for result in (without, forced))
    assert np.sqrt(np.mean((shown - full) ** 2)) <= 0.02 / 10 * full.mean()
