"""What is known in closed form: form factors of shapes, and the light in scenes.

Sources: J. R. Howell, A catalog of radiation heat transfer configuration factors; the triangles' by the contour
integral (see form_factors.contour) in 30 digits; the light by conservation of energy and the inverse square law.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from .patches import triangle_geometry
from .scene import AreaLamp, Float64, PointLamp, Scene, SceneObject, SunLamp, Surface, Vector
from .shapes import box, polygon, quad, sphere, triangles

#: Longest edge, in metres, of the triangles that are to show how a lamp's light falls off over a metre.
_FINE = 0.09
#: Corners of the regular polygons that stand for discs: of the same area, and with a rim within 0.2 % of theirs.
_DISC_CORNERS = 48


@dataclass(frozen=True, eq=False)
class FormFactor:
    """exact: the share of the light that leaves the front of `first` and arrives at the front of `second`.

    slack: relative, what the shapes themselves, being polygons, differ from those of the formula.
    """

    name: str
    first: SceneObject
    second: SceneObject
    exact: float
    slack: float = 0.0


def form_factors() -> Iterator[FormFactor]:
    """All of them."""
    yield FormFactor("unit cube, opposite faces", *parallel(1, 1, 1), 0.199824896)
    yield FormFactor("unit cube, adjacent faces", *perpendicular(1, 1, 1), 0.200043776)
    yield FormFactor("parallel 1 x 1.5, gap 0.5", *parallel(1, 1.5, 0.5), 0.475576437)
    for gap, exact in (
        (10, 0.003162057),
        (2, 0.068589589),
        (0.5, 0.415253284),
        (0.1, 0.826994522),
        (0.01, 0.980416603),
    ):
        yield FormFactor(f"parallel unit squares, gap {gap}", *parallel(1, 1, gap), exact)
    for (h, w), exact in (
        ((2, 1), 0.232852603),
        ((1, 2), 0.116426301),
        ((10, 1), 0.249209486),
        ((0.1, 1), 0.043251369),
    ):
        yield FormFactor(f"perpendicular, heights {h} and {w}", *perpendicular(h, w, 1), exact)
    for gap, exact in ((1, 0.381966011), (3, 0.091673087), (0.1, 0.904875078)):
        yield FormFactor(f"coaxial discs, gap {gap}", disc("first", 0), disc("second", gap, downward=True), exact, 1e-3)
    for height, exact in ((1, 0.146446609), (2, 0.052786405), (0.1, 0.450248140)):
        yield FormFactor(f"ball to coaxial disc, height {height}", _ball(height), disc("disc", 0), exact, 6e-3)
    for degrees, exact in (
        (10, 0.84009535),
        (45, 0.49101064),
        (60, 0.38235710),
        (90, (3 - np.sqrt(3)) / 6),
        (135, 0.05219210),
        (170, 0.00256923),
    ):
        yield FormFactor(f"two triangles sharing a leg, {degrees} degrees", *wedge(degrees), float(exact))
    corner = triangles("second", [(0, 0, 0), (0, 0, 1), (0, -1, 0)], [(0, 1, 2)])
    yield FormFactor("two triangles touching at a corner", wedge(90)[0], corner, 0.04116904)
    for degrees in (20, 60, 120):
        yield strips(degrees)


def parallel(a: float, b: float, gap: float) -> tuple[SceneObject, SceneObject]:
    """Two rectangles a x b that face each other."""
    return quad("first", (0, 0, 0), (a, 0, 0), (0, b, 0)), quad("second", (0, 0, gap), (0, b, 0), (a, 0, 0))


def perpendicular(h: float, w: float, common: float) -> tuple[SceneObject, SceneObject]:
    """A rectangle w x common on the ground, and h x common that stands on their common edge."""
    return quad("first", (0, 0, 0), (w, 0, 0), (0, common, 0)), quad("second", (0, 0, 0), (0, common, 0), (0, 0, h))


def disc(name: str, height: float, *, downward: bool = False) -> SceneObject:
    """The unit disc, as a regular polygon of the same area."""
    angle = 2 * np.pi * np.arange(_DISC_CORNERS) / _DISC_CORNERS
    radius = np.sqrt(2 * np.pi / (_DISC_CORNERS * np.sin(2 * np.pi / _DISC_CORNERS)))
    rim: Float64 = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(_DISC_CORNERS, height)], axis=1)
    return polygon(name, rim[::-1] if downward else rim)


def wedge(degrees: float) -> tuple[SceneObject, SceneObject]:
    """Two right isosceles triangles that share a leg and open by an angle."""
    cos, sin = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    first = triangles("first", [(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
    return first, triangles("second", [(0, 0, 0), (0, 1, 0), (cos, 0, sin)], [(0, 1, 2)])


def strips(degrees: float, length: float = 400.0) -> FormFactor:
    """Two endless strips of unit width that share an edge: 1 - sin(a/2).

    From one of finite length at most 4 / (pi * length) leaves by both ends: (acos s - s sqrt(1 - s^2)) / pi is the
    share of light whose way has a sine over s along the strip, and what arrives d farther along has tan > d / 2 at
    least; integrated over d that is 2 / pi for each end.
    """
    angle = np.radians(degrees)
    across: Vector = (float(np.cos(angle)), 0.0, float(np.sin(angle)))
    exact = float(1 - np.sin(angle / 2))
    first, second = quad("first", u=(1, 0, 0), v=(0, length, 0)), quad("second", u=(0, length, 0), v=across)
    return FormFactor(f"endless strips, {degrees} degrees", first, second, exact, 4 / (np.pi * length) / exact)


def _ball(height: float) -> SceneObject:
    """A ball around (0, 0, height); what its 512 faces show in any direction is within 0.6 % of what a ball's would."""
    ball = sphere("ball", radius=height / 20, level=3)
    return SceneObject(ball.name, np.add(ball.vertices, (0, 0, height)), ball.triangles, ball.surface)


