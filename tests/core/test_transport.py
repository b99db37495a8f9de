"""Light between patches: closed furnaces, the ledger of energy, backs, and the insides of solids."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest

from radiosity_baker.core import surroundings
from radiosity_baker.core.direct.emitters import emitting_panels
from radiosity_baker.core.direct.illumination import DirectLight
from radiosity_baker.core.direct.lamps import place
from radiosity_baker.core.form_factors.sides import SITES
from radiosity_baker.core.hemisphere import Codes
from radiosity_baker.core.parallel import Workers
from radiosity_baker.core.patches import unit_space
from radiosity_baker.core.plan import plan
from radiosity_baker.core.progress import Progress
from radiosity_baker.core.scene import PointLamp, Scene, SunLamp, Surface
from radiosity_baker.core.settings import Settings
from radiosity_baker.core.sky import DARK
from radiosity_baker.core.transport import make_transport, solve_halves
from radiosity_baker.core.visibility import Visibility


def lit(transport, scene, **changes):
    """The scene solved with its lamps and panels."""
    space = unit_space(scene)
    lights = [place(lamp, space) for lamp in scene.lamps] + emitting_panels(scene, space)
    return transport(scene, lights, **changes)


@pytest.mark.parametrize("by_rays", [True, False])
@pytest.mark.parametrize("albedo", [0.5, 0.9, 0.99])
@pytest.mark.parametrize(("estimator", "patches"), [("hemisphere", 500), ("analytic", 100)])
def test_a_furnace_has_the_radiosity_of_its_series(build, transport, estimator, patches, albedo, by_rays):
    """E + p E + p^2 E ... = E / (1 - p) everywhere in a closed cube, to 1e-3, in under 50 iterations."""
    surface = Surface("glowing", (albedo, albedo, albedo), (1.0, 2.0, 4.0))
    scene = Scene((build.box(inward=True),), (surface,))
    space = unit_space(scene)
    lights = () if by_rays else emitting_panels(scene, space)
    solved = transport(scene, lights, estimator=estimator, patches=patches, emitters_by_rays=by_rays)
    emitted = np.pi * np.array(surface.emission)
    radiosity = emitted + solved.reflected
    assert radiosity == pytest.approx(np.tile(emitted / (1 - albedo), (len(radiosity), 1)), rel=1e-3)
    assert solved.solution.iterations < 50


@pytest.mark.parametrize("estimator", ["hemisphere", "analytic"])
def test_a_closed_room_absorbs_all_that_is_emitted(transport, build, estimator):
    """The ledger closes to what the solve left, which is at most its tolerance of the largest irradiance anywhere."""
    tolerance = 1e-4
    solved = lit(transport, build.furnished_room(), estimator=estimator, patches=300, tolerance=tolerance)
    ledger = solved.energy()
    assert ledger["escaped"] == 0
    assert ledger["emitted"] == pytest.approx(ledger["absorbed"] + ledger["residual"])
    area = solved.sides.area.sum() * solved.sides.patches.space.metres**2
    assert abs(ledger["residual"]) <= 2 * (tolerance + 1e-6) * area * solved.solution.irradiance.max()


@pytest.mark.parametrize("estimator", ["hemisphere", "analytic"])
def test_open_ground_sends_what_it_reflects_to_the_sky(build, transport, estimator):
    """Sun of irradiance E on an area A: emitted E A, absorbed (1 - p) E A, escaped p E A."""
    ground = build.quad("ground", (0, 0, 0), (3, 0, 0), (0, 2, 0))
    scene = Scene((ground,), (Surface("s", (0.25, 0.25, 0.25)),), (SunLamp("sun", (0, 0, -1), (5.0, 5.0, 5.0)),))
    ledger = lit(transport, scene, estimator=estimator, patches=100).energy()
    expected = {"emitted": 30.0, "absorbed": 22.5, "escaped": 7.5, "residual": 0.0}
    assert ledger == pytest.approx(expected, abs=1e-9)


def test_the_sky_arrives_where_it_is_seen(build, transport):
    scene = Scene((build.quad(),), (build.grey,), sky=(1.0, 2.0, 3.0))
    solved = transport(scene, patches=50)
    assert solved.escape == pytest.approx(1.0)
    assert solved.incoming == pytest.approx(np.tile(np.pi * np.array(scene.sky), (len(solved.incoming), 1)))


def test_light_in_a_sphere_spreads_evenly_after_one_bounce(build, transport):
    """F_ij = A_j / A, so whatever the lamp lights first, what comes back is p P / (A (1 - p)) everywhere.

    A row of N = 1024 rays finds the mean of the light with the standard deviation s / sqrt(N), where s is that of the
    first light over the surface; its balance with its neighbours only helps. Flat patches make the sphere's row of one
    in 2000 uneven, and its radius smaller by one in 500.
    """
    albedo, radius = 0.5, 2.0
    scene = Scene(
        (build.sphere(radius=radius, level=4, inward=True),),
        (Surface("s", (albedo,) * 3),),
        (PointLamp("lamp", (1.0, 0, 0), (10.0, 10.0, 10.0)),),
    )
    solved = lit(transport, scene, patches=2000, transport_rays=1024)
    power, area = 4 * np.pi * 10, 4 * np.pi * radius**2
    assert solved.energy()["emitted"] == pytest.approx(power, rel=0.01)
    back = (solved.solution.irradiance - solved.incoming)[:, 0]
    even = albedo * power / (area * (1 - albedo))
    weight = solved.sides.area / solved.sides.area.sum()
    assert weight @ back == pytest.approx(even, rel=0.01)
    spread = np.sqrt(weight @ (solved.incoming[:, 0] - weight @ solved.incoming[:, 0]) ** 2)
    noise = albedo * spread / np.sqrt(1024)
    assert np.sqrt(weight @ (back - weight @ back) ** 2) <= noise + 0.004 * even


def test_a_plane_reflects_and_receives_from_both_sides(build, transport):
    """A lamp between ground and ceiling: which way the ceiling's normals face makes no difference."""
    ground = build.quad("ground", (-1, -1, 0), (2, 0, 0), (0, 2, 0))
    lamp = PointLamp("lamp", (0, 0, 0.5), (1.0, 1.0, 1.0))
    ledgers = []
    for u, v in (((2, 0, 0), (0, 2, 0)), ((0, 2, 0), (2, 0, 0))):
        ceiling = build.quad("ceiling", (-1, -1, 1), u, v)
        ledgers.append(lit(transport, Scene((ground, ceiling), (build.grey,), (lamp,)), transport_rays=512).energy())
    shows_back, shows_front = ledgers
    assert shows_back["emitted"] == pytest.approx(shows_front["emitted"], rel=0.01)
    # Counting hits with 512 rays of each of hundreds of patches: shares of the whole are good to 1 %.
    for name in ("absorbed", "escaped"):
        assert shows_back[name] == pytest.approx(shows_front[name], rel=0.01)
    # Each bounce between the two parallel squares keeps p F = 0.5 * 0.415253 of the light, as the catalogue has it.
    assert shows_front["escaped"] > 0.25 * shows_front["emitted"]


