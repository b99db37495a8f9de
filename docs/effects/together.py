"""What effects cost alone and together: one stage, to which one thing after the other is added."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from time import process_time

import bpy

from ...addon.scene_reader import pick_receivers, read_scene
from ...core.bake import bake
from ...core.settings import Settings
from ...sample_blends.modelling import add_mesh, box, emission, spot_lamp, sun_lamp
from .lamps import COLD, WARM
from .skies import plain
from .textures import image, pictured, unwrap
from .transparency import STAGE, canopy, made_of, screen, stage

#: A size and no error asked: as many triangles and passes in every scene, so that only the effects differ.
SETTINGS = Settings(size=0.25, triangles=2_000, error=None, threads=1)
_TIMES = 2


def _sun() -> None:
    sun_lamp("Sun", 2.0, WARM, (2.0, -2.0, 3.0), (0.0, 0.0, 0.0), angle=3.0)


def _spot() -> None:
    spot_lamp("Torch", 200.0, COLD, (0.0, -1.5, 2.5), (0.0, 0.2, 0.2), angle=50.0, blend=0.6, radius=0.1)


def _slab() -> None:
    add_mesh("Slab", box((1.0, 0.3, 0.05), emission("Glow", (8.0, 6.0, 4.0))), at=(-0.8, -0.6, 1.6))


def _sky() -> None:
    plain((0.5, 0.5, 0.5))


def _picture() -> None:
    unwrap(
        add_mesh("Picture", box((0.8, 0.05, 0.8), pictured("Canvas", image("Paint", 4, 4, seed=8), 1.0)), at=(1, 1, 0))
    )


def _veil() -> None:
    gauze = made_of("Gauze", "ShaderNodeBsdfPrincipled", Base_Color=(0.8, 0.8, 0.8, 1.0), Alpha=0.5)
    add_mesh("Veil", canopy(gauze).scaled(0.6, 0.6, 1.0), at=(0.6, 0.2, 0.2))


def _leaf() -> None:
    leaf = made_of("Cloth", "ShaderNodeBsdfTranslucent", Color=(0.8, 0.8, 0.8, 1.0))
    add_mesh("Leaf", canopy(leaf).scaled(0.6, 0.6, 1.0), at=(-0.6, 0.3, -0.2))


def _mirror() -> None:
    silver = made_of("Silver", "ShaderNodeBsdfAnisotropic", Color=(0.9, 0.9, 0.9, 1.0), Roughness=0.0)
    add_mesh("Mirror", screen(silver, 1.0, 1.0), at=(0.2, 1.8, 0.1))


#: What is added, in this order.
THINGS: dict[str, Callable[[], None]] = {
    "a sun": _sun,
    "a spot lamp": _spot,
    "a glowing slab": _slab,
    "an even sky": _sky,
    "a picture": _picture,
    "a veil": _veil,
    "a translucent cloth": _leaf,
    "a mirror": _mirror,
}


@dataclass(frozen=True)
class Cost:
    """Seconds of the processor, and rays."""

    seconds: float
    rays: int

    def __sub__(self, other: Cost) -> Cost:
        return Cost(self.seconds - other.seconds, self.rays - other.rays)

    def __add__(self, other: Cost) -> Cost:
        return Cost(self.seconds + other.seconds, self.rays + other.rays)


def cost(things: Iterable[str]) -> Cost:
    """Of the stage under a lamp with these things on it: the least of some times."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    stage()
    for name in things:
        THINGS[name]()
    context = bpy.context
    context.view_layer.update()
    receivers = pick_receivers(context.scene, context.view_layer, STAGE)
    scene, _ = read_scene(context.evaluated_depsgraph_get(), receivers, tessellate=True)
    took = []
    for _ in range(_TIMES):
        begun = process_time()
        rays = bake(scene, SETTINGS).report.rays["total"]
        took.append(process_time() - begun)
    return Cost(min(took), rays)


def table() -> Iterator[str]:
    """Lines of a table: each thing alone, and with all before it; beside it what the things cost alone, added up."""
    heads = "Thing", "Alone: seconds", "Million rays", "With all above: seconds", "Parts", "Million rays", "Parts"
    yield f"| {' | '.join(heads)} |"
    yield "| --- | ---: | ---: | ---: | ---: | ---: | ---: |"
    nothing = added = cost(())
    yield f"| the stage under a lamp | {nothing.seconds:.2f} | {nothing.rays / 1e6:.2f} | | | | |"
    names = list(THINGS)
    for number, name in enumerate(names):
        alone = cost([name]) - nothing
        together = cost(names[: number + 1])
        added += alone
        cells = [f"{alone.seconds:+.2f}", f"{alone.rays / 1e6:+.2f}", f"{together.seconds:.2f}", f"{added.seconds:.2f}"]
        yield f"| {name} | {' | '.join(cells)} | {together.rays / 1e6:.2f} | {added.rays / 1e6:.2f} |"
