"""Receivers start coarse and get finer where light bends, without cracks and without moving a point."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from radiosity_baker.core.bake import bake
from radiosity_baker.core.bending import Bends
from radiosity_baker.core.patches import triangle_geometry
from radiosity_baker.core.receivers import shared_edges
from radiosity_baker.core.result import BakedObject
from radiosity_baker.core.scene import PointLamp, Scene, SunLamp
from radiosity_baker.core.settings import Settings
from radiosity_baker.core.tessellation import triform, whole


@pytest.fixture(scope="module")
def shaded(build):
    """A square's hard shadow on the ground."""
    ground = build.quad("ground", (-2, -2, 0), (4, 0, 0), (0, 4, 0))
    sail = build.quad("sail", (-0.7, -0.7, 1), (1.4, 0, 0), (0, 1.4, 0), receives=False)
    sun = SunLamp("sun", (0, 0, -1), (1.0, 1.0, 1.0))
    settings = Settings(triangles=6000, error=0.02, threads=2)
    return Scene((ground, sail), (build.grey,), (sun,)), settings


def centres_and_areas(baked: BakedObject) -> tuple[np.ndarray, np.ndarray]:
    corners = baked.vertices[baked.triangles]
    return corners.mean(axis=1), triangle_geometry(corners)[1]


def test_triangles_are_small_along_a_shadow_edge_and_large_elsewhere(shaded):
    result = bake(*shaded).objects[0]
    centre, area = centres_and_areas(result)
    edge = np.abs(np.abs(centre[:, :2]).max(axis=1) - 0.7)
    assert np.median(area[edge < 0.03]) < np.median(area[edge > 0.5]) / 15
    assert len(area) <= 6000 + 6000 / 16 * 2


def test_it_fits_better_than_ten_times_as_many_triangles_of_one_size(shaded):
    """Against the shadow itself, at random points of every triangle; the even triangles are the mesh's own."""
    scene, settings = shaded
    adapted = bake(scene, settings).objects[0]
    mesh = triform(whole(scene.objects[0].vertices, scene.objects[0].triangles), 0.1)
    fine = replace(scene.objects[0], vertices=mesh.vertices, triangles=mesh.triangles, surface=mesh.parent * 0)
    even = bake(replace(scene, objects=(fine, scene.objects[1])), replace(settings, tessellate=False)).objects[0]
    assert len(even.triangles) > 10 * len(adapted.triangles)
    assert squared_error(adapted) < squared_error(even)


def squared_error(baked: BakedObject) -> float:
    weights = np.random.default_rng(0).dirichlet(np.ones(3), size=(len(baked.triangles), 20))
    points = np.einsum("tbi,tik->tbk", weights, baked.vertices[baked.triangles])
    true = np.where(np.abs(points[..., :2]).max(axis=2) < 0.7, 0.0, 0.5 / np.pi)
    shown = np.einsum("tbi,ti->tb", weights, baked.layers["combined"][..., 0])
    return float(centres_and_areas(baked)[1] @ ((shown - true) ** 2).mean(axis=1))


def test_no_cracks_and_no_point_moved(shaded):
    """Every inner edge has two triangles, and new points lie where their weights say, on the input's triangles."""
    scene, settings = shaded
    result = bake(scene, settings).objects[0]
    ground = scene.objects[0]
    assert result.vertices[: len(ground.vertices)].tobytes() == ground.vertices.tobytes()
    corners = result.vertices[result.triangles]
    told = result.barycentric @ ground.vertices[ground.triangles][result.parent]
    assert told == pytest.approx(corners, abs=1e-12)
    edges = 3 * len(result.triangles)
    on_rim = np.abs(corners[:, :, :2]) == 2.0
    rim = np.count_nonzero((on_rim & np.roll(on_rim, -1, axis=1)).any(axis=2))
    assert 2 * len(shared_edges(result.triangles)[0]) + rim == edges


def test_even_light_needs_no_more_triangles_than_at_the_start(build):
    lamp = PointLamp("lamp", (0.5, 0.5, 30.0), (100.0, 100.0, 100.0))
    result = bake(Scene((build.quad(),), (build.grey,), (lamp,)), Settings(triangles=5000, error=0.02, threads=2))
    assert len(result.objects[0].triangles) < 5000 / 8


