"""What a bake will simulate, why, and what it will cost."""

from __future__ import annotations

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from radiosity_baker.core.bake import bake
from radiosity_baker.core.contours import Contours
from radiosity_baker.core.contrast import Contrast
from radiosity_baker.core.cost import Machine
from radiosity_baker.core.direct.crowd import Crowd
from radiosity_baker.core.effects import MOST_PANELS
from radiosity_baker.core.patches import triangle_geometry, unit_space
from radiosity_baker.core.pilot import Pilot
from radiosity_baker.core.plan import (
    LOOKING,
    _Prices,
    choose,
    choose_effort,
    gather_rays,
    plan,
    plan_with_prices,
    thriftier,
)
from radiosity_baker.core.receivers import make_receivers
from radiosity_baker.core.scene import AreaLamp, PointLamp, Portal, Scene, SkyMap, SpotLamp, SunLamp, Surface
from radiosity_baker.core.settings import Settings
from radiosity_baker.core.survey import Survey
from radiosity_baker.core.tessellation import triform, whole

AXES = ((1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0))
COLOR = (1.0, 1.0, 1.0)
LAMPS = {
    "point lamps": PointLamp("Bulb", (0, 0, 1), COLOR),
    "spot lamps": SpotLamp("Torch", (0, 0, 1), COLOR, AXES, 1.0, 0.1),
    "sun": SunLamp("Noon", (0, 0, -1), COLOR),
    "area lamps": AreaLamp("Softbox", (0, 0, 1), (1, 0, 0), (0, 1, 0), (0, 0, -1), COLOR),
}


def effects(scene, **asked):
    return {effect.name: effect for effect in plan(scene, Settings(**asked)).effects}


@pytest.fixture
def ground(build):
    return Scene((build.quad(),), (build.grey,))


@pytest.mark.parametrize("kind", LAMPS)
def test_each_kind_of_lamp_is_on_only_where_there_is_one(ground, kind):
    found = effects(replace(ground, lamps=(LAMPS[kind],)))
    assert {name for name in LAMPS if found[name].active} == {kind}
    assert LAMPS[kind].name in found[kind].reason


def test_many_lamps_are_counted_not_listed(ground):
    lamps = tuple(PointLamp(f"Lamp {k}", (0, 0, 1), COLOR) for k in range(7))
    assert effects(replace(ground, lamps=lamps))["point lamps"].reason == "Lamp 0, Lamp 1, Lamp 2 and 4 more"


@pytest.mark.parametrize(
    ("lamp", "soft"),
    [
        (LAMPS["point lamps"], False),
        (replace(LAMPS["point lamps"], radius=0.1), True),
        (replace(LAMPS["spot lamps"], radius=0.1), True),
        (LAMPS["sun"], False),
        (replace(LAMPS["sun"], angle=0.01), True),
        (LAMPS["area lamps"], True),
    ],
)
def test_shadows_are_soft_where_a_lamp_has_a_size(ground, lamp, soft):
    effect = effects(replace(ground, lamps=(lamp,)))["soft shadows"]
    assert effect.active == soft
    assert (lamp.name in effect.reason) == soft


def test_sky_emitters_and_bounces(ground):
    dark = effects(ground)
    assert not dark["sky"].active
    assert not dark["emitting surfaces"].active
    assert dark["bounces"].active
    assert "50%" in dark["bounces"].reason
    assert effects(replace(ground, sky=(0, 0, 0.1)))["sky"].active
    glowing = replace(ground, surfaces=(Surface("glow", (0, 0, 0), (0, 1, 0)),))
    found = effects(glowing)
    assert found["emitting surfaces"].active
    assert not found["bounces"].active


def test_unused_materials_count_for_nothing(ground):
    """Neither their light nor their albedo."""
    scene = Scene(ground.objects, (Surface("black", (0, 0, 0)), Surface("glow", (1, 1, 1), (5, 5, 5))))
    found = effects(scene)
    assert not found["emitting surfaces"].active
    assert not found["bounces"].active


