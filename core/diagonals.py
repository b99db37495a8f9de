"""Diagonals chosen by the light: which two triangles show a quadrilateral best.

A shadow's edge that runs across the diagonals of small squares shows as teeth; along them it is smooth. So where two
triangles are halves of a convex quadrilateral, its diagonal is turned if that lessens the jumps of the gradient over
its edges (data dependent triangulation: Dyn, Levin, Rippa 1990). Vertices and their light stay as they are.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .receivers import Receivers, next_corner, shared_edges
from .scene import Bool, Float64
from .tessellation import Int64

#: How often diagonals are turned at most, no two of neighbouring triangles at once.
_ROUNDS = 8
#: Jumps smaller than this share of the mean, squared, are left as they are; others must lessen by this share.
_MATTERS, _GAIN = 0.05, 0.05
#: The least share of a quadrilateral that either triangle may have; the squared sine of an angle that is nothing.
_SLIVER, _NEEDLE = 0.05, 1e-8


def turn_diagonals(receivers: Receivers, light: Float64, fixed: Bool) -> Int64:
    """For each corner of the output triangles (e, 3) the number 3 e + i of the corner it is to be instead.

    light (v,): at the fit vertices. Diagonals stay beside fixed (e,) triangles, where triangles are not parts of one of
    the input's, where the fit breaks: there they are cut to where the light jumps; and on contours, where light has a
    kink that no jump of the gradient is too much for.
    """
    fixed = fixed | receivers.broken
    corner = np.arange(receivers.corner_vertex.size).reshape(-1, 3)
    surface = _Surface(receivers, light)
    gradient = surface.gradients(corner)
    for _ in range(_ROUNDS):
        quads = _Quads.of(receivers, corner, fixed)
        chosen, (one, other) = surface.worth_turning(quads, gradient)
        if not len(chosen):
            break
        first, second = quads.first[chosen], quads.second[chosen]
        corner[first], corner[second] = one, other
        gradient[first], gradient[second] = surface.gradients(one), surface.gradients(other)
    return corner


@dataclass(frozen=True, eq=False)
class _Quads:
    """Pairs of triangles (q,), first and second, that share an edge.

    corners (q, 4): its ends and the apexes of both, by number; beyond (q, 4): the triangles over the other sides, from
    that between the second end and the first apex on and round, -1 where there is none; movable (q,): whose diagonal
    may be turned.
    """

    first: Int64
    second: Int64
    corners: Int64
    beyond: Int64
    movable: Bool

    @classmethod
    def of(cls, receivers: Receivers, corner: Int64, fixed: Bool) -> _Quads:
        vertex, parent = receivers.corner_vertex.ravel(), receivers.parent
        here, there = shared_edges(vertex[corner])
        first, second = here[:, 0] // 3, there[:, 0] // 3
        side, back = here[:, 0], np.where(next_corner(there[:, 1]) == there[:, 0], there[:, 1], there[:, 0])
        over = np.full(corner.size, -1)
        over[side], over[back] = second, first
        apex, far = next_corner(here[:, 1]), next_corner(next_corner(back))
        beyond = over[np.stack([here[:, 1], apex, next_corner(back), far], axis=1)]
        movable = (parent[first] == parent[second]) & ~fixed[first] & ~fixed[second]
        if receivers.on_contour is not None:
            on_contour = receivers.on_contour.ravel()[corner.ravel()]
            movable &= ~on_contour[here].all(axis=1)
        corners = corner.ravel()[np.stack([here[:, 0], here[:, 1], apex, far], axis=1)]
        return cls(first, second, corners, beyond, movable)


class _Surface:
    """Where the corners of the output triangles are, and the light at each."""

    def __init__(self, receivers: Receivers, light: Float64) -> None:
        self._position = receivers.element_corners.reshape(-1, 3)
        self._light = light[receivers.corner_vertex.ravel()]

    def gradients(self, corners: Int64) -> Float64:
        """(n, 3) of the light over triangles (n, 3) of these corners; none in needles."""
        sides, rise = (x[corners[:, 1:]] - x[corners[:, :1]] for x in (self._position, self._light))
        (aa, ab), (_, bb) = np.moveaxis(np.einsum("nik,njk->nij", sides, sides), 0, 2)
        area = aa * bb - ab**2
        inverse = np.divide(1.0, area, out=np.zeros_like(area), where=area > _NEEDLE * aa * bb)
        weights = np.stack([bb * rise[:, 0] - ab * rise[:, 1], aa * rise[:, 1] - ab * rise[:, 0]], axis=1)
        return np.asarray(np.einsum("ni,nik->nk", weights * inverse[:, None], sides))

    def worth_turning(self, quads: _Quads, gradient: Float64) -> tuple[Int64, tuple[Int64, Int64]]:
        """Which of the pairs to turn now, and the triangles (n, 3) that they then are."""
        jump = self._jump(gradient[quads.first], gradient[quads.second], quads.corners[:, :2])
        some = np.flatnonzero(quads.movable & (jump > _MATTERS * jump.sum() / max(len(jump), 1)))
        corners, beyond = quads.corners[some], quads.beyond[some]
        one, other = corners[:, [0, 3, 2]], corners[:, [3, 1, 2]]
        old = gradient[quads.first[some]], gradient[quads.second[some]]
        new = self.gradients(one), self.gradients(other)
        before, after = jump[some], self._jump(*new, corners[:, 2:])
        for k, (ends, was, would) in enumerate([([1, 2], 0, 1), ([2, 0], 0, 0), ([0, 3], 1, 0), ([3, 1], 1, 1)]):
            outside, side = gradient[beyond[:, k]], corners[:, ends]
            inside = beyond[:, k] >= 0
            before = before + inside * self._jump(old[was], outside, side)
            after = after + inside * self._jump(new[would], outside, side)
        gain = np.where(self._convex(one, other), before - after, 0.0)
        better = np.flatnonzero(gain > _GAIN * before)
        chosen = better[_apart(gain[better], quads.first[some[better]], quads.second[some[better]], beyond[better])]
        return some[chosen], (one[chosen], other[chosen])

    def _jump(self, one: Float64, other: Float64, ends: Int64) -> Float64:
        """Squared jumps (n,) of gradients (n, 3), as light over the length of the edges between ends (n, 2)."""
        along, step = self._position[ends[:, 0]] - self._position[ends[:, 1]], one - other
        return np.asarray(np.einsum("nk,nk->n", along, along) * np.einsum("nk,nk->n", step, step))

    def _convex(self, one: Int64, other: Int64) -> Bool:
        """Where both triangles (n, 3) face alike, and neither is a sliver beside the other."""
        sides = [self._position[corners[:, 1:]] - self._position[corners[:, :1]] for corners in (one, other)]
        first, second = (np.cross(side[:, 0], side[:, 1]) for side in sides)
        whole = first + second
        shares = [np.einsum("nk,nk->n", part, whole) for part in (first, second)]
        return np.asarray(np.minimum(*shares) > _SLIVER * np.einsum("nk,nk->n", whole, whole))


def _apart(gain: Float64, first: Int64, second: Int64, beyond: Int64) -> Int64:
    """Those (n,) pairs of triangles whose gain is the largest of all pairs that they share a triangle with, or that
    have one beside theirs."""
    rank = np.empty(len(gain), dtype=np.int64)
    rank[np.argsort(gain, kind="stable")] = np.arange(1, len(gain) + 1)
    # The last place stands for the triangle where there is none, number -1.
    best = np.zeros(max(int(t.max(initial=0)) for t in (first, second, beyond)) + 2, dtype=np.int64)
    for triangles in (first, second):
        np.maximum.at(best, triangles, rank)
    around = np.maximum(best[beyond].max(axis=1, initial=0), np.maximum(best[first], best[second]))
    return np.flatnonzero(rank >= around)
