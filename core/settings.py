"""What a person may ask of a bake."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

Estimator = Literal["auto", "hemisphere", "analytic", "centroid"]

#: Every layer a bake can deliver, and what it holds, W/(m^2 sr).
LAYERS = {
    "combined": "emitted plus reflected radiance, what Cycles' Combined bake gives",
    "light": "irradiance / pi, without the surface's own colour",
    "direct": "reflected radiance that came straight from lamps, emitting surfaces and the sky",
    "indirect": "reflected radiance that bounced at least once",
    "emission": "emitted radiance",
    "sky": "reflected radiance that came straight from the sky",
    "error": "estimated standard error of the combined radiance",
    "unreached": "grey; magenta where light was filled in from neighbours, red deep inside solids",
    "escaped": "share of the hemisphere, weighted by the cosine, that is open to the void: no radiance, 0 to 1",
    "triangles": "a colour of its own for every output triangle",
}

#: Layers that are no light: pictures of how the bake went.
VIEWS = ("unreached", "escaped", "triangles")


@dataclass(frozen=True)
class Settings:
    """tessellate: split the receivers (results `new` and `replace`), or keep their corners (`keep`).
    size: longest edge of a receiver's triangle, metres; None chooses it so that about `triangles` result.
    error: asked surface error; seconds: asked time. With both None the error of a preview is used; with both set, the
    bake ends at whichever comes first. threads: 0 takes every core.
    effects: by name (core.effects.EFFECTS), those to simulate, or not, whatever the scene calls for."""

    tessellate: bool = True
    size: float | None = None
    triangles: int = 50_000
    error: float | None = 0.02
    seconds: float | None = None
    estimator: Estimator = "auto"
    seed: int = 0
    threads: int = 0
    layers: tuple[str, ...] = ("combined",)
    effects: Mapping[str, bool] = field(default_factory=dict)


def asked_error(settings: Settings) -> float:
    """The relative error to aim at; by the clock, as small as time allows."""
    return settings.error or (0.02 if settings.seconds is None else 0.01)
