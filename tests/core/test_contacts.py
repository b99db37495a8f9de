"""Where bodies touch, nearly touch and cross: no vertex is darker or brighter than the true light around it.

An even sky of radiance 1 lights a receiver beside a black convex body, so the light is 1 less the form factor of the
body's faces that look that way: exact, by Lambert's formula, and no face of a convex body hides another.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from radiosity_baker.core.bake import bake
from radiosity_baker.core.form_factors.polygon import polygon_irradiance
from radiosity_baker.core.patches import triangle_geometry
from radiosity_baker.core.plan import choose_effort
from radiosity_baker.core.result import BakedObject
from radiosity_baker.core.scene import Scene, SceneObject, Surface
from radiosity_baker.core.settings import Settings
from radiosity_baker.core.shapes import box, quad, sphere
from radiosity_baker.core.tessellation import triform, whole
from radiosity_baker.core.visibility import Visibility

SURFACES = (Surface("grey", (0.5, 0.5, 0.5)), Surface("black", (0.0, 0.0, 0.0)))
SIZE, PASSES, RAYS = 0.25, 8, 32
#: A vertex is the mean of PASSES samples at least, each the share of RAYS rays that see the sky: five standard
#: deviations at the most uncertain share. The black ring that an unfilled vertex draws is three times as deep.
BOUND = 5 * 0.5 / np.sqrt(PASSES * RAYS)
FLOOR = quad("floor", (-1, -1, 0), (2, 0, 0), (0, 2, 0))
SIDE = box("side", (-0.5, -0.5, 0), (0, 0.5, 0.7))
GAPS = (0.0, 0.001, 0.03, 0.1)


def turned(body: SceneObject, axis: int, degrees: float, about=(0.0, 0.0, 0.0)) -> SceneObject:
    i, j = [(1, 2), (2, 0), (0, 1)][axis]
    cosine, sine = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    matrix = np.eye(3)
    matrix[[i, i, j, j], [i, j, i, j]] = cosine, -sine, sine, cosine
    return replace(body, vertices=(body.vertices - about) @ matrix.T + about)


def moved(body: SceneObject, by) -> SceneObject:
    return replace(body, vertices=body.vertices + by)


def box_on_plane(gap, degrees):
    return FLOOR, turned(box("body", (-0.3, -0.2, gap), (0.33, 0.37, gap + 0.5), surface=1), 2, degrees)


def sphere_on_plane(gap, degrees):
    ball = turned(sphere("body", 0.4, level=1, surface=1), 0, degrees)
    return FLOOR, moved(ball, (-0.03, -0.01, gap - ball.vertices[:, 2].min()))


def two_boxes(gap, degrees):
    body = box("body", (gap, -0.3, -0.1), (gap + 0.4, 0.33, 0.45), surface=1)
    return SIDE, turned(body, 0, degrees, (0, 0, 0.2))


def crossing_planes(gap, degrees):
    sheet = turned(quad("body", (0, -0.7, 0), (0.9, 0, 0), (0, 1.4, 0), surface=1), 1, -degrees)
    return FLOOR, moved(sheet, (0.013, 0.02, gap))


CASES = [
    *((box_on_plane, gap, degrees) for gap in GAPS for degrees in (0, 22.5, 45)),
    *((sphere_on_plane, gap, degrees) for gap in GAPS for degrees in (0, 45)),
    *((two_boxes, gap, degrees) for gap in (*GAPS, -0.2) for degrees in (0, 22.5, 45)),
    *((crossing_planes, gap, degrees) for gap in (-0.3, *GAPS[:3]) for degrees in (90, 60, 22.5)),
]


def baked(receiver: SceneObject, body: SceneObject, *, tessellate: bool = True) -> BakedObject:
    scene = Scene((receiver, replace(body, receives=False)), SURFACES, sky=(1.0, 1.0, 1.0))
    settings = Settings(size=SIZE, error=None, layers=("light",), threads=2, tessellate=tessellate)
    effort = replace(choose_effort(scene, settings), patches=200, passes=PASSES, gather_rays=RAYS)
    return bake(scene, settings, effort=effort).objects[0]


def grid(count: int = 8) -> np.ndarray:
    """Barycentric coordinates of even points of a triangle, a hair inside."""
    i, j = np.nonzero(np.add.outer(np.arange(count + 1), np.arange(count + 1)) <= count)
    return np.column_stack([i, j, count - i - j]) / count * (1 - 3e-4) + 1e-4


def shortfall_and_excess(result: BakedObject, body: SceneObject, *, sheet: bool) -> tuple[float, float]:
    """How much darker the worst vertex is than all light that can be seen around it, and how much brighter."""
    corners = result.vertices[result.triangles]
    normals, area = triangle_geometry(corners)
    points = np.einsum("bi,tik->tbk", grid(), corners).reshape(-1, 3)
    facing = np.repeat(normals, len(grid()), axis=0)
    faces = body.vertices[body.triangles]
    true = 1.0 - sum(polygon_irradiance(points, facing, face, two_sided=sheet) for face in faces)
    # Out of sight is what lies inside the body, and what is dim in a gap much narrower than the cell.
    reach = np.repeat(np.sqrt(2 * area) / 4, len(grid()))[:, None] * facing
    covered = ~Visibility(faces).unblocked((points + 1e-6 * facing).astype(np.float32), (points + reach).astype("f4"))
    hidden = covered & (true < 0.5 * true.mean())
    # Nobody sees a triangle that lies in a gap as a whole.
    hidden |= np.repeat(covered.reshape(len(corners), -1).all(axis=1), len(grid()))
    if not sheet:
        outward = triangle_geometry(faces)[0]
        height = points @ outward.T - np.einsum("tk,tk->t", faces[:, 0], outward)
        hidden |= (height < 1e-9).all(axis=1)
    seen = (~hidden).reshape(len(corners), -1)
    true = true.reshape(seen.shape)
    where = np.column_stack([np.round(corners.reshape(-1, 3), 7), np.round(np.repeat(normals, 3, axis=0), 4)])
    vertex = np.unique(where, axis=0, return_inverse=True)[1].reshape(-1)
    low, high = np.full(vertex.max() + 1, np.inf), np.full(vertex.max() + 1, -np.inf)
    np.minimum.at(low, vertex, np.repeat(np.where(seen, true, np.inf).min(axis=1), 3))
    np.maximum.at(high, vertex, np.repeat(np.where(seen, true, -np.inf).max(axis=1), 3))
    value = result.layers["light"][..., 0].reshape(-1)
    shows = np.repeat(seen.any(axis=1), 3)
    return float((low[vertex] - value)[shows].max()), float((value - high[vertex])[shows].max())


@pytest.mark.parametrize(("place", "gap", "degrees"), CASES)
def test_no_vertex_leaves_the_range_of_the_light_around_it(place, gap, degrees):
    receiver, body = place(gap, degrees)
    short, excess = shortfall_and_excess(baked(receiver, body), body, sheet=place is crossing_planes)
    assert short < BOUND
    assert excess < BOUND


@pytest.mark.parametrize(("gap", "degrees"), [(0.0, 22.5), (0.001, 45)])
def test_nor_does_one_of_a_mesh_that_is_kept(gap, degrees):
    floor, body = box_on_plane(gap, degrees)
    mesh = triform(whole(floor.vertices, floor.triangles), SIZE)
    fine = replace(floor, vertices=mesh.vertices, triangles=mesh.triangles, surface=floor.surface[mesh.parent])
    result = baked(fine, body, tessellate=False)
    assert len(result.triangles) == len(mesh.triangles)
    short, excess = shortfall_and_excess(result, body, sheet=False)
    assert short < BOUND
    assert excess < BOUND


def test_a_floor_under_a_box_is_dark_up_to_the_triangles_that_show():
    """The light of what is seen may reach as far under the box as the triangles that its outline crosses, and no
    further; and those that show in part are not dark."""
    body = box("body", (-0.5, -0.5, 0), (0.5, 0.5, 0.7), surface=1, receives=False)
    scene = Scene((FLOOR, body), SURFACES, sky=(1.0, 1.0, 1.0))
    (baked,) = bake(scene, Settings(size=0.15, error=0.1)).objects
    corners = np.abs(baked.vertices[baked.triangles][:, :, :2])
    inside = (corners <= 0.5).all(axis=(1, 2))
    light = baked.layers["combined"].max(axis=(1, 2))
    assert inside.any()
    assert light[inside].max() == 0
    assert light[(corners.max(axis=2) > 0.5 + 1e-9).any(axis=1)].min() > 0
