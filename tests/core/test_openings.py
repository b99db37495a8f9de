"""Windows that rays find: where they are, what they are worth, and that nothing looks for them without a need."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from radiosity_baker.core import plan as planning
from radiosity_baker.core.bake import bake
from radiosity_baker.core.openings import find_openings
from radiosity_baker.core.patches import triangle_geometry
from radiosity_baker.core.pilot import Pilot, look_for_sky
from radiosity_baker.core.plan import plan
from radiosity_baker.core.result import BakedObject
from radiosity_baker.core.scene import AreaLamp, PointLamp, Portal, Scene, SunLamp, Surface
from radiosity_baker.core.settings import Settings

WHITE = Surface("white", (0.5, 0.5, 0.5))
LAMP = PointLamp("bulb", (0.0, 0.0, 2.0), (1.0, 1.0, 1.0))


def wall(build, x, holes):
    """In the plane x, from y = -2 to 2 and z = 0 to 3, with holes (y, y, z, z) in it that lie beside each other."""
    edges = [-2.0, *(y for hole in holes for y in hole[:2]), 2.0]
    pieces = [(low, high, 0.0, 3.0) for low, high in zip(edges[::2], edges[1::2], strict=True)]
    for y0, y1, z0, z1 in holes:
        pieces += [(y0, y1, 0.0, z0), (y0, y1, z1, 3.0)]
    return [
        build.quad(f"wall {x} {k}", (x, y0, z0), (0, y1 - y0, 0), (0, 0, z1 - z0), receives=False)
        for k, (y0, y1, z0, z1) in enumerate(pieces)
        if z1 > z0
    ]


def house(build, *walls, sky=(1.0, 1.0, 1.0), lamps=()) -> Scene:
    """Rooms from x = -2 to 2 one behind another; walls: their planes x and holes. The floor is baked."""
    rest = [
        build.quad("south", (-2, -2, 0), (4, 0, 0), (0, 0, 3), receives=False),
        build.quad("north", (-2, 2, 0), (0, 0, 3), (4, 0, 0), receives=False),
        build.quad("ceiling", (-2, -2, 3), (0, 4, 0), (4, 0, 0), receives=False),
    ]
    upright = [piece for x, holes in walls for piece in wall(build, x, holes)]
    return Scene((build.quad("floor", (-2, -2, 0), (4, 0, 0), (0, 4, 0)), *rest, *upright), (WHITE,), lamps, sky)


def turned(scene: Scene, degrees: float) -> Scene:
    cosine, sine = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    turn = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    return replace(scene, objects=tuple(replace(o, vertices=o.vertices @ turn) for o in scene.objects))


def extents(portal: Portal) -> tuple[float, float]:
    return tuple(sorted(2 * float(np.linalg.norm(half)) for half in (portal.half_u, portal.half_v)))


def mean_radiance(baked: BakedObject) -> float:
    area = triangle_geometry(baked.vertices[baked.triangles])[1]
    return float(area @ baked.layers["combined"].mean(axis=(1, 2)) / area.sum())


def openings(scene: Scene) -> tuple[Portal, ...]:
    pilot = Pilot(scene)
    return find_openings(look_for_sky(pilot), pilot)


SMALL, TALL = (-0.3, 0.3, 1.0, 1.4), (1.0, 1.5, 0.5, 2.5)


@pytest.mark.parametrize("degrees", [0.0, 31.0])
def test_a_window_is_found_as_it_is(build, degrees):
    (window,) = openings(turned(house(build, (-2.0, []), (2.0, [SMALL])), degrees))
    turn = np.radians(degrees)
    assert window.center == pytest.approx((2.0 * np.cos(turn), 2.0 * np.sin(turn), 1.2), abs=1e-6)
    assert window.normal == pytest.approx((-np.cos(turn), -np.sin(turn), 0.0), abs=1e-6)
    assert extents(window) == pytest.approx((0.4, 0.6), abs=1e-6)


def test_windows_beside_each_other_and_across_are_told_apart(build):
    found = openings(house(build, (-2.0, [SMALL]), (2.0, [SMALL, TALL])))
    sizes = sorted((round(p.center[0]), *np.round(extents(p), 3)) for p in found)
    assert sizes == [(-2, 0.4, 0.6), (2, 0.4, 0.6), (2, 0.5, 2.0)]


def test_between_things_that_stand_in_the_open_there_is_no_window(build):
    """Stairs against two walls: rays from what they hide leave through the plane of a step, beside it and above."""
    ground = build.box("ground", (-3, -3, -0.2), (3, 3, 0))
    walls = build.box("back", (-3, 3, 0), (3, 3.2, 3)), build.box("left", (-3.2, -3, 0), (-3, 3.2, 3))
    stairs = [build.box(f"step {k}", (1.2, 1 + 0.45 * k, 0), (2.6, 1.45 + 0.45 * k, 0.22 * (k + 1))) for k in range(4)]
    assert openings(Scene((ground, *walls, *stairs), (WHITE,), sky=(1.0, 1.0, 1.0))) == ()


def test_a_window_that_has_a_portal_is_not_found_again(build):
    scene = house(build, (-2.0, []), (2.0, [SMALL, TALL]))
    own = Portal("mine", (2.0, 0.0, 1.2), (0.0, 0.3, 0.0), (0.0, 0.0, 0.2), (-1.0, 0.0, 0.0))
    (other,) = openings(replace(scene, portals=(own,)))
    assert extents(other) == pytest.approx((0.5, 2.0), abs=1e-6)


def test_through_a_doorway_and_a_window_behind_it_the_light_is_the_same(build):
    """Its mean within 4 standard deviations of what rays alone find: a share p of the sky, counted with n rays, is good
    to sqrt(p / n), and less than half as noisy with openings."""
    scene = house(build, (-2.0, []), (0.0, [SMALL]), (2.0, [(-1.0, 1.0, 1.0, 2.5)]))
    settings = Settings(size=0.2, error=0.05, threads=2)
    with_openings, plain = (bake(scene, replace(settings, effects=asked)) for asked in ({}, {"portals": False}))
    reasons = {effect.name: effect.reason for effect in with_openings.report.effects}
    assert "opening" in reasons["portals"]
    one, other = (mean_radiance(r.objects[0]) for r in (with_openings, plain))
    share = other / WHITE.albedo[0]
    deviation = other * np.sqrt(1 / (share * plain.report.rays["gather"]))
    assert one == pytest.approx(other, abs=4 * deviation + 3e-3 * other)
    sampling = [r.report.estimated_error["sampling"] for r in (with_openings, plain)]
    assert sampling[0] < sampling[1] / 2


def test_nothing_is_looked_for_without_a_sky(build, monkeypatch):
    monkeypatch.setattr(planning, "look_for_sky", None)
    scene = house(build, (-2.0, []), (2.0, [SMALL]), lamps=(LAMP,))
    plan(replace(scene, sky=(0.0, 0.0, 0.0)), Settings())
    plan(scene, Settings(effects={"sky": False}))
    with pytest.raises(TypeError):
        plan(scene, Settings())


def test_no_opening_is_looked_for_where_rays_find_the_sky_well_enough(build, monkeypatch):
    """Under the open sky; and where a lamp outshines by far what comes in."""
    monkeypatch.setattr(planning, "find_openings", None)
    plan(Scene((build.quad(),), (WHITE,), sky=(1.0, 1.0, 1.0)), Settings())
    bright = house(build, (-2.0, []), (2.0, [SMALL]), sky=(0.01, 0.01, 0.01), lamps=(LAMP,))
    plan(bright, Settings())
    with pytest.raises(TypeError):
        plan(replace(bright, lamps=()), Settings())


def closed(build, **changes) -> Scene:
    return replace(house(build, (-2.0, []), (2.0, []), lamps=(LAMP,)), **changes)


def reason_for(scene: Scene, name: str, **asked) -> tuple[bool, str]:
    effect = next(e for e in plan(scene, Settings(**asked)).effects if e.name == name)
    return effect.active, effect.reason


def test_a_closed_room_has_no_sky_and_says_so(build):
    """And leaving it out changes nothing, for no ray finds it, but where solvers stop and where that decides who looks
    longer and how strongly neighbours are smoothed: less than noise does."""
    scene = closed(build)
    assert reason_for(scene, "sky") == (False, "every ray that leaves a receiver hits something")
    settings = Settings(size=1.0, error=None, threads=1)
    left_out, forced = (bake(scene, replace(settings, effects=asked)) for asked in ({}, {"sky": True}))
    assert {e.name: e.active for e in forced.report.effects}["sky"]
    shown, same = (r.objects[0].layers["combined"] for r in (left_out, forced))
    noise = forced.report.estimated_error["sampling"] * same.mean()
    assert np.abs(shown - same).max() <= noise
    assert np.median(np.abs(shown - same)) <= noise / 100


@pytest.mark.parametrize("bright", [1.0, 1e4])
def test_a_sun_outside_changes_nothing_in_a_closed_room(build, bright):
    """However much brighter the roof is than the room: the bounces inside are solved to the end."""
    lit = closed(build, sky=(0.0, 0.0, 0.0))
    sun = SunLamp("sun", (0.3, 0.2, -1.0), (bright,) * 3)
    night, day = (bake(s, Settings(size=1.0, threads=1)) for s in (lit, replace(lit, lamps=(LAMP, sun))))
    dark, same = (mean_radiance(r.objects[0]) for r in (night, day))
    assert same == pytest.approx(dark, rel=day.report.estimated_error["total"])


def test_a_sky_that_only_other_surfaces_see_is_not_left_out(build):
    """The receiver is a box's inside, with one hole towards a room that is open on top."""
    floor = build.quad("floor", (-1, -1, 0.5), (0.1, 0, 0), (0, 0.1, 0))
    scene = closed(build)
    scene = replace(scene, objects=(floor, *(replace(o, receives=False) for o in scene.objects if o.name != "ceiling")))
    lid = build.quad("lid", (-1.5, -1.5, 0.6), (0, 1.5, 0), (1.5, 0, 0), receives=False)
    assert reason_for(replace(scene, objects=(*scene.objects, lid)), "sky")[0]


