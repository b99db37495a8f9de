"""The sky as rays find it: a table of what they bring by the direction in which they leave the scene."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .patches import Space
from .scene import RGB, Bool, Float32, Float64, Int32, Portal, SkyMap

#: Texels of a sky that is not even. All have the same solid angle, 0.0015 sr, about (2.2 degrees)^2.
_ROWS, _COLUMNS = 64, 128


@dataclass(frozen=True, eq=False)
class Sky:
    """Texels: rows of equal height in z from straight down to straight up, columns of equal longitude as in a SkyMap.

    light (rows * columns, k) float32: what a ray that leaves through each texel brings. A black sky has k = 0, an even
    one k = 1, for then rays need only be counted, and any other one the three channels. irradiance (k, 3): turns the
    mean of that over cosine-distributed rays into W/m^2. portals: what leaves through these brings nothing, for
    they are sampled as lights; it has a texel of its own, the last.
    """

    rows: int
    columns: int
    light: Float32
    irradiance: Float64
    portals: tuple[Rectangle, ...] = ()

    @staticmethod
    def of(sky: RGB | SkyMap) -> Sky:
        if isinstance(sky, SkyMap):
            texels = equal_texels(sky, _ROWS, _COLUMNS).reshape(-1, 3)
            return Sky(_ROWS, _COLUMNS, (np.pi * texels).astype(np.float32), np.eye(3))
        shines = int(max(sky) > 0)
        return Sky(1, 1, np.ones((1, shines), dtype=np.float32), np.pi * np.array([sky] * shines).reshape(-1, 3))

    def in_colour(self, coloured: bool) -> Sky:
        """The same sky with three channels, if what rays bring may be tinted on their way."""
        if not coloured or self.light.shape[1] != 1:
            return self
        return Sky(self.rows, self.columns, (self.light * self.irradiance).astype(np.float32), np.eye(3))

    @property
    def mean_irradiance(self) -> float:
        """W/m^2, the mean of the channels, where nothing else is in sight in any direction."""
        light = self.light[: self.rows * self.columns].mean(axis=0)
        return float((light @ self.irradiance).mean())

    def without(self, portals: list[Rectangle]) -> Sky:
        """The sky that shines elsewhere than through the portals."""
        dark = np.zeros_like(self.light[:1])
        return replace(self, light=np.concatenate([self.light, dark]), portals=tuple(portals)) if portals else self

    def texel(self, directions: Float32) -> Int32:
        """Number of the texel (n,) that each unit vector (n, 3) points to."""
        if self.rows * self.columns == 1:
            return np.zeros(len(directions), dtype=np.int32)
        x, y, z = directions.T
        row = (z + 1) * np.float32(self.rows / 2)
        column = (np.float32(0.5) - np.arctan2(y, x) * np.float32(0.5 / np.pi)) * np.float32(self.columns)
        row = np.clip(row.astype(np.int32), 0, self.rows - 1)
        return row * np.int32(self.columns) + np.minimum(column.astype(np.int32), self.columns - 1)

    def beside_portals(self, texel: Int32, origins: Float32, directions: Float32) -> Int32:
        """Texels (n,) of straight rays, with the dark one for those that leave through a portal."""
        through = np.zeros(len(texel), dtype=bool)
        for portal in self.portals:
            through |= portal.crossed(origins.T, directions.T)
        return np.where(through, np.int32(len(self.light) - 1), texel)


@dataclass(frozen=True, eq=False)
class Rectangle:
    """A portal in the unit box: center, half_u, half_v, normal (3,)."""

    center: Float64
    half_u: Float64
    half_v: Float64
    normal: Float64

    @staticmethod
    def of(portal: Portal, space: Space) -> Rectangle:
        half_u, half_v = np.array(portal.half_u) / space.metres, np.array(portal.half_v) / space.metres
        return Rectangle(space.normalise(np.array(portal.center)), half_u, half_v, np.array(portal.normal))

    @property
    def corners(self) -> Float64:
        """(4, 3), counter-clockwise seen from the room."""
        outline = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], dtype=float)
        if np.cross(self.half_u, self.half_v) @ self.normal < 0:
            outline = outline[::-1]
        return np.asarray(self.center + outline @ np.stack([self.half_u, self.half_v]))

    def crossed(self, origins: Float32, directions: Float32) -> Bool:
        """Which rays cross it from the room outward; origins and directions (3, ...) broadcast."""

        def along(axis: Float64, vectors: Float32) -> Float32:
            return np.asarray(np.tensordot(axis.astype(np.float32), vectors, axes=1))

        away = origins - self.center.astype(np.float32).reshape(3, *[1] * (origins.ndim - 1))
        height, fall = along(self.normal, away), -along(self.normal, directions)
        outward = (height > 0) & (fall > 0)
        reach = height / np.where(outward, fall, np.float32(1))
        for half in (self.half_u, self.half_v):
            axis = half / (half @ half)
            outward &= np.abs(along(axis, away) + reach * along(axis, directions)) <= 1
        return outward

    def may_be_crossed_with(self, other: Rectangle) -> bool:
        """Whether some ray crosses both outward: not if each lies on the inner side of the other."""
        within = [
            ((one.corners - two.center) @ two.normal).min() > -1e-6 * np.abs(one.corners - two.center).max()
            for one, two in ((self, other), (other, self))
        ]
        return not all(within)


def equal_texels(sky: SkyMap, rows: int, columns: int) -> Float64:
    """Means (rows, columns, 3) of a map over texels of equal solid angle, in which its energy is kept exactly."""
    pixels = sky.pixels.astype(np.float64)
    height, width = pixels.shape[:2]
    by_row = _overlap(-np.cos(np.linspace(0.0, np.pi, height + 1)), np.linspace(-1.0, 1.0, rows + 1))
    by_column = _overlap(np.linspace(0.0, 1.0, width + 1), np.linspace(0.0, 1.0, columns + 1))
    means = [by_row @ pixels[..., k] @ by_column.T for k in range(3)]
    return np.stack(means, axis=-1)


def _overlap(old: Float64, new: Float64) -> Float64:
    """(new intervals, old intervals): which share of each new interval an old one covers, from their borders."""
    low = np.maximum(old[None, :-1], new[:-1, None])
    high = np.minimum(old[None, 1:], new[1:, None])
    return np.asarray(np.maximum(high - low, 0.0) / np.diff(new)[:, None])


#: A sky that brings nothing.
DARK = Sky.of((0.0, 0.0, 0.0))
