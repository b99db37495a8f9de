"""Every kind of lamp against Cycles: what core.scene's lamp classes state, evaluated here, is what Cycles bakes."""

import math

import bpy
import numpy as np
import pytest

from radiosity_baker.addon.lamps import NARROWEST_SPREAD, read_lamp, warn_of_linking
from radiosity_baker.core.scene import AreaLamp, PointLamp, SpotLamp, SunLamp

POINTS = np.array([[0.01, 0.0, 0.0], [1.0, 0.0, 0.0], [0.3, 0.4, 1.2], [2.0, 0.5, 1.0], [-0.5, 1.5, 0.3]])
UP = np.tile([0.0, 0.0, 1.0], (len(POINTS), 1))
ABOVE = (0.0, 0.0, 2.0)
# Probes are 1e-4 wide and Cycles bakes in float32; what has a size is sampled: 2048 Sobol points leave under 0.3 %.
EXACT = 2e-4
SAMPLED = 3e-3
GRID = (np.arange(300) + 0.5) / 300


def read(obj):
    lamp, warnings = read_lamp(obj.name, obj.data, np.array(obj.matrix_world, dtype=np.float64))
    assert warnings == []
    return lamp


def irradiance(lamp, points=POINTS, normals=UP):
    return np.array([EVALUATE[type(lamp)](lamp, q, n) for q, n in zip(points, normals, strict=True)])


def of_samples(places, normal, weights, seen_from, through):
    """Integral over a lamp's surface, (..., 3) places with normals and area weights, seen from (point, normal)."""
    q, n = seen_from
    ray = q - places
    square = (ray**2).sum(-1)
    ray = ray / np.sqrt(square)[..., None]
    cosines = np.maximum(0.0, (ray * normal).sum(-1)) * np.maximum(0.0, -ray @ n)
    return (cosines / square * weights * through(ray)).sum()


def of_ball(lamp, q, n, through=lambda _: 1.0):
    position, radius = np.array(lamp.position), lamp.radius
    intensity = np.array(lamp.intensity)
    axis = q - position
    distance = np.linalg.norm(axis)
    axis = axis / distance
    if radius == 0.0:
        return intensity * through(axis) * max(0.0, -axis @ n) / distance**2
    side = np.cross(axis, [0.6, 0.8, 0.1])
    side /= np.linalg.norm(side)
    turn = 2.0 * np.pi * GRID[:, None, None]
    around = np.cos(turn) * side + np.sin(turn) * np.cross(axis, side)
    radiance = intensity / (np.pi * radius**2)
    if lamp.facing_disc:
        places = position + radius * np.sqrt(GRID)[None, :, None] * around
        return radiance * of_samples(places, axis, np.pi * radius**2 / GRID.size**2, (q, n), through)
    edge = math.sqrt(1.0 - (radius / distance) ** 2)
    cosine = (1.0 - (1.0 - edge) * GRID)[None, :, None]
    ray = cosine * axis + np.sqrt(1.0 - cosine**2) * around
    return radiance * 2.0 * np.pi * (1.0 - edge) * (np.maximum(0.0, -ray @ n) * through(ray)).mean()


def of_spot(lamp, q, n):
    to_local = np.linalg.inv(np.array(lamp.axes))
    half = lamp.cone_angle / 2.0

    def through(ray):
        local = ray @ to_local
        cosine = -local[..., 2] / np.linalg.norm(local, axis=-1)
        x = np.clip((cosine - math.cos(half)) / max((1.0 - math.cos(half)) * lamp.blend, 1e-12), 0.0, 1.0)
        return x * x * (3.0 - 2.0 * x)

    return of_ball(lamp, q, n, through)


def of_sun(lamp, q, n):
    del q
    toward = -np.array(lamp.direction)
    side = np.cross(toward, [0.6, 0.8, 0.1])
    side /= np.linalg.norm(side)
    edge = math.cos(lamp.angle / 2.0)
    cosine = (1.0 - (1.0 - edge) * GRID)[None, :, None]
    turn = 2.0 * np.pi * GRID[:, None, None]
    around = np.cos(turn) * side + np.sin(turn) * np.cross(toward, side)
    rays = cosine * toward + np.sqrt(1.0 - cosine**2) * around
    if lamp.angle == 0.0:
        return np.array(lamp.irradiance) * max(0.0, toward @ n)
    radiance = np.array(lamp.irradiance) / (np.pi * math.sin(lamp.angle / 2.0) ** 2)
    return radiance * 2.0 * np.pi * (1.0 - edge) * np.maximum(0.0, rays @ n).mean()


