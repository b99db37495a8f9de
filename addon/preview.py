"""A picture of baked objects without a window: Workbench, flat light, so that the baked values themselves are shown.

The picture is taken in a scene of its own, which is removed again: nothing of the user's scene is touched, and what was
not baked (above all the originals under their baked copies) is not in the way.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path

import bpy
from mathutils import Matrix, Vector

from ..core.scene import SceneError

#: Pixels across. The height follows the scene's own aspect.
WIDTH = 1280

#: What Blender writes into a picture besides the picture: the file's path, the date, how long it took.
METADATA = ("camera", "date", "filename", "frame", "lens", "marker", "memory", "render_time", "scene", "time")

#: Where the stand-in camera looks from when the scene has none: front, right and above.
THREE_QUARTER_VIEW = Vector((1.0, -1.6, 0.9))

#: How much further back the stand-in camera stands than what would just fit.
MARGIN = 1.05


def render_preview(scene: bpy.types.Scene, objects: Sequence[bpy.types.Object], path: Path, *, attribute: str) -> None:
    """Render `objects`, coloured by their attribute `attribute`, through the scene's camera into a PNG at `path`.

    With the exposure of the scene's colour management, as in a render; at 0 the picture has the viewport's own colours.
    Without a camera the objects are framed from outside. Raises SceneError when an object lacks the attribute.
    """
    for item in objects:
        if attribute not in item.data.color_attributes:
            raise SceneError(f"Object '{item.name}' has no colour attribute '{attribute}': bake it first.")
    bpy.context.view_layer.update()  # objects that were added just now have no place in the world before it
    with ExitStack() as stack:
        for mesh in {item.data for item in objects}:
            stack.enter_context(_active_colour(mesh, attribute))
        studio = stack.enter_context(_studio(scene, objects))
        studio.view_settings.exposure = scene.view_settings.exposure
        studio.render.filepath = str(path)
        bpy.ops.render.render(scene=studio.name, write_still=True)


@contextmanager
def _active_colour(mesh: bpy.types.Mesh, attribute: str) -> Iterator[None]:
    """Make `attribute` the one that is drawn, for a while."""
    before = mesh.color_attributes.active_color_name
    mesh.color_attributes.active_color_name = attribute
    try:
        yield
    finally:
        mesh.color_attributes.active_color_name = before


@contextmanager
def _studio(scene: bpy.types.Scene, objects: Sequence[bpy.types.Object]) -> Iterator[bpy.types.Scene]:
    """A scene that holds only `objects`, seen by the camera of `scene`, set up for a flat picture of colours."""
    studio = bpy.data.scenes.new("Radiosity preview")
    stand_in = None
    try:
        for item in objects:
            studio.collection.objects.link(item)
        studio.frame_set(scene.frame_current)
        studio.world = scene.world  # for its viewport colour, the backdrop
        _show_values(studio)
        shape = scene.render
        studio.render.pixel_aspect_x, studio.render.pixel_aspect_y = shape.pixel_aspect_x, shape.pixel_aspect_y
        studio.render.resolution_x, studio.render.resolution_percentage = WIDTH, 100
        studio.render.resolution_y = max(1, round(WIDTH * shape.resolution_y / shape.resolution_x))
        if scene.camera is None:
            stand_in = _framing_camera(studio, objects)
        studio.camera = scene.camera or stand_in
        yield studio
    finally:
        bpy.data.scenes.remove(studio)
        if stand_in is not None:
            bpy.data.cameras.remove(stand_in.data)  # and its object with it


def _show_values(studio: bpy.types.Scene) -> None:
    """Colours and nothing but them: no light, no outline, and the plain sRGB curve of the Standard view."""
    studio.render.engine = "BLENDER_WORKBENCH"
    image = studio.render.image_settings
    image.file_format, image.color_mode = "PNG", "RGB"
    for entry in METADATA:
        setattr(studio.render, f"use_stamp_{entry}", False)
    studio.display.render_aa = "8"
    shading = studio.display.shading
    shading.light, shading.color_type = "FLAT", "VERTEX"
    shading.show_shadows = shading.show_cavity = shading.show_object_outline = shading.show_xray = False
    studio.view_settings.view_transform, studio.view_settings.look = "Standard", "None"
    studio.view_settings.gamma = 1.0


def _framing_camera(studio: bpy.types.Scene, objects: Sequence[bpy.types.Object]) -> bpy.types.Object:
    """A camera in `studio` that sees all of `objects` from the front, the right and above."""
    camera = bpy.data.objects.new("Radiosity preview", bpy.data.cameras.new("Radiosity preview"))
    studio.collection.objects.link(camera)
    camera.matrix_world = THREE_QUARTER_VIEW.to_track_quat("Z", "Y").to_matrix().to_4x4()
    depsgraph = studio.view_layers[0].depsgraph
    depsgraph.update()
    corners = [item.matrix_world @ Vector(corner) for item in objects for corner in item.bound_box]
    location, _ = camera.camera_fit_coords(depsgraph, [value for corner in corners for value in corner])
    middle = sum(corners, Vector()) / len(corners)
    location = middle + MARGIN * (location - middle)
    distances = sorted((corner - location).length for corner in corners)
    camera.data.clip_start, camera.data.clip_end = distances[0] / 1000, distances[-1] * 2
    camera.matrix_world = Matrix.Translation(location) @ camera.matrix_world
    return camera