def test_two_shadow_rays_from_each_point_of_a_side_are_enough(build, transport):
    """Its other points find what those miss: the light of all sides is that of four rays each, to four deviations of as
    many coins as there are points, which it would be if all lay in half shadow."""
    ground = build.quad("ground", (-2, -2, 0), (4, 0, 0), (0, 4, 0))
    block = build.box("block", (-0.63, -0.41, 0), (0.5, 0.47, 1.2), surface=0)
    lamp = SunLamp("sun", (0.3, 0.2, -0.9), (3.0, 3.0, 3.0), 0.2)
    scene = Scene((ground, block), (build.grey,), (lamp,))
    few, many = (lit(transport, scene, patches=1500, shadow_rays=count) for count in (4, 16))
    assert 0 < few.rays["shadow"] <= 2 * SITES * len(few.sides.side)
    mean = [solved.sides.area @ solved.incoming[:, 0] for solved in (few, many)]
    assert mean[0] == pytest.approx(mean[1], rel=4 * 0.5 / np.sqrt(SITES * len(few.sides.side)))


@pytest.mark.parametrize("seed", range(4))
def test_the_inside_of_a_solid_on_the_ground_stays_dark(build, transport, seed):
    ground = build.quad("ground", (-2, -2, 0), (4, 0, 0), (0, 4, 0))
    block = build.box("block", (-0.63, -0.41, 0), (0.5, 0.47, 1.2), surface=1)
    surfaces = (build.grey, Surface("block", (0.8, 0.8, 0.8)))
    scene = Scene((ground, block), surfaces, (SunLamp("sun", (0.3, 0.2, -0.9), (3.0, 3.0, 3.0)),), (1.0, 1.0, 1.0))
    solved = lit(transport, scene, patches=1500, seed=seed, cut=True)
    inside = solved.sides.back & np.isclose(solved.sides.albedo[:, 0], 0.8)
    outside = ~solved.sides.back & np.isclose(solved.sides.albedo[:, 0], 0.8)
    assert inside.any()
    assert solved.solution.irradiance[outside].mean() > 1
    leaked, usual = solved.solution.irradiance[inside], solved.solution.irradiance[outside].mean()
    assert leaked.max() <= surroundings._DARK / 5 * usual, "so that no point in there is taken for lit"
    assert leaked.mean() <= 1e-3 * usual


