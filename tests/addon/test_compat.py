"""Old and new Blenders by their features, stood in for by plain objects."""

from types import SimpleNamespace

import numpy as np
import pytest

from radiosity_baker.addon.compat import lamp_strength, shader_tree

TREE = object()


def owner(*, use_nodes=None, **rna):
    """A datablock whose `use_nodes` has the given RNA facts, or that has none when use_nodes is None."""
    properties = {} if use_nodes is None else {"use_nodes": SimpleNamespace(**rna)}
    made = SimpleNamespace(bl_rna=SimpleNamespace(properties=properties), node_tree=TREE)
    if use_nodes is not None:
        made.use_nodes = use_nodes
    return made


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        (owner(use_nodes=True), TREE),
        (owner(use_nodes=False), None),
        (owner(use_nodes=False, is_deprecated=False), None),
        (owner(use_nodes=False, is_deprecated=True), TREE),
        (owner(), TREE),
    ],
)
def test_nodes_count_when_they_are_in_use_or_always_are(data, expected):
    assert shader_tree(data) is expected


def test_a_lamp_of_an_old_blender_is_colour_times_energy():
    lamp = SimpleNamespace(color=(1.0, 0.5, 0.25), energy=8.0)
    assert lamp_strength(lamp, np.eye(4)) == (8.0, 4.0, 2.0)


def test_a_lamp_of_a_newer_blender_has_exposure_temperature_and_area():
    matrix = np.arange(16.0).reshape(4, 4)
    asked = []

    def area(matrix_world):
        asked.append(matrix_world)
        return 10.0

    lamp = SimpleNamespace(
        color=(1.0, 0.5, 0.25),
        energy=8.0,
        exposure=2.0,
        use_temperature=True,
        temperature_color=(2.0, 1.0, 0.5),
        normalize=False,
        area=area,
    )

    assert lamp_strength(lamp, matrix) == (640.0, 160.0, 40.0)
    # Blender's array of a matrix goes column by column.
    np.testing.assert_array_equal(asked, [matrix.T])

    lamp.use_temperature, lamp.normalize = False, True
    assert lamp_strength(lamp, matrix) == (32.0, 16.0, 8.0)
