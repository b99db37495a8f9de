"""Pictures of vertex colours before and after, from the viewport of a real window: Cycles' bake to face corners beside
ours, on meshes of about as many triangles. `tests/gui/run --colours` starts Blender with this script, first without a
window, to bake, and then with one.

Both are shown as a person sees them: solid shading, attribute colours, flat light; with the same exposure.
"""

import importlib
import os
import shutil
import subprocess
import traceback
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector

PACKAGE = "bl_ext.user_default.radiosity_baker"
DESK = Path(os.environ["DESK"])
#: Samples of Cycles for each corner; ours has the settings that a new scene has.
SAMPLES = 128
#: This share of the corners may be brighter than that, where 1 is as bright as a screen can be.
BRIGHTER, BRIGHT = 0.02, 0.9


@dataclass(frozen=True)
class View:
    """Where a scene is looked at from, and to; lens in mm."""

    eye: tuple[float, float, float]
    target: tuple[float, float, float]
    lens: float


VIEWS = {
    "cornell_box": View((0, -4.6, 1), (0, 0, 1), 112),
    "doorway": View((-3.7, -1.6, 2.0), (0.6, 0.3, 0.75), 38),
    "courtyard": View((4.5, -10.5, 6.5), (0.0, 0.2, 0.2), 58),
}


def module(name):
    return importlib.import_module(f"{PACKAGE}.{name}")


def bake(name):
    """Leave a file with Cycles' bake and one with ours, and say how many triangles each has."""
    measure, colours = module("docs.bench.measure"), module("docs.colours.measure")
    settings = module("core.settings").Settings()
    ours = measure.bake_once(name, "", settings, None)
    values = [colours_of(copy) for copy in ours.copies]
    white = np.quantile(np.concatenate(values), 1.0 - BRIGHTER) / BRIGHT
    keep(name, "ours", ours.copies, [value / white for value in values])
    even = colours.even_bake(name, ours.run.triangles, passes=2, seed=0)
    corners = module("addon.oracle").corner_bake(bpy.context, even.copies, samples=SAMPLES, seed=1, threads=0)
    keep(name, "cycles", even.copies, [value / white for value in corners])
    print(f"{name}: {even.run.triangles} triangles of Cycles, {ours.run.triangles} of ours", flush=True)


def colours_of(obj):
    colours = np.empty(len(obj.data.loops) * 4, np.float32)
    obj.data.color_attributes["Radiosity"].data.foreach_get("color", colours)
    return colours.reshape(-1, 4)[:, :3]


def keep(name, whose, objects, values):
    """Save a file that holds nothing but the objects with the values of their corners."""
    for obj in list(bpy.data.objects):
        if obj not in objects:
            bpy.data.objects.remove(obj)
    for obj, colours in zip(objects, values, strict=True):
        target = obj.data.color_attributes["Radiosity"]
        target.data.foreach_set("color", np.column_stack([colours, np.ones(len(colours))]).astype(np.float32).ravel())
        obj.data.color_attributes.active_color = target
    bpy.ops.object.select_all(action="DESELECT")
    bpy.ops.wm.save_as_mainfile(filepath=str(DESK / f"{name}_{whose}.blend"), copy=True)


def view_area():
    return max(
        (area for area in bpy.context.window.screen.areas if area.type == "VIEW_3D"),
        key=lambda area: area.width * area.height,
    )


def look(view):
    space = view_area().spaces.active
    for what, value in module("addon.viewport").BAKED_LOOK.items():
        setattr(space.shading, what, value)
    space.shading.show_backface_culling = space.shading.show_object_outline = False
    space.overlay.show_overlays = space.show_gizmo = False
    space.show_region_header = space.show_region_tool_header = space.show_region_toolbar = False
    space.lens, space.clip_start = view.lens, 0.01
    way = Vector(view.target) - Vector(view.eye)
    region = space.region_3d
    region.view_perspective, region.view_location, region.view_distance = "PERSP", Vector(view.target), way.length
    region.view_rotation = way.to_track_quat("-Z", "Y")


def pictures(name, view):
    for whose in ("cycles", "ours"):
        bpy.ops.wm.open_mainfile(filepath=str(DESK / f"{name}_{whose}.blend"), load_ui=False)
        yield 1.0
        if len(bpy.context.window.screen.areas) > 1:
            with bpy.context.temp_override(area=view_area()):
                bpy.ops.screen.screen_full_area(use_hide_panels=True)
            yield 1.0
        look(view)
        yield 2.0
        path = DESK / "pictures" / f"{name}_{whose}.png"
        subprocess.run([shutil.which("import"), "-window", "root", str(path)], check=True)


def steps():
    bpy.context.preferences.view.show_splash = False
    for name in NAMES:
        yield from pictures(name, VIEWS[name])


def drive(walk):
    try:
        return next(walk)
    except StopIteration:
        os._exit(0)
    except BaseException:  # noqa: BLE001 - whatever it was, the window must not stay open
        traceback.print_exc()
        os._exit(1)


NAMES = os.environ.get("SCENES", "").split() or list(VIEWS)
if bpy.app.background:
    for scene_name in NAMES:
        bake(scene_name)
else:
    walk = steps()
    bpy.app.timers.register(lambda: drive(walk), first_interval=1.0, persistent=True)
