"""Many lights at once: which of them to ask at each point, and those of one kind together.

Numpy works along whole arrays: two hundred lamps one by one, each on a few points, take as many short arrays as there
are lamps. So lamps of one kind are one lamp whose numbers are arrays, and the same formulas serve (`lamps`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from copy import copy
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..scene import Float64
from .choice import chances, draw
from .lamps import Light, some_of

#: Numbers of one array, and lights asked at once: what a processor's cache holds.
_TABLE, _ASKED = 1 << 14, 1 << 13

Int64 = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Asked:
    """Lights that are asked, (k,) each: its number; the point, and the half of the rays that asks; how much of it would
    arrive there, and its colour (k, 3), over the chance that it is asked."""

    light: Int64
    point: Int64
    half: Int64
    share: Float64
    color: Float64

    def only(self, chosen: Int64) -> Asked:
        return Asked(self.light[chosen], self.point[chosen], self.half[chosen], self.share[chosen], self.color[chosen])


class Crowd:
    """Lights, by kind."""

    def __init__(self, lights: Sequence[Light]) -> None:
        self._color = np.stack([light.color for light in lights])
        kinds: dict[object, list[int]] = {}
        for number, light in enumerate(lights):
            kinds.setdefault(_kind(light, number), []).append(number)
        self._kinds = [(_together([lights[number] for number in some]), np.array(some)) for some in kinds.values()]
        self._kind, self._place = np.zeros((2, len(lights)), dtype=np.int64)
        for kind, (_, some) in enumerate(self._kinds):
            self._kind[some], self._place[some] = kind, np.arange(len(some))

    def shares(self, points: Float64, normals: Float64) -> Float64:
        """How much of each light arrives (l, n) at points (n, 3) with normals (n, 3), as if it shone evenly."""
        shares = np.empty((len(self._color), len(points)))
        for light, some in self._kinds:
            shares[some] = some_of(light, np.s_[:, None]).share(points, normals)
        return shares

    def choose(
        self, points: Float64, normals: Float64, count: int, rng: np.random.Generator
    ) -> tuple[Asked, Asked, Float64]:
        """Lights to ask at points (n, 3) with normals (n, 3): those that are asked for sure; those that each of two
        halves draws, so that `count` are asked in all; and what all those that are not sure would bring, (n, 3)."""
        sure: list[Asked] = []
        drawn: list[Asked] = []
        rest = np.empty((len(points), 3))
        step = max(_TABLE // len(self._color), 1)
        for begin in range(0, len(points), step):
            part = slice(begin, begin + step)
            shares = self.shares(points[part], normals[part])
            chance = chances(shares * self._color.mean(axis=1)[:, None], count)
            certain = chance == 1
            others = np.where(certain, 0.0, chance)
            halves = draw(others, rng.random((2, shares.shape[1])))
            rest[part] = np.where(certain, 0.0, shares).T @ self._color
            for found, chosen in ((sure, certain[None]), (drawn, halves)):
                half, light, point = np.nonzero(chosen)
                color = self._color[light] / chance[light, point, None]
                found.append(Asked(light, point + begin, half, shares[light, point], color))
        return _joined(sure), _joined(drawn), rest

    def alike(self, asked: Asked) -> Iterator[tuple[Light, Asked]]:
        """Some of the lights that are asked after others, as one light with numbers for each of them."""
        kind = self._kind[asked.light]
        for number, (light, _) in enumerate(self._kinds):
            own = np.flatnonzero(kind == number)
            for begin in range(0, len(own), _ASKED):
                some = asked.only(own[begin : begin + _ASKED])
                yield some_of(light, self._place[some.light]), some


def _kind(light: Light, number: int) -> object:
    """What lights have in common that can be asked together; others stand alone."""
    return (type(light), light.kind) if light.each else number


def _together(lights: Sequence[Light]) -> Light:
    """Lights of one kind as one, with the numbers of each, (l, ...)."""
    together = copy(lights[0])
    for name in together.each:
        setattr(together, name, np.array([getattr(light, name) for light in lights]))
    return together


def _joined(parts: Sequence[Asked]) -> Asked:
    names = ("light", "point", "half", "share", "color")
    return Asked(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))
