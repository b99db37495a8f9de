"""What is baked, as plain arrays: triangles, surfaces, lamps and the sky.

Lengths are metres, directions unit vectors, and all light is scene-linear RGB. Nothing here knows Blender: the scene
reader of the add-on fills these classes in, and a test or another program can do the same by hand.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Float32 = NDArray[np.float32]
Float64 = NDArray[np.float64]
Int32 = NDArray[np.int32]
Bool = NDArray[np.bool_]
RGB = tuple[float, float, float]
Vector = tuple[float, float, float]

#: A constant emitter or reflector is refused above this albedo: light in a closed room would never die.
ALBEDO_LIMIT = 0.9999


class SceneError(ValueError):
    """The scene cannot be baked as it is. The message names the thing and the remedy."""


@dataclass(frozen=True, eq=False)
class Texture:
    """An image over a surface, placed by the UV coordinates of its triangles' corners.

    pixels (h, w, 3) float32, row 0 at the bottom: (0, 0) is the lower left corner of the image, (1, 1) the upper right,
    and pixel centres lie half a pixel inside. extension: what lies beyond the image: the image again, its outermost
    pixels, black, or its mirror image. interpolation: between pixel centres, or the pixel that holds the point.
    separate: neighbouring pixels may belong to different places on the surface, so they are never averaged.
    """

    pixels: Float32
    extension: Literal["repeat", "extend", "clip", "mirror"] = "repeat"
    interpolation: Literal["linear", "closest"] = "linear"
    separate: bool = False

    @cached_property
    def levels(self) -> tuple[Float32, ...]:
        """The pixels, then images of half the size each, down to one pixel; none smaller where pixels are separate."""
        levels = [self.pixels]
        while max(levels[-1].shape[:2]) > 1 and not self.separate:
            levels.append(_halved(_halved(levels[-1]).transpose(1, 0, 2)).transpose(1, 0, 2))
        return tuple(levels)


def _halved(pixels: Float32) -> Float32:
    """Half as many rows with the same mean: of two each, or with an odd number of three, the outer ones in part."""
    count = len(pixels) // 2
    if not count:
        return pixels
    if len(pixels) % 2 == 0:
        return np.asarray((pixels[0::2] + pixels[1::2]) / 2, dtype=np.float32)
    row = np.arange(count, dtype=np.float32)[:, None, None]
    total = (count - row) * pixels[0:-1:2] + count * pixels[1::2] + (row + 1) * pixels[2::2]
    return np.asarray(total / (2 * count + 1), dtype=np.float32)


@dataclass(frozen=True)
class Surface:
    """A material. Both sides are alike, as in Cycles, but that emission may be of the front alone.

    opacity: share of the light that meets the material at all, 0 to 1; the rest goes straight through, tinted by
    `transparent`. Its texture cuts holes: it multiplies what rays find, but not what is baked, which is the light of
    what is there. All else is of the opaque part: shares per channel that are reflected diffusely (albedo), leave
    diffusely on the other side (transmission), are mirrored (mirror), or meet clear glass (glass), which mirrors a
    little and lets the rest straight through. emission: emitted radiance per channel, W/(m^2 sr). A texture
    multiplies albedo and transmission, or emission, point by point. one_sided: the back emits nothing. ior: index of
    refraction of the glass, 1 mirrors nothing. roughness of the mirror, 0 to 1, as in Blender.
    """

    name: str
    albedo: RGB = (0.8, 0.8, 0.8)
    emission: RGB = (0.0, 0.0, 0.0)
    albedo_texture: Texture | None = None
    emission_texture: Texture | None = None
    opacity: float = 1.0
    transparent: RGB = (1.0, 1.0, 1.0)
    transmission: RGB = (0.0, 0.0, 0.0)
    mirror: RGB = (0.0, 0.0, 0.0)
    glass: RGB = (0.0, 0.0, 0.0)
    ior: float = 1.0
    roughness: float = 0.0
    opacity_texture: Texture | None = None
    one_sided: bool = False

    @property
    def scattered(self) -> RGB:
        """Share of the arriving light that leaves the front diffusely, wherever it arrived; see `front_share`."""
        red, green, blue = (self.opacity * (a + t) for a, t in zip(self.albedo, self.transmission, strict=True))
        return (red, green, blue)

    @property
    def front_share(self) -> RGB:
        """How much of that arrived on the front: the light that counts is this share of the front's and the rest of the
        back's."""
        red, green, blue = (a / (a + t) if t > 0 else 1.0 for a, t in zip(self.albedo, self.transmission, strict=True))
        return (red, green, blue)

    @property
    def emitted(self) -> RGB:
        """Radiance that the surface emits where it covers `opacity` of what is behind it."""
        red, green, blue = (self.opacity * channel for channel in self.emission)
        return (red, green, blue)


@dataclass(frozen=True, eq=False)
class SceneObject:
    """Triangles of one object in world space.

    vertices (v, 3) float64, triangles (t, 3) int32 into vertices, counter-clockwise seen from the front,
    surface (t,) int32 into Scene.surfaces. corner_normals (t, 3, 3) float32 are the shading normals of each triangle's
    corners; None shades flat. A receiver is what gets a baked attribute; all objects block and bounce light, but those
    without casts_shadow do not stand between a lamp and what it shines on.
    uv (t, 3, 2) float32: place of each triangle's corners in the textures of its own surface; needed where that has
    any. colors (t, 3, 3) float32: corner colours that multiply the albedo. present: it blocks and bounces light; a
    receiver that is not lies in the light and leaves no trace there. size: longest edge that its triangles may have
    after the split, metres, where it is to have one of its own.
    """

    name: str
    vertices: Float64
    triangles: Int32
    surface: Int32
    corner_normals: Float32 | None = None
    receives: bool = True
    uv: Float32 | None = None
    colors: Float32 | None = None
    present: bool = True
    size: float | None = None
    casts_shadow: bool = True