def test_the_open_part_of_the_ground_is_what_takes_part(build, transport):
    """Of the 16 m^2 all but the block's footprint, and that of patches that lie under it whole."""
    ground = build.quad("ground", (-2, -2, 0), (4, 0, 0), (0, 4, 0))
    block = build.box("block", (-0.63, -0.41, 0), (0.5, 0.47, 1.2), surface=1)
    surfaces = (build.grey, Surface("block", (0.8, 0.8, 0.8)))
    solved = transport(Scene((ground, block), surfaces, sky=(1.0, 1.0, 1.0)), patches=3000)
    seen = np.isclose(solved.sides.albedo[:, 0], 0.5) & (solved.escape[:, 0] > 0)
    metres = solved.sides.patches.space.metres
    straddling = (solved.sides.open_share < 1) & seen
    # Each straddling patch's open share is one of four points': off by at most a half, evenly.
    slack = 4 * np.sqrt(np.sum((0.5 * solved.sides.patches.patch_area[solved.sides.patch[straddling]]) ** 2))
    assert straddling.any()
    assert solved.sides.area[seen].sum() * metres**2 == pytest.approx(16 - 1.13 * 0.88, abs=slack * metres**2)


def test_a_patch_under_a_step_has_the_light_of_what_shows_of_it(build, transport):
    """Two steps that touch cover the ground from y = 0.07 on. What is left lies in the sun, and no light is lost but
    where a part is too small to be found: of parts of all sizes 2 / (37 * 38) of the area is missed by 36 points."""
    front = 0.07
    ground = build.quad("ground", (-1.3, -2.5, 0), (3.8, 1.2, 0), (-1.2, 3.8, 0))
    steps = [
        build.box("low", (-3, front, 0), (3, 0.5, 0.2), surface=1),
        build.box("high", (-3, 0.5, 0), (3, 3, 0.4), surface=1),
    ]
    sun = SunLamp("sun", (0, 0.6, -0.8), (1.0, 1.0, 1.0))
    scene = Scene((ground, *steps), (build.grey, Surface("black", (0.0,) * 3)), (sun,))
    solved = lit(transport, scene, patches=10000, transport_rays=64)
    sides, patches = solved.sides, solved.sides.patches
    corners = patches.space.metres * patches.corners + patches.space.center
    weights = np.random.default_rng(0).dirichlet(np.ones(3), 1000)
    bare = np.zeros(len(patches))
    bare[patches.patch] = (weights @ corners[:, :, 1, None] < front).mean(axis=(1, 2))
    of_ground = ~sides.back & np.isclose(sides.albedo[:, 0], 0.5)
    straddling = of_ground & (bare > 0)[sides.patch] & (bare < 1)[sides.patch]
    shows = (bare * patches.patch_area)[sides.patch[straddling]]
    assert np.count_nonzero(straddling) > 40
    assert shows @ solved.incoming[straddling, 0] == pytest.approx(0.8 * shows.sum(), rel=0.02)
    found = sides.area[straddling & (solved.incoming[:, 0] > 0)]
    assert found.sum() == pytest.approx(shows.sum(), rel=0.1)


