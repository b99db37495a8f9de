"""What bytes, points and exposure make of the light, and that it can be had back."""

import bpy
import numpy as np
import pytest

from radiosity_baker.addon.attribute_writer import remove_layers, write
from radiosity_baker.addon.colour_storage import EXPOSURE_KEY, MeshCorners, Storage, encode, factor_of, in_bytes
from radiosity_baker.addon.scene_reader import read_scene


@pytest.fixture(autouse=True)
def lamp(add_lamp):
    return add_lamp("POINT", {"energy": 10.0}, location=(0, 0, 50))


@pytest.fixture
def strip(add_mesh):
    """A square and a triangle of a quarter of its area beside it, folded up."""
    points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (1, 0, 0.5)]
    return add_mesh("Strip", vertices=points, faces=[(0, 1, 2, 3), (1, 4, 2)])


@pytest.fixture
def store(bake_positions):
    def run(obj, storage, light=None, mode="keep"):
        """Write light, a function of the triangles' world positions (t, 3, 3), and return the attribute's values."""
        scene, sources = read_scene(bpy.context.evaluated_depsgraph_get(), [obj], tessellate=mode != "keep")
        result = bake_positions(scene)
        if light is not None:
            values = result.objects[0].layers["combined"]
            values[...] = light(values)
        (written,) = write(bpy.context, result, sources, result_mode=mode, storage=storage)
        run.warnings = result.report.warnings
        run.mesh = written.data
        attribute = written.data.color_attributes["Radiosity"]
        assert (attribute.domain, attribute.data_type) == (storage.domain, storage.data_type)
        values = np.empty(4 * len(attribute.data), np.float32)
        attribute.data.foreach_get("color", values)
        return values.reshape(-1, 4)

    return run


def test_points_hold_the_mean_of_their_corners_by_area(strip, store):
    # Each face in its own colour: the square 1, the triangle 6.
    values = store(strip, Storage("POINT"), lambda at: np.where(at[..., 2:].max(1, keepdims=True) > 0, 6.0, 1.0))

    shared = (1.0 * 1.0 + 6.0 * 0.25) / 1.25
    np.testing.assert_allclose(values[:, 0], [1.0, shared, shared, 1.0, 6.0], rtol=1e-6)
    assert (values[:, 3] == 1.0).all()


def test_loose_vertices_get_the_mean_of_the_others():
    corners = MeshCorners(np.array([0, 1, 2], np.int32), np.ones(3), 4)
    stored, _ = encode({"combined": np.arange(9, dtype=np.float32).reshape(3, 3)}, corners, Storage("POINT"))
    np.testing.assert_allclose(stored["combined"][3], [3.0, 4.0, 5.0])


@pytest.mark.parametrize("mode", ["keep", "replace", "new"])
@pytest.mark.parametrize("storage", [Storage("POINT"), Storage("POINT", "BYTE_COLOR")])
def test_points_of_a_tessellated_mesh_get_the_light_of_their_place(strip, store, mode, storage):
    values = store(strip, storage, mode=mode)

    places = np.array([vertex.co for vertex in store.mesh.vertices])
    # Bytes: within the largest step, from 254 to 255; what lies on a step of its own, as 0 and 1 do, stays.
    step = 1.0 - ((254 / 255 + 0.055) / 1.055) ** 2.4 if storage.data_type == "BYTE_COLOR" else 1e-6
    np.testing.assert_allclose(values[:, :3], places, atol=step)


def test_bytes_saturate_and_never_wrap(strip, store):
    values = store(strip, Storage(data_type="BYTE_COLOR"), lambda at: at * 0 + np.float32([257 / 255, 1e6, 0.0]))

    np.testing.assert_array_equal(values[:, :3], np.broadcast_to([1.0, 1.0, 0.0], (7, 3)))
    (warning,) = store.warnings
    assert "1e+06" in warning
    assert "-20.0 stops" in warning  # 2^-20 of a million is just below 1


def test_nothing_is_said_where_nothing_is_cut_off(strip, store):
    store(strip, Storage(data_type="BYTE_COLOR", exposure=-20.0), lambda at: at * 0 + 1e6)
    assert store.warnings == []


def test_the_corners_of_a_vertex_stay_one_colour(strip, store):
    values = store(strip, Storage(data_type="BYTE_COLOR"), lambda at: at * 0 + 0.7321)

    of_vertex = [loop.vertex_index for loop in strip.data.loops]
    for vertex in range(5):
        assert len({tuple(v) for v, own in zip(values.tolist(), of_vertex, strict=True) if own == vertex}) == 1


def test_dither_is_right_on_average_and_repeatable():
    count = 100_000
    corners = MeshCorners(np.arange(count, dtype=np.int32), np.ones(count), count)
    light = {"combined": np.full((count, 3), 0.7321, np.float32)}
    first, _ = encode(light, corners, Storage(data_type="BYTE_COLOR"))
    again, _ = encode(light, corners, Storage(data_type="BYTE_COLOR"))

    np.testing.assert_array_equal(first["combined"], again["combined"])
    low, high = np.unique(first["combined"])
    assert low < 0.7321 < high
    # The mean of n two-valued numbers: five standard deviations of at most half a step over sqrt(n).
    assert first["combined"][:, 0].mean() == pytest.approx(0.7321, abs=5 * 0.5 * (high - low) / np.sqrt(count))
    # Thresholds of neighbours tell nothing of each other, or a pattern would show: five standard deviations again.
    upper = (first["combined"][:, 0] == high) - (first["combined"][:, 0] == high).mean()
    assert abs((upper[1:] * upper[:-1]).mean()) < 5 * upper.var() / np.sqrt(count)


def test_what_bytes_can_hold_stays_as_it_is():
    encoded = np.arange(256) / 255
    steps = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    for threshold in (0.0, 0.5, 0.999):
        held = in_bytes(np.repeat(steps[:, None], 3, axis=1), np.full((256, 1), threshold))
        np.testing.assert_array_equal(held[:, 1], steps.astype(np.float32))


@pytest.mark.parametrize("domain", ["CORNER", "POINT"])
def test_exposure_is_kept_and_can_be_taken_back(strip, store, domain):
    plain = store(strip, Storage(domain))
    assert EXPOSURE_KEY not in strip.data
    assert factor_of(strip.data, "Radiosity") == 1.0

    brighter = store(strip, Storage(domain, exposure=1.5))
    assert factor_of(strip.data, "Radiosity") == 2.0**1.5
    np.testing.assert_allclose(brighter[:, :3] / factor_of(strip.data, "Radiosity"), plain[:, :3], rtol=1e-6)

    np.testing.assert_array_equal(store(strip, Storage(domain)), plain)
    assert EXPOSURE_KEY not in strip.data
    store(strip, Storage(domain, exposure=1.5))
    remove_layers(strip.data)
    assert EXPOSURE_KEY not in strip.data