def test_the_number_of_bounces_that_matter(ground):
    """0.5 ** 9 is the first power of one half under 0.2 %, a tenth of the asked error: what the ninth would add."""
    assert "bounce 9 adds 0.20% in a closed room" in effects(ground)["bounces"].reason
    assert "bounce 4 adds 6.25%" in effects(ground, error=0.8)["bounces"].reason


def test_bounces_that_add_less_than_a_tenth_of_the_asked_error_are_left_out(ground):
    """At an albedo of 0.001 all of them add at most 0.001 / 0.999."""
    nearly_black = replace(ground, surfaces=(Surface("soot", (0.001, 0.001, 0.001)),))
    assert not effects(nearly_black)["bounces"].active
    assert effects(nearly_black, error=0.01)["bounces"].active


def test_every_light_and_what_rays_go_on_from_has_its_price(build):
    sky = np.full((16, 32, 3), 0.5, dtype=np.float32)
    sky[12, 5:7] = 50.0
    portal = Portal("window", (0, 0, -5), (0.3, 0, 0), (0, 0.3, 0), (0, 0, -1))
    floor, veil = build.quad("floor"), build.quad("veil", (0, 0, 1), surface=1, receives=False)
    surfaces = (build.grey, Surface("gauze", opacity=0.5))
    scene = Scene((floor, veil), surfaces, tuple(LAMPS.values()), sky=SkyMap(sky), portals=(portal,))
    costs = plan(scene, Settings()).costs
    assert {*LAMPS, "sky lights", "portals", "transparency", "bounces"} <= set(costs)
    assert min(costs.values()) > 0


def test_many_emitting_triangles_are_left_to_the_rays(build):
    few, many = build.box(surface=1), build.sphere(level=2, surface=1)
    surfaces = (build.grey, Surface("glow", emission=(1, 1, 1)))
    assert not plan(Scene((few,), surfaces), Settings()).effort.emitters_by_rays
    assert len(many.triangles) > MOST_PANELS
    assert plan(Scene((many,), surfaces), Settings()).effort.emitters_by_rays


def test_every_effect_has_a_reason(build):
    for effect in plan(build.furnished_room(), Settings()).effects:
        assert effect.reason
        assert effect.name


def test_nothing_looks_around_where_nothing_is_to_be_seen(ground):
    black = replace(ground, surfaces=(Surface("black", (0, 0, 0)),), lamps=(LAMPS["sun"],))
    planned = plan(black, Settings())
    assert not planned.looks_around
    assert not any(e.active for e in planned.effects if e.name in LOOKING)
    assert plan(replace(black, sky=COLOR), Settings()).looks_around
    assert plan(replace(black, surfaces=(Surface("grey", (0.1, 0, 0)),)), Settings()).looks_around


def test_effects_that_are_off_cast_no_ray(ground):
    black = replace(ground, surfaces=(Surface("black", (0, 0, 0)),), lamps=(LAMPS["point lamps"],))
    asked = Settings(triangles=50, error=0.08, threads=1, effects={"shadows": True})
    rays = bake(black, asked).report.rays
    assert rays.get("gather", 0) == rays.get("transport", 0) == 0
    assert rays["shadow"] > 0
    no_lamps = replace(ground, sky=COLOR)
    rays = bake(no_lamps, Settings(triangles=50, error=0.08, threads=1)).report.rays
    assert rays.get("shadow", 0) == 0
    assert rays["gather"] > 0


@pytest.mark.parametrize("asked", [{"triangles": 500}, {"triangles": 20_000}, {"size": 0.1}, {"size": 0.03}])
def test_the_predicted_cells_are_the_actual_ones_within_a_factor_of_two(build, asked):
    ball = build.sphere("ball", radius=0.3, level=2)
    scene = Scene((*build.furnished_room().objects, ball), (build.grey,) * 3)
    settings = Settings(**asked)
    actual = len(make_receivers(scene, unit_space(scene), settings, settings.triangles).cells)
    assert actual / 2 <= plan(scene, settings).cells <= actual * 2


