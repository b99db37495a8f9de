"""What cannot be baked is refused before any work, by the name of what is wrong and what to do about it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .cost import refuse_without_room
from .patches import bounds, triangle_geometry
from .plan import Plan
from .scene import ALBEDO_LIMIT, AreaLamp, Scene, SceneError, SceneObject, SkyMap, Surface

#: Beyond this many half extents from the origin, single precision shows in the result.
_FAR = 1e5

#: Share of their squared extent that the faces to be baked must cover: less is the rounding of none.
_NO_AREA = 1e-14

#: Share of the scene's extent under which an object is lost between two coordinates of single precision.
_LOST = 2.0 * float(np.finfo(np.float32).eps)
#: Output triangles beyond which no machine that Blender runs on holds a bake.
_MOST_CELLS = 20_000_000


def check_cost(plan: Plan) -> None:
    """Raise SceneError, with numbers, before a bake that is too large, or larger than the memory that is free."""
    if plan.cells > _MOST_CELLS:
        raise SceneError(
            f"This bake would split the objects into {plan.cells:,} triangles and hold {plan.memory_mb / 1e3:,.0f} GB: "
            f"choose a larger triangle size, or fewer triangles; {_MOST_CELLS:,} are the most."
        )
    refuse_without_room(plan.memory_mb)


def check_scene(scene: Scene) -> Scene:
    """The scene in an order that does not depend on that of its objects, with warnings. Raises SceneError."""
    objects = tuple(sorted((o for o in scene.objects if len(o.triangles)), key=lambda o: o.name))
    if not any(o.receives for o in objects):
        raise SceneError("Nothing to bake: no object with faces was chosen. Select a mesh object and bake again.")
    for scene_object in objects:
        _check_object(scene_object, len(scene.surfaces))
    _check_area([o for o in objects if o.receives])
    _check_sizes(objects)
    warnings = list(scene.warnings)
    surfaces = tuple(_check_surface(surface, warnings) for surface in scene.surfaces)
    for lamp in scene.lamps:
        if not np.isfinite(np.concatenate([np.ravel(v) for v in vars(lamp).values() if not isinstance(v, str)])).all():
            raise SceneError(f"Lamp '{lamp.name}' has a value that is not a number: check its transform and its power.")
        if isinstance(lamp, AreaLamp) and not np.cross(lamp.half_u, lamp.half_v).any():
            raise SceneError(f"Lamp '{lamp.name}' has no area to shine from: give it a size, or make it a point lamp.")
    sky = scene.sky.pixels if isinstance(scene.sky, SkyMap) else np.array(scene.sky)
    if not np.isfinite(sky).all() or sky.min() < 0:
        raise SceneError("The sky has a colour that is negative or not a number: check the nodes of the world.")
    extent = max(float(np.max(np.ptp(o.vertices, axis=0))) for o in objects)
    away = max(float(np.abs(o.vertices).max()) for o in objects)
    if away > _FAR * max(extent, 1e-30):
        warnings.append(
            f"The scene is {away / extent:,.0f} times its own size away from the origin, where Blender's coordinates "
            "are coarse: move it nearer for an exact bake."
        )
    return replace(
        scene,
        objects=objects,
        surfaces=surfaces,
        lamps=tuple(sorted(scene.lamps, key=lambda lamp: lamp.name)),
        warnings=tuple(warnings),
    )


def _check_object(scene_object: SceneObject, surfaces: int) -> None:
    name, vertices, triangles = scene_object.name, scene_object.vertices, scene_object.triangles
    if triangles.min() < 0 or triangles.max() >= len(vertices):
        raise SceneError(f"'{name}' has faces that use vertices which do not exist: run Mesh > Clean Up > Validate.")
    if len(scene_object.surface) != len(triangles) or scene_object.surface.max() >= surfaces:
        raise SceneError(f"'{name}' has faces whose material does not exist: assign a material to all of them.")
    if not np.isfinite(vertices[triangles]).all():
        raise SceneError(f"'{name}' has vertices without finite coordinates: delete them, or undo what made them.")
    if scene_object.uv is not None and not np.isfinite(scene_object.uv).all():
        raise SceneError(f"'{name}' has UV coordinates that are not numbers: unwrap it again.")
    if scene_object.colors is not None and not (
        np.isfinite(scene_object.colors).all() and scene_object.colors.min() >= 0
    ):
        raise SceneError(f"'{name}' has vertex colours that are negative or not numbers: paint it again.")


def _check_area(receivers: list[SceneObject]) -> None:
    if not any(map(_has_area, receivers)):
        names = ", ".join(f"'{o.name}'" for o in receivers[:3])
        raise SceneError(f"Nothing to bake: the faces of {names} have no area. Check its scale, or delete them.")


def _check_sizes(objects: tuple[SceneObject, ...]) -> None:
    """A vertex that flew off makes the scene so large that nothing else has a size in it."""
    low, high = bounds(objects)
    extent = float((high.max(axis=0) - low.min(axis=0)).max())
    own, receives = (high - low).max(axis=1), np.array([o.receives for o in objects])
    lost = np.flatnonzero(receives & (own > 0.0) & (own < _LOST * extent))
    if len(lost):
        reach = np.maximum(np.abs(low - low[lost[0]]), np.abs(high - low[lost[0]])).max(axis=1)
        name, far = objects[lost[0]].name, objects[int(reach.argmax())].name
        raise SceneError(
            f"'{name}' is lost in a scene of {extent:.0e} m, where nothing so small can be told apart: move '{far}' "
            "nearer, or delete its vertices that are far away."
        )


def _has_area(scene_object: SceneObject) -> bool:
    corners = scene_object.vertices[scene_object.triangles]
    extent = float(np.ptp(corners.reshape(-1, 3), axis=0).max())
    return float(triangle_geometry(corners)[1].sum()) > _NO_AREA * extent**2


def _check_surface(surface: Surface, warnings: list[str]) -> Surface:
    shares = np.array([surface.albedo, surface.transmission, surface.mirror, surface.glass])
    values = np.concatenate([shares.ravel(), surface.emission, surface.transparent, [surface.opacity]])
    if not np.isfinite(values).all() or values.min() < 0:
        raise SceneError(f"Material '{surface.name}' has a colour that is negative or not a number: pick another.")
    for texture in (surface.albedo_texture, surface.emission_texture):
        if texture is not None and not (np.isfinite(texture.pixels).all() and texture.pixels.min() >= 0):
            raise SceneError(f"Material '{surface.name}' has an image with values that are negative or not numbers.")
    total = shares.sum(axis=0)
    if total.max() <= ALBEDO_LIMIT and values[-4:].max() <= 1.0:
        return surface
    if total.max() > ALBEDO_LIMIT and not shares[2:].any() and surface.albedo_texture is None:
        warnings.append(
            f"Material '{surface.name}' reflects all light or more; {ALBEDO_LIMIT:.2%} is used. Nothing real is whiter "
            "than fresh snow at 90 %: pick a darker colour."
        )
    limited = shares * (ALBEDO_LIMIT / np.maximum(total, ALBEDO_LIMIT))
    albedo, transmission, mirror, glass = ((float(r), float(g), float(b)) for r, g, b in limited)
    red, green, blue = (min(channel, 1.0) for channel in surface.transparent)
    return replace(
        surface,
        albedo=albedo,
        transmission=transmission,
        mirror=mirror,
        glass=glass,
        opacity=min(surface.opacity, 1.0),
        transparent=(red, green, blue),
    )
