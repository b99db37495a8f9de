"""The whole bake against closed forms, and what every bake promises."""

from __future__ import annotations

import threading
from dataclasses import replace

import numpy as np
import pytest

from radiosity_baker.core import baked as core_baked
from radiosity_baker.core.bake import bake
from radiosity_baker.core.patches import triangle_geometry
from radiosity_baker.core.progress import Cancelled, Progress
from radiosity_baker.core.scene import ALBEDO_LIMIT, AreaLamp, PointLamp, Scene, SceneObject, SunLamp, Surface
from radiosity_baker.core.settings import LAYERS, Settings
from radiosity_baker.core.tessellation import triform, whole

WHITE = Surface("white", (0.5, 0.5, 0.5))
SKY = (1.0, 2.0, 3.0)


def preview(scene, progress=None, **asked):
    """A quick bake with every layer."""
    settings = Settings(**({"triangles": 800, "error": 0.08, "threads": 2, "layers": tuple(LAYERS)} | asked))
    return bake(scene, settings, progress)


def corners(baked) -> np.ndarray:
    """(t, 3, 3) metres."""
    return baked.vertices[baked.triangles]


def values(result, layer="combined") -> np.ndarray:
    """(n, 3) of all objects and corners."""
    return np.concatenate([o.layers[layer].reshape(-1, 3) for o in result.objects])


@pytest.fixture(scope="module")
def room(build):
    return build.furnished_room()


@pytest.fixture(scope="module")
def baked_room(room):
    return preview(room)


@pytest.fixture(scope="module")
def terrace(build):
    """A block on open ground, under sun and sky."""
    surfaces = (WHITE, Surface("blue", (0.1, 0.2, 0.8), (0.0, 0.05, 0.1)))
    ground = build.quad("ground", (-2, -2, 0), (4, 0, 0), (0, 4, 0))
    block = build.box("block", (-0.5, -0.5, 0), (0.5, 0.5, 1.2), surface=1)
    sun = SunLamp("sun", (0.6, 0, -0.8), (3.0, 3.0, 2.0), 0.05)
    return Scene((ground, block), surfaces, (sun,), SKY)


@pytest.fixture(scope="module")
def baked_terrace(terrace):
    return preview(terrace)


@pytest.mark.parametrize("estimator", ["hemisphere", "analytic"])
@pytest.mark.parametrize("albedo", [0.5, 0.9, 0.99])
def test_in_a_furnace_all_is_equally_bright(build, albedo, estimator):
    """Every surface emits e in a closed room: radiance e / (1 - p) at every corner, to 1e-3."""
    surface = Surface("glowing", (albedo, albedo, albedo), (1.0, 2.0, 0.0))
    result = preview(Scene((build.box(inward=True),), (surface,)), estimator=estimator, triangles=200)
    expected = np.array(surface.emission) / (1 - albedo)
    assert values(result) == pytest.approx(np.tile(expected, (len(values(result)), 1)), rel=1e-3)


def test_a_furnace_of_many_emitters_too(build):
    """More than are sampled as lamps, so that rays find them."""
    surface = Surface("glowing", (0.9, 0.9, 0.9), (1.0, 2.0, 0.0))
    result = preview(finely(Scene((build.box(inward=True),), (surface,)), 0.4), triangles=200)
    assert values(result) == pytest.approx(np.tile([10.0, 20.0, 0.0], (len(values(result)), 1)), rel=1e-3)


def test_open_ground_reflects_the_sky(build):
    result = preview(Scene((build.quad(),), (WHITE,), sky=SKY), triangles=50)
    assert values(result) == pytest.approx(np.tile(0.5 * np.array(SKY), (len(values(result)), 1)), rel=1e-6)
    assert values(result, "indirect").max() == 0


