"""Textures: where their pixels are, means without aliasing, and light on what they colour."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from radiosity_baker.core import textures
from radiosity_baker.core.bake import bake
from radiosity_baker.core.direct.emitters import emitting_panels, emitting_pieces
from radiosity_baker.core.effects import choose_effects
from radiosity_baker.core.form_factors.polygon import polygon_irradiance
from radiosity_baker.core.patches import unit_space
from radiosity_baker.core.plan import choose_effort
from radiosity_baker.core.scene import ALBEDO_LIMIT, Scene, SceneError, Surface, Texture
from radiosity_baker.core.settings import Settings
from radiosity_baker.core.textures import even_points, look_up, triangle_colours

#: UV coordinates of `build.quad`: its corner at (0, 0), u and v along the axes of the image.
UNIT = np.array([[(0, 0), (1, 0), (1, 1)], [(0, 0), (1, 1), (0, 1)]], dtype=np.float32)
QUICK = Settings(triangles=200, error=0.1, threads=1)


def grey(values) -> Texture:
    """A texture of the rows of `values`, the first at the bottom."""
    return Texture(np.repeat(np.array(values, dtype=np.float32)[:, :, None], 3, axis=2))


def checker(count, low=0.0, high=1.0) -> Texture:
    row, column = np.indices((count, count))
    return replace(grey(np.where((row + column) % 2, high, low)), interpolation="closest")


@pytest.fixture
def sheet(build):
    """A square of 1 m under a sky of radiance 1, with a texture over it: what it shows is its albedo."""

    def make(texture, uv=UNIT, **surface) -> Scene:
        painted = Surface("painted", (1.0, 1.0, 1.0), albedo_texture=texture, **surface)
        return Scene((replace(build.quad(), uv=uv),), (painted,), sky=(1.0, 1.0, 1.0))

    return make


@pytest.mark.parametrize("count", [1, 4, 16, 25])
def test_even_points_are_the_centroids_of_equal_parts(count):
    points = even_points(count)
    assert len(np.unique(points.round(9), axis=0)) == count
    assert points.min() > 0
    # The mean of x^2 over a triangle is 1/6; over equal parts it is that less their own spread, 1 / (18 count).
    np.testing.assert_allclose((points**2).mean(axis=0), 1 / 6 - 1 / (18 * count), rtol=1e-12)


def test_pixels_are_where_blender_has_them():
    texture = grey([[0.1, 0.2], [0.3, 0.4]])
    centres = np.array([(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)])
    np.testing.assert_allclose(look_up(texture, centres)[:, 0], [0.1, 0.2, 0.3, 0.4], rtol=1e-6)
    np.testing.assert_allclose(look_up(texture, np.array([[0.5, 0.5]]))[0], 0.25, rtol=1e-6)
    nearly = np.array([(0.49, 0.01), (0.51, 0.01), (0.01, 0.51)])
    closest = look_up(replace(texture, interpolation="closest"), nearly)[:, 0]
    np.testing.assert_allclose(closest, [0.1, 0.2, 0.3], rtol=1e-6)


@pytest.mark.parametrize(
    ("extension", "beyond", "at_the_edge"),
    [
        ("repeat", [0.2, 0.1, 0.2], 0.15),
        ("extend", [0.1, 0.2, 0.2], 0.1),
        ("clip", [0.0, 0.0, 0.0], 0.05),
        ("mirror", [0.1, 0.2, 0.1], 0.1),
    ],
)
def test_beyond_its_edge_an_image_goes_on_as_it_says(extension, beyond, at_the_edge):
    texture = replace(grey([[0.1, 0.2]]), extension=extension)
    places = np.array([(-0.25, 0.5), (1.25, 0.5), (1.75, 0.5)])
    np.testing.assert_allclose(look_up(texture, places)[:, 0], beyond, rtol=1e-6)
    np.testing.assert_allclose(look_up(texture, np.array([[0.0, 0.5]]))[0], at_the_edge, rtol=1e-6)


@pytest.mark.parametrize("shape", [(8, 8), (7, 5), (1, 9), (6, 3)])
def test_smaller_images_keep_the_mean(shape):
    pixels = np.random.default_rng(0).random((*shape, 3), dtype=np.float32)
    levels = Texture(pixels).levels
    assert levels[-1].shape == (1, 1, 3)
    for level in levels:
        np.testing.assert_allclose(level.mean(axis=(0, 1)), pixels.mean(axis=(0, 1)), rtol=1e-5)


def test_separate_pixels_are_never_averaged():
    assert len(replace(checker(8), separate=True).levels) == 1


@pytest.mark.parametrize("count", [2, 6, 8, 64, 1000])
def test_the_mean_of_a_checker_is_half_however_fine(sheet, count):
    scene = sheet(checker(count))
    albedo = triangle_colours(scene, scene.objects[0]).albedo
    # Half of each triangle is white but for the diagonal, which goes through fields of one colour: 1 / (2 count); the
    # points themselves settle a coarse pattern to one of the sixteen.
    np.testing.assert_allclose(albedo, 0.5, atol=1 / (2 * count) + 1 / 16)


def test_the_mean_of_a_ramp_is_its_value_at_the_centroid(sheet):
    ramp = grey([np.arange(256) / 256 + 1 / 512])
    scene = sheet(replace(ramp, extension="extend"))
    albedo = triangle_colours(scene, scene.objects[0]).albedo[:, 0]
    np.testing.assert_allclose(albedo, [2 / 3, 1 / 3], atol=1 / 512)


def test_corner_colours_multiply_the_albedo_and_are_limited(build):
    colors = np.array([[(1, 0, 0), (0, 1, 0), (0, 0, 1)], [(2, 2, 2)] * 3], dtype=np.float32)
    scene = Scene((replace(build.quad(), colors=colors),), (Surface("half", (0.6, 0.3, 0.9)),))
    albedo = triangle_colours(scene, scene.objects[0]).albedo
    np.testing.assert_allclose(albedo[0], [0.2, 0.1, 0.3], rtol=1e-6)
    np.testing.assert_allclose(albedo[1], [ALBEDO_LIMIT, 0.6, ALBEDO_LIMIT], rtol=1e-6)


def test_patches_have_the_mean_of_their_texture(sheet, build):
    image = Texture(np.random.default_rng(3).random((32, 32, 3), dtype=np.float32))
    patches = build.patches(sheet(image), 128)
    assert np.ptp(patches.albedo[:, 0]) > 0.1
    # Linear look-ups mix pixels across the edges of the image, but no light is lost or won by that.
    mean = patches.patch_area @ patches.albedo / patches.patch_area.sum()
    np.testing.assert_allclose(mean, image.pixels.mean(axis=(0, 1)), atol=0.01)


def test_a_ramp_shows_exactly(sheet):
    """Linear in space under an even sky: no fit, no sampling and no vertex density can excuse an error."""
    ramp = replace(grey([np.arange(256) / 256 + 1 / 512]), extension="extend")
    result = bake(sheet(ramp), QUICK)
    baked = result.objects[0]
    assert not any("reflects all light" in warning for warning in result.report.warnings)
    shown = baked.layers["combined"][..., 0]
    x = baked.vertices[baked.triangles][..., 0]
    np.testing.assert_allclose(shown, x, atol=2e-3)


def test_detail_finer_than_the_triangles_does_not_alias(sheet):
    shown = bake(sheet(checker(501, 0.2, 0.8)), QUICK).objects[0].layers["combined"]
    np.testing.assert_allclose(shown, 0.5, atol=0.01)


def test_the_layer_without_colour_has_none(sheet):
    layers = bake(sheet(checker(4)), replace(QUICK, layers=("light", "combined", "emission"))).objects[0].layers
    np.testing.assert_allclose(layers["light"], 1.0, atol=1e-3)
    assert np.ptp(layers["combined"]) > 0.8
    assert layers["emission"].max() == 0


def test_colours_do_not_bleed_over_a_seam(sheet):
    """Two halves of an image, one on each triangle: along the diagonal both keep their own."""
    image = replace(grey([[0.2, 0.2, 0.8, 0.8]]), interpolation="closest")
    uv = np.array([[(0, 0), (0.2, 0), (0.2, 1)], [(0.8, 0), (1, 1), (0.8, 1)]], dtype=np.float32)
    baked = bake(sheet(image, uv), QUICK).objects[0]
    expected = np.where(baked.parent == 0, 0.2, 0.8)[:, None, None]
    np.testing.assert_allclose(baked.layers["combined"], np.broadcast_to(expected, (len(expected), 3, 3)), atol=1e-3)


def test_a_textured_emitter_lights_as_its_bright_half_alone_does(build):
    """The left half of the panel shines: the irradiance is Lambert's of that half."""
    half = replace(grey([[4.0, 0.0]]), interpolation="closest")
    panel = replace(build.quad("panel", (0, 0, 1)), uv=UNIT)
    floor = build.quad("floor", (-1, -1, 0), (3, 0, 0), (0, 3, 0), surface=1)
    scene = Scene((panel, floor), (Surface("panel", (0, 0, 0), (1, 1, 1), emission_texture=half), build.grey))
    space = unit_space(scene)
    points, up = space.normalise(np.array([(0.2, 0.3, 0.0), (1.5, 1.0, 0.0)])), np.array([(0, 0, 1.0)] * 2)

    pieces = emitting_pieces(scene)
    arrives = sum(panel.share(points, up)[:, None] * panel.color for panel in emitting_panels(scene, space))

    lit = space.normalise(np.array([(0, 0, 1), (0.5, 0, 1), (0.5, 1, 1), (0, 1, 1.0)]))
    exact = 4 * np.pi * polygon_irradiance(points, up, lit, two_sided=True)
    # The diagonals of the triangles cross the border of the two halves, where pieces remain that shine in part.
    np.testing.assert_allclose(arrives[:, 0], exact, rtol=0.03)
    assert len(pieces) <= 34
    assert sum(p.area * p.radiance[0] for p in pieces) == pytest.approx(2.0, rel=0.02)


