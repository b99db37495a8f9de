"""The effects of light a bake can simulate: whether a scene calls for each, why, and what the scene is without it.

Every effect is a function `judge(scene, settings)` that answers with an `Effect`, and a function `without(scene)` that
takes it out of the scene: what is not called for is not there for the rest of the bake, and so costs nothing. Effects
that are ways of computing rather than parts of the scene leave it as it is; the stages ask `Plan.active` for them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from math import ceil, log
from typing import Any, Literal

import numpy as np

from .convexity import nothing_stands_between
from .direct.sky import split_bright
from .patches import triangle_geometry
from .result import Effect
from .scene import (
    LAMP_COLOUR,
    RGB,
    AreaLamp,
    Float32,
    Float64,
    Lamp,
    PointLamp,
    Scene,
    SceneError,
    SkyMap,
    SpotLamp,
    SunLamp,
    Surface,
    Texture,
)
from .settings import Settings, asked_error
from .sky import equal_texels
from .textures import shines, triangle_colours, triangle_emission, varying_albedo, varying_emission

#: Emitting triangles up to this many are sampled one by one, as lamps are. Of more, some are chosen at each point, or,
#: where they are more than this part of all surfaces, the rays that look around find them.
MOST_PANELS, LARGE_PART = 64, 0.1
#: Each kind of lamp, by the name of its effect.
LAMPS: dict[str, type] = {"point lamps": PointLamp, "spot lamps": SpotLamp, "sun": SunLamp, "area lamps": AreaLamp}

#: What is left out with the sky, and why where nothing of it is to be seen.
_OF_SKY = ("sky", "sky map", "sky lights", "portals")
_HIDDEN = "every ray that leaves a receiver hits something"


@dataclass(frozen=True)
class Rule:
    """judge: whether the scene calls for the effect, and why. without: the scene when it is left out."""

    judge: Callable[[Scene, Settings], Effect]
    without: Callable[[Scene], Scene]


def choose_effects(scene: Scene, settings: Settings, *, sees_sky: bool = True) -> tuple[tuple[Effect, ...], Scene]:
    """Each effect, whether it is simulated, and why; and the scene without those that are not.

    settings.effects overrides what the scene calls for. sees_sky: whether rays from the receivers can find the sky.
    Raises SceneError for an effect that does not exist.
    """
    for name in settings.effects:
        if name not in EFFECTS:
            raise SceneError(f"There is no effect '{name}': choose from {', '.join(EFFECTS)}.")
    hidden = not sees_sky and not settings.effects.get("sky")
    effects = tuple(
        Effect(name, False, _HIDDEN)
        if hidden and name in _OF_SKY
        else _overridden(rule.judge(scene, settings), settings.effects)
        for name, rule in EFFECTS.items()
    )
    for effect in effects:
        if not effect.active:
            scene = EFFECTS[effect.name].without(scene)
    return effects, scene


def _overridden(effect: Effect, asked: Mapping[str, bool]) -> Effect:
    active = asked.get(effect.name, effect.active)
    if active == effect.active:
        return effect
    return Effect(effect.name, active, f"switched {'on' if active else 'off'} by hand; {effect.reason}")


def point_lamps(scene: Scene, _: Settings) -> Effect:
    return _lamps("point lamps", PointLamp, scene)


def spot_lamps(scene: Scene, _: Settings) -> Effect:
    return _lamps("spot lamps", SpotLamp, scene)


def sun(scene: Scene, _: Settings) -> Effect:
    return _lamps("sun", SunLamp, scene)


def area_lamps(scene: Scene, _: Settings) -> Effect:
    return _lamps("area lamps", AreaLamp, scene)


def soft_shadows(scene: Scene, _: Settings) -> Effect:
    soft = [lamp.name for lamp in scene.lamps if _has_size(lamp)]
    if not soft:
        return Effect("soft shadows", False, "no lamp has a size")
    return Effect("soft shadows", True, f"{_names(soft)} {'has' if len(soft) == 1 else 'have'} a size")


def shadows(scene: Scene, _: Settings) -> Effect:
    if not any(lamp.casts_shadow for lamp in scene.lamps):
        return Effect("shadows", False, "no lamp casts any")
    if nothing_stands_between(scene):
        return Effect("shadows", False, "nothing can stand between the lamps and the surfaces: all lie around them")
    return Effect("shadows", True, "surfaces may stand in the light of lamps")


def emitting_surfaces(scene: Scene, _: Settings) -> Effect:
    emitting = emitting_triangles(scene)
    if not emitting:
        return Effect("emitting surfaces", False, "no surface emits")
    many = "by the rays that look around" if emitters_by_rays(scene) else "some of them at each point"
    how = "as lamps" if emitting <= MOST_PANELS else many
    return Effect("emitting surfaces", True, f"{emitting} triangles emit; sampled {how}")


def sky(scene: Scene, _: Settings) -> Effect:
    light = scene.sky.pixels if isinstance(scene.sky, SkyMap) else np.array(scene.sky)
    shines = bool(light.max() > 0)
    return Effect("sky", shines, "the world emits light" if shines else "the world is black")


def sky_map(scene: Scene, _: Settings) -> Effect:
    if isinstance(scene.sky, SkyMap):
        return Effect("sky map", True, "the world looks different from direction to direction")
    return Effect("sky map", False, "the world is the same in all directions")


def sky_lights(scene: Scene, _: Settings) -> Effect:
    if not isinstance(scene.sky, SkyMap):
        return Effect("sky lights", False, "the world is the same in all directions")
    count = len(split_bright(scene.sky)[1])
    if not count:
        return Effect("sky lights", False, "nothing in the sky is much brighter than the rest of it")
    what = "a bright spot is" if count == 1 else f"{count} bright spots are"
    return Effect("sky lights", True, f"{what} sampled as {'a sun' if count == 1 else 'suns'}")


def portals(scene: Scene, settings: Settings) -> Effect:
    if not sky(scene, settings).active:
        return Effect("portals", False, "the world is black")
    if not scene.portals:
        return Effect("portals", False, "no area lamp is a portal, and rays find the sky well enough")
    placed = [portal.name for portal in scene.portals if not portal.found]
    found = len(scene.portals) - len(placed)
    ways = [_names(placed)] * bool(placed)
    ways += ["an opening that was found" if found == 1 else f"{found} openings that were found"] * bool(found)
    return Effect("portals", True, f"the sky shines through {' and '.join(ways)}")


def colour(scene: Scene, _: Settings) -> Effect:
    what = next(_coloured(scene), None)
    if what is not None:
        return Effect("colour", True, f"{what} is coloured")
    if goes_on(scene):
        return Effect("colour", True, "what lets light through or mirrors it is followed in three channels")
    return Effect("colour", False, "one channel: all light and all surfaces are grey")


def _coloured(scene: Scene) -> Iterator[str]:
    """What is not grey, by name; what is found out quickly first."""
    used = {int(i) for o in scene.objects for i in np.unique(o.surface)}
    surfaces = [surface for number, surface in enumerate(scene.surfaces) if number in used]
    colours = ("albedo", "emission", "transparent", "transmission", "mirror", "glass")
    yield from (lamp.name for lamp in scene.lamps if _has_colour(np.array(getattr(lamp, LAMP_COLOUR[type(lamp)]))))
    yield from (s.name for s in surfaces if _has_colour(np.array([getattr(s, name) for name in colours])))
    if _has_colour(scene.sky.pixels if isinstance(scene.sky, SkyMap) else np.array(scene.sky)):
        yield "the sky"
    for surface in surfaces:
        textures = surface.albedo_texture, surface.emission_texture
        if any(texture is not None and _has_colour(texture.pixels) for texture in textures):
            yield surface.name
    yield from (o.name for o in scene.objects if o.colors is not None and _has_colour(o.colors))


def _has_colour(values: Float32 | Float64) -> bool:
    """Whether some row of values (..., 3) differs by more than rounding from channel to channel."""
    return bool((np.ptp(values, axis=-1) > 1e-5 * values.max(axis=-1)).any())


def bounces(scene: Scene, settings: Settings) -> Effect:
    used = {int(i) for o in scene.objects for i in np.unique(o.surface)}
    albedo = max((max(scene.surfaces[i].scattered) for i in used), default=0.0)
    little = asked_error(settings) / 10.0
    if albedo <= 0:
        return Effect("bounces", False, "every surface is black")
    if albedo < little * (1.0 - albedo) and not goes_on(scene):
        return Effect("bounces", False, f"surfaces reflect {albedo:.2%} at most: no bounce would show")
    if settings.estimator == "centroid":
        return Effect("bounces", True, "as the original program did: centroid form factors, plain shooting")
    mean = _mean_albedo(scene)
    matter = max(1, ceil(log(little) / log(mean)) - 1) if 0 < mean < 1 else 1
    left = mean ** (matter + 1)
    return Effect(
        "bounces",
        True,
        f"all at once, for fewer take no less time: surfaces reflect {mean:.0%}, and bounce {matter + 1} adds "
        f"{left:.2%} in a closed room",
    )


def transparency(scene: Scene, _: Settings) -> Effect:
    sheer = _used(scene, _is_sheer)
    shadowless = [o.name for o in scene.objects if not o.casts_shadow]
    if sheer or shadowless:
        reasons = [f"{_names(sheer)} let light through"] * bool(sheer)
        reasons += [f"{_names(shadowless)} cast no shadow"] * bool(shadowless)
        return Effect("transparency", True, "; ".join(reasons))
    return Effect("transparency", False, "every surface is opaque")


def diffuse_transmission(scene: Scene, _: Settings) -> Effect:
    thin = _used(scene, lambda surface: max(surface.transmission) > 0.0)
    reason = f"light that falls on one side of {_names(thin)} leaves on the other too"
    return Effect("diffuse transmission", bool(thin), reason if thin else "no surface is translucent")


def mirrors(scene: Scene, _: Settings) -> Effect:
    shiny = _used(scene, lambda surface: max(surface.mirror) > 0.0)
    return Effect("mirrors", bool(shiny), f"{_names(shiny)} reflect rays on" if shiny else "no surface mirrors")


def clear_glass(scene: Scene, _: Settings) -> Effect:
    glass = _used(scene, lambda surface: max(surface.glass) > 0.0)
    reason = f"rays go straight through {_names(glass)}"
    return Effect("clear glass", bool(glass), reason if glass else "no surface is clear glass")


def power_by_area(scene: Scene) -> float:
    """About how much light other than the sky's falls on the surfaces, W/m^2: what lamps and emitting surfaces give
    off, over all of them. Suns are left out: of their light little may get in."""
    area = power = 0.0
    for scene_object in scene.objects:
        own = triangle_geometry(scene_object.vertices[scene_object.triangles])[1]
        area += float(own.sum())
        power += np.pi * float(own @ triangle_emission(scene, scene_object).mean(axis=1))
    return (power + sum(_power(lamp) for lamp in scene.lamps)) / area if area else 0.0


def _power(lamp: Lamp) -> float:
    """W, mean over the channels; none of a sun."""
    match lamp:
        case SunLamp():
            return 0.0
        case AreaLamp():
            sides = 4.0 * np.linalg.norm(np.cross(lamp.half_u, lamp.half_v))
            return float(np.pi * np.mean(lamp.radiance) * sides * (1.0 if lamp.shape == "rectangle" else np.pi / 4.0))
        case SpotLamp():
            return float(2.0 * np.pi * (1.0 - np.cos(lamp.cone_angle / 2.0)) * np.mean(lamp.intensity))
        case PointLamp():
            return float(4.0 * np.pi * np.mean(lamp.intensity))


def mean_of_sky(scene: Scene) -> float:
    """Mean radiance over all directions and channels."""
    return float(equal_texels(scene.sky, 1, 1).mean() if isinstance(scene.sky, SkyMap) else np.mean(scene.sky))


def goes_on(scene: Scene) -> bool:
    """Whether rays go on from some surface, or through it."""
    return bool(_used(scene, lambda s: _is_sheer(s) or max(np.concatenate([s.transmission, s.mirror, s.glass])) > 0.0))


def albedo_textures(scene: Scene, _: Settings) -> Effect:
    varying = [o.name for o in scene.objects if varying_albedo(scene, o)]
    if not varying:
        return Effect("albedo textures", False, "every surface has one colour")
    return Effect("albedo textures", True, f"the colour changes over {_names(varying)}")


def textured_emission(scene: Scene, _: Settings) -> Effect:
    varying = [o.name for o in scene.objects if varying_emission(scene, o)]
    if not varying:
        return Effect("textured emission", False, "no surface emits more in one place than in another")
    return Effect("textured emission", True, f"what shines changes over {_names(varying)}")


def emitting_triangles(scene: Scene) -> int:
    """How many triangles emit light."""
    shining = [o for o in scene.objects if shines(scene, o)]
    return sum(int(np.count_nonzero(triangle_emission(scene, o).max(axis=1) > 0)) for o in shining)


def emitters_by_rays(scene: Scene) -> bool:
    """Whether rays that look around find the emitting triangles best: these are many, and a large part of all there is
    to see."""
    if emitting_triangles(scene) <= MOST_PANELS:
        return False
    total = emitting = 0.0
    for scene_object in scene.objects:
        area = triangle_geometry(scene_object.vertices[scene_object.triangles])[1]
        total += float(area.sum())
        emitting += float(area[triangle_emission(scene, scene_object).max(axis=1) > 0].sum())
    return emitting > LARGE_PART * total


def _lamps(name: str, kind: type, scene: Scene) -> Effect:
    names = [lamp.name for lamp in scene.lamps if isinstance(lamp, kind)]
    return Effect(name, bool(names), _names(names) if names else "none in the scene")


def _is_sheer(surface: Surface) -> bool:
    return surface.opacity < 1.0 or surface.opacity_texture is not None


def _used(scene: Scene, has: Callable[[Surface], bool]) -> list[str]:
    """Names of the surfaces with a property that some triangle has."""
    used = {int(i) for o in scene.objects for i in np.unique(o.surface)}
    return [surface.name for number, surface in enumerate(scene.surfaces) if number in used and has(surface)]


def _names(names: list[str]) -> str:
    return ", ".join(names[:3]) + (f" and {len(names) - 3} more" if len(names) > 3 else "")


def _has_size(lamp: Lamp) -> bool:
    match lamp:
        case AreaLamp():
            return True
        case SunLamp():
            return lamp.angle > 0
        case PointLamp() | SpotLamp():
            return lamp.radius > 0


def _mean_albedo(scene: Scene) -> float:
    """Mean over the surface and the channels."""
    total = area = 0.0
    for scene_object in scene.objects:
        areas = triangle_geometry(scene_object.vertices[scene_object.triangles])[1]
        total += float(areas @ triangle_colours(scene, scene_object).albedo.mean(axis=1))
        area += float(areas.sum())
    return total / area if area else 0.0


def _without_lamps(kind: type) -> Callable[[Scene], Scene]:
    return lambda scene: replace(scene, lamps=tuple(lamp for lamp in scene.lamps if not isinstance(lamp, kind)))


def _with_hard_shadows(scene: Scene) -> Scene:
    """Point-sized lamps of the same power; an area lamp stays, for it has no light without an area."""

    def hard(lamp: Lamp) -> Lamp:
        match lamp:
            case SunLamp():
                return replace(lamp, angle=0.0)
            case PointLamp() | SpotLamp():
                return replace(lamp, radius=0.0)
            case AreaLamp():
                return lamp

    return replace(scene, lamps=tuple(hard(lamp) for lamp in scene.lamps))


def _without_shadows(scene: Scene) -> Scene:
    return replace(scene, lamps=tuple(replace(lamp, casts_shadow=False) for lamp in scene.lamps))


def _without_emission(scene: Scene) -> Scene:
    return replace(scene, surfaces=tuple(replace(s, emission=(0.0, 0.0, 0.0)) for s in scene.surfaces))


def _with_even(name: Literal["albedo", "emission"]) -> Callable[[Scene], Scene]:
    """Each surface's albedo or emission becomes its mean over all that has the surface."""

    def evened(scene: Scene) -> Scene:
        varying = varying_albedo if name == "albedo" else varying_emission
        if not any(varying(scene, o) for o in scene.objects):
            return scene
        total, area = np.zeros((len(scene.surfaces), 3)), np.full(len(scene.surfaces), np.finfo(float).tiny)
        for scene_object in scene.objects:
            areas = triangle_geometry(scene_object.vertices[scene_object.triangles])[1]
            values = getattr(triangle_colours(scene, scene_object), name)
            np.add.at(total, scene_object.surface, areas[:, None] * values)
            np.add.at(area, scene_object.surface, areas)
        plain = np.array([s.scattered if name == "albedo" else s.emitted for s in scene.surfaces])
        mean = np.divide(total / area[:, None], plain, out=np.zeros_like(plain), where=plain > 0.0)
        scaled = ("albedo", "transmission") if name == "albedo" else ("emission",)
        changes: list[dict[str, Any]] = [
            {f"{name}_texture": None, **{field: tuple(factor * getattr(s, field)) for field in scaled}}
            for s, factor in zip(scene.surfaces, mean, strict=True)
        ]
        surfaces = tuple(replace(s, **change) for s, change in zip(scene.surfaces, changes, strict=True))
        if name == "emission":
            return replace(scene, surfaces=surfaces)
        return replace(scene, surfaces=surfaces, objects=tuple(replace(o, colors=None) for o in scene.objects))

    return evened