def test_the_sun_shines_on_open_ground(build):
    lean = np.array([0.6, 0, -0.8])
    for angle in (0.0, 0.1):
        sun = SunLamp("sun", tuple(lean), (3.0, 2.0, 1.0), angle)
        result = preview(Scene((build.quad(),), (WHITE,), (sun,)), triangles=50)
        expected = 0.5 / np.pi * 0.8 * np.array(sun.irradiance)
        assert values(result) == pytest.approx(np.tile(expected, (len(values(result)), 1)), rel=1e-6)


def test_a_lamp_over_the_ground_obeys_the_inverse_square(build):
    """I cos / d^2 at every corner; from ten floors up it bends so little that linear elements show it."""
    lamp = PointLamp("lamp", (0.5, 0.5, 10.0), (10.0, 20.0, 30.0))
    result = preview(Scene((build.quad(),), (WHITE,), (lamp,)), size=0.1)
    way = np.array(lamp.position) - corners(result.objects[0])
    distance = np.linalg.norm(way, axis=2, keepdims=True)
    expected = 0.5 / np.pi * np.array(lamp.intensity) * way[..., 2:] / distance**3
    assert result.objects[0].layers["combined"] == pytest.approx(expected, rel=1e-3)


def test_a_wall_hides_its_part_of_the_sky(build):
    """Beside a long black wall of height H: open sky (1 + 1 / sqrt(1 + (H / d)^2)) / 2, field notes section 2.

    Averaged over at least 20 vertices at like distance, of 4 passes of 32 stratified rays in 6 cells each: a standard
    deviation of at most sqrt(0.25 * 0.75 / (20 * 32 * 4)) = 0.9 %, with all cells counted once.
    """
    black = Surface("black", (0.0, 0.0, 0.0))
    wall = build.quad("wall", (0, -60, 0), (0, 120, 0), (0, 0, 1), surface=1, receives=False)
    ground = build.quad("ground", (0, -1, 0), (2, 0, 0), (0, 2, 0))
    result = preview(Scene((ground, wall), (WHITE, black), sky=(1, 1, 1)), size=0.09)
    open_sky = result.objects[0].layers["sky"][..., 0].ravel() / 0.5
    distance = corners(result.objects[0])[..., 0].ravel()
    expected = (1 + 1 / np.sqrt(1 + 1 / np.maximum(distance, 1e-9) ** 2)) / 2
    assert values(result, "indirect").max() == 0
    for near in np.arange(0.1, 1.9, 0.2):
        ring = (distance >= near) & (distance < near + 0.2)
        assert np.count_nonzero(ring) >= 20 * 6
        assert open_sky[ring].mean() == pytest.approx(expected[ring].mean(), abs=4 * 0.009)
    assert open_sky.mean() == pytest.approx(expected.mean(), abs=0.009)


def test_there_is_no_black_ring_around_what_stands_on_the_ground(build):
    """Beside a convex block at least half of the sky is open, everywhere on the ground outside it."""
    ground = build.quad("ground", (-2, -2, 0), (4, 0, 0), (0, 4, 0))
    block = build.box("block", (-0.63, -0.41, 0), (0.5, 0.47, 1.2), receives=False)
    result = preview(Scene((ground, block), (WHITE,), sky=(1, 1, 1)), triangles=1500)
    x, y, _ = np.moveaxis(corners(result.objects[0]), 2, 0).reshape(3, -1)
    outside = (x < -0.63) | (x > 0.5) | (y < -0.41) | (y > 0.47)
    open_sky = result.objects[0].layers["sky"][..., 0].ravel() / 0.5
    # 4 passes of 32 rays in each of some 3 cells around a vertex: 4 standard deviations of a half are 0.1.
    assert open_sky[outside].min() >= 0.5 - 4 * np.sqrt(0.25 / (3 * 128))


def test_a_closed_room_stays_dark_under_a_bright_sky(build):
    result = preview(Scene((build.box(inward=True),), (WHITE,), sky=(1e6, 1e6, 1e6)), triangles=300)
    assert values(result).max() == 0


