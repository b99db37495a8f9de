"""What a person sees: the panel in the Render properties and in the 3D View's sidebar, and the status bar.

Both places show the same sections; each section is written once, and a class per place is made from it, since Blender
wants one class for every panel of every editor.
"""

import textwrap
from collections.abc import Sequence
from typing import Any, ClassVar

import bpy
from bpy.app.translations import pgettext_iface as tr

from . import light_materials, presets, viewport
from .checklist import FIXES
from .copies import original_of
from .job import BakeJob
from .places import PLACES, redraw_panel
from .planning import Following
from .translations import CONTEXT, told
from .wording import count, energy_line, error_causes, percent, stage, time_line

#: Of the default interface font at scale 1, on average; and what a panel leaves free at its sides, with an icon.
PIXELS_PER_LETTER = 6.0
MARGIN = 70.0


class BakeSection:
    bl_label = "Radiosity"

    def draw(self, context: bpy.types.Context) -> None:
        settings, layout = context.scene.radiosity_baker, self.layout
        if BakeJob.running is None:
            button = layout.column()
            button.scale_y = 1.5
            button.operator("object.radiosity_bake", icon="LIGHT_SUN")
            _label(layout.column(align=True), context, _what_is_baked(context), icon="INFO")
        else:
            _draw_progress(layout, BakeJob.running)

        layout = layout.column()
        layout.enabled = BakeJob.running is None
        layout.use_property_split = True
        layout.use_property_decorate = False
        column = layout.column()
        column.row().prop(settings, "goal", expand=True)
        column.prop(settings, "error" if settings.goal == "ERROR" else "seconds")
        layout.prop(settings, "result")
        column = layout.column()
        column.active = settings.result != "KEEP"
        column.prop(settings, "density")
        column.prop(settings, "triangles" if settings.density == "TRIANGLES" else "size")

    def draw_header_preset(self, _context: bpy.types.Context) -> None:
        menu = (
            presets.VIEW3D_PT_radiosity_presets
            if self.bl_space_type == "VIEW_3D"
            else presets.RENDER_PT_radiosity_presets
        )
        menu.draw_panel_header(self.layout)


class ObjectSection:
    bl_label = "Active Object"
    bl_options: ClassVar[set[str]] = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.object is not None and context.object.type == "MESH"

    def draw(self, context: bpy.types.Context) -> None:
        obj, layout = original_of(context.view_layer, context.object), self.layout
        own = obj.radiosity_baker
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.label(text=obj.name, icon="OBJECT_DATA")
        column = layout.column(heading="Light")
        column.prop(own, "receives")
        column.prop(own, "casts")
        column.prop(own, "bounces")
        row = layout.row(heading="Longest Edge")
        row.prop(own, "use_size", text="")
        size = row.row()
        size.active = own.use_size
        size.prop(own, "size", text="")


class LastBakeSection:
    bl_label = "Last Bake"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.scene.radiosity_baker.last_report() is not None

    def draw(self, context: bpy.types.Context) -> None:
        settings, layout = context.scene.radiosity_baker, self.layout
        report = settings.last_report()
        if viewport.is_shown(context):
            layout.operator("view3d.radiosity_restore", icon="LOOP_BACK")
        else:
            layout.operator("view3d.radiosity_show", icon="HIDE_OFF")
        column = layout.column(align=True)
        column.operator("object.radiosity_show_light", icon="MATERIAL")
        column.operator("object.radiosity_show_lit", icon="SHADING_TEXTURE")
        if light_materials.shows_light(light_materials.last_baked(context.scene)):
            layout.operator("object.radiosity_put_back", icon="LOOP_BACK")
        layers = viewport.baked_layers(context.scene, report)
        if len(layers) > 1:
            grid = layout.grid_flow(columns=3, even_columns=True, align=True)
            for layer in layers:
                grid.prop_enum(settings, "layer", layer)

        row = layout.row(align=True)
        row.operator("object.radiosity_bake", text="Bake Again")
        row.operator("object.radiosity_refine")
        row.operator("object.radiosity_clear", text="Clear")
        column = layout.column(align=True)
        _figure(column, "Baked", count("object", len(report["objects"])))
        _figure(column, "Triangles", f"{sum(entry['triangles'] for entry in report['objects']):,}")
        _figure(column, "Time", f"{report['seconds']['total']:.1f} s")
        if "total" in report["estimated_error"]:
            column = layout.column(align=True)
            _figure(column, "Estimated Error", percent(report["estimated_error"]["total"]))
            for cause, share in error_causes(report):
                _figure(column, cause.capitalize(), percent(share), active=False)
        _label(layout.column(align=True), context, energy_line(report))
        for warning in report["warnings"]:
            _label(layout.column(align=True), context, warning, icon="ERROR")


class PlanSection:
    bl_label = "Check and Plan"

    def draw(self, context: bpy.types.Context) -> None:
        settings, layout = context.scene.radiosity_baker, self.layout
        plan = settings.last_plan()
        layout.operator("object.radiosity_plan", icon="VIEWZOOM")
        if settings.plan and Following.behind:
            _label(layout.column(align=True), context, tr("Changed since: check again"), icon="FILE_REFRESH")
        for number, problem in enumerate(settings.problems()):
            column = layout.box().column(align=True)
            _label(column, context, problem.text, icon="ERROR")
            column.operator("object.radiosity_fix", text=FIXES[problem.kind][0]).number = number
        if settings.plan and not settings.problems():
            layout.label(text="Nothing stands in the way", icon="CHECKMARK")
        if "seconds" in plan:
            column = layout.column(align=True)
            _figure(column, "Time", tr("About {amount}").format(amount=f"{plan['seconds']:.1f} s"))
            _figure(column, "Memory", tr("About {amount}").format(amount=f"{plan['memory_mb']:,.0f} MB"))
        if plan.get("costs"):
            grid = layout.grid_flow(row_major=True, columns=2, even_columns=True, align=True)
            for error, seconds in plan["costs"]:
                text = f"{100 * error:g} %: {seconds:.0f} s"
                grid.operator("object.radiosity_accuracy", text=text).percent = 100 * error
        if plan.get("effects"):
            _draw_effects(layout, context, plan["effects"])


