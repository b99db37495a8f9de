"""The picture shows the baked values themselves, of the baked objects alone, and leaves the scene as it was."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
import pytest

from radiosity_baker.addon import preview
from radiosity_baker.addon.preview import render_preview
from radiosity_baker.core.scene import SceneError

#: A rounding, Workbench's half floats, and the dither of Blender's 8-bit files.
STEPS = 2


@pytest.fixture(autouse=True)
def small_pictures(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(preview, "WIDTH", 64)


@pytest.fixture
def camera() -> bpy.types.Object:
    """Looks straight down from 10 m at a field 4 m wide, in a small square picture's shape."""
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.type, camera.data.ortho_scale = "ORTHO", 4.0
    camera.location.z = 10.0
    scene = bpy.context.scene
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.resolution_x = scene.render.resolution_y = 64
    return camera


def add_plane(name: str, colour: tuple[float, float, float], *, x: float = 0.0, size: float = 2.0) -> bpy.types.Object:
    half = size / 2
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([(-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0)], [], [(0, 1, 2, 3)])
    attribute = mesh.color_attributes.new("Radiosity", "FLOAT_COLOR", "CORNER")
    attribute.data.foreach_set("color", np.tile([*colour, 1.0], 4).astype(np.float32))
    plane = bpy.data.objects.new(name, mesh)
    plane.location.x = x
    bpy.context.scene.collection.objects.link(plane)
    return plane


def pixels(path: Path) -> np.ndarray:
    """Rows from the top, RGB from 0 to 255, as stored in the file."""
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.name = "Non-Color"
    width, height = image.size
    values = np.array(image.pixels[:]).reshape(height, width, -1)[::-1, :, :3]
    bpy.data.images.remove(image)
    return np.rint(values * 255)


def srgb(linear: float) -> float:
    """IEC 61966-2-1, 0 to 255."""
    return 255 * (12.92 * linear if linear <= 0.0031308 else 1.055 * linear ** (1 / 2.4) - 0.055)


def centre(picture: np.ndarray) -> np.ndarray:
    return picture[picture.shape[0] // 2, picture.shape[1] // 2]


@pytest.mark.usefixtures("camera")
def test_a_pixel_is_the_baked_value_through_the_srgb_curve(tmp_path: Path):
    plane = add_plane("Plane", (0.5, 0.2, 0.01))
    render_preview(bpy.context.scene, [plane], tmp_path / "p.png", attribute="Radiosity")
    expected = [srgb(0.5), srgb(0.2), srgb(0.01)]
    assert np.abs(centre(pixels(tmp_path / "p.png")) - expected).max() <= STEPS


@pytest.mark.usefixtures("camera")
def test_the_scenes_own_exposure_counts(tmp_path: Path):
    plane = add_plane("Plane", (2.0, 2.0, 2.0))
    bpy.context.scene.view_settings.exposure = -2.0
    render_preview(bpy.context.scene, [plane], tmp_path / "p.png", attribute="Radiosity")
    assert np.abs(centre(pixels(tmp_path / "p.png")) - srgb(0.5)).max() <= STEPS


@pytest.mark.usefixtures("camera")
def test_an_exposure_of_nothing_is_an_exposure_too(tmp_path: Path):
    """What is dim or glaring in the viewport is so in the picture."""
    planes = [add_plane("Dim", (0.01, 0.01, 0.01)), add_plane("Glare", (50.0, 50.0, 50.0), x=-1.5, size=0.5)]
    render_preview(bpy.context.scene, planes, tmp_path / "p.png", attribute="Radiosity")
    picture = pixels(tmp_path / "p.png")
    assert np.abs(centre(picture) - srgb(0.01)).max() <= STEPS
    assert picture.max() == 255


@pytest.mark.usefixtures("camera")
def test_only_the_given_objects_are_seen(tmp_path: Path):
    plane = add_plane("Plane", (0.5, 0.5, 0.5))
    original = add_plane("Original", (1.0, 0.0, 0.0), size=4.0)
    original.location.z = 1.0  # in front of the plane
    render_preview(bpy.context.scene, [plane], tmp_path / "p.png", attribute="Radiosity")
    picture = pixels(tmp_path / "p.png")
    assert np.abs(centre(picture) - srgb(0.5)).max() <= STEPS
    assert (picture[0, 0] < srgb(0.1)).all()


@pytest.mark.usefixtures("camera")
def test_the_asked_attribute_is_shown_and_the_active_one_stays(tmp_path: Path):
    plane = add_plane("Plane", (0.5, 0.5, 0.5))
    plane.data.color_attributes.new("Other", "FLOAT_COLOR", "CORNER")
    plane.data.color_attributes.active_color_name = "Other"
    render_preview(bpy.context.scene, [plane], tmp_path / "p.png", attribute="Radiosity")
    assert np.abs(centre(pixels(tmp_path / "p.png")) - srgb(0.5)).max() <= STEPS
    assert plane.data.color_attributes.active_color_name == "Other"


def test_without_a_camera_all_objects_are_framed(tmp_path: Path):
    planes = [add_plane("Left", (1.0, 0.0, 0.0), x=-5.0), add_plane("Right", (0.0, 1.0, 0.0), x=5.0)]
    render_preview(bpy.context.scene, planes, tmp_path / "p.png", attribute="Radiosity")
    red, green, _ = np.moveaxis(pixels(tmp_path / "p.png"), 2, 0)
    assert ((red >= 255 - STEPS) & (green <= STEPS)).any()
    assert ((green >= 255 - STEPS) & (red <= STEPS)).any()


def test_the_file_is_left_as_it_was(camera: bpy.types.Object, tmp_path: Path):
    plane = add_plane("Plane", (0.5, 0.5, 0.5))
    scene = bpy.context.scene
    before = settings_and_data(scene)
    render_preview(scene, [plane], tmp_path / "p.png", attribute="Radiosity")
    scene.camera = None
    render_preview(scene, [plane], tmp_path / "p.png", attribute="Radiosity")
    scene.camera = camera
    assert settings_and_data(scene) == before


def settings_and_data(scene: bpy.types.Scene) -> dict:
    groups = (scene.render, scene.render.image_settings, scene.view_settings, scene.display, scene.display.shading)
    values = {
        f"{group.bl_rna.identifier}.{prop.identifier}": repr(getattr(group, prop.identifier))
        for group in groups
        for prop in group.bl_rna.properties
        if not prop.is_readonly and prop.type != "POINTER"
    }
    names = {
        kind: list(getattr(bpy.data, kind).keys()) for kind in ("scenes", "objects", "cameras", "meshes", "worlds")
    }
    return values | names | {"frame": scene.frame_current, "window": bpy.context.scene.name}


def test_the_picture_tells_nothing_about_this_machine(tmp_path: Path):
    plane = add_plane("Plane", (0.5, 0.5, 0.5))
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    render_preview(bpy.context.scene, [plane], tmp_path / "p.png", attribute="Radiosity")
    assert b"tEXt" not in (tmp_path / "p.png").read_bytes()


def test_an_object_without_the_attribute_is_named(tmp_path: Path):
    plane = add_plane("Bare", (0.0, 0.0, 0.0))
    with pytest.raises(SceneError, match=r"'Bare'.*'Light'.*bake it first"):
        render_preview(bpy.context.scene, [plane], tmp_path / "p.png", attribute="Light")
    assert not list(tmp_path.iterdir())