def test_layers_add_up(baked_terrace, baked_room):
    for result in (baked_terrace, baked_room):
        total = values(result, "emission") + values(result, "direct") + values(result, "indirect")
        assert values(result) == pytest.approx(total, rel=1e-5, abs=1e-7)
        assert (values(result, "sky") <= values(result, "direct") * (1 + 1e-5) + 1e-7).all()
        assert values(result, "indirect").max() > 0
    assert values(baked_room, "sky").max() == 0
    assert values(baked_terrace, "sky").max() > 0


def test_the_light_layer_is_the_reflected_light_without_its_colour(terrace, baked_terrace):
    by_name = {o.name: o for o in terrace.objects}
    for baked in baked_terrace.objects:
        surface = by_name[baked.name].surface[baked.parent]
        albedo = np.array([s.albedo for s in terrace.surfaces])[surface][:, None]
        emission = np.array([s.emission for s in terrace.surfaces])[surface][:, None]
        assert baked.layers["emission"] == pytest.approx(np.broadcast_to(emission, baked.layers["emission"].shape))
        reflected = baked.layers["combined"] - emission
        assert albedo * baked.layers["light"] == pytest.approx(reflected, rel=1e-5, abs=1e-6)


def test_only_asked_layers_are_made(build):
    result = preview(Scene((build.quad(),), (WHITE,), sky=SKY), triangles=10, layers=("light",))
    assert list(result.objects[0].layers) == ["light"]


def test_nothing_is_negative_or_not_a_number(baked_terrace, baked_room):
    for result in (baked_terrace, baked_room):
        for layer in LAYERS:
            assert np.isfinite(values(result, layer)).all()
            assert values(result, layer).min() >= 0


def test_colour_bleeds_from_the_walls(baked_room):
    """Beside the red wall the white floor receives more red than green, beside the green wall more green than red."""
    baked = next(o for o in baked_room.objects if o.name == "room")
    x, _, z = np.moveaxis(corners(baked), 2, 0)
    floor = (z < 1e-9).all(axis=1)
    indirect = baked.layers["indirect"]
    lamp = np.array([10.0, 9.0, 8.0])
    for near, more, less in ((x < -0.8, 0, 1), (x > 0.8, 1, 0)):
        light = indirect[near & floor[:, None]].mean(axis=0) / lamp
        assert light[more] > 1.2 * light[less]


@pytest.mark.parametrize("scene", ["room", "terrace"])
def test_threads_do_not_change_a_byte(scene, request):
    one = preview(request.getfixturevalue(scene), threads=1)
    two = request.getfixturevalue(f"baked_{scene}")
    for a, b in zip(one.objects, two.objects, strict=True):
        assert a.vertices.tobytes() == b.vertices.tobytes()
        assert a.triangles.tobytes() == b.triangles.tobytes()
        assert all(a.layers[name].tobytes() == b.layers[name].tobytes() for name in LAYERS)
    assert one.report.estimated_error == two.report.estimated_error
    assert one.report.rays == two.report.rays


def test_another_seed_gives_other_noise_and_the_same_light(room, baked_room):
    other = preview(room, seed=1)
    assert values(other).tobytes() != values(baked_room).tobytes()
    assert mean_radiance(other) == pytest.approx(mean_radiance(baked_room), rel=0.02)


def mean_radiance(result) -> float:
    area = np.concatenate([triangle_geometry(corners(o))[1] for o in result.objects])
    light = np.concatenate([o.layers["combined"].mean(axis=(1, 2)) for o in result.objects])
    return float(area @ light / area.sum())


def test_the_order_of_objects_does_not_matter(terrace, baked_terrace):
    turned = preview(replace(terrace, objects=terrace.objects[::-1]))
    ours = {o.name: o.layers["combined"] for o in baked_terrace.objects}
    for baked in turned.objects:
        assert baked.layers["combined"] == pytest.approx(ours[baked.name], rel=1e-5)