@dataclass(frozen=True, eq=False)
class KnownLight:
    """exact: combined radiance W/(m^2 sr), red channel, at points (n, 3) metres of the receivers.

    slack: relative to the largest exact value, what shapes and interpolation over triangles with edges up to `edge`
    metres may differ from the formula. mean: only the mean over the receivers' area is known; it is off by no more than
    the error that the bake states, which is a root mean square.
    """

    name: str
    scene: Scene
    exact: Callable[[Float64], Float64]
    slack: float
    edge: float = 0.5
    mean: bool = False


def known_light() -> Iterator[KnownLight]:
    """All of them. Where no shadow falls and nothing is blocked, only interpolation is left: see the slacks."""
    for albedo in (0.5, 0.9, 0.99, 0.999, 0.9999):
        yield furnace(albedo)
    white, half = _grey(0.8), _grey(0.5)
    ground = quad("ground")
    yield KnownLight("open ground under an even sky", Scene((ground,), (half,), sky=(2.0, 2.0, 2.0)), _even(1.0), 1e-6)
    sun = SunLamp("sun", (0.6, 0.0, -0.8), (3.0, 3.0, 3.0), angle=0.02)
    yield KnownLight("open ground under the sun", Scene((ground,), (half,), (sun,)), _even(1.2 / np.pi), 1e-6)
    yield _under_a_lamp("ground under a point lamp", 0.0)
    yield _under_a_lamp("ground under a ball lamp", 0.5)
    yield _under_a_panel()
    yield KnownLight("closed room under a bright sky", Scene((box(inward=True),), (half,), sky=(1e6,) * 3), _even(0), 0)
    yield KnownLight("closed room without light", Scene((box(inward=True),), (white,)), _even(0), 0)
    yield _lit_room()
    yield _ball_in_a_ball()