def test_cost_is_positive_and_grows_with_what_is_asked(build):
    room = build.furnished_room()
    small, large = plan(room, Settings(triangles=500)), plan(room, Settings(triangles=200_000))
    assert small.seconds > 0
    assert 0 < small.memory_mb < large.memory_mb
    # Three hundred times the cells: whatever else runs on this machine meanwhile, it takes longer.
    assert small.seconds < large.seconds
    finer = plan(room, Settings(error=0.005))
    assert finer.effort.patches > plan(room, Settings(error=0.05)).effort.patches


def test_asked_seconds_are_what_the_plan_says_where_that_is_possible(build, monkeypatch):
    monkeypatch.setattr("radiosity_baker.core.plan.calibrate", lambda *_: Machine(3e-7, 5e-9, 1.0, 1))
    room = build.furnished_room()
    half = plan(room, Settings()).seconds / 2
    assert plan(room, Settings(error=None, seconds=half)).seconds == half
    hurried = plan(room, Settings(error=0.02, seconds=1e-6))
    assert hurried.seconds > 1e-6
    assert hurried.effort.triangles >= 1500


def test_less_time_makes_less_of_everything_but_what_the_mesh_has(build, monkeypatch):
    """A machine of a fixed speed, so that other programs have no say."""
    monkeypatch.setattr("radiosity_baker.core.plan.calibrate", lambda *_: Machine(3e-7, 5e-9, 1.0, 1))
    dense = Scene((build.sphere(level=5, inward=True),), (build.grey,), (LAMPS["point lamps"],))
    free, hurried = plan(dense, Settings()), plan(dense, Settings(error=None, seconds=0.7))
    assert free.seconds > 1.0
    assert hurried.seconds == 0.7
    for name in ("triangles", "patches", "transport_rays", "gather_rays", "boundary_passes"):
        assert getattr(hurried.effort, name) < getattr(free.effort, name)
    assert hurried.cells >= len(dense.objects[0].triangles)
    one, two = (plan(dense, Settings(error=None, seconds=s)).effort for s in (0.5, 0.7))
    assert one.gather_rays <= two.gather_rays


def test_rough_bakes_sample_kept_meshes_on_fewer_cells(build):
    """What is kept shows no more for being sampled more finely; what is new is as fine as was asked."""
    room = Scene((build.sphere(level=2, inward=True),), (build.grey,), (LAMPS["point lamps"],))

    def triangles(error: float, tessellate: bool) -> int:
        return choose_effort(room, Settings(triangles=20_000, error=error, tessellate=tessellate)).triangles

    assert [triangles(error, False) for error in (0.01, 0.02, 0.04, 0.16, 0.5)] == [
        20_000,
        20_000,
        10_000,
        2_500,
        1_500,
    ]
    assert triangles(0.2, True) == 20_000


def test_less_time_asks_fewer_of_many_lamps(build):
    """As many as are enough for a rough bake, and no more than there were."""
    effort = build.effort(lights=24)
    fewer = [thriftier(effort, steps).lights for steps in (1, 5, 24)]
    assert effort.lights > fewer[0] > fewer[1] >= fewer[2] == 4
    assert thriftier(replace(effort, lights=4), 24).lights == 4
    assert thriftier(replace(effort, lights=3), 24).lights == 3