def moved(scene: Scene, scale: float, offset: float) -> Scene:
    """The same scene, larger and elsewhere: with lamps of the same radiance, it looks the same."""

    def there(point):
        return tuple(np.array(point) * scale + offset)

    def lamp_there(lamp):
        match lamp:
            case AreaLamp():
                half_u, half_v = (tuple(np.array(half) * scale) for half in (lamp.half_u, lamp.half_v))
                return replace(lamp, center=there(lamp.center), half_u=half_u, half_v=half_v)
            case PointLamp():
                intensity = tuple(np.array(lamp.intensity) * scale**2)
                return replace(lamp, position=there(lamp.position), radius=lamp.radius * scale, intensity=intensity)
        return lamp

    objects = tuple(replace(o, vertices=o.vertices * scale + offset) for o in scene.objects)
    return replace(scene, objects=objects, lamps=tuple(map(lamp_there, scene.lamps)))


@pytest.mark.parametrize(("scale", "offset"), [(1e-4, 0.0), (1e5, 0.0), (1.0, 2e5)])
def test_neither_scale_nor_place_matter(room, scale, offset):
    """To 1e-3 of the brightest, at the corners of the input."""
    lamp = PointLamp("ball", (0.5, 0.5, 1.0), (1.0, 1.0, 1.0), radius=0.05)
    scene = replace(room, lamps=(*room.lamps, lamp))
    here = values(preview(scene, tessellate=False))
    there = values(preview(moved(scene, scale, offset), tessellate=False))
    assert there == pytest.approx(here, abs=1e-3 * float(here.max()))


def test_a_scene_too_far_away_is_baked_with_a_warning(build):
    far = moved(Scene((build.quad(),), (WHITE,), sky=SKY), 1.0, 1e6)
    result = preview(far, triangles=10)
    assert any("away from the origin" in warning for warning in result.report.warnings)
    assert np.isfinite(values(result)).all()


def test_without_light_all_is_black_and_no_ray_is_cast(build, room):
    for scene in (replace(room, lamps=()), Scene((build.quad(),), (WHITE,))):
        result = preview(scene)
        assert values(result).max() == 0
        assert result.report.estimated_error["total"] == 0


def test_black_surfaces_reflect_nothing_but_are_lit(room):
    black = tuple(replace(s, albedo=(0.0, 0.0, 0.0)) for s in room.surfaces)
    result = preview(replace(room, surfaces=black))
    assert values(result).max() == 0
    assert values(result, "light").max() > 0
    bounces = next(e for e in result.report.effects if e.name == "bounces")
    assert not bounces.active


def test_a_channel_without_light_is_exactly_black(room):
    lamp = replace(room.lamps[0], radiance=(10.0, 0.0, 1.0))
    result = preview(replace(room, lamps=(lamp,)))
    assert values(result)[:, 1].max() == 0
    assert values(result)[:, 2].max() > 0


@pytest.mark.parametrize("tessellate", [True, False])
@pytest.mark.parametrize(
    ("vertices", "faces"),
    [
        pytest.param([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)], id="a single triangle"),
        pytest.param([(0, 0, 0), (1, 0, 0), (0, 1, 0), (2, 0, 0)], [(0, 1, 2), (0, 1, 3), (1, 1, 2)], id="no area"),
        pytest.param([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2), (0, 1, 2), (2, 1, 0)], id="duplicates"),
        pytest.param([(0, 0, 0), (1, 0, 0), (1, 1e-6, 0), (0, 1, 0)], [(0, 1, 2), (0, 2, 3)], id="needle"),
        pytest.param([(0, 0, 0), (1, 0, 0), (0, 1, 0), (9, 9, 9)], [(0, 1, 2)], id="loose vertex"),
        pytest.param(
            [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], [(0, 1, 2), (1, 0, 3), (0, 1, 2)], id="three on an edge"
        ),
    ],
)
def test_degenerate_meshes_bake(build, vertices, faces, tessellate):
    mesh = build.triangles("odd", vertices, faces)
    lamp = PointLamp("lamp", (0.2, 0.2, 2.0), (10.0, 10.0, 10.0), 0.1)
    result = preview(Scene((mesh,), (WHITE,), (lamp,), SKY), triangles=60, tessellate=tessellate)
    for layer in LAYERS:
        assert np.isfinite(values(result, layer)).all()
    assert values(result).max() > 0


