"""The light of a running bake, drawn over the 3D View.

It is a picture and no more: nothing in the file knows of it, so a bake that is cancelled, undone around or saved during
leaves no trace.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import bpy
import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader

from ..core.result import BakeResult
from ..core.scene import Float32

#: How far the picture is drawn before the surface it lies on, as a share of the depth range.
_BEFORE = 2e-5
#: Corners that go to the graphics card at a time: a few milliseconds.
_AT_ONCE = 150_000


@dataclass(frozen=True, eq=False)
class Picture:
    """Triangles in the world, (3 t, 3), and the colour of each of their corners as a screen shows it, (3 t, 4)."""

    positions: Float32
    colors: Float32

    @staticmethod
    def of(result: BakeResult) -> Picture:
        corners = [item.vertices[item.triangles].reshape(-1, 3) for item in result.objects]
        light = [item.layers["combined"].reshape(-1, 3) for item in result.objects]
        colors = np.ones((sum(map(len, light)), 4), np.float32)
        colors[:, :3] = to_screen(np.concatenate(light))
        return Picture(np.concatenate(corners).astype(np.float32), colors)


def to_screen(linear: Float32) -> Float32:
    """Scene-linear values as Solid shading shows them: sRGB's curve (IEC 61966-2-1), and white above 1."""
    clipped = np.clip(linear, 0.0, 1.0)
    return np.where(clipped <= 0.0031308, 12.92 * clipped, 1.055 * clipped ** (1 / 2.4) - 0.055).astype(np.float32)


class LiveLight:
    """Draws the latest picture in every 3D View that shows the scene which is baked."""

    def __init__(self, scene: bpy.types.Scene) -> None:
        self._scene = scene.session_uid
        self._batches: list[Any] = []
        self._coming: list[Any] = []
        self._picture: Picture | None = None
        self._shader = gpu.shader.from_builtin("SMOOTH_COLOR")
        self._handle = bpy.types.SpaceView3D.draw_handler_add(self._draw, (), "WINDOW", "POST_VIEW")

    def show(self, picture: Picture) -> None:
        """From now on; until `load` has all of it, what was shown before stays."""
        self._picture, self._coming = picture, []

    def load(self) -> bool:
        """One more piece of the picture; whether that was the last, and there is something new to be seen."""
        if self._picture is None:
            return False
        begin = len(self._coming) * _AT_ONCE
        piece = slice(begin, begin + _AT_ONCE)
        content = {"pos": self._picture.positions[piece], "color": self._picture.colors[piece]}
        self._coming.append(batch_for_shader(self._shader, "TRIS", content))
        if piece.stop < len(self._picture.positions):
            return False
        self._batches, self._coming, self._picture = self._coming, [], None
        return True

    def remove(self) -> None:
        bpy.types.SpaceView3D.draw_handler_remove(self._handle, "WINDOW")

    def _draw(self) -> None:
        context = bpy.context
        if not self._batches or context.scene.session_uid != self._scene:
            return
        projection = context.region_data.window_matrix.copy()
        projection[2] = projection[2] - _BEFORE * projection[3]
        gpu.state.depth_test_set("LESS_EQUAL")
        gpu.state.depth_mask_set(True)
        with gpu.matrix.push_pop_projection():
            gpu.matrix.load_projection_matrix(projection)
            for batch in self._batches:
                batch.draw(self._shader)
        gpu.state.depth_mask_set(False)
        gpu.state.depth_test_set("NONE")