def test_a_sky_that_is_all_the_light_there_is_or_outshines_it_is_not_left_out(build):
    """What the rays could have missed would then be more than a tenth of the asked error."""
    assert reason_for(closed(build, lamps=()), "sky")[0]
    assert reason_for(closed(build, sky=(1e5, 1e5, 1e5)), "sky")[0]
    dim = AreaLamp("glow", (0, 0, 2.9), (0.1, 0, 0), (0, 0.1, 0), (0, 0, -1), (1e-3, 1e-3, 1e-3))
    assert reason_for(closed(build, lamps=(dim,)), "sky")[0]


def test_a_tent_lets_the_sky_in_although_no_ray_gets_out(build):
    """Its cloth passes light on from one side to the other."""
    cloth = Surface("cloth", (0.3, 0.3, 0.3), transmission=(0.3, 0.3, 0.3))
    assert reason_for(closed(build, surfaces=(cloth,)), "sky")[0]


def test_where_nothing_comes_back_nothing_wanders_out(build):
    """All rays are swallowed by veils without a colour, in one turn."""
    veil = Surface("veil", opacity=0.0, transparent=(0.0, 0.0, 0.0))
    inside = closed(build)
    walls = tuple(o if o.receives else replace(o, surface=o.surface + 1) for o in inside.objects)
    assert not reason_for(replace(inside, objects=walls, surfaces=(WHITE, veil)), "sky")[0]
