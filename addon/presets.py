"""Presets: three that come with the add-on, and below them a person's own, in Blender's preset menu."""

from __future__ import annotations

from typing import ClassVar

import bpy
from bl_operators.presets import AddPresetBase
from bl_ui.utils import PresetPanel

#: What each is for, and the settings it changes.
PRESETS = {
    "draft": ("A quick look: coarse and 10 % off", {"goal": "ERROR", "error": 10.0, "triangles": 10_000}),
    "preview": ("Good enough to judge the light by", {"goal": "ERROR", "error": 5.0, "triangles": 25_000}),
    "production": ("For keeps: fine and 1 % off", {"goal": "ERROR", "error": 1.0, "triangles": 200_000}),
}
#: What a preset of one's own keeps.
KEPT = ("goal", "error", "seconds", "result", "density", "triangles", "size", "layers", "estimator")
KEPT += ("attribute", "domain", "data_type", "exposure")
FOLDER = "radiosity_baker"


class RADIOSITY_MT_presets(bpy.types.Menu):
    bl_label = "Radiosity Presets"
    preset_subdir = FOLDER
    preset_operator = "script.execute_preset"
    draw = bpy.types.Menu.draw_preset


class RADIOSITY_OT_add_preset(AddPresetBase, bpy.types.Operator):
    bl_idname = "radiosity.add_preset"
    bl_label = "Add Radiosity Preset"
    bl_description = "Keep these settings as a preset, or remove one"
    preset_menu = "RADIOSITY_MT_presets"
    preset_subdir = FOLDER
    preset_defines: ClassVar[list[str]] = ["asked = bpy.context.scene.radiosity_baker"]
    preset_values: ClassVar[list[str]] = [f"asked.{name}" for name in KEPT]


class RADIOSITY_OT_choose_preset(bpy.types.Operator):
    bl_idname = "radiosity.choose_preset"
    bl_label = "Choose Preset"
    bl_description = "Use the settings of this preset"
    bl_options: ClassVar[set[str]] = {"REGISTER", "UNDO"}

    preset: bpy.props.EnumProperty(name="Preset", items=[(n, n.capitalize(), said) for n, (said, _) in PRESETS.items()])

    def execute(self, context: bpy.types.Context) -> set[str]:
        for name, value in PRESETS[self.preset][1].items():
            setattr(context.scene.radiosity_baker, name, value)
        return {"FINISHED"}


class _Presets(PresetPanel):
    bl_label = "Radiosity Presets"
    preset_subdir = FOLDER
    preset_operator = "script.execute_preset"
    preset_add_operator = "radiosity.add_preset"

    def draw(self, context: bpy.types.Context) -> None:
        column = self.layout.column(align=True)
        for preset in PRESETS:
            column.operator("radiosity.choose_preset", text=preset.capitalize()).preset = preset
        self.layout.separator()
        if bpy.utils.preset_paths(FOLDER):
            super().draw(context)
        else:
            self._draw_first(context.window_manager)

    def _draw_first(self, manager: bpy.types.WindowManager) -> None:
        """As Blender draws it below presets; where there are none yet it complains of missing paths."""
        row = self.layout.row()
        row.prop(manager, "preset_name", text="")
        row.operator(self.preset_add_operator, text="", icon="ADD").name = manager.preset_name


class VIEW3D_PT_radiosity_presets(_Presets, bpy.types.Panel):
    bl_space_type, bl_region_type = "VIEW_3D", "HEADER"


class RENDER_PT_radiosity_presets(_Presets, bpy.types.Panel):
    bl_space_type, bl_region_type = "PROPERTIES", "HEADER"


CLASSES = (
    RADIOSITY_MT_presets,
    RADIOSITY_OT_add_preset,
    RADIOSITY_OT_choose_preset,
    VIEW3D_PT_radiosity_presets,
    RENDER_PT_radiosity_presets,
)


def register() -> None:
    for item in CLASSES:
        bpy.utils.register_class(item)


def unregister() -> None:
    for item in reversed(CLASSES):
        bpy.utils.unregister_class(item)
