"""Make the pictures of the documentation with the product itself: bake the samples, and render what was baked.

    .venv/bin/python docs/pictures.py                  all of them, into docs/images/
    .venv/bin/python docs/pictures.py cornell_box      those of one sample; of several when more are named

The bakes, previews and reports they are made from stay in build/pictures/. Pictures of Blender's window are made by
`tests/gui/run --manual`.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import bpy
import numpy as np
from PIL import Image  # comes with matplotlib

from radiosity_baker.addon import command_line
from radiosity_baker.addon.attribute_writer import attribute_name
from radiosity_baker.addon.preview import render_preview

ROOT = Path(__file__).resolve().parent.parent
IMAGES, BAKES = ROOT / "docs" / "images", ROOT / "build" / "pictures"
ATTRIBUTE = "Radiosity"
LAYERS = ("light", "direct", "indirect", "emission", "sky", "error")

#: Pixels across of a picture, of each of two that stand side by side, and of what is between them: small enough for a
#: repository at full colours, since a palette of 256 shows as bands on smooth walls.
ALONE, BESIDE, GAP = 780, 520, 20

#: Stops that an estimated error, which is small, is lifted to be seen.
LIFT = 3.0


#: Triangles for scenes with many sharp shadows; a preview needs fewer.
MANY = 150_000


def bake(sample: str, name: str, triangles: int = 50_000) -> list[bpy.types.Object]:
    """Bake a sample by the command line, open what it wrote, and return the objects that carry the light."""
    baked = BAKES / f"{name}.blend"
    code = command_line.run(
        [
            "bake",
            str(ROOT / "sample_blends" / f"{sample}.blend"),
            f"--output={baked}",
            f"--preview={BAKES / name}.png",
            f"--report={BAKES / name}.json",
            f"--layers={','.join(LAYERS)}",
            f"--triangles={triangles}",
        ]
    )
    if code:
        sys.exit(code)
    bpy.ops.wm.open_mainfile(filepath=str(baked), load_ui=False)
    return [item for item in bpy.context.scene.objects if item.type == "MESH" and ATTRIBUTE in item.data.attributes]


def cornell_box() -> None:
    objects = bake("cornell_box_area_lamp", "cornell_box")
    save([BAKES / "cornell_box.png"], IMAGES / "cornell_box.png", width=ALONE)
    layers = [picture("cornell_box", objects, layer) for layer in ("direct", "indirect", "combined")]
    save(layers, IMAGES / "layers.png", width=400)


def living_room() -> None:
    objects = bake("living_room", "living_room", MANY)
    save([BAKES / "living_room.png"], IMAGES / "living_room.png", width=ALONE)
    paint_materials(objects, "Unlit")
    save(
        [preview("living_room", objects, "Unlit"), BAKES / "living_room.png"], IMAGES / "before_after.png", width=BESIDE
    )
    bpy.context.scene.view_settings.exposure += LIFT
    error = picture("living_room", objects, "error")
    save([BAKES / "living_room.png", error], IMAGES / "error.png", width=BESIDE)


def stage() -> None:
    bake("stage", "stage", MANY)
    save([BAKES / "stage.png"], IMAGES / "stage.png", width=ALONE)


def paint_materials(objects: Sequence[bpy.types.Object], attribute: str) -> None:
    """Give the objects their materials' viewport colours as an attribute: how they look in Blender before a bake."""
    for mesh in {item.data for item in objects}:
        colours = np.array([material.diffuse_color for material in mesh.materials], np.float32)
        slot = np.empty(len(mesh.polygons), np.int32)
        mesh.polygons.foreach_get("material_index", slot)
        corners = np.empty(len(mesh.polygons), np.int32)
        mesh.polygons.foreach_get("loop_total", corners)
        target = mesh.color_attributes.new(attribute, "FLOAT_COLOR", "CORNER")
        target.data.foreach_set("color", np.repeat(colours[slot], corners, axis=0).ravel())


def picture(name: str, objects: Sequence[bpy.types.Object], layer: str) -> Path:
    return preview(name, objects, attribute_name(ATTRIBUTE, layer))


def preview(name: str, objects: Sequence[bpy.types.Object], attribute: str) -> Path:
    path = BAKES / f"{name} {attribute}.png"
    render_preview(bpy.context.scene, objects, path, attribute=attribute)
    return path


def save(sources: Sequence[Path], target: Path, width: int) -> None:
    """Put pictures beside each other, each `width` pixels wide."""
    parts = []
    for source in sources:
        with Image.open(source) as opened:
            whole = opened.convert("RGB")
        parts.append(whole.resize((width, round(width * whole.height / whole.width)), Image.Resampling.LANCZOS))
    sheet = Image.new("RGB", (len(parts) * (width + GAP) - GAP, parts[0].height), "white")
    for number, part in enumerate(parts):
        sheet.paste(part, (number * (width + GAP), 0))
    sheet.save(target, optimize=True)


PICTURES: dict[str, Callable[[], None]] = {"cornell_box": cornell_box, "living_room": living_room, "stage": stage}

if __name__ == "__main__":
    IMAGES.mkdir(parents=True, exist_ok=True)
    BAKES.mkdir(parents=True, exist_ok=True)
    for sample in sys.argv[1:] or PICTURES:
        PICTURES[sample]()