def test_tables_hold_the_light_of_the_side_that_a_ray_meets(build, transport):
    """Over ground and a ceiling that shows its back to it and to the lamp between them."""
    ground = build.quad("ground", (-1, -1, 0), (2, 0, 0), (0, 2, 0))
    ceiling = build.quad("ceiling", (-1, -1, 1), (2, 0, 0), (0, 2, 0), surface=1)
    lamp = PointLamp("lamp", (0, 0, 0.5), (1.0, 1.0, 1.0))
    scene = Scene((ground, ceiling), (build.grey, Surface("other", (0.3, 0.3, 0.3))), (lamp,))
    solved = lit(transport, scene, patches=100)
    patches = solved.sides.patches
    codes = Codes(len(patches))
    table = solved.by_code(solved.reflected)
    assert table.shape == (2 * len(patches) + 1, 3)
    row_of = {int(side): row for row, side in enumerate(solved.sides.side)}
    for side in range(codes.lost):
        expected = solved.reflected[row_of[side]] if side in row_of else np.zeros(3)
        assert table[side] == pytest.approx(expected, rel=1e-6)
    above = np.isclose(patches.albedo[:, 0], 0.3)
    fronts, backs = table[: codes.patches], table[codes.patches : codes.lost]
    assert backs[above].min() > fronts[above].max()
    assert backs[~above].max() == 0, "nothing reaches under the ground"
    assert (table[codes.lost] == 0).all()


def test_coarser_patches_keep_constants_and_means(build, transport):
    solved = lit(transport, build.furnished_room(), patches=800)
    values = solved.reflected
    coarse = solved.over_coarser_patches(values)
    assert solved.sides.area @ coarse == pytest.approx(solved.sides.area @ values)
    assert solved.over_coarser_patches(np.ones_like(values)) == pytest.approx(1.0)
    assert len(np.unique(coarse[:, 0])) < len(np.unique(values[:, 0])) / 2


def test_halves_are_independent_answers_to_one_question(build, workers):
    scene = build.furnished_room()
    space = unit_space(scene)
    patches = build.patches(scene, 500)
    visibility = Visibility(patches.corners)
    light = DirectLight([place(lamp, space) for lamp in scene.lamps], visibility, 0)
    planned = plan(scene, Settings(error=0.08))
    one, two = solve_halves(patches, visibility, light, DARK, planned, workers, 0)
    assert one.solution.irradiance.tobytes() != two.solution.irradiance.tobytes()
    assert one.energy()["absorbed"] == pytest.approx(two.energy()["absorbed"], rel=0.03)
    black = Scene(scene.objects, (Surface("black", (0, 0, 0)),) * 3, scene.lamps)
    assert solve_halves(patches, visibility, light, DARK, plan(black, Settings()), workers, 0) == ()


def test_what_one_half_alone_has_met_is_no_hole_in_the_other(build, workers):
    """Of the insides of two boxes that run through each other few rays find other parts than as many others do, and a
    receiver's rays may meet any of them."""
    one = build.box("one", (-0.5, 0.0, 0.0), (0.2, 0.5, 0.5))
    two = build.box("two", (-0.1, 0.2, -0.3), (0.5, 0.4, 0.3))
    room = build.box("room", (-1, -1, -1), (1, 1, 1), inward=True)
    lamp = PointLamp("bulb", (0.0, -0.5, 0.0), (1.0, 1.0, 1.0))
    shown = Scene((one, two, room), (build.grey,), (lamp,))
    patches = build.patches(shown, 1000)
    visibility = Visibility(patches.corners)
    light = DirectLight([place(lamp, unit_space(shown)) for lamp in shown.lamps], visibility, 0)
    planned = plan(shown, Settings())
    planned = replace(planned, effort=replace(planned.effort, transport_rays=4))
    halves = solve_halves(patches, visibility, light, DARK, planned, workers, 0)
    around = surroundings.look_up(patches, visibility, halves, DARK, planned.effort, 0)
    alone = [np.setdiff1d(*sides) for sides in permutations([half.sides.side for half in halves])]
    assert all(len(some) for some in alone)
    for some in alone:
        assert np.array_equal(around.tables[0][some, :3], around.tables[1][some, :3])
        assert not around.lit[some].any(), "for nobody knows"


@pytest.mark.parametrize("estimator", ["hemisphere", "analytic", "centroid"])
def test_threads_do_not_change_a_byte(build, estimator):
    scene = build.furnished_room()
    patches = build.patches(scene, 200)
    visibility = Visibility(patches.corners)
    light = DirectLight([place(lamp, unit_space(scene)) for lamp in scene.lamps], visibility, 0)
    found = []
    for threads in (1, 2):
        with Workers(threads, Progress()) as workers:
            effort = build.effort(estimator=estimator)
            solved = make_transport(patches, visibility, light, DARK, effort, workers, seed=0, purpose="threads")
        found.append(solved.solution.irradiance.tobytes())
    assert found[0] == found[1]
