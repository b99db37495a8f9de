"""The picture of a running bake has the colours that Solid shading shows."""

import numpy as np
import pytest

from radiosity_baker.addon.live_light import Picture, to_screen
from radiosity_baker.core.result import BakedObject, BakeResult, Report


def test_the_screens_curve_is_srgb_and_clips():
    # IEC 61966-2-1: linear 0.2140 is the middle of the curve.
    linear = np.array([-1.0, 0.0, 0.001, 0.21404114, 1.0, 7.0], np.float32)
    assert to_screen(linear) == pytest.approx([0.0, 0.0, 0.01292, 0.5, 1.0, 1.0], abs=1e-6)


def test_every_corner_has_its_place_and_colour():
    vertices = np.arange(12.0).reshape(4, 3)
    triangles = np.array([[0, 1, 2], [3, 2, 1]], np.int32)
    light = np.random.default_rng(0).random((2, 3, 3)).astype(np.float32)
    baked = BakedObject("A", vertices, triangles, np.zeros(2, np.int32), np.zeros((2, 3, 3)), {"combined": light})
    picture = Picture.of(BakeResult((baked, baked), Report()))
    assert picture.positions == pytest.approx(np.tile(vertices[triangles].reshape(-1, 3), (2, 1)))
    assert picture.colors[6:, :3] == pytest.approx(to_screen(light.reshape(-1, 3)))
    assert (picture.colors[:, 3] == 1.0).all()
