"""Blender's half: reads the scene, runs the bake, writes the attributes and draws the panel."""

from . import (
    copies,
    headless,
    light_materials,
    operators,
    panels,
    planning,
    presets,
    properties,
    translations,
    viewport,
)

WINDOW = (translations, copies, viewport, light_materials, properties, planning, operators, presets, panels)


def register() -> None:
    for module in WINDOW:
        module.register()
    headless.register_command()


def unregister() -> None:
    headless.unregister_command()
    for module in reversed(WINDOW):
        module.unregister()