def test_choices_among_many_lamps_are_foreseen(build, monkeypatch):
    """Within a factor of two of how often a bake asks which of them to ask. Seen to fail: choices that cost nothing."""
    room = build.furnished_room()
    lamps = [replace(LAMPS["point lamps"], name=f"Bulb {i}", position=(0.2 + 0.05 * i, 0.3, 1.6)) for i in range(30)]
    settings, made = Settings(error=0.05, triangles=3000), []
    choose_among = Crowd.choose

    def counted(crowd, points, *given):
        made.append(len(points) * len(lamps))
        return choose_among(crowd, points, *given)

    def foreseen(count):
        scene = replace(room, lamps=tuple(lamps[:count]))
        chosen = choose(scene, settings, Pilot(scene))
        prices = _Prices(chosen, settings, Pilot(scene), Machine(1e-7, 1e-8, 1.0, 1))
        return sum(work.choices for work in prices._works(prices.of(chosen.effort)).values())

    monkeypatch.setattr(Crowd, "choose", counted)
    bake(replace(room, lamps=tuple(lamps)), settings)
    assert sum(made) / 2 < foreseen(30) < sum(made) * 2
    assert foreseen(5) == 0.0


def test_who_asks_for_little_gets_few_patches(ground):
    asked = {0.2: 409, 0.1: 819, 0.05: 3276, 0.02: 8192, 0.01: 16_384, 0.001: 32_768}
    assert {error: choose_effort(ground, Settings(error=error)).patches for error in asked} == asked
    pairs = {0.2: 150, 0.1: 300, 0.02: 1500}
    assert {e: choose_effort(ground, Settings(error=e, estimator="centroid")).patches for e in pairs} == pairs


def test_light_that_has_bounced_calls_for_fewer_cells(build, monkeypatch):
    """In a white room nearly all light has bounced, and is smooth."""
    room, seconds = build.furnished_room(), {}
    for reflected in (0.0, 0.5, 0.75, 0.95):
        machine = Machine(3e-7, 1e-8, 1.0, 1, reflected=reflected)
        monkeypatch.setattr("radiosity_baker.core.plan.calibrate", lambda *_, machine=machine: machine)
        seconds[reflected] = plan(room, Settings(error=0.02)).seconds
    assert seconds[0.0] > seconds[0.5] > seconds[0.75] > seconds[0.95]


def test_harsh_light_calls_for_more_of_everything(build, monkeypatch):
    """Cells up to those allowed, patches, and cuts where shadows cross many cells."""
    room, seconds = build.furnished_room(), {}
    monkeypatch.setattr("radiosity_baker.core.plan.calibrate", lambda *_: Machine(3e-7, 1e-8, 1.0, 1, reflected=0.5))
    for harsh in (
        Contrast(0.1, 0.05),
        Contrast(0.1, 0.2),
        Contrast(1.0, 0.05),
        Contrast(1e3, 0.05),
        Contrast(1e4, 0.05),
    ):
        monkeypatch.setattr("radiosity_baker.core.plan.contrast", lambda *_, harsh=harsh: harsh)
        planned = plan(room, Settings(error=0.02))
        seconds[harsh] = planned.seconds, planned.memory_mb
    even, crossed, bright, brighter, brightest = seconds.values()
    assert even < crossed
    assert even < bright < brighter == brightest


def test_contrast_counts_beside_the_light_that_rays_find(build, monkeypatch):
    """Half of the rays meet the sky, of which a sun is asked for straight; and emitting surfaces that are too many."""
    told = []
    monkeypatch.setattr("radiosity_baker.core.plan.calibrate", lambda *_: Machine(3e-7, 1e-8, 0.5, 1))
    monkeypatch.setattr(
        "radiosity_baker.core.plan.contrast", lambda *given: told.append(given[3]) or Contrast(0.1, 0.05)
    )
    sunny = np.full((16, 32, 3), 0.25, dtype=np.float32)
    sunny[12, 5:7] = 500.0
    glow = Surface("glow", emission=(3.0,) * 3)
    ball = build.sphere(level=2, surface=1)
    ground = build.quad()
    plan(Scene((ground,), (build.grey,), sky=(0.5,) * 3), Settings())
    plan(Scene((ground,), (build.grey,), sky=SkyMap(sunny)), Settings())
    plan(Scene((ground, ball), (build.grey, glow)), Settings())
    area = [float(triangle_geometry(o.vertices[o.triangles])[1].sum()) for o in (ground, ball)]
    assert told == pytest.approx([0.25 * np.pi, 0.125 * np.pi, 3.0 * np.pi * area[1] / sum(area)], rel=0.02)


