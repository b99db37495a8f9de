"""What a glTF export holds of the baked light: the file's own data, read here without Blender."""

import json
import struct

import bpy
import numpy as np
import pytest

from radiosity_baker.addon.attribute_writer import write
from radiosity_baker.addon.colour_storage import Storage
from radiosity_baker.addon.scene_reader import read_scene

#: Of glTF's component types (glTF 2.0, 3.6.2.2), those that colours and positions have: dtype, and what 1 is.
COMPONENTS = {5121: (np.uint8, 255.0), 5123: (np.uint16, 65535.0), 5126: (np.float32, 1.0)}
WIDTHS = {"VEC3": 3, "VEC4": 4}


def read_accessor(path, semantic):
    """The values (n, k) that the only primitive of a .glb has for a semantic, normalised to floats."""
    data = path.read_bytes()
    length = struct.unpack_from("<I", data, 12)[0]
    document, binary = json.loads(data[20 : 20 + length]), data[20 + length + 8 :]
    (mesh,) = document["meshes"]
    (primitive,) = mesh["primitives"]
    accessor = document["accessors"][primitive["attributes"][semantic]]
    view = document["bufferViews"][accessor["bufferView"]]
    kind, one = COMPONENTS[accessor["componentType"]]
    width, begin = WIDTHS[accessor["type"]], view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
    assert "byteStride" not in view or view["byteStride"] == width * np.dtype(kind).itemsize
    values = np.frombuffer(binary, kind, accessor["count"] * width, begin).reshape(-1, width)
    return values / one


@pytest.mark.parametrize("data_type", ["FLOAT_COLOR", "BYTE_COLOR"])
def test_the_file_holds_the_combined_light(add_mesh, add_lamp, bake_positions, tmp_path, data_type):
    """Each corner is painted with its place, so what the file says of a vertex must be where the file says it is."""
    add_lamp("POINT", {"energy": 10.0}, location=(0, 0, 50))
    quad = add_mesh("Quad")
    scene, sources = read_scene(bpy.context.evaluated_depsgraph_get(), [quad], tessellate=True)
    result = bake_positions(scene, 2, ("direct", "combined"))
    result.objects[0].layers["direct"] = np.zeros_like(result.objects[0].layers["combined"])
    (copy,) = write(bpy.context, result, sources, result_mode="new", storage=Storage(data_type=data_type))
    copy.data.color_attributes.active_color_name = "Radiosity Direct"  # What the viewport shows must not matter.
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj == copy)
    path = tmp_path / "baked.glb"

    bpy.ops.export_scene.gltf(
        filepath=str(path), export_format="GLB", use_selection=True, export_yup=False, export_vertex_color="ACTIVE"
    )

    place, colour = read_accessor(path, "POSITION"), read_accessor(path, "COLOR_0")
    assert len(place) >= 25
    # 16 bits in the file; bytes moreover are off by less than a step, the largest of which is the last.
    step = 1.0 - ((254 / 255 + 0.055) / 1.055) ** 2.4 if data_type == "BYTE_COLOR" else 0.0
    np.testing.assert_allclose(colour[:, :3], place, atol=step + 1 / 65535)