def _without_sky(scene: Scene) -> Scene:
    return replace(scene, sky=(0.0, 0.0, 0.0))


def _opaque(scene: Scene) -> Scene:
    objects = tuple(replace(o, casts_shadow=True) for o in scene.objects)
    return replace(_with_surfaces(scene, opacity=1.0, opacity_texture=None), objects=objects)


def _with_surfaces(scene: Scene, **changes: Any) -> Scene:
    return replace(scene, surfaces=tuple(replace(s, **changes) for s in scene.surfaces))


def _without_share(name: str) -> Callable[[Scene], Scene]:
    """What takes a share of the light away from all surfaces: it is swallowed instead."""
    return lambda scene: _with_surfaces(scene, **{name: (0.0, 0.0, 0.0)})


def _without_portals(scene: Scene) -> Scene:
    return replace(scene, portals=())


def _with_even_sky(scene: Scene) -> Scene:
    """The mean of the map in all directions."""
    if not isinstance(scene.sky, SkyMap):
        return scene
    red, green, blue = equal_texels(scene.sky, 1, 1)[0, 0].tolist()
    return replace(scene, sky=(red, green, blue))


def _in_grey(scene: Scene) -> Scene:
    """Everything in the mean of its channels."""

    def grey(values: RGB) -> RGB:
        mean = sum(values) / 3.0
        return (mean, mean, mean)

    def grey_pixels(texture: Texture | None) -> Texture | None:
        return texture and replace(texture, pixels=_mean_channels(texture.pixels))

    def grey_surface(s: Surface) -> Surface:
        return replace(
            s,
            albedo=grey(s.albedo),
            emission=grey(s.emission),
            transparent=grey(s.transparent),
            transmission=grey(s.transmission),
            mirror=grey(s.mirror),
            glass=grey(s.glass),
            albedo_texture=grey_pixels(s.albedo_texture),
            emission_texture=grey_pixels(s.emission_texture),
        )

    def grey_lamp(lamp: Lamp) -> Lamp:
        name = LAMP_COLOUR[type(lamp)]
        change: dict[str, Any] = {name: grey(getattr(lamp, name))}
        return replace(lamp, **change)

    sky = SkyMap(_mean_channels(scene.sky.pixels)) if isinstance(scene.sky, SkyMap) else grey(scene.sky)
    objects = (o if o.colors is None else replace(o, colors=_mean_channels(o.colors)) for o in scene.objects)
    return replace(
        scene,
        surfaces=tuple(map(grey_surface, scene.surfaces)),
        lamps=tuple(map(grey_lamp, scene.lamps)),
        sky=sky,
        objects=tuple(objects),
    )


