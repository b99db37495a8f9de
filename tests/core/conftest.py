"""Simple scenes that have closed forms, and the stages of the pipeline on them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from radiosity_baker.core.direct.illumination import DirectLight
from radiosity_baker.core.parallel import Workers
from radiosity_baker.core.patch_contacts import cut_at_contacts
from radiosity_baker.core.patches import Patches, make_patches, split_objects, triangle_geometry, unit_space
from radiosity_baker.core.plan import Effort, choose_effort
from radiosity_baker.core.progress import Progress
from radiosity_baker.core.result import BakedObject
from radiosity_baker.core.scene import AreaLamp, Scene, Surface
from radiosity_baker.core.settings import Settings
from radiosity_baker.core.shapes import box, quad, sphere, triangles
from radiosity_baker.core.sky import Sky
from radiosity_baker.core.transport import Transport, make_transport
from radiosity_baker.core.visibility import Visibility

GREY = Surface("grey", (0.5, 0.5, 0.5))


def furnished_room(albedo=0.7) -> Scene:
    """A closed room of 2 m, a box that stands on its floor, and a lamp under its ceiling."""
    lamp = AreaLamp("lamp", (0, 0, 1.9), (0.3, 0, 0), (0, 0.3, 0), (0, 0, -1), (10.0, 9.0, 8.0))
    room = box("room", (-1, -1, 0), (1, 1, 2), inward=True, surface=[0, 1, 2, 2, 2, 2])
    block = box("block", (-0.5, -0.3, 0), (0.1, 0.3, 0.8), surface=2)
    surfaces = (
        Surface("red", (albedo, 0.1, 0.1)),
        Surface("green", (0.1, albedo, 0.1)),
        Surface("white", (albedo, albedo, albedo)),
    )
    return Scene((room, block), surfaces, (lamp,))


def effort(**changes) -> Effort:
    """The usual effort, on fewer patches, solved to rounding and with nothing culled, with changes."""
    usual = choose_effort(furnished_room(), Settings())
    return replace(usual, **({"patches": 500, "tolerance": 1e-6, "threshold": 0.0} | changes))


def patches_of(scene: Scene, wanted: int) -> Patches:
    return make_patches(scene, unit_space(scene), split_objects(scene, wanted))


def mean_light(baked: BakedObject) -> np.ndarray:
    """The mean radiance (3,) over the surface of what was baked, however its triangles are spread."""
    area = triangle_geometry(baked.vertices[baked.triangles])[1]
    return area @ baked.layers["combined"].astype(float).mean(axis=1) / area.sum()


@pytest.fixture(scope="session")
def build() -> SimpleNamespace:
    """Builders of objects, scenes and stages, by name."""
    return SimpleNamespace(
        grey=GREY,
        quad=quad,
        triangles=triangles,
        box=box,
        sphere=sphere,
        furnished_room=furnished_room,
        effort=effort,
        patches=patches_of,
        mean_light=mean_light,
    )


@pytest.fixture
def workers() -> Iterator[Workers]:
    with Workers(2, Progress()) as two:
        yield two


@pytest.fixture
def transport(workers):
    """Solve the exchange of light in a scene; lights: what is sampled as lamps; cut: patches at contacts, as a bake
    does."""

    def run(scene: Scene, lights=(), seed=0, purpose="test", *, cut=False, **changes) -> Transport:
        asked = effort(**changes)
        patches = patches_of(scene, asked.patches)
        if cut:
            split = split_objects(scene, asked.patches)
            whole = Visibility(patches.corners)
            patches = make_patches(scene, unit_space(scene), cut_at_contacts(split, patches, whole))
        visibility = Visibility(patches.corners)
        direct_light = DirectLight(list(lights), visibility, seed)
        sky = Sky.of(scene.sky)
        return make_transport(patches, visibility, direct_light, sky, asked, workers, seed=seed, purpose=purpose)

    return run