def test_a_mesh_without_any_area_bakes_or_is_refused_by_name(build):
    line = build.triangles("line", [(0, 0, 0), (1, 0, 0), (2, 0, 0)], [(0, 1, 2)])
    lit = build.quad("lit")
    result = preview(Scene((line, lit), (WHITE,), sky=SKY), triangles=20)
    assert np.isfinite(values(result)).all()


def test_a_lamp_inside_a_wall_or_close_to_it(build):
    for height in (0.0, 1e-4, -1e-9):
        lamps = (
            PointLamp("point", (0.5, 0.5, height), (1.0, 1.0, 1.0)),
            AreaLamp("panel", (0.5, 0.5, 1 - height), (0.2, 0, 0), (0, 0.2, 0), (0, 0, -1), (1.0, 1.0, 1.0)),
        )
        result = preview(Scene((build.box(inward=True),), (WHITE,), lamps), triangles=100)
        assert np.isfinite(values(result)).all()


def test_kept_triangles_are_the_input_triangles(terrace):
    result = preview(terrace, tessellate=False)
    given = {o.name: o for o in terrace.objects}
    for baked in result.objects:
        assert baked.triangles.tobytes() == given[baked.name].triangles.tobytes()
        assert baked.vertices.tobytes() == given[baked.name].vertices.tobytes()
        assert baked.parent.tolist() == list(range(len(baked.triangles)))
        assert baked.barycentric == pytest.approx(np.broadcast_to(np.eye(3), baked.barycentric.shape))
        assert baked.layers["combined"].shape == (len(baked.triangles), 3, 3)


def test_tessellated_triangles_lie_in_the_input(terrace, baked_terrace):
    given = {o.name: o for o in terrace.objects}
    for baked in baked_terrace.objects:
        source = given[baked.name]
        assert baked.vertices[: len(source.vertices)].tobytes() == source.vertices.tobytes()
        told = baked.barycentric @ source.vertices[source.triangles][baked.parent]
        assert told == pytest.approx(corners(baked), abs=1e-12)
        area = np.bincount(baked.parent, triangle_geometry(corners(baked))[1])
        assert area == pytest.approx(triangle_geometry(source.vertices[source.triangles])[1])


def test_triangles_are_as_small_as_asked(build):
    result = preview(Scene((build.quad(),), (WHITE,), sky=SKY), size=0.2)
    edges = corners(result.objects[0])[:, [1, 2, 0]] - corners(result.objects[0])
    assert np.linalg.norm(edges, axis=2).max() <= 0.2


def test_what_does_not_receive_shades_and_reflects_but_is_not_baked(terrace):
    ground, block = terrace.objects
    result = preview(replace(terrace, objects=(ground, replace(block, receives=False))))
    assert [o.name for o in result.objects] == ["ground"]
    assert values(result, "indirect").max() > 0


def test_smooth_shading_weighs_light_by_the_shading_normal(build):
    """A smooth ball under a distant lamp: E cos of the true sphere's normal, not of the flat triangle's."""
    ball = build.sphere(level=3, smooth=True)
    sun = SunLamp("sun", (0, 0, -1), (1.0, 1.0, 1.0))
    result = preview(Scene((ball,), (WHITE,), (sun,)), tessellate=False, triangles=5000, error=0.02)
    baked = result.objects[0]
    lit = corners(baked)[..., 2] > 0.3  # away from the terminator, where a linear element must cut a corner
    expected = 0.5 / np.pi * corners(baked)[..., 2]
    # Blended over an edge of 0.2, the normal's z bends by 0.2^2 / 8 at most.
    assert baked.layers["direct"][..., 0][lit] == pytest.approx(expected[lit], abs=0.5 / np.pi * 0.2**2 / 8 * 2)


