"""What a bake leaves behind, so that the next one of the same scene need not start over.

Light is linear in its sources. The light of one lamp alone, its response, is sampled once with the triangles, patches
and rays of the bake; from then on any change of that lamp's colour or energy is a sum of arrays. And a bake that is
asked for a smaller error than before goes on sampling where it stood.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field, fields, is_dataclass, replace
from typing import Any

import numpy as np

from .accuracy import ErrorEstimate
from .baked import Baked
from .clock import Clock
from .direct.illumination import DirectLight
from .direct.lamps import place
from .parallel import Workers
from .receivers import cell_colours
from .refinement import Light, fit_alone, refine
from .report import mean_energy
from .result import BakeResult
from .scene import LAMP_COLOUR, Float64, Lamp, Scene
from .settings import Settings
from .sky import Sky
from .surroundings import look_up
from .survey import Survey
from .transport import HALVES, Transport, fill_with_light

#: A lamp that becomes so many times as bright would want triangles and samples of its own.
_MOST_GROWTH = 4.0


@dataclass(eq=False)
class _Last:
    """The scene and the settings as they were given, what was baked, its light, and the responses of lamps by name."""

    scene: Scene
    settings: Settings
    baked: Baked
    light: Light
    responses: dict[str, _Response] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class _Response:
    """What one lamp alone brings, in plain white: its light, and the solved halves that it was gathered from."""

    light: Light
    halves: tuple[Transport, ...]


class Memory:
    """Keeps the last bake, for as long as it is kept itself."""

    def __init__(self) -> None:
        self._last: _Last | None = None

    def remember(self, scene: Scene, settings: Settings, baked: Baked, light: Light) -> None:
        self._last = _Last(scene, settings, baked, light)

    def forget(self) -> None:
        self._last = None

    def recall(self, scene: Scene, settings: Settings, clock: Clock) -> BakeResult | None:
        """The result for a scene that differs from the last one by the brightness of lamps only, or for one that is the
        same and is to be baked better; None when there is nothing to build upon.

        Raises Cancelled when the clock's progress says so.
        """
        last = self._last
        if last is None or not _same_question(last.settings, settings) or not _same_but_lamps(last.scene, scene):
            return None
        changes = lamp_changes(last.scene, scene)
        if changes is None or not changes.keys() <= {lamp.name for lamp in last.baked.plan.scene.lamps}:
            return None
        better = (settings.error, settings.seconds) != (last.settings.error, last.settings.seconds)
        if better and (changes or not _sampling_would_help(last.light.error)):
            return None
        survey = last.baked.survey
        rays = Counter({purpose: -count for purpose, count in survey.rays.items()})
        with Workers(settings.threads, clock.progress) as workers:
            survey.workers = workers
            if better:
                last.light, last.settings = _refined(last.baked, settings, workers, clock), settings
            for name in changes.keys() - last.responses.keys():
                with clock.stage("relight", 0.1):
                    last.responses[name] = _response(last.baked, name, last.light.alphas, workers, rays)
        result = last.baked.result(_relit(last, changes), settings, clock)
        result.report.energy = _ledger(last, changes)
        rays.update(survey.rays)
        result.report.rays = {"total": rays.total(), **{purpose: count for purpose, count in rays.items() if count}}
        return result


def lamp_changes(before: Scene, after: Scene) -> dict[str, Float64] | None:
    """By how much (3,) the colour of each lamp has changed, of those where it has; None when lamps differ by more."""
    old, new = ({lamp.name: lamp for lamp in scene.lamps} for scene in (before, after))
    if old.keys() != new.keys() or len(old) != len(before.lamps):
        return None
    changes = {}
    for name, lamp in old.items():
        one, other = _color(lamp), _color(new[name])
        if type(lamp) is not type(new[name]) or not same(_unit(lamp), _unit(new[name])):
            return None
        if (other > _MOST_GROWTH * one).any():
            return None
        if (one != other).any():
            changes[name] = other - one
    return changes


def same(one: Any, other: Any) -> bool:
    """Whether two values, or two trees of dataclasses, tuples and arrays, are equal throughout."""
    if one is other:
        return True
    if type(one) is not type(other):
        return False
    if isinstance(one, np.ndarray):
        return bool(np.array_equal(one, other))
    if isinstance(one, tuple):
        return len(one) == len(other) and all(map(same, one, other))
    if is_dataclass(one):
        return all(same(getattr(one, f.name), getattr(other, f.name)) for f in fields(one))
    return bool(one == other)


def _same_question(before: Settings, after: Settings) -> bool:
    """Whether the same is asked, but for how well, how fast and which layers; the layer Sky has a way of its own."""
    return same(*(replace(s, error=None, seconds=None, threads=0, layers=_of_sky(s)) for s in (before, after)))


def _of_sky(settings: Settings) -> tuple[str, ...]:
    return tuple(layer for layer in settings.layers if layer == "sky")


def _same_but_lamps(before: Scene, after: Scene) -> bool:
    return same(*(replace(scene, lamps=(), warnings=()) for scene in (before, after)))


def _sampling_would_help(error: ErrorEstimate) -> bool:
    """Whether sampling is most of the error: other triangles and patches take another bake."""
    return error.sampling > float(np.hypot(error.transport, error.resolution))


def _color(lamp: Lamp) -> Float64:
    return np.array(getattr(lamp, LAMP_COLOUR[type(lamp)]))


def _unit(lamp: Lamp) -> Lamp:
    """The same lamp in plain white, of one unit."""
    bright: dict[str, Any] = {LAMP_COLOUR[type(lamp)]: (1.0, 1.0, 1.0)}
    return replace(lamp, **bright)


def _refined(baked: Baked, settings: Settings, workers: Workers, clock: Clock) -> Light:
    """The light after more passes, until the new question is answered."""
    effort = baked.plan.effort
    return refine(baked.survey, baked.plan.scene, settings, effort, workers, clock, lambda *_: None)[1]


def _relit(last: _Last, changes: dict[str, Float64]) -> Light:
    """The light with the change (3,) of each lamp times its response."""
    light = last.light
    if not changes:
        return light
    brightness = doubt = _brightness(last.baked, light)
    for name, change in changes.items():
        response = last.responses[name].light
        light = replace(
            light,
            lamps=np.maximum(light.lamps + change * response.lamps, 0.0),
            reflected=np.maximum(light.reflected + change * response.reflected, 0.0),
        )
        doubt += float(np.abs(change).mean()) * _brightness(last.baked, response)
    # Each part of the light is as sure as the whole was; what was taken away leaves its error behind.
    return replace(
        light,
        error=light.error.scaled(doubt / (_brightness(last.baked, light) or doubt or 1.0)),
        cell_error=light.cell_error * (doubt / (brightness or 1.0)) ** 2,
    )


def _ledger(last: _Last, changes: dict[str, Float64]) -> dict[str, float]:
    """Where the light went, W, with the change (3,) of each lamp."""
    ledger = mean_energy(last.baked.halves)
    for name, change in changes.items():
        for account, more in mean_energy(last.responses[name].halves, change / 3.0).items():
            ledger[account] += more
    return ledger


def _response(baked: Baked, name: str, alphas: tuple[Float64, ...], workers: Workers, rays: Counter[str]) -> _Response:
    """The light of one lamp alone, in plain white, with the smoothing of the whole. Counts its rays by purpose."""
    plan, survey = baked.plan, baked.survey
    effort, seed, black = replace(plan.effort, emitters_by_rays=False), survey.seed, Sky.of((0.0, 0.0, 0.0))
    lamp = next(lamp for lamp in plan.scene.lamps if lamp.name == name)
    light = DirectLight([place(_unit(lamp), baked.patches.space)], survey.visibility, seed)
    halves = []
    for half, purpose in zip(baked.halves, HALVES, strict=False):
        exchange = replace(half.exchange, glints=None)
        halves.append(fill_with_light(exchange, light, None, effort, workers, seed=seed, purpose=purpose))
        rays.update(halves[-1].rays - exchange.rays)
    around = look_up(baked.patches, survey.visibility, tuple(halves), black, effort, seed)
    alone = Survey(survey.receivers, light, around, effort, seed, workers)
    alone.catch_up(survey.passes)
    alone.top_up(survey.indirect[0].tried + survey.indirect[1].tried)
    rays.update(alone.rays)
    return _Response(fit_alone(alone, alphas), tuple(halves))


def _brightness(baked: Baked, light: Light) -> float:
    """Mean reflected radiance on the receivers, W/(m^2 sr)."""
    receivers = baked.survey.receivers
    reflected = cell_colours(baked.plan.scene, receivers).albedo * receivers.at_cells(light.arriving) / np.pi
    return float(receivers.cells.area @ reflected.mean(axis=1) / receivers.cells.area.sum())