def test_the_emission_layer_shows_the_texture(sheet):
    image = grey([[0.0, 1.0], [2.0, 3.0]])
    scene = sheet(None, emission=(1.0, 2.0, 0.5), emission_texture=image)
    layer = bake(scene, replace(QUICK, layers=("emission",))).objects[0].layers["emission"]
    assert layer[..., 0].mean() == pytest.approx(1.5, abs=0.15)
    np.testing.assert_allclose(layer[..., 1], 2 * layer[..., 0], rtol=1e-5)


def test_without_textures_none_is_looked_up(build, monkeypatch):
    monkeypatch.setattr(textures, "point_colours", None)
    bake(build.furnished_room(), QUICK)


def test_textures_that_are_switched_off_leave_their_mean(sheet):
    scene = sheet(checker(8), emission=(2.0, 2.0, 2.0), emission_texture=grey([[0.0, 1.0]]))
    effects, left = choose_effects(scene, Settings(effects={"albedo textures": False, "textured emission": False}))
    assert left.surfaces[0].albedo_texture is left.surfaces[0].emission_texture is None
    assert left.surfaces[0].albedo == pytest.approx((0.5,) * 3, abs=0.05)
    assert left.surfaces[0].emission == pytest.approx((1.0,) * 3, abs=0.05)
    assert {e.name for e in effects if "by hand" in e.reason} == {"albedo textures", "textured emission"}