def test_coarse_triangles_over_a_gap_get_fine_enough_to_look_into_it(build):
    """The underside of a box a tenth of its breadth above the ground is as dark with few triangles as with many. A
    coarse triangle takes the ground for a thing that lies on it, and would be filled from anywhere."""
    ground = build.quad("ground", (-2, -2, 0), (4, 0, 0), (0, 4, 0))
    chest = build.box("chest", (-0.5, -0.5, 0.1), (0.5, 0.5, 0.7))
    lamp = PointLamp("lamp", (0.3, 0.2, 3.0), (10.0, 10.0, 10.0), radius=0.2)
    scene = Scene((ground, chest), (build.grey,), (lamp,))
    under, above = [], 0.0
    for settings in (Settings(triangles=1500, error=0.05, threads=2), Settings(triangles=40_000, threads=2)):
        chest_baked, ground_baked = bake(scene, settings).objects
        centre, area = centres_and_areas(chest_baked)
        bottom = centre[:, 2] < 0.101
        under.append(area[bottom] @ chest_baked.layers["combined"][bottom].mean(axis=(1, 2)) / area[bottom].sum())
        _, area = centres_and_areas(ground_baked)
        above = area @ ground_baked.layers["combined"].mean(axis=(1, 2)) / area.sum()
    assert under[0] == pytest.approx(under[1], abs=0.04 * above)


def test_nobody_looks_again_where_what_is_split_is_enough(build, monkeypatch):
    """A lamp near a square: at 2 % some triangles are split, but those who asked for 0.5 % must look what came of it.
    Either keeps what it promised."""
    looks, split = [], []
    look, choose = Bends._surveyed, Bends._worst

    def counted(self, *given):
        found = choose(self, *given)
        split.append(found.chosen.sum())
        return found

    monkeypatch.setattr(Bends, "_surveyed", lambda *given: looks.append(given[2]) or look(*given))
    monkeypatch.setattr(Bends, "_worst", counted)
    scene = Scene((build.quad(),), (build.grey,), (PointLamp("lamp", (0.5, 0.5, 0.3), (1.0, 1.0, 1.0)),))
    rough = bake(scene, Settings(triangles=6000, error=0.02, threads=2)).report
    assert looks == [0]
    assert split[0] > 0
    assert rough.estimated_error["resolution"] <= 0.02
    fine = bake(scene, Settings(triangles=6000, error=0.005, threads=2)).report
    assert looks[1:4] == [0, 1, 2]
    assert fine.estimated_error["resolution"] <= 0.005


def test_what_the_first_look_has_missed_is_split_once_it_is_seen(build, monkeypatch):
    """As if nothing bent at first: the error is stated, and triangles are split until it is what was asked for."""
    monkeypatch.setattr(Bends, "refine", lambda bends, _: bends._cut(0.0))
    settings = Settings(triangles=20_000, error=0.02, threads=2)
    split = bake(build.furnished_room(), settings)
    assert split.report.estimated_error["total"] <= 0.02
    monkeypatch.setattr(Bends, "finer", lambda *_: None)
    coarse = bake(build.furnished_room(), settings)
    assert coarse.report.estimated_error["resolution"] > 0.02
    assert sum(len(o.triangles) for o in split.objects) > 1.5 * sum(len(o.triangles) for o in coarse.objects)
    assert split.report.rays["gather"] > coarse.report.rays["gather"]


def test_nobody_samples_again_for_a_handful_of_triangles(build, monkeypatch):
    """There is room for two more splits, which bring next to nothing."""
    finer, asked = Bends.finer, []

    def crowded(bends, _):
        trial = bends._cut(0.0)
        bends._limit = len(bends._last.source) + 10
        return trial

    monkeypatch.setattr(Bends, "refine", crowded)
    monkeypatch.setattr(Bends, "finer", lambda *given: asked.append(finer(*given)))
    result = bake(build.furnished_room(), Settings(triangles=20_000, error=0.02, threads=2))
    assert result.report.estimated_error["total"] > 0.02
    assert asked
    assert not any(asked)


def test_faint_contours_leave_room_for_the_triangles_that_bright_light_calls_for(build):
    """Slats throw forty faint shadows of a sun, whose cuts alone would take all the triangles there are to be had,
    while a lamp close to the ground is far off with the coarse ones."""
    ground = build.quad("ground", (-2, -2, 0), (4, 0, 0), (0, 4, 0))
    slats = [build.quad(f"slat {k}", (-2 + k * 0.1, -2, 1), (0.05, 0, 0), (0, 4, 0), receives=False) for k in range(40)]
    suns = SunLamp("sun", (0, 0, -1), (0.02, 0.02, 0.02)), PointLamp("lamp", (0.5, 0.5, 0.2), (1.0, 1.0, 1.0))
    asked = Settings(triangles=2000, error=0.02, threads=2, effects={"bounces": False})
    result = bake(Scene((ground, *slats), (build.grey,), suns), asked)
    # A tenth more than there are at first and may be added.
    assert len(result.objects[0].triangles) <= 1.1 * 2000 * (1 + 2 / 16)
    assert result.report.estimated_error["resolution"] < 0.1
