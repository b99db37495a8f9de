"""Where the panel appears, and how it is drawn anew there."""

from __future__ import annotations

import bpy

#: What Blender wants to know about each place.
PLACES = {
    "RENDER": {"bl_space_type": "PROPERTIES", "bl_region_type": "WINDOW", "bl_context": "render"},
    "VIEW3D": {"bl_space_type": "VIEW_3D", "bl_region_type": "UI", "bl_category": "Radiosity"},
}


def redraw_panel(context: bpy.types.Context) -> None:
    """Draw the panel anew where it is on show, and nothing that costs more."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            for region in area.regions:
                if _shows_panel(area, region):
                    region.tag_redraw()


def _shows_panel(area: bpy.types.Area, region: bpy.types.Region) -> bool:
    if (area.type, region.type) == ("VIEW_3D", "UI"):
        return region.active_panel_category == PLACES["VIEW3D"]["bl_category"]
    return (area.type, region.type) == ("PROPERTIES", "WINDOW") and area.spaces.active.context == "RENDER"