def test_the_plan_names_what_is_textured(sheet, build):
    reasons = {e.name: e for e in choose_effects(sheet(checker(8)), Settings())[0]}
    assert reasons["albedo textures"].active
    assert "quad" in reasons["albedo textures"].reason
    assert not reasons["textured emission"].active
    plain = {e.name: e.active for e in choose_effects(build.furnished_room(), Settings())[0]}
    assert not plain["albedo textures"]


def test_textured_receivers_do_not_start_coarse(sheet, build):
    """Their detail is not where light bends, so it would be missed."""
    assert choose_effort(sheet(checker(8)), Settings()).coarsest == 1
    assert choose_effort(build.furnished_room(), Settings()).coarsest > 1


def test_a_texture_needs_a_place(sheet):
    with pytest.raises(SceneError, match=r"'quad'.*unwrap"):
        bake(sheet(checker(2), uv=None), QUICK)


@pytest.mark.parametrize("bad", [np.nan, -1.0])
def test_images_that_cannot_be_are_refused(sheet, bad):
    with pytest.raises(SceneError, match="'painted'"):
        bake(sheet(grey([[bad, 1.0]])), QUICK)


def test_textured_light_is_the_same_with_any_threads(sheet):
    scene = sheet(checker(8), emission=(1.0, 1.0, 1.0), emission_texture=checker(4))
    one, two = (bake(scene, replace(QUICK, threads=n)).objects[0].layers["combined"] for n in (1, 2))
    assert one.tobytes() == two.tobytes()
