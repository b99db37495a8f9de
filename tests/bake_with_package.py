"""Run by test_extension.py in a Python without embreex: install the package, bake with it, print what was seen."""

from __future__ import annotations

import importlib
import importlib.util
import json
import sys
from pathlib import Path

import bpy
import numpy as np

PACKAGE = "bl_ext.user_default.radiosity_baker"


def main(archive: str) -> None:
    assert importlib.util.find_spec("embreex") is None
    assert importlib.util.find_spec("radiosity_baker") is None
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.extensions.package_install_files(filepath=archive, repo="user_default", enable_on_install=True)

    bpy.ops.mesh.primitive_plane_add(size=4.0)
    floor = bpy.context.object
    bpy.ops.object.light_add(type="POINT", location=(0.0, 0.0, 2.0))
    bpy.context.object.data.energy = 100.0
    bpy.context.view_layer.objects.active = floor
    bpy.context.object.select_set(True)
    settings = bpy.context.scene.radiosity_baker
    settings.result, settings.density, settings.size = "REPLACE", "SIZE", 0.3
    bpy.ops.object.radiosity_bake()
    colours = np.array([corner.color for corner in floor.data.color_attributes["Radiosity"].data])

    blend = Path(bpy.utils.resource_path("USER")) / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    headless = importlib.import_module(f"{PACKAGE}.addon.headless")
    code = headless.main(["bake", str(blend), "--output", str(blend.with_name("baked.blend")), "--quiet"])

    embreex = importlib.import_module("embreex")
    bpy.ops.preferences.addon_disable(module=PACKAGE)
    seen = {
        "package": headless.__name__.removesuffix(".addon.headless"),
        "embreex": embreex.__file__,
        "brightest": float(colours[:, :3].max()),
        "darkest": float(colours[:, :3].min()),
        "headless": code,
        "registered_after_disabling": hasattr(bpy.types.Scene, "radiosity_baker"),
    }
    print(json.dumps(seen))


if __name__ == "__main__":
    main(sys.argv[1])
