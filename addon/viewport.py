"""Showing the baked light in a 3D View, and putting back what was there.

Solid shading with flat light and attribute colours shows the baked values themselves, in every Blender and at once.
What a viewport looked like before is kept with its screen: undo does not touch it and saving takes it along.
"""

import json
from typing import Any

import bpy
from bpy.app.handlers import persistent
from bpy.props import StringProperty

from ..core.settings import LAYERS
from .attribute_writer import attribute_name

BAKED_LOOK = {
    "type": "SOLID",
    "color_type": "VERTEX",
    "light": "FLAT",
    "show_shadows": False,
    "show_cavity": False,
    "show_xray": False,
}


def find_view(context: bpy.types.Context) -> bpy.types.Area | None:
    """The 3D View the person is in, or the largest of the window when the click came from elsewhere."""
    if context.area is not None and context.area.type == "VIEW_3D":
        return context.area
    if context.screen is None:
        return None
    views = [area for area in context.screen.areas if area.type == "VIEW_3D"]
    return max(views, key=lambda area: area.width * area.height, default=None)


def redraw(context: bpy.types.Context) -> None:
    """Draw what every 3D View shows anew, and not the tools around it."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            for region in area.regions:
                if (area.type, region.type) == ("VIEW_3D", "WINDOW"):
                    region.tag_redraw()


def is_shown(context: bpy.types.Context) -> bool:
    """Does the viewport at hand show the baked light, with something to go back to?"""
    area = find_view(context)
    return area is not None and _key(area) in _kept(area.id_data)


def show(area: bpy.types.Area) -> None:
    """Let a 3D View show the active colour attributes as they are, and keep what it showed before."""
    shading = area.spaces.active.shading
    before = {}
    for name, value in BAKED_LOOK.items():
        before[name] = getattr(shading, name)
        setattr(shading, name, value)
    kept = _kept(area.id_data)
    kept.setdefault(_key(area), before)  # Shown twice, the first look is the one to go back to.
    area.id_data.radiosity_baker_looks = json.dumps(kept)


def restore(area: bpy.types.Area) -> None:
    """Give a 3D View back the look it had before `show`."""
    kept = _kept(area.id_data)
    before = kept.pop(_key(area))
    for name, value in before.items():
        setattr(area.spaces.active.shading, name, value)
    area.id_data.radiosity_baker_looks = json.dumps(kept)


def show_layer(scene: bpy.types.Scene, report: dict[str, Any], layer: str) -> None:
    """Make a layer the active colour attribute of the objects of a bake. The render attribute, which exporters read,
    stays with the combined light."""
    for entry in report["objects"]:
        attribute = _layer_of(scene, entry, layer)
        if attribute is not None:
            attribute.id_data.color_attributes.active_color_name = attribute.name
            attribute.id_data.update_tag()  # Without it, a viewport that has drawn the mesh keeps the old colours.


_baked_before_undo = False


@persistent
def _remember_before_undo(scene: bpy.types.Scene, *_: object) -> None:
    global _baked_before_undo  # noqa: PLW0603 - Blender's handlers have no other place in common
    _baked_before_undo = _is_baked(scene)


@persistent
def _follow_undo(scene: bpy.types.Scene, *_: object) -> None:
    """Undo knows no viewports: when it takes the light away the old look comes back, and with a redo the new one."""
    view = find_view(bpy.context)
    if view is None or _is_baked(scene) == _baked_before_undo:
        return
    if _baked_before_undo and is_shown(bpy.context):
        restore(view)
    elif not _baked_before_undo and scene.radiosity_baker.show_when_done:
        show(view)


def _is_baked(scene: bpy.types.Scene) -> bool:
    return scene.radiosity_baker.last_report() is not None


def baked_layers(scene: bpy.types.Scene, report: dict[str, Any]) -> list[str]:
    """The layers that the objects of a bake still have."""
    return [layer for layer in LAYERS if any(_layer_of(scene, entry, layer) for entry in report["objects"])]


def _layer_of(scene: bpy.types.Scene, entry: dict[str, Any], layer: str) -> bpy.types.Attribute | None:
    baked = scene.objects.get(entry["name"])
    if baked is None or baked.type != "MESH":
        return None
    return baked.data.color_attributes.get(attribute_name(entry["attribute"], layer))


def _kept(screen: bpy.types.Screen) -> dict[str, dict[str, Any]]:
    return json.loads(screen.radiosity_baker_looks or "{}")


def _key(area: bpy.types.Area) -> str:
    # Areas have no name; their place in the screen survives saving and loading.
    return str(list(area.id_data.areas).index(area))


class VIEW3D_OT_radiosity_show(bpy.types.Operator):
    bl_idname = "view3d.radiosity_show"
    bl_label = "Show Baked Light"
    bl_description = "Show the baked light in the 3D View: solid shading, flat light, attribute colours"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return find_view(context) is not None

    def execute(self, context: bpy.types.Context) -> set[str]:
        show(find_view(context))
        return {"FINISHED"}


class VIEW3D_OT_radiosity_restore(bpy.types.Operator):
    bl_idname = "view3d.radiosity_restore"
    bl_label = "Restore Viewport"
    bl_description = "Give the 3D View back the shading it had before it showed the baked light"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return is_shown(context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        restore(find_view(context))
        return {"FINISHED"}


def register() -> None:
    bpy.app.handlers.undo_pre.append(_remember_before_undo)
    bpy.app.handlers.redo_pre.append(_remember_before_undo)
    bpy.app.handlers.undo_post.append(_follow_undo)
    bpy.app.handlers.redo_post.append(_follow_undo)
    bpy.types.Screen.radiosity_baker_looks = StringProperty(options={"HIDDEN"})
    bpy.utils.register_class(VIEW3D_OT_radiosity_show)
    bpy.utils.register_class(VIEW3D_OT_radiosity_restore)


def unregister() -> None:
    bpy.app.handlers.redo_post.remove(_follow_undo)
    bpy.app.handlers.undo_post.remove(_follow_undo)
    bpy.app.handlers.redo_pre.remove(_remember_before_undo)
    bpy.app.handlers.undo_pre.remove(_remember_before_undo)
    bpy.utils.unregister_class(VIEW3D_OT_radiosity_restore)
    bpy.utils.unregister_class(VIEW3D_OT_radiosity_show)
    del bpy.types.Screen.radiosity_baker_looks
