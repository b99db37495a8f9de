"""The scenes, by name: each is a function that fills an empty file and is marked with `@effect_scene`."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable
from dataclasses import dataclass

import bpy

_PACKAGE = __package__ or ""


@dataclass(frozen=True)
class EffectScene:
    """shows: effects (core.effects.EFFECTS) that the plan must find.
    receivers: names of what is baked; else every mesh."""

    kind: str
    name: str
    build: Callable[[], None]
    shows: tuple[str, ...]
    receivers: tuple[str, ...] | None


_scenes: dict[str, EffectScene] = {}


def effect_scene(
    *shows: str, receivers: tuple[str, ...] | None = None
) -> Callable[[Callable[[], None]], Callable[[], None]]:
    """Enter a function that builds a scene, under its own name. It starts from a file that holds nothing."""

    def enter(build: Callable[[], None]) -> Callable[[], None]:
        name = build.__name__.replace("_", " ")
        if name in _scenes:
            raise ValueError(f"There are two scenes '{name}'.")
        _scenes[name] = EffectScene(build.__module__.rpartition(".")[2], name, build, shows, receivers)
        return build

    return enter


def all_scenes() -> dict[str, EffectScene]:
    """Every scene of every module of this package, kind by kind."""
    for module in pkgutil.iter_modules(importlib.import_module(_PACKAGE).__path__):
        if module.name != "__main__":
            importlib.import_module(f"{_PACKAGE}.{module.name}")
    return dict(sorted(_scenes.items(), key=lambda item: item[1].kind))


def built(scene: EffectScene) -> None:
    """Make the scene the one that Blender has open."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene.build()
    bpy.context.view_layer.update()