class Watched(Progress):
    """Remembers every report; cancels itself after so many of them."""

    def __init__(self, patience: float = np.inf) -> None:
        super().__init__()
        self.reports: list[tuple[str, float]] = []
        self.patience = patience

    def report(self, stage, fraction, error=None, until=None):
        self.reports.append((stage, fraction))
        if len(self.reports) > self.patience:
            self.cancel()
        super().report(stage, fraction, error, until)


def test_progress_rises_from_nothing_to_the_end(terrace):
    progress = Watched()
    preview(terrace, progress)
    fractions = [fraction for _, fraction in progress.reports]
    assert fractions[0] == 0
    assert fractions == sorted(fractions)
    assert 0.95 <= fractions[-1] <= 1
    assert {stage for stage, _ in progress.reports} >= {"plan", "tessellate", "transport", "gather", "fit", "layers"}


def test_all_looks_at_the_same_triangles_share_what_was_worked_out(terrace, monkeypatch):
    """The rays that tell how much escapes are cast for the first light, and once for what comes after it."""

    class Shown(Progress):
        def show(self, so_far):
            shown.append(so_far())

    shown, cast, share = [], [], core_baked.escaped_share
    monkeypatch.setattr(core_baked, "escaped_share", lambda *given: cast.append(given) or share(*given))
    preview(terrace, Shown(watched=True))
    assert len(shown) > 2
    assert len(cast) == 2


def test_cancelling_stops_the_bake_at_every_stage(build):
    scene = Scene((build.quad(), build.box(low=(0.2, 0.2, 0), high=(0.5, 0.5, 0.4))), (WHITE,), sky=SKY)
    complete = Watched()
    preview(scene, complete, triangles=100)
    for patience in range(len(complete.reports)):
        with pytest.raises(Cancelled):
            preview(scene, Watched(patience), triangles=100)


def test_cancelling_from_another_thread_stops_a_long_bake(room):
    progress = Progress()
    timer = threading.Timer(0.5, progress.cancel)
    timer.start()
    with pytest.raises(Cancelled):
        preview(room, progress, triangles=100_000, error=0.001)
    timer.join()


def test_more_than_all_light_is_clamped_with_a_warning(build):
    """Albedo 1 in a closed room has no answer; the limit has, e / (1 - limit), if rows are exact."""
    surface = Surface("mirror white", (1.0, 1.5, 0.0), (0.001, 0.0, 0.0))
    result = preview(Scene((build.box(inward=True),), (surface,)), triangles=50)
    assert any("mirror white" in warning for warning in result.report.warnings)
    assert values(result)[:, 0] == pytest.approx(0.001 / (1 - ALBEDO_LIMIT), rel=0.02)


def test_the_report_accounts_for_the_bake(baked_terrace):
    report = baked_terrace.report
    assert report.rays["total"] == sum(count for purpose, count in report.rays.items() if purpose != "total")
    stages = sum(seconds for stage, seconds in report.seconds.items() if stage != "total")
    assert 0.8 * report.seconds["total"] <= stages <= report.seconds["total"]
    assert [o["name"] for o in report.objects] == [o.name for o in baked_terrace.objects]
    assert [o["corners"] for o in report.objects] == [3 * len(o.triangles) for o in baked_terrace.objects]
    parts = [report.estimated_error[part] for part in ("sampling", "transport", "resolution")]
    assert report.estimated_error["total"] == pytest.approx(np.linalg.norm(parts))
    ledger = report.energy
    assert ledger["emitted"] == pytest.approx(ledger["absorbed"] + ledger["escaped"] + ledger["residual"])
    assert abs(ledger["residual"]) < 0.01 * ledger["emitted"]
    assert ledger["escaped"] > 0
    assert report.threads == 2
    assert report.patches > 0


