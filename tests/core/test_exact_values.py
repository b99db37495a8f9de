"""Unoccluded form factors that are known in closed form, by the analytic estimator, whole and tessellated.

Sources: J. R. Howell, A catalog of radiation heat transfer configuration factors; the triangles' by the contour
integral in 30 digits. The estimator promises 1e-3 of a whole surface; it is held to that, near, far and touching.
"""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_baker.core.form_factors.analytic import analytic_rows
from radiosity_baker.core.parallel import Workers
from radiosity_baker.core.patches import make_patches, split_objects, unit_space
from radiosity_baker.core.progress import Progress
from radiosity_baker.core.scene import Scene, SceneObject, Surface
from radiosity_baker.core.visibility import Visibility


def surface_form_factor(first: np.ndarray, second: np.ndarray, wanted: int) -> float:
    """F from convex polygon first (v, 3) to second, each seen from where it turns counter-clockwise."""
    objects = []
    for number, corners in enumerate((first, second)):
        fan = np.array([[0, k, k + 1] for k in range(1, len(corners) - 1)], dtype=np.int32)
        surface = np.full(len(fan), number, dtype=np.int32)
        objects.append(SceneObject(f"polygon {number}", np.asarray(corners, dtype=float), fan, surface))
    # The albedo tells the surfaces apart once they are cut into patches.
    scene = Scene(tuple(objects), (Surface("first", (0.25, 0, 0)), Surface("second", (0.5, 0, 0))))
    patches = make_patches(scene, unit_space(scene), split_objects(scene, wanted))
    with Workers(1, Progress()) as workers:
        estimate = analytic_rows(
            patches, Visibility(patches.corners), workers, threshold=0.0, seed=0, purpose="exact values"
        )
    own = estimate.sides.albedo[:, 0] == 0.25
    arrived = estimate.rows.apply(np.where(own, 0.0, 1.0))
    return float((estimate.sides.area * arrived)[own].sum() / estimate.sides.area[own].sum())


def rectangle(corner: tuple[float, ...], u: tuple[float, ...], v: tuple[float, ...]) -> np.ndarray:
    """Faces cross(u, v)."""
    c, a, b = np.array(corner, float), np.array(u, float), np.array(v, float)
    return np.array([c, c + a, c + a + b, c + b])


def parallel(a: float, b: float, gap: float) -> tuple[np.ndarray, np.ndarray]:
    return rectangle((0, 0, 0), (a, 0, 0), (0, b, 0)), rectangle((0, 0, gap), (0, b, 0), (a, 0, 0))


def perpendicular(h: float, w: float, common: float) -> tuple[np.ndarray, np.ndarray]:
    """From w x common on the ground to h x common that stands on their common edge."""
    return rectangle((0, 0, 0), (w, 0, 0), (0, common, 0)), rectangle((0, 0, 0), (0, common, 0), (0, 0, h))


def discs(gap: float) -> tuple[np.ndarray, np.ndarray]:
    """Regular polygons of 48 sides with the area of the unit disc: their rim differs by 0.2 % of the radius at most."""
    angle = 2 * np.pi * np.arange(48) / 48
    radius = np.sqrt(2 * np.pi / (48 * np.sin(2 * np.pi / 48)))
    rim = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(48)], axis=1)
    return rim, np.add(rim, (0, 0, gap))[::-1]


def wedge(degrees: float) -> tuple[np.ndarray, np.ndarray]:
    """Two right isosceles triangles that share a leg."""
    cos, sin = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]]), np.array([[0, 0, 0], [0, 1, 0], [cos, 0, sin]])


CASES = {
    "cube, opposite faces": (parallel(1, 1, 1), 0.199824896),
    "cube, adjacent faces": (perpendicular(1, 1, 1), 0.200043776),
    "parallel 1 x 1.5, gap 0.5": (parallel(1, 1.5, 0.5), 0.475576437),
    "parallel squares, gap 10": (parallel(1, 1, 10), 0.003162057),
    "parallel squares, gap 2": (parallel(1, 1, 2), 0.068589589),
    "parallel squares, gap 0.5": (parallel(1, 1, 0.5), 0.415253284),
    "parallel squares, gap 0.1": (parallel(1, 1, 0.1), 0.826994522),
    "parallel squares, gap 0.01": (parallel(1, 1, 0.01), 0.980416603),
    "perpendicular 2, 1, 1": (perpendicular(2, 1, 1), 0.232852603),
    "perpendicular 1, 2, 1": (perpendicular(1, 2, 1), 0.116426301),
    "perpendicular 10, 1, 1": (perpendicular(10, 1, 1), 0.249209486),
    "perpendicular 0.1, 1, 1": (perpendicular(0.1, 1, 1), 0.043251369),
    "discs, gap 1": (discs(1), 0.381966011),
    "discs, gap 3": (discs(3), 0.091673087),
    "discs, gap 0.1": (discs(0.1), 0.904875078),
    "triangles at 90 degrees": (wedge(90), (3 - np.sqrt(3)) / 6),
    "triangles at 10 degrees": (wedge(10), 0.84009535),
    "triangles at 45 degrees": (wedge(45), 0.49101064),
    "triangles at 60 degrees": (wedge(60), 0.38235710),
    "triangles at 135 degrees": (wedge(135), 0.05219210),
    "triangles at 170 degrees": (wedge(170), 0.00256923),
    "triangles touching at one vertex": (
        (wedge(90)[0], np.array([[0, 0, 0], [0, 0, 1], [0, -1, 0.0]])),
        0.04116904,
    ),
}


@pytest.mark.parametrize("wanted", [2, 150])
@pytest.mark.parametrize("case", CASES)
def test_known_form_factor(case: str, wanted: int) -> None:
    (first, second), expected = CASES[case]
    assert surface_form_factor(first, second, wanted) == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("degrees", [0.1, 1.0])
def test_knife_wedge(degrees: float) -> None:
    """What does not meet the other triangle leaves through the open sides: F falls short of the endless wedge's
    1 - sin(a/2), by less than twice the opening. Rays start 4e-6 off their surface, so near the edge some are lost."""
    opening = np.radians(degrees)
    assert 1 - 2 * opening - 1e-3 < surface_form_factor(*wedge(degrees), 2) < 1 - np.sin(opening / 2)


def test_squares_almost_touching_never_exceed_one() -> None:
    assert 0.997 < surface_form_factor(*parallel(1, 1, 0.001), 2) <= 1.0