def furnace(albedo: float) -> KnownLight:
    """A closed room, every surface of which emits 1: 1 / (1 - albedo). Rows of single precision, 6e-8, come back so
    often, and the solve stops at a ten-thousandth."""
    scene = Scene((box(inward=True),), (Surface("glowing", (albedo,) * 3, (1.0,) * 3),))
    return KnownLight(f"furnace of albedo {albedo}", scene, _even(1 / (1 - albedo)), 1e-4 + 6e-8 / (1 - albedo))


def _under_a_lamp(name: str, radius: float) -> KnownLight:
    """I cos / d^2, for a ball as for a point."""
    lamp = PointLamp("lamp", (0.5, 0.5, 10.0), (100.0,) * 3, radius, facing_disc=False)

    def exact(points: Float64) -> Float64:
        way = np.array(lamp.position) - points
        return np.asarray(0.5 / np.pi * 100.0 * way[:, 2] / np.linalg.norm(way, axis=1) ** 3)

    return KnownLight(name, Scene((quad("ground"),), (_grey(0.5),), (lamp,)), exact, _bend(10.0), _FINE)


def _bend(height: float) -> float:
    """Relative difference between a lamp's light on the ground and a plane fitted to it over three triangles, which is
    how far the smoothest fit looks: the second derivative of the fourth power of the cosine is 4 / height^2 at most."""
    return (3 * _FINE) ** 2 / 2 * 4 / height**2


def _under_a_panel() -> KnownLight:
    """Element to parallel rectangle (Howell B-3), once for each quarter of the panel."""
    height, half = 5.0, 1.0
    lamp = AreaLamp("panel", (0.5, 0.5, height), (half, 0, 0), (0, half, 0), (0, 0, -1), (10.0,) * 3)

    def corner(x: Float64, y: Float64) -> Float64:
        one, two = np.sqrt(height**2 + x**2), np.sqrt(height**2 + y**2)
        return np.asarray((x / one * np.arctan(y / one) + y / two * np.arctan(x / two)) / (2 * np.pi))

    def exact(points: Float64) -> Float64:
        x, y = points[:, 0] - 0.5, points[:, 1] - 0.5
        factor = sum(corner(half + a * x, half + b * y) for a in (-1, 1) for b in (-1, 1))
        return np.asarray(0.5 * 10.0 * factor)

    return KnownLight(
        "ground under an area lamp", Scene((quad("ground"),), (_grey(0.5),), (lamp,)), exact, _bend(height), _FINE
    )


def _lit_room() -> KnownLight:
    """In any closed room of one albedo p, lit by a power P: mean irradiance P / (A (1 - p)), whatever its shape."""
    albedo, power = 0.5, 10.0
    lamp = PointLamp("lamp", (0.3, 0.5, 0.6), (power / (4 * np.pi),) * 3)
    room = box(inward=True, high=(1, 1, 2))
    exact = albedo / np.pi * power / (10.0 * (1 - albedo))
    return KnownLight(
        "mean light in a closed room", Scene((room,), (_grey(albedo),), (lamp,)), _even(exact), 0.0, 0.15, mean=True
    )


def _ball_in_a_ball() -> KnownLight:
    """A black ball of area a that emits M, in a white one of area A, albedo p: irradiance M a / (A - p (A - a))."""
    albedo = 0.8
    inner, outer = sphere("inner", 0.5, 2, surface=1), sphere("outer", 1.0, 2, inward=True)
    inner = SceneObject(inner.name, inner.vertices, inner.triangles, inner.surface, receives=False)
    areas = [float(triangle_geometry(o.vertices[o.triangles])[1].sum()) for o in (inner, outer)]
    exact = albedo / np.pi * np.pi * areas[0] / (areas[1] - albedo * (areas[1] - areas[0]))
    scene = Scene((inner, outer), (_grey(albedo), Surface("lamp", (0.0,) * 3, (1.0,) * 3)))
    return KnownLight("a glowing ball in a white one", scene, _even(exact), 0.0, 0.15, mean=True)


def _grey(albedo: float) -> Surface:
    return Surface("grey", (albedo,) * 3)


def _even(radiance: float) -> Callable[[Float64], Float64]:
    return lambda points: np.full(len(points), float(radiance))