def of_panel(lamp, q, n):
    u, v = (2.0 * GRID - 1.0)[:, None, None], (2.0 * GRID - 1.0)[None, :, None]
    area = 4.0
    if lamp.shape == "ellipse":
        radius, turn = np.sqrt(GRID)[:, None, None], 2.0 * np.pi * GRID[None, :, None]
        u, v, area = radius * np.cos(turn), radius * np.sin(turn), np.pi
    normal, half_u, half_v = np.array(lamp.normal), np.array(lamp.half_u), np.array(lamp.half_v)
    places = np.array(lamp.center) + u * half_u + v * half_v
    area *= np.linalg.norm(np.cross(half_u, half_v))

    def through(ray):
        if lamp.spread >= np.pi:
            return 1.0
        half = lamp.spread / 2.0
        cosine = np.maximum(ray @ normal, 1e-9)
        tangent = np.sqrt(np.maximum(0.0, 1.0 - cosine**2)) / cosine
        return np.maximum(0.0, (math.tan(half) - tangent) / (math.tan(half) - half))

    return np.array(lamp.radiance) * of_samples(places, normal, area / GRID.size**2, (q, n), through)


EVALUATE = {PointLamp: of_ball, SpotLamp: of_spot, SunLamp: of_sun, AreaLamp: of_panel}


@pytest.mark.parametrize(
    "case",
    [
        ("POINT", {"shadow_soft_size": 0.0}, {}, EXACT),
        ("POINT", {"shadow_soft_size": 0.0}, {"scale": (2.0, 2.0, 2.0)}, EXACT),
        ("POINT", {"shadow_soft_size": 0.5}, {}, SAMPLED),
        ("POINT", {"shadow_soft_size": 0.5, "use_soft_falloff": False}, {"scale": (1.0, 1.0, 3.0)}, SAMPLED),
        ("SPOT", {"shadow_soft_size": 0.0, "spot_size": 2.4, "spot_blend": 0.6}, {}, EXACT),
        (
            "SPOT",
            {"shadow_soft_size": 0.0, "spot_size": 1.8},
            {"scale": (2, 1, 1), "rotation_euler": (0.3, 0.2, 0.5)},
            EXACT,
        ),
        ("SPOT", {"shadow_soft_size": 0.0, "spot_size": 1.2}, {"scale": (-1, 0.5, 0.3)}, EXACT),
        ("SPOT", {"shadow_soft_size": 0.5, "spot_size": 1.2, "spot_blend": 1.0}, {}, SAMPLED),
        (
            "SPOT",
            {"shadow_soft_size": 0.5, "spot_size": 1.2, "use_soft_falloff": False, "spot_blend": 1.0},
            {},
            SAMPLED,
        ),
        ("SUN", {"angle": 0.0}, {"rotation_euler": (0.4, 0.2, 0.0)}, EXACT),
        ("SUN", {"angle": 1.0}, {"rotation_euler": (0.9, 0.2, 0.0), "scale": (3.0, 3.0, 3.0)}, SAMPLED),
        ("SUN", {"angle": 3.0}, {"rotation_euler": (1.2, 0.2, 0.0)}, SAMPLED),
        ("AREA", {"shape": "SQUARE", "size": 1.0}, {}, SAMPLED),
        ("AREA", {"shape": "RECTANGLE", "size": 1.0, "size_y": 0.4}, {"scale": (2, 0.5, 3)}, SAMPLED),
        ("AREA", {"shape": "DISK", "size": 1.0}, {"rotation_euler": (0.2, 0.3, 0.5)}, SAMPLED),
        ("AREA", {"shape": "ELLIPSE", "size": 1.0, "size_y": 0.4}, {"scale": (2, 0.5, 1)}, SAMPLED),
        ("AREA", {"shape": "SQUARE", "size": 1.0}, {"scale": (-2, 0.5, 1), "rotation_euler": (0.2, 0.3, 0.5)}, SAMPLED),
        ("AREA", {"shape": "SQUARE", "size": 0.6, "spread": 2.0}, {}, SAMPLED),
        ("AREA", {"shape": "DISK", "size": 0.6, "spread": 1.0}, {}, SAMPLED),
    ],
)
def test_a_lamp_gives_what_cycles_gives(add_lamp, cycles_irradiance, case):
    kind, settings, placed, kept = case
    obj = add_lamp(kind, {"energy": 100.0, "color": (1.0, 0.5, 0.25), **settings}, location=ABOVE, **placed)
    expected = cycles_irradiance(POINTS, UP, samples=16 if kept == EXACT else 2048)

    found = irradiance(read(obj))

    assert expected.max() > 0.1
    np.testing.assert_allclose(found, expected, atol=kept * expected.max())


NEWER = pytest.mark.skipif(
    "exposure" not in bpy.types.Light.bl_rna.properties,
    reason="this Blender has no exposure, temperature and normalize",
)