def test_pools_of_light_call_for_more_cells(build, monkeypatch):
    """Where they call for more than shadows do, and the less so the more light has bounced."""
    room, seconds = build.furnished_room(), {}
    for uneven, reflected in ((0.0, 0.5), (10.0, 0.5), (1000.0, 0.5), (1000.0, 0.75), (1e9, 0.5), (1e10, 0.5)):
        machine = Machine(3e-7, 1e-8, 1.0, 1, reflected=reflected)
        monkeypatch.setattr("radiosity_baker.core.plan.calibrate", lambda *_, machine=machine: machine)
        monkeypatch.setattr("radiosity_baker.core.plan.unevenness", lambda *_, uneven=uneven: uneven)
        seconds[uneven, reflected] = plan(room, Settings(error=0.05, triangles=50_000)).seconds
    assert seconds[0.0, 0.5] == seconds[10.0, 0.5] < seconds[1000.0, 0.75] < seconds[1000.0, 0.5] < seconds[1e9, 0.5]
    assert seconds[1e9, 0.5] == seconds[1e10, 0.5]


def test_pools_count_beside_all_other_light(build, monkeypatch):
    """As much as comes from emitting surfaces, and from the sky and suns where rays leave: half of them do."""
    told = []
    monkeypatch.setattr("radiosity_baker.core.plan.calibrate", lambda *_: Machine(3e-7, 1e-8, 0.5, 1))
    monkeypatch.setattr("radiosity_baker.core.plan.unevenness", lambda _pilot, _lamps, other: told.append(other) or 0.0)
    lamp, sun = PointLamp("lamp", (0, 0, 1), (1.0,) * 3), SunLamp("sun", (0, 0, -1), (2.0,) * 3)
    shining = replace(build.grey, emission=(3.0,) * 3)
    panel = replace(build.quad("panel", (-0.5, -0.5, 2), (0, 1, 0), (1, 0, 0)), surface=np.ones(2, dtype=np.int32))
    ground = build.quad()
    for scene in (
        Scene((ground,), (build.grey,), (lamp,)),
        Scene((ground,), (build.grey,), (lamp, sun), sky=(0.5,) * 3),
        Scene((ground, panel), (build.grey, shining), (lamp,)),
    ):
        plan(scene, Settings(error=0.02))
    area = [float(triangle_geometry(o.vertices[o.triangles])[1].sum()) for o in (ground, panel)]
    assert told == pytest.approx([0.0, 0.5 * (0.5 * np.pi + 2.0), 3.0 * np.pi * area[1] / sum(area)])


def test_a_smaller_error_costs_more_and_one_calibration_prices_them_all(build, monkeypatch):
    calls = []
    monkeypatch.setattr(
        "radiosity_baker.core.plan.calibrate", lambda *_: calls.append(1) or Machine(3e-7, 5e-9, 1.0, 1)
    )
    planned, prices = plan_with_prices(build.furnished_room(), Settings(error=None, seconds=5.0))
    assert len(calls) == 1
    assert planned.seconds <= 5.0
    seconds = [prices[error].seconds for error in sorted(prices, reverse=True)]
    assert seconds == sorted(seconds)
    assert seconds[-1] > 2 * seconds[0]
    assert prices[0.01].seconds == plan(build.furnished_room(), Settings(error=0.01)).seconds


def test_the_asked_estimator_is_used(build):
    room = build.furnished_room()
    assert plan(room, Settings()).effort.estimator == "hemisphere"
    for name in ("hemisphere", "analytic", "centroid"):
        assert plan(room, Settings(estimator=name)).effort.estimator == name


def test_planning_changes_nothing(build):
    room = build.furnished_room()
    before = [o.vertices.tobytes() for o in room.objects]
    first, second = plan(room, Settings()), plan(room, Settings())
    assert first.effects == second.effects
    assert first.effort == second.effort
    assert [o.vertices.tobytes() for o in room.objects] == before
    assert np.isfinite(first.seconds)


