"""What light is asked for straight, and what is left to rays that look around."""

from __future__ import annotations

from ..patches import Space
from ..scene import Scene
from ..sky import Sky
from .emitters import emitting_panels
from .illumination import Source
from .lamps import place
from .sky import divide_sky


def sources(
    scene: Scene, around: Scene, space: Space, *, sky_lights: bool, portals: bool
) -> tuple[list[Source], list[Source], Sky]:
    """Lamps of a scene and emitting surfaces around it; what is asked for straight of its sky, as lights and through
    portals if wanted; and the rest of the sky."""
    others: list[Source] = [place(lamp, space) for lamp in scene.lamps]
    others += emitting_panels(around, space)
    sky, of_sky = divide_sky(scene, space, suns=sky_lights, portals=portals)
    return others, list[Source](of_sky), sky
