"""Emitting surfaces as lamps: each triangle a panel that shines from both sides."""

from __future__ import annotations

import numpy as np

from ..effects import MOST_PANELS, emitting_triangles
from ..patches import Space, triangle_geometry
from ..scene import Scene
from .lamps import Light, Panel


def emitting_panels(scene: Scene, space: Space) -> list[Light]:
    """A light for each emitting triangle; none when there are so many that rays find them better."""
    if emitting_triangles(scene) > MOST_PANELS:
        return []
    panels: list[Light] = []
    for scene_object in scene.objects:
        corners = space.normalise(scene_object.vertices[scene_object.triangles])
        area = triangle_geometry(corners)[1]
        for triangle in np.flatnonzero(area > 0):
            surface = scene.surfaces[scene_object.surface[triangle]]
            if max(surface.emission) > 0:
                panels.append(Panel(surface.name, corners[triangle], np.array(surface.emission), two_sided=True))
    return panels