def finely(scene: Scene, size: float) -> Scene:
    """The scene with its triangles split beforehand."""

    def split(o: SceneObject) -> SceneObject:
        mesh = triform(whole(o.vertices, o.triangles), size)
        return SceneObject(o.name, mesh.vertices, mesh.triangles, o.surface[mesh.parent])

    return replace(scene, objects=tuple(map(split, scene.objects)))


def surface_error(coarse, fine) -> float:
    """Root mean square over the surface that can be seen of what the coarse bake shows beside the fine one, relative to
    the mean. Each fine triangle knows where it lies in those of the coarse bake, which are its input."""
    squared = light = area = 0.0
    for shown, true in zip(coarse.objects, fine.objects, strict=True):
        there = true.barycentric @ shown.layers["combined"][true.parent]
        x, y, z = corners(true).mean(axis=1).T
        under_the_block = (z < 1e-9) & (x > -0.5) & (x < 0.1) & (np.abs(y) < 0.3)
        weight = np.where(under_the_block, 0.0, triangle_geometry(corners(true))[1])
        difference = there - true.layers["combined"]
        middle = (difference.sum(axis=1) ** 2 + (difference**2).sum(axis=1)) / 12  # mean square of a linear function
        squared += weight @ middle.mean(axis=1)
        light += weight @ true.layers["combined"].mean(axis=(1, 2))
        area += weight.sum()
    return float(np.sqrt(squared / area) / (light / area))


def test_the_stated_error_is_the_true_one_within_a_factor_of_two(room):
    """Against a bake with triangles a quarter as long, many more rays and another seed."""
    scene = finely(room, 0.3)
    coarse = preview(scene, tessellate=False, size=0.3)
    fine = preview(scene, size=0.075, seed=77, error=0.02)
    true = surface_error(coarse, fine)
    stated = coarse.report.estimated_error["total"]
    assert true / 2 <= stated <= true * 2


def shown_while_baking(scene, **asked):
    """What whoever watches is shown, each with its stage, and the result."""
    shown = []

    class Shown(Progress):
        def show(self, so_far):
            shown.append((self.stage, so_far()))

    return shown, preview(scene, Shown(watched=True), **asked)


def test_watching_shows_light_from_the_start_and_changes_nothing(build):
    objects = (build.quad(), build.box(low=(0.2, 0.2, 0), high=(0.5, 0.5, 0.4)))
    scene = Scene(objects, (WHITE,), (PointLamp("lamp", (0.2, 0.2, 2.0), (10.0, 10.0, 10.0)),), SKY)
    shown, watched = shown_while_baking(scene, triangles=100)
    alone = preview(scene, triangles=100)
    stages = [stage for stage, _ in shown]
    assert stages[0] == "plan"
    assert {"gather", "fit"} <= set(stages)
    for one, two in zip(watched.objects, alone.objects, strict=True):
        assert np.array_equal(one.layers["combined"], two.layers["combined"])
    # The last picture is the result; the first, rough one has no bounce yet, and nobody knows its error.
    assert np.array_equal(shown[-1][1].objects[0].layers["combined"], watched.objects[0].layers["combined"])
    first = shown[0][1]
    assert first.report.estimated_error == {}
    assert first.objects[0].layers["direct"].any()
    assert not first.objects[0].layers["indirect"].any()


def test_the_first_look_is_rough_whatever_is_asked(build):
    scene = Scene((build.quad(),), (WHITE,), (PointLamp("lamp", (0.2, 0.2, 2.0), (10.0, 10.0, 10.0)),))

    class First(Progress):
        def show(self, so_far):
            self.triangles = len(so_far().objects[0].triangles)
            self.cancel()

    progress = First(watched=True)
    with pytest.raises(Cancelled):
        preview(scene, progress, size=0.002)  # a million of them
    assert 1_000 < progress.triangles < 20_000


def test_where_only_the_sky_shines_there_is_no_black_first_look(build):
    shown, _ = shown_while_baking(Scene((build.quad(),), (WHITE,), sky=SKY), triangles=100)
    assert shown[0][1].objects[0].layers["combined"].any()
