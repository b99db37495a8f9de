"""Blender's images as arrays of scene-linear light."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import bpy
import numpy as np

from ..core.scene import Float32
from ..core.tessellation import Int64

Extension = Literal["repeat", "extend", "clip", "mirror"]

#: Pixels along a side that an image is reduced to: finer than vertex colours can show.
LARGEST = 1024
#: What is beyond an image, as numpy's padding names it.
_PADDING = {"repeat": "wrap", "extend": "edge", "clip": "constant", "mirror": "symmetric"}
#: What Cycles shows for an image whose pixels are missing.
MISSING = (1.0, 0.0, 1.0, 1.0)
#: Colour spaces whose byte pixels hold the numbers themselves.
_PLAIN = {"Non-Color", "Raw", "Linear", "Linear Rec.709"}


class UnreadableImage(ValueError):
    """The image's pixels do not say what Cycles makes of them. The message tells why."""


def has_pixels(image: bpy.types.Image) -> bool:
    """Whether an image's file was found and read; tiles and films are not looked into."""
    return image.source not in {"FILE", "GENERATED"} or len(image.pixels) > 0


def read_image(
    image: bpy.types.Image, extension: Extension, *, smooth: bool, premultiplied: bool
) -> tuple[Float32, Float32]:
    """Colour (h, w, 3), scene-linear, and alpha (h, w, 1); row 0 at the bottom. Not always with the image's own pixels.

    Cycles mixes neighbouring pixels as they are stored and applies the sRGB curve afterwards, so between a black and a
    white pixel its images are darker than half. Pixels are therefore divided, and mixed as Cycles does it if `smooth`;
    where there are many, each keeps the mean of its parts. Large images come reduced to `LARGEST` pixels along a side.
    premultiplied: the colour is to be multiplied by the alpha, as in Cycles where no node asks for the alpha.
    Raises UnreadableImage for tiles, films, colour spaces and kinds of alpha that only Blender itself can read.
    """
    if image.source not in {"FILE", "GENERATED"}:
        raise UnreadableImage(f"of the kind {image.source.lower()}")
    space = image.colorspace_settings.name
    encoded = not image.is_float and space == "sRGB"
    if not (image.is_float or encoded or space in _PLAIN):
        raise UnreadableImage(f"in the colour space {space}")
    width, height = image.size
    stored = np.empty(width * height * image.channels, np.float32)
    image.pixels.foreach_get(stored)
    pixels = _four_channels(stored.reshape(height, width, image.channels))
    if image.colorspace_settings.is_data or image.alpha_mode in {"NONE", "CHANNEL_PACKED"}:
        divide = False
    else:
        # Blender keeps bytes without their alpha and floats with it; Cycles mixes both with it. What it makes of floats
        # without it has changed from version to version.
        clear = bool((pixels[..., 3] < 1.0).any())
        if clear and image.is_float and image.alpha_mode == "STRAIGHT":
            raise UnreadableImage("of floating-point pixels with a straight alpha")
        divide = clear and not premultiplied
        if not image.is_float:
            pixels[..., :3] *= pixels[..., 3:]
    if image.alpha_mode == "NONE":
        pixels[..., 3] = 1.0
    pixels = _resampled(pixels, _Resampling.of(pixels, extension, encoded and smooth), encoded, divide)
    return pixels[..., :3], pixels[..., 3:]


def _four_channels(pixels: Float32) -> Float32:
    if pixels.shape[2] == 4:
        return pixels
    colour = pixels[..., :3] if pixels.shape[2] == 3 else np.repeat(pixels[..., :1], 3, axis=2)
    alpha = np.ones_like(pixels[..., :1]) if pixels.shape[2] != 2 else pixels[..., 1:]
    return np.concatenate([colour, alpha], axis=2)


@dataclass(frozen=True)
class _Resampling:
    """Every pixel is divided into parts x parts; then come means over blocks of pixels, whose rows and columns begin at
    the given ones and end at the last, or of nothing where rows is None. padding: numpy's name for what is beyond."""

    parts: int
    rows: Int64 | None
    columns: Int64
    padding: str

    @staticmethod
    def of(pixels: Float32, extension: Extension, divided: bool) -> _Resampling:
        height, width = pixels.shape[:2]
        side = max(height, width)
        parts = 1
        if divided and side <= 2 * LARGEST:
            # An odd number, so that the middle part is in the middle of its pixel.
            parts = max(3, min(17, (LARGEST // side - 1) | 1))
        small = side * parts <= LARGEST
        return _Resampling(parts, None if small else _blocks(height), _blocks(width), _PADDING[extension])


def _resampled(pixels: Float32, how: _Resampling, encoded: bool, divide: bool) -> Float32:
    """A few rows at a time, since an image of 8k is large enough once."""
    padded = np.pad(pixels, ((1, 1), (1, 1), (0, 0)), how.padding) if how.parts > 1 else pixels
    result = []
    rows = np.arange(len(pixels) + 1) if how.rows is None else how.rows
    for begin, end in pairwise(rows):
        block = padded[begin : end + 2] if how.parts > 1 else padded[begin:end].copy()
        if how.parts > 1:
            block = _divided(_divided(block, how.parts).swapaxes(0, 1), how.parts).swapaxes(0, 1)
        if divide:
            np.divide(block[..., :3], block[..., 3:], out=block[..., :3], where=block[..., 3:] > 0.0)
        if encoded:
            block[..., :3] = srgb_to_linear(block[..., :3])
        if how.rows is not None:
            columns = how.columns * how.parts
            means = np.add.reduceat(block.mean(axis=0), columns[:-1], axis=0) / np.diff(columns)[:, None]
            block = means[None]
        result.append(block.astype(np.float32))
    return np.concatenate(result)


def _divided(pixels: Float32, parts: int) -> Float32:
    """Rows (n + 2, ...) to (n * parts, ...): what is mixed of each inner row and the one before or after it."""
    offset = (np.arange(parts) + 0.5) / parts - 0.5
    share = np.abs(offset).astype(np.float32)[None, :, None, None]
    own, before, after = pixels[1:-1, None], pixels[:-2, None], pixels[2:, None]
    other = np.where((offset < 0)[None, :, None, None], before, after)
    return np.asarray((own * (1 - share) + other * share).reshape(-1, *pixels.shape[1:]))


def _blocks(count: int) -> Int64:
    """Where the blocks of pixels along a side begin, and the end."""
    wanted = math.ceil(count / math.ceil(count / LARGEST))
    return np.arange(wanted + 1) * count // wanted


def srgb_to_linear(values: Float32) -> Float32:
    """The sRGB transfer function, IEC 61966-2-1."""
    low = values <= 0.04045
    return np.where(low, values / 12.92, ((np.maximum(values, 0.04045) + 0.055) / 1.055) ** 2.4).astype(np.float32)
