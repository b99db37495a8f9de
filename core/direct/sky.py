"""The sky as lights: its bright parts as suns, and portals.

What is small and bright random rays find too seldom, so it is sampled as lights. The sky is cut at a radiance. What is
below stays in the map, where rays find it with little noise; what is above becomes discs. Each has the energy, the mean
direction and the spread of the part that it stands for, so a receiver that sees all of a part gets from its disc what
it gets from the part. A portal is an area lamp with the sky's radiance, and rays that leave through it bring
nothing.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ..patches import Space
from ..scene import RGB, Float32, Float64, Scene, SkyMap, SunLamp
from ..sky import Rectangle, Sky
from .lamps import BEYOND, Light, Panel, Ways, place

#: The sky is cut at so many times the mean of what is left of it.
_CONTRAST = 6.0
#: Discs at most; and where discs of so many degrees across stand for parts well enough, there are fewer.
_MOST_DISCS, _DEGREES = 12, 8.0


def divide_sky(scene: Scene, space: Space, *, suns: bool, portals: bool) -> tuple[Sky, list[Light]]:
    """The sky that rays find, and the lights for the rest of it: its bright parts, and what portals let in."""
    smooth, bright = split_bright(scene.sky) if suns else (scene.sky, ())
    sky = Sky.of(smooth)
    shining = scene.portals if portals and sky.light.any() else ()
    rectangles = [Rectangle.of(portal, space) for portal in shining]
    windows = [
        Window(portal.name, rectangle, sky, rectangles[:number])
        for number, (portal, rectangle) in enumerate(zip(shining, rectangles, strict=True))
    ]
    return sky.without(rectangles), [*(place(sun, space) for sun in bright), *windows]


class Window(Panel):
    """The sky behind a portal, as an area lamp: it shines from the rectangle, but its shadow rays go on to the sky.

    What leaves through one of the portals before it as well, is theirs.
    """

    each: tuple[str, ...] = ()

    def __init__(self, name: str, portal: Rectangle, sky: Sky, before: list[Rectangle]) -> None:
        super().__init__(name, portal.corners, np.zeros(3), two_sided=False)
        self._sky = sky
        self._before = [other for other in before if portal.may_be_crossed_with(other)]
        self._one_colour = sky.light.shape[1] == 1
        self.even = self._one_colour and not self._before
        self.color = sky.irradiance[0] if self._one_colour else sky.light.mean(axis=0).astype(np.float64)

    def aim(self, points: Float32, unit: Float32) -> Ways:
        ways = super().aim(points, unit)
        stretch = BEYOND * ways.inverse
        return Ways(ways.towards * stretch, ways.inverse / np.maximum(stretch, np.float32(1e-30)), ways.solid)

    def gain(self, points: Float32, ways: Ways) -> Float32 | None:
        """The sky's radiance along the ways relative to its mean, (r, n) or channel by channel (3, r, n)."""
        own = [~other.crossed(points[:, None], ways.towards) for other in self._before]
        alone = np.logical_and.reduce(own).astype(np.float32) if own else None
        if self._one_colour:
            return alone
        directions = (ways.towards * ways.inverse).reshape(3, -1).T
        light = self._sky.light[self._sky.texel(directions)].T.reshape(ways.towards.shape)
        relative = light / np.maximum(self.color, 1e-30).astype(np.float32)[:, None, None]
        return relative if alone is None else relative * alone


@lru_cache(maxsize=2)
def split_bright(sky: RGB | SkyMap) -> tuple[RGB | SkyMap, tuple[SunLamp, ...]]:
    """The sky without what is much brighter than the rest, and that as suns; none where the sky is even enough."""
    if not isinstance(sky, SkyMap):
        return sky, ()
    height, width = sky.pixels.shape[:2]
    band = np.diff(-np.cos(np.linspace(0.0, np.pi, height + 1))) * 2.0 * np.pi / width
    grey = sky.pixels.mean(axis=2, dtype=np.float64)
    cut = _cut(grey.ravel(), np.repeat(band, width))
    row, column = np.nonzero(grey > cut)
    if not len(row):
        return sky, ()
    kept = cut / grey[row, column]
    pixels = sky.pixels.copy()
    energy = pixels[row, column] * ((1.0 - kept) * band[row])[:, None]
    pixels[row, column] *= kept[:, None].astype(np.float32)
    polar, azimuth = np.pi * (1.0 - (row + 0.5) / height), np.pi * (1.0 - 2.0 * (column + 0.5) / width)
    direction = np.stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], axis=1)
    parts = _parts(direction, energy.mean(axis=1))
    suns = tuple(
        _disc(f"Sky {number:02}", direction[part], energy[part], float(band[row[part]].mean()))
        for number, part in enumerate(parts, start=1)
    )
    return SkyMap(pixels), suns


def _cut(radiance: Float64, solid_angle: Float64) -> float:
    """The largest t that is at most _CONTRAST times the mean of min(radiance, t) over the sphere."""
    order = np.argsort(radiance)
    ordered, share = radiance[order], solid_angle[order] / solid_angle.sum()
    below = np.cumsum(share * ordered)
    above = 1.0 - np.cumsum(share)
    fits = np.flatnonzero(_CONTRAST * (below + above * ordered) >= ordered)
    last = int(fits[-1])
    if last == len(ordered) - 1:
        return float(ordered[-1])
    return float(_CONTRAST * below[last] / max(1.0 - _CONTRAST * above[last], 1e-12))


def _parts(direction: Float64, energy: Float64) -> list[np.ndarray]:
    """Indices of each part: the one that is spread the most, by energy, is cut in two across its longest axis, until
    what is left of the spread does not matter or there are enough."""
    enough = 2.0 * np.sin(np.radians(_DEGREES / 4.0)) ** 2 * energy.sum()
    parts = [np.arange(len(energy))]
    while len(parts) < _MOST_DISCS:
        spread = [_moments(direction[part], energy[part])[1] for part in parts]
        total = [np.trace(matrix) for matrix in spread]
        if sum(total) <= enough:
            break
        widest = int(np.argmax(total))
        part = parts.pop(widest)
        mean, matrix = _moments(direction[part], energy[part])
        along = (direction[part] - mean) @ np.linalg.eigh(matrix)[1][:, -1]
        parts += [part[along < 0], part[along >= 0]]
    return sorted(parts, key=lambda part: -energy[part].sum())


def _moments(direction: Float64, energy: Float64) -> tuple[Float64, Float64]:
    """Mean direction (3,), and the spread about it (3, 3) times the energy."""
    mean = energy @ direction / energy.sum()
    away = direction - mean
    return mean, (away * energy[:, None]).T @ away


def _disc(name: str, direction: Float64, energy: Float64, pixel: float) -> SunLamp:
    """The disc of the same energy (n, 3), mean direction and spread. pixel: the least solid angle it may have.

    The mean direction of an even disc of half angle a has the length (1 + cos a) / 2.
    """
    grey = energy.mean(axis=1)
    total = grey @ direction
    length = float(np.linalg.norm(total))
    axis = total / length
    cosine = min(2.0 * length / float(grey.sum()) - 1.0, 1.0 - pixel / (2.0 * np.pi))
    red, green, blue = (energy.T @ (direction @ axis)).tolist()
    x, y, z = (-axis).tolist()
    return SunLamp(name, (x, y, z), (red, green, blue), 2.0 * float(np.arccos(max(cosine, 0.0))))