@dataclass(frozen=True)
class PointLamp:
    """A lamp that shines alike in all directions, from a point or a ball.

    intensity: W/sr per channel, total over the ball. radius: metres; 0 is a point, with irradiance I cos / d^2.
    facing_disc: the lamp is a disc of that radius that turns to each receiver (Blender's "soft falloff") rather than a
    sphere. Either has the radiance I / (pi radius^2). casts_shadow: False shines through everything, as of all lamps.
    """

    name: str
    position: Vector
    intensity: RGB
    radius: float = 0.0
    facing_disc: bool = True
    casts_shadow: bool = True


@dataclass(frozen=True)
class SpotLamp:
    """A point lamp behind a cone.

    axes: rows are the lamp's local x, y, z in world space, scaled as the lamp object is; the lamp shines along -z.
    cone_angle: full angle h in radians. blend: 0 hard edge, 1 soft from the axis outward. A ray from any point of the
    lamp has the local direction r = ray @ inv(axes), made a unit vector, and is dimmed by x x (3 - 2 x) with
    x = (-r_z - cos(h/2)) / ((1 - cos(h/2)) blend) clipped to 0..1; from within a ball (facing_disc False) it is not.
    """

    name: str
    position: Vector
    intensity: RGB
    axes: tuple[Vector, Vector, Vector]
    cone_angle: float
    blend: float
    radius: float = 0.0
    facing_disc: bool = True
    casts_shadow: bool = True


@dataclass(frozen=True)
class SunLamp:
    """Parallel light.

    direction: the way the light travels. irradiance: W/m^2 on a plane that faces it. angle: full angle of the sun's
    disc in radians, up to pi; 0 gives hard shadows. Its radiance is even: irradiance / (pi sin^2(angle/2)).
    """

    name: str
    direction: Vector
    irradiance: RGB
    angle: float = 0.0
    casts_shadow: bool = True


@dataclass(frozen=True)
class AreaLamp:
    """A flat lamp that shines from one side.

    half_u, half_v: from the centre to the middle of two neighbouring sides (or the ellipse's half axes).
    normal: unit vector at right angles to both, the way it shines; their cross product may be its opposite.
    radiance: W/(m^2 sr), power / (pi area). spread: full angle of the beam in radians, pi for a plain diffuse emitter;
    below that the radiance at an angle a to the normal is radiance * max(0, tan h - tan a) / (tan h - h), h = spread/2,
    which keeps the power.
    """

    name: str
    center: Vector
    half_u: Vector
    half_v: Vector
    normal: Vector
    radiance: RGB
    shape: Literal["rectangle", "ellipse"] = "rectangle"
    spread: float = np.pi
    casts_shadow: bool = True


@dataclass(frozen=True, eq=False)
class SkyMap:
    """A sky that varies with direction.

    pixels (h, w, 3) float32: radiance, W/(m^2 sr), even over each pixel. Row 0 is straight down, the last straight up,
    in equal steps of the angle to the axis; the middle of a row is +x, and columns go on by -y, -x and +y:
    u = 1/2 - atan2(y, x) / (2 pi), as in Cycles' equirectangular environments.
    """

    pixels: Float32


Lamp = PointLamp | SpotLamp | SunLamp | AreaLamp

#: What tells how bright a lamp is, and of which colour, by its kind.
LAMP_COLOUR: dict[type, str] = {
    PointLamp: "intensity",
    SpotLamp: "intensity",
    SunLamp: "irradiance",
    AreaLamp: "radiance",
}


@dataclass(frozen=True)
class Portal:
    """A rectangle in a window, through which the sky shines into a room: it gives no light, but tells where to look.

    half_u, half_v: from the centre to the middle of two neighbouring sides, at right angles. normal: unit vector at
    right angles to both, into the room. found: by rays (core.openings), rather than made by a person.
    """

    name: str
    center: Vector
    half_u: Vector
    half_v: Vector
    normal: Vector
    found: bool = False


@dataclass(frozen=True, eq=False)
class Scene:
    """Everything a bake needs. sky: radiance from every direction that no surface covers, W/(m^2 sr)."""

    objects: tuple[SceneObject, ...]
    surfaces: tuple[Surface, ...]
    lamps: tuple[Lamp, ...] = ()
    sky: RGB | SkyMap = (0.0, 0.0, 0.0)
    warnings: tuple[str, ...] = field(default=())
    portals: tuple[Portal, ...] = ()

    def surroundings(self) -> Scene:
        """The scene as light meets it: without the objects that only receive. Raises SceneError when that is all."""
        if all(o.present for o in self.objects):
            return self
        if not any(o.present for o in self.objects):
            raise SceneError("No object casts shadows or bounces light: switch Casts on for at least one of them.")
        return replace(self, objects=tuple(o for o in self.objects if o.present))

    def receivers(self) -> tuple[SceneObject, ...]:
        return tuple(o for o in self.objects if o.receives)