def _mean_channels(values: Float32) -> Float32:
    return np.repeat(values.mean(axis=-1, keepdims=True), 3, axis=-1)


def _unchanged(scene: Scene) -> Scene:
    return scene


#: Every effect by its name, in the order in which a person reads them.
EFFECTS: dict[str, Rule] = {
    "point lamps": Rule(point_lamps, _without_lamps(PointLamp)),
    "spot lamps": Rule(spot_lamps, _without_lamps(SpotLamp)),
    "sun": Rule(sun, _without_lamps(SunLamp)),
    "area lamps": Rule(area_lamps, _without_lamps(AreaLamp)),
    "shadows": Rule(shadows, _without_shadows),
    "soft shadows": Rule(soft_shadows, _with_hard_shadows),
    "emitting surfaces": Rule(emitting_surfaces, _without_emission),
    "sky": Rule(sky, _without_sky),
    "sky map": Rule(sky_map, _with_even_sky),
    "sky lights": Rule(sky_lights, _unchanged),
    "portals": Rule(portals, _without_portals),
    "transparency": Rule(transparency, _opaque),
    "diffuse transmission": Rule(diffuse_transmission, _without_share("transmission")),
    "mirrors": Rule(mirrors, _without_share("mirror")),
    "clear glass": Rule(clear_glass, _without_share("glass")),
    "bounces": Rule(bounces, _unchanged),
    "colour": Rule(colour, _in_grey),
    "albedo textures": Rule(albedo_textures, _with_even("albedo")),
    "textured emission": Rule(textured_emission, _with_even("emission")),
}
