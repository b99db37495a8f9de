"""Blender's images as arrays of scene-linear light."""

from __future__ import annotations

import math
from itertools import pairwise

import bpy
import numpy as np

from ..core.scene import Float32

#: Pixels along a side that an image is reduced to: finer than vertex colours can show.
LARGEST = 1024
#: What Cycles shows for an image whose pixels are missing.
MISSING = (1.0, 0.0, 1.0, 1.0)
#: Colour spaces whose byte pixels hold the numbers themselves.
_PLAIN = {"Non-Color", "Raw", "Linear", "Linear Rec.709"}


class UnreadableImage(ValueError):
    """The image's pixels do not say what Cycles makes of them. The message tells why."""


def has_pixels(image: bpy.types.Image) -> bool:
    """Whether an image's file was found and read; tiles and films are not looked into."""
    return image.source not in {"FILE", "GENERATED"} or len(image.pixels) > 0


def read_image(image: bpy.types.Image) -> Float32:
    """(h, w, 4) RGBA, scene-linear, row 0 at the bottom, as it is stored: its alpha may be premultiplied or not.

    Large images come reduced to `LARGEST` pixels along a side at most. Raises UnreadableImage for tiles, films and
    colour spaces that only Blender itself can read.
    """
    if image.source not in {"FILE", "GENERATED"}:
        raise UnreadableImage(f"of the kind {image.source.lower()}")
    width, height = image.size
    space = image.colorspace_settings.name
    encoded = not image.is_float and space == "sRGB"
    if not (image.is_float or encoded or space in _PLAIN):
        raise UnreadableImage(f"in the colour space {space}")
    stored = np.empty(width * height * image.channels, np.float32)
    image.pixels.foreach_get(stored)
    rows = _four_channels(stored.reshape(height, width, image.channels))
    return _reduced(rows, encoded)


def _four_channels(pixels: Float32) -> Float32:
    if pixels.shape[2] == 4:
        return pixels
    colour = pixels[..., :3] if pixels.shape[2] == 3 else np.repeat(pixels[..., :1], 3, axis=2)
    alpha = np.ones_like(pixels[..., :1]) if pixels.shape[2] != 2 else pixels[..., 1:]
    return np.concatenate([colour, alpha], axis=2)


def _reduced(pixels: Float32, encoded: bool) -> Float32:
    """Means over blocks of pixels, a few rows at a time: an image of 8k is large enough once."""
    height, width = (_blocks(count) for count in pixels.shape[:2])
    small = np.empty((len(height) - 1, len(width) - 1, 4), np.float32)
    for row, (begin, end) in enumerate(pairwise(height)):
        block = pixels[begin:end].copy()
        if encoded:
            block[..., :3] = srgb_to_linear(block[..., :3])
        total = np.add.reduceat(block.sum(axis=0), width[:-1], axis=0)
        small[row] = total / ((end - begin) * np.diff(width)[:, None])
    return small


def _blocks(count: int) -> np.ndarray:
    """Where the blocks of pixels along a side begin, and the end."""
    wanted = math.ceil(count / math.ceil(count / LARGEST))
    return np.arange(wanted + 1) * count // wanted


def srgb_to_linear(values: Float32) -> Float32:
    """The sRGB transfer function, IEC 61966-2-1."""
    low = values <= 0.04045
    return np.where(low, values / 12.92, ((np.maximum(values, 0.04045) + 0.055) / 1.055) ** 2.4).astype(np.float32)
