"""Sides of cells over which light breaks: fits have values of their own on either side of them."""

from __future__ import annotations

from functools import partial

import numpy as np

from .gather import Points
from .keys import Known, key
from .receivers import Receivers, shared_edges
from .scene import Bool, Int32
from .sights import COVERED, WHOLE, Sights
from .surroundings import GAP
from .tessellation import Int64

#: How far beside a side of a cell, relative to its height, it shows what is on either side.
_BESIDE_SIDE = 0.1


class Breaks:
    """Finds where light breaks, and remembers it: most of it is asked for again after some cells were split."""

    def __init__(self, sights: Sights) -> None:
        self._sights = sights
        self._known, self._known_middles = Known(1), Known(1)

    def between(self, receivers: Receivers, near: Bool, sight: Int64) -> Bool | None:
        """Sides (c, 3) of cells with a light that is in sight as a whole on one side and hidden on the other, with an
        outline between them, with something that stands between them, or that `_meets` adds; None without any.

        They are looked for between near (c,) cells, and between others that have something else in sight (c,): a
        contour may run along their sides, and cross none.
        """
        here, there = shared_edges(receivers.cell_vertex)
        one, other = here[:, 0] // 3, there[:, 0] // 3
        both = (near[one] & near[other]) | (~near[one] & ~near[other] & _part(sight[one], sight[other]))
        if not both.any():
            return None
        side = np.concatenate([here[both, 0], _side(there[both])])
        weights = np.full((len(side), 3), (1.0 - _BESIDE_SIDE) / 2.0)
        weights[np.arange(len(side)), (side + 2) % 3] = _BESIDE_SIDE
        broken = self._broken_between(Points(receivers.cells, side // 3, weights))
        side = side.reshape(2, -1)
        broken |= self._meets(receivers, near, side, receivers.cell_vertex[here[both] // 3, here[both] % 3])
        breaks = np.zeros(3 * len(near), dtype=bool)
        breaks[side[:, broken]] = True
        return breaks.reshape(-1, 3)

    def _broken_between(self, points: Points) -> Bool:
        """Whether light breaks (n,) between points (2 n,) on two sides of n places."""
        ends = points.positions.reshape(2, -1, 3)
        keys = key(ends, points.normals[: ends.shape[1]])
        return self._known.look_up(keys, lambda fresh: self._seen_between(points.only(np.tile(fresh, 2)))) > 0.0

    def _seen_between(self, points: Points) -> Bool:
        """The same where nothing is known yet."""
        sight, look = self._sights.workers.beside(
            partial(self._sights.sight, points, None), partial(self._sights.look, points, GAP * points.size, 1)
        )
        self._sights.rays += look.rays
        one, other = sight.reshape(2, -1)
        parted = self._sights.barred(points.only(slice(0, len(one))), points.positions[len(one) :])
        return np.asarray(_part(one, other) | parted | look.outlines)

    def _meets(self, receivers: Receivers, near: Bool, side: Int64, ends: Int32) -> Bool:
        """Sides (s,), of near (c,) cells on either of two sides (2, s) of them, that part a cell in full shadow from
        another, with an end (s, 2) where full shadow meets full light.

        There a hard shadow goes over into a strip, which is soft, and too thin at its beginning for what is on either
        side to be told from it. In one value where they meet light would smear into dark, and dark into light.
        """
        cell = np.flatnonzero(near)
        middles, sight = self._middles(receivers, cell)
        corner, (one, other) = receivers.cell_vertex, side // 3
        met = np.zeros(len(ends), dtype=bool)
        for number, source in enumerate(self._sights.light.lights if self._sights.shadows else []):
            whole, part = (sight >> WHOLE + number & 1) > 0, (sight >> number & 1) > 0
            shines = source.share(middles.positions, middles.normals) > 0.0
            in_shadow = np.zeros(len(near), dtype=bool)
            in_shadow[cell[whole]] = True
            dark, light = np.zeros((2, int(corner.max()) + 1), dtype=bool)
            dark[corner[cell[whole]]], light[corner[cell[shines & ~part]]] = True, True
            met |= (in_shadow[one] != in_shadow[other]) & (dark & light)[ends].any(axis=1)
        return met & near[one] & near[other]

    def _middles(self, receivers: Receivers, cell: Int64) -> tuple[Points, Int64]:
        """The middles of cells (n,), and what is in sight (n,) of them."""
        middles = Points(receivers.cells, cell, np.full((len(cell), 3), 1 / 3))
        keys = key(middles.positions[None], middles.normals)
        sight = self._known_middles.look_up(keys, lambda fresh: self._sights.sight(middles.only(fresh), None))
        return middles, sight.astype(np.int64)


def _part(one: Int64, other: Int64) -> Bool:
    """Whether a light is in sight as a whole on one side and hidden on the other, or one of them is covered: (n,)."""
    lights = (1 << WHOLE) - 1
    return np.asarray(((one >> WHOLE & ~other | other >> WHOLE & ~one) & lights | (one ^ other) & COVERED) > 0)


def _side(ends: Int64) -> Int64:
    """The side (n,), 3 t + i from corner i to the next, whose ends are two corners (n, 2) of a triangle t."""
    first, second = ends.T
    return np.where((first % 3 + 1) % 3 == second % 3, first, second)