@NEWER
@pytest.mark.parametrize(
    ("kind", "settings"),
    [
        ("POINT", {"shadow_soft_size": 0.0, "exposure": 1.5}),
        ("POINT", {"shadow_soft_size": 0.0, "use_temperature": True, "temperature": 3000.0}),
        ("POINT", {"shadow_soft_size": 0.0, "normalize": False}),
        ("POINT", {"shadow_soft_size": 0.3, "normalize": False}),
        ("SPOT", {"shadow_soft_size": 0.3, "normalize": False, "spot_size": 3.1}),
        ("SUN", {"angle": 0.0, "normalize": False}),
        ("SUN", {"angle": 0.5, "normalize": False}),
        ("AREA", {"size": 0.5, "normalize": False}),
        ("AREA", {"size": 0.5, "normalize": False, "shape": "DISK"}),
    ],
)
def test_newer_lamp_settings_mean_what_cycles_means(add_lamp, cycles_irradiance, kind, settings):
    obj = add_lamp(kind, {"energy": 100.0, **settings}, location=ABOVE, scale=(2.0, 1.0, 1.0), rotation_euler=(0, 0, 1))
    expected = cycles_irradiance(POINTS, UP, samples=512)

    np.testing.assert_allclose(irradiance(read(obj)), expected, atol=SAMPLED * expected.max())


def test_a_lamps_emission_node_scales_it(add_lamp, cycles_irradiance, shader):
    obj = add_lamp("POINT", {"energy": 100.0, "shadow_soft_size": 0.0}, location=ABOVE)
    shader(obj.data, "ShaderNodeEmission", Color=(1.0, 0.5, 0.0, 1.0), Strength=3.0)
    expected = cycles_irradiance(POINTS, UP, samples=16)

    np.testing.assert_allclose(irradiance(read(obj)), expected, atol=EXACT * expected.max())


def test_a_parallel_beam_keeps_its_power_within_the_narrowest_spread(add_lamp, cycles_irradiance):
    obj = add_lamp("AREA", {"energy": 100.0, "size": 0.6, "spread": 0.0}, location=ABOVE)
    middle, up = POINTS[:1], UP[:1]
    expected = cycles_irradiance(middle, up, samples=512)
    lamp = read(obj)

    assert lamp.spread == NARROWEST_SPREAD
    assert expected[0, 0] == pytest.approx(100.0 / 0.36, rel=1e-3)
    # The beam is narrower than the lamp, so the middle sees all of it: (tan h - a) integrates to pi (tan h - h).
    assert lamp.radiance[0] * np.pi == pytest.approx(expected[0, 0], rel=1e-3)


@pytest.mark.parametrize(
    ("kind", "settings", "placed", "warning"),
    [
        ("POINT", {"energy": 0.0}, {}, None),
        ("POINT", {"color": (0.0, 0.0, 0.0)}, {}, None),
        ("POINT", {"energy": -1.0}, {}, "takes light away"),
        ("AREA", {"size": 0.0}, {}, "has no area"),
        ("SPOT", {}, {"scale": (1.0, 0.0, 1.0)}, "scaled to nothing"),
    ],
)
def test_lamps_without_light_are_left_out_and_say_why(add_lamp, kind, settings, placed, warning):
    obj = add_lamp(kind, {"energy": 10.0, **settings}, **placed)

    lamp, warnings = read_lamp("My lamp", obj.data, np.array(obj.matrix_world, dtype=np.float64))

    assert lamp is None
    assert [w for w in warnings if "'My lamp'" in w and warning in w] if warning else warnings == []


def test_a_portal_is_no_lamp(add_lamp):
    obj = add_lamp("AREA", {"energy": 10.0})
    obj.data.cycles.is_portal = True

    assert read_lamp("Portal", obj.data, np.eye(4)) == (None, [])


def test_a_lamp_without_shadows_shines_through_everything(add_lamp, add_mesh, cycles_irradiance):
    """As Cycles has it, and as the closed form without a roof."""
    obj = add_lamp("POINT", {"energy": 10.0, "use_shadow": False, "shadow_soft_size": 0.0}, location=(0, 0, 2))
    lamp, warnings = read_lamp("Fill", obj.data, np.array(obj.matrix_world))
    assert not lamp.casts_shadow
    assert warnings == []
    add_mesh("Roof", vertices=((-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)))
    seen = cycles_irradiance([(0.0, 0.0, 0.0)], [(0.0, 0.0, 1.0)])
    assert seen[0] == pytest.approx(10.0 / (4.0 * np.pi) / 4.0, rel=1e-3)


def test_light_linking_is_warned_of_by_name(add_lamp):
    obj = add_lamp("POINT")
    assert warn_of_linking("Key", obj) == []
    obj.light_linking.receiver_collection = bpy.data.collections.new("Only these")
    assert "'Key'" in warn_of_linking("Key", obj)[0]


@pytest.mark.parametrize("kind", ["ShaderNodeTexIES", "ShaderNodeLightFalloff"])
def test_what_shapes_a_lamps_light_and_is_not_read_is_warned_of_by_name(add_lamp, shader, kind):
    obj = add_lamp("POINT", {"energy": 10.0})
    emission = shader(obj.data, "ShaderNodeEmission", Strength=1.0)
    tree = obj.data.node_tree
    tree.links.new(tree.nodes.new(kind).outputs[0], emission.inputs["Strength"])
    _, warnings = read_lamp("Lamp", obj.data, np.eye(4))
    assert len(warnings) == 1
    assert f"'{obj.data.name}'" in warnings[0]