@pytest.mark.parametrize(("error", "rays"), [(0.1, 16), (0.05, 32), (0.02, 32), (0.014, 64), (0.001, 64)])
def test_small_scenes_have_rays_while_they_cost_next_to_nothing(error, rays):
    assert gather_rays(error) == rays


@pytest.mark.parametrize(("cells", "rays"), [(300, 128), (3_000, 64), (12_000, 32), (200_000, 32)])
def test_points_on_few_cells_look_around_with_more_rays(build, cells, rays):
    effort = build.effort(gather_rays=32)
    assert effort.rays_of_point(cells) == rays
    assert replace(effort, gather_rays=256).rays_of_point(300) == 256


@pytest.mark.parametrize(("error", "rays"), [(0.05, 4), (0.02, 8), (0.01, 32), (0.005, 64)])
def test_noise_falls_with_the_root_of_the_rays(error, rays):
    """In large scenes half the error takes four times as many; more than the most are passes."""
    assert gather_rays(error, 200_000) == rays


def finely_modelled(scene, edge):
    """The same shapes of many more triangles of their own."""
    objects = []
    for o in scene.objects:
        fine = triform(whole(o.vertices, o.triangles), edge)
        objects.append(replace(o, vertices=fine.vertices, triangles=fine.triangles, surface=o.surface[fine.parent]))
    return replace(scene, objects=tuple(objects))


def test_the_predicted_memory_is_what_large_meshes_take_within_half_as_much_again(build):
    scene = finely_modelled(build.furnished_room(), 0.06)
    asked = Settings(tessellate=False, triangles=sum(len(o.triangles) for o in scene.objects), error=0.1, threads=2)
    foreseen = plan(scene, asked).memory_mb
    tracemalloc.start(1)
    try:
        bake(scene, asked)
        held = tracemalloc.get_traced_memory()[1] / 1e6
    finally:
        tracemalloc.stop()
    # Embree's own is not among it, and neither is what lies about between arrays: that is no more than a third.
    assert 2 / 3 * held < foreseen < 1.5 * 4 / 3 * held


def test_few_triangles_take_few_passes_where_light_calls_for_no_more(build, monkeypatch):
    scene, asked = build.furnished_room(0.9), Settings(triangles=12_000, error=0.05, threads=2)
    passes: list[int] = []
    run_pass = Survey.run_pass
    monkeypatch.setattr(Survey, "run_pass", lambda self: passes.append(self.passes) or run_pass(self))
    cells = sum(len(o.triangles) for o in bake(scene, asked).objects)
    # Those of the last survey, since it began anew.
    taken = passes[::-1].index(0) + 1
    chosen = choose(scene, asked, Pilot(scene))
    prices = _Prices(chosen, asked, Pilot(scene), Machine(1e-7, 1e-8, 1.0, 2, reflected=0.8))
    assert taken <= prices._passes(chosen.effort, cells) <= 2 * taken


def test_a_fine_mesh_is_looked_at_once(build, monkeypatch):
    scene = finely_modelled(build.furnished_room(), 0.2)
    asked = Settings(triangles=1500, error=0.1, threads=2)
    cut: list[int] = []
    cut_receivers = Contours.cut
    monkeypatch.setattr(
        Contours, "cut", lambda self, r, *more: cut.append(len(r.cells)) or cut_receivers(self, r, *more)
    )
    bake(scene, asked)
    assert 0.5 < sum(work.contours for work in works_of(scene, asked)) / sum(cut) < 2.0


def works_of(scene, asked):
    """What the plan foresees."""
    chosen, machine = choose(scene, asked, Pilot(scene)), Machine(1e-7, 1e-8, 1.0, 2, reflected=0.5)
    prices = _Prices(chosen, asked, Pilot(scene), machine)
    return prices._works(prices.of(chosen.effort)).values()