class AdvancedSection:
    bl_label = "Advanced"
    bl_options: ClassVar[set[str]] = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        settings, layout = context.scene.radiosity_baker, self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop(settings, "estimator")
        layout.prop(settings, "seed")
        layout.prop(settings, "threads")
        layout.prop(settings, "attribute")
        layout.prop(settings, "domain")
        layout.prop(settings, "data_type")
        layout.prop(settings, "exposure")
        layout.prop(settings, "show_while_baking")
        layout.prop(settings, "show_when_done")
        layout.column().prop(settings, "layers", expand=True)


def redraw(context: bpy.types.Context) -> None:
    """Draw the panel and the status bar anew."""
    redraw_panel(context)
    for window in context.window_manager.windows:
        window.workspace.status_text_set(_draw_status if BakeJob.running is not None else None)


def _what_is_baked(context: bpy.types.Context) -> str:
    selected = sum(candidate.type == "MESH" for candidate in context.selected_objects)
    rendered = sum(obj.type == "MESH" and not obj.hide_render for obj in context.view_layer.objects)
    if 0 < selected < rendered:
        return tr("Bakes the selection: {some} of {all} meshes").format(some=selected, all=rendered)
    return tr("Bakes all meshes")


def _draw_effects(layout: bpy.types.UILayout, context: bpy.types.Context, effects: Sequence[dict[str, Any]]) -> None:
    """Those that are simulated, and the others below, out of the way."""
    for effect in effects:
        if effect["active"]:
            _draw_effect(layout, context, effect)
    header, body = layout.panel("radiosity_other_effects", default_closed=True)
    header.label(text="Not Simulated")
    for effect in effects if body is not None else ():
        if not effect["active"]:
            _draw_effect(body, context, effect)


def _draw_effect(layout: bpy.types.UILayout, context: bpy.types.Context, effect: dict[str, Any]) -> None:
    """A switch, and the reason why it stands as it does."""
    column = layout.column(align=True)
    column.active = effect["active"]
    name = told(effect["name"])
    row = column.row()
    row.alignment = "LEFT"
    switch = row.operator(
        "object.radiosity_switch_effect",
        text=name[0].upper() + name[1:],
        translate=False,
        icon="CHECKBOX_HLT" if effect["active"] else "CHECKBOX_DEHLT",
        emboss=False,
    )
    switch.effect, switch.active = effect["name"], effect["active"]
    _label(column, context, effect["reason"], icon="BLANK1")


def _draw_progress(layout: bpy.types.UILayout, job: BakeJob) -> None:
    """As high as the button and the label it stands in for, so that nothing below it moves."""
    row = layout.row(align=True)
    row.scale_y = 1.5
    row.progress(factor=job.progress.fraction, text=stage(job))
    row.operator("object.radiosity_keep", icon="CHECKMARK", text="")
    row.operator("object.radiosity_cancel", icon="X", text="")
    layout.label(text=time_line(job), icon="TIME")


def _draw_status(header: bpy.types.Header, _context: bpy.types.Context) -> None:
    job, layout = BakeJob.running, header.layout
    if job is None:
        return
    key = layout.row(align=True)
    key.label(icon="EVENT_ESC")
    key.separator(factor=2.0)
    key.label(text="Cancel Bake")
    layout.separator_spacer()
    bar = layout.row()
    bar.ui_units_x = 16
    bar.progress(factor=job.progress.fraction, text=stage(job))
    layout.label(text=time_line(job))
    layout.separator_spacer()


def _figure(layout: bpy.types.UILayout, name: str, value: str, *, active: bool = True) -> None:
    """A name and its value, aligned as Blender aligns a property."""
    split = layout.split(factor=0.5)
    split.active = active
    right = split.row()
    right.alignment = "RIGHT"
    right.label(text=name, text_ctxt=CONTEXT)
    split.label(text=value)


def _label(layout: bpy.types.UILayout, context: bpy.types.Context, text: str, icon: str = "NONE") -> None:
    """A text over as many lines as the region's width calls for; Blender's own labels cut it off."""
    width = context.region.width / context.preferences.system.ui_scale - MARGIN
    whole = told(text).replace(" %", "\N{NO-BREAK SPACE}%")
    for line in textwrap.wrap(whole, max(20, int(width / PIXELS_PER_LETTER))):
        layout.label(text=line, icon=icon)
        icon = "NONE" if icon == "NONE" else "BLANK1"


def _panels() -> list[type]:
    """A panel for every section in every place, parents before their children."""
    made = []
    for place, where in PLACES.items():
        main = f"{place}_PT_radiosity"
        for section in (BakeSection, ObjectSection, LastBakeSection, PlanSection, AdvancedSection):
            name = main if section is BakeSection else f"{main}_{section.__name__.removesuffix('Section').lower()}"
            about = dict(where, bl_idname=name)
            if section is not BakeSection:
                about["bl_parent_id"] = main
            made.append(type(name, (section, bpy.types.Panel), about))
    return made


PANELS = _panels()


def register() -> None:
    for panel in PANELS:
        bpy.utils.register_class(panel)


def unregister() -> None:
    for panel in reversed(PANELS):
        bpy.utils.unregister_class(panel)
