"""Triangles cut along the edges of shadows and along the outlines of what stands on a surface.

A step of the light that runs through triangles cannot be shown by linear elements: it becomes a ramp as wide as they
are, with teeth. Cut along the step (discontinuity meshing: Heckbert 1992; Lischinski, Tampieri, Greenberg 1992), and
with values of its own on either side, the light is linear again, whatever the size of the triangles. The shadow of a
light with size is cut twice, where it begins and where it is full: between the two is a strip of triangles.

Neighbouring cells that have other lights in view are where contours are looked for, and from there they are followed
from edge to edge. On an edge, bisection finds the place. Where the shadows of many lights cross an edge, the one that
steps most is tried first, and pieces are looked at again. A contour is left alone where a line from end to end of the
edge shows the light about as well: a shadow that is soft over all of it.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, fields, replace
from functools import partial

import numpy as np

from .breaks import Breaks
from .convexity import nothing_stands_between
from .direct.illumination import DirectLight
from .gather import Points
from .keys import Known, key
from .parallel import Workers
from .patches import Cells
from .receivers import Receivers, cell_colours, cut_cells, numbered_edges
from .scene import Bool, Float64, Scene
from .sights import BARRED, COVERED, WHOLE, Sights
from .surroundings import GAP, Surroundings
from .tessellation import Int64

#: Where edges are looked at, from one end to the other; and how far inside the triangle, relative to its height.
_PLACES = np.array([0.02, 0.26, 0.5, 0.74, 0.98])
_ASIDE = 2e-4
#: A place on an edge is found by looking between two others, so often, at so many places at once: less often would need
#: more places, more often more calls. How often the pieces are looked at again, for more than one contour.
_NARROWINGS, _BETWEEN, _PASSES = 4, 3, 4
#: A cut nearer to an end than this, relative to the uncut cell, is none: it would leave a sliver.
_SNAP = 0.015
#: How far within what is covered a cut is put, relative to that: a little of its dark would show.
_WITHIN = 0.5
#: A shadow counts when light along the edge, and so near to the contour, is off a line from end to end by so much, as a
#: share of how far light changes there, and of the most light there; and by so many standard deviations of its noise.
_NEAR, _KINK, _CONTRAST, _SIGNIFICANT = 0.02, 0.1, 0.1, 3.0
#: The shadows of so many lights are tried on an edge.
_SHADOWS = 3
#: How far beside what stands on a surface light is looked at, relative to the edge.
_BESIDE = 0.25
#: What stands on a surface, however thin, counts when light differs by this share on its two sides.
_PARTED = 0.5


@dataclass(frozen=True, eq=False)
class _Edges:
    """Edges of cells (e,): a cell that each belongs to; weights (e, 3) there of its first end, of its second and of the
    corner opposite; length in the unit box; a key that tells it from others, also when cells are numbered anew."""

    cell: Int64
    first: Float64
    second: Float64
    opposite: Float64
    length: Float64
    key: Float64

    @classmethod
    def of(cls, receivers: Receivers, side: Int64) -> _Edges:
        """The edges that sides (e,), as `numbered_edges` counts them, lie on; from the vertex with the lower number to
        the other."""
        cell, corner = side // 3, side % 3
        vertex, each = receivers.cell_vertex[cell], np.arange(len(side))
        turned = vertex[each, corner] > vertex[each, (corner + 1) % 3]
        one, other = (corner + turned) % 3, (corner + ~turned) % 3
        corners, unit = receivers.cells.corners[cell], np.eye(3)
        ends = corners[each, one], corners[each, other]
        length = np.linalg.norm(ends[0] - ends[1], axis=1)
        return cls(
            cell, unit[one], unit[other], unit[(corner + 2) % 3], length, key(ends, receivers.cells.normals[cell])
        )

    def only(self, chosen: Int64) -> _Edges:
        return _Edges(*(getattr(self, field.name)[chosen] for field in fields(self)))

    def weights(self, place: Float64) -> Float64:
        """Weights (e, 3) of the places (e,) from the first end to the second, a little to the inside of the cell."""
        along = place[:, None]
        return (1.0 - _ASIDE) * ((1.0 - along) * self.first + along * self.second) + _ASIDE * self.opposite

    def at(self, places: Float64, cells: Cells) -> Points:
        """Points at places (p, e) of the edges, (p * e,) of them: those at the first place of each edge first."""
        every = self.only(np.tile(np.arange(len(self.cell)), len(places)))
        return Points(cells, every.cell, every.weights(places.ravel()))


@dataclass(frozen=True, eq=False)
class _Crossings:
    """Of edges (e,): a place from the first end to the second where a contour that matters crosses each, nan where none
    does; where from there what is covered lies: 1 towards the second end, -1 towards the first, 0 on neither side; and
    by how much irradiance differs there.
    """

    place: Float64
    inward: Float64
    step: Float64

    @classmethod
    def none(cls, count: int) -> _Crossings:
        return cls(np.full(count, np.nan), np.zeros(count), np.zeros(count))

    def __setitem__(self, chosen: Int64 | Bool, found: _Crossings) -> None:
        for own, new in zip(self.columns(), found.columns(), strict=True):
            own[chosen] = new

    def columns(self) -> tuple[Float64, ...]:
        return self.place, self.inward, self.step


@dataclass(frozen=True, eq=False)
class Cut:
    """Receivers with cells cut along contours; source: for each new cell the one it came from. Of those there were
    before: worth (c,), the largest squared step of radiance, times the area, of a contour that crosses the cell, 0
    without any, and crossed (c,), how many of its sides contours cross, also where these were left alone."""

    receivers: Receivers
    source: Int64
    worth: Float64
    crossed: Int64

    @property
    def added(self) -> Int64:
        """(c,) how many cells more each of those there were before has become."""
        return np.bincount(self.source, minlength=len(self.worth)) - 1

    @classmethod
    def none(cls, receivers: Receivers) -> Cut:
        count = len(receivers.cells)
        return cls(receivers, np.arange(count), np.zeros(count), np.zeros(count, dtype=np.int64))


class Contours:
    """Cuts cells along the contours of lights and solids."""

    def __init__(
        self, scene: Scene, direct_light: DirectLight, around: Surroundings | None, seed: int, workers: Workers
    ) -> None:
        self._scene = scene
        self._sights = Sights(direct_light, around, seed, workers)
        self._breaks = Breaks(self._sights)
        self._known = Known(3)
        # A sheet may lie close above another, and still nothing stand between either and a lamp.
        alone = len(scene.objects) == 1 and nothing_stands_between(scene)
        self._nothing_to_find = alone or (not self._sights.shadows and around is None)

    @property
    def rays(self) -> Counter[str]:
        """Cast so far, by purpose."""
        return self._sights.rays

    def cut(self, receivers: Receivers, least: float = 0.0) -> Cut:
        """The receivers with cells cut along the contours. least: a shadow is left alone where it is worth less, as
        worth is counted in what comes of it, to the larger of the cells whose side it crosses.
        """
        cut = Cut.none(receivers)
        if self._nothing_to_find:
            return cut
        source, worth, crossed = cut.source, cut.worth, cut.crossed
        middles = Points(receivers.cells, source, np.full((len(source), 3), 1 / 3))
        sight = self._sights.sight(middles, GAP * middles.size)
        near = self._borders(receivers, middles, sight)
        size = np.sqrt(2.0 * receivers.cells.area)
        uncut = [len(mesh.vertices) for mesh in receivers.fine]
        contoured = np.zeros(len(source), dtype=bool)
        # In radiance, squared, times the area.
        shown = cell_colours(self._scene, receivers).shown_in_white * receivers.cells.area
        for _ in range(_PASSES):
            if not near.any():
                break
            number, _, side = numbered_edges(receivers.cell_vertex)
            found = self._follow(receivers, number, side, near)
            crossing = np.isfinite(found.place)
            on_edge = np.where(crossing, found.step**2 * _larger_beside(shown[source], number), 0.0)
            np.maximum.at(worth, source, on_edge[number].max(axis=1))
            np.maximum.at(crossed, source, np.count_nonzero(crossing[number], axis=1))
            found.place[on_edge < least] = np.nan
            crossing = np.flatnonzero(np.isfinite(found.place))
            edges, place, inward = _Edges.of(receivers, side[crossing]), found.place[crossing], found.inward[crossing]
            margin = _SNAP * size[source[edges.cell]] / np.maximum(edges.length, np.finfo(float).tiny)
            contoured |= np.isfinite(found.place)[number].any(axis=1)
            found.place[crossing] = _off_the_ends(place + _WITHIN * margin * inward, inward, margin)
            places = found.place[number]
            receivers, piece = cut_cells(receivers, places)
            near, contoured, source = np.isfinite(places).any(axis=1)[piece], contoured[piece], source[piece]
        on_contour = np.concatenate([mesh.triangles >= n for mesh, n in zip(receivers.fine, uncut, strict=True)])
        breaks = self._breaks.between(receivers, contoured, sight[source])
        return Cut(replace(receivers, breaks=breaks, on_contour=on_contour), source, worth, crossed)

    def _borders(self, receivers: Receivers, middles: Points, sight: Int64) -> Bool:
        """Cells (c,) with others around them from whose middles other lights are in sight (c,), or that are covered."""
        cells, corner = receivers.cells, receivers.cell_vertex
        low, high = np.full((2, int(corner.max()) + 1), sight[0])
        for k in range(3):
            low[corner[:, k]] = high[corner[:, k]] = sight
        for k in range(3):
            np.minimum.at(low, corner[:, k], sight)
            np.maximum.at(high, corner[:, k], sight)
        near = (low != high)[corner].any(axis=1)
        for k in range(3):
            near |= self._sights.barred(middles, cells.corners[:, k])
        return np.asarray(near)

    def _follow(self, receivers: Receivers, number: Int64, side: Int64, near: Bool) -> _Crossings:
        """Where contours that matter cross the edges (e,) of each number (c, 3), on which sides (e,) lie; followed from
        the near (c,) cells on, and from what is known."""
        edges, found = _Edges.of(receivers, side), _Crossings.none(len(side))
        asked, recalled = self._known.recall(edges.key)
        found[asked] = _Crossings(*recalled)
        near = near | np.isfinite(found.place)[number].any(axis=1)
        while True:
            fresh = np.unique(number[near])
            fresh = fresh[~asked[fresh]]
            if not len(fresh):
                return found
            asked[fresh] = True
            found[fresh] = crossings = self._crossings(receivers, edges.only(fresh))
            self._known.remember(edges.key[fresh], crossings.columns())
            leads_on = np.zeros(len(side), dtype=bool)
            leads_on[fresh] = np.isfinite(crossings.place)
            near = leads_on[number].any(axis=1)

    def _crossings(self, receivers: Receivers, edges: _Edges) -> _Crossings:
        """Where they cross edges: outlines of what stands on the surface first, and shadows on edges that none of these
        crosses."""
        seen = self._on_edges(receivers, edges, np.broadcast_to(_PLACES[:, None], (len(_PLACES), len(edges.cell))))
        found = _Crossings.none(len(edges.cell))
        changes = seen[1:] ^ seen[:-1]
        # Where something is covered, nothing else that stands there counts.
        bits = np.where((changes >= COVERED).any(axis=0), COVERED, BARRED)
        differs = (changes & bits) != 0
        some = np.flatnonzero(differs.any(axis=0))
        if len(some):
            interval = differs.argmax(axis=0)[some]
            found[some] = self._outlines(receivers, edges.only(some), seen[:, some], interval, bits[some])
        for _ in range(_SHADOWS):
            rest = np.flatnonzero(np.isnan(found.place))
            bits, interval, brings = self._strongest(receivers, edges.only(rest), seen[:, rest])
            dark = np.flatnonzero(bits)
            if not len(dark):
                break
            some = rest[dark]
            sights = seen[:, some], interval[dark], bits[dark]
            found[some] = self._shadows(receivers, edges.only(some), *sights, brings[dark])
            seen[:, some] &= ~bits[dark]
        return found

    def _strongest(self, receivers: Receivers, edges: _Edges, seen: Int64) -> tuple[Int64, Int64, Float64]:
        """Of the lights of which so much is seen (p, e) at the places of the edges, the bits (e,) of that whose shadow
        makes the largest step from one place to the next, 0 where none does; in which interval (e,) it does; and the
        irradiance (e,) that this light brings with nothing in the way."""
        bits, interval = np.zeros((2, len(edges.cell)), dtype=np.int64)
        brings, largest = np.zeros((2, len(edges.cell)))
        for number, light in enumerate(self._sights.light.lights if self._sights.shadows else []):
            hidden = (seen >> number & 1) + (seen >> WHOLE + number & 1)
            change = np.abs(np.diff(hidden, axis=0))
            some = np.flatnonzero(change.any(axis=0))
            if not len(some):
                continue
            where, each = change[:, some].argmax(axis=0), edges.only(some)
            points = each.at(_PLACES[np.stack([where, where + 1])], receivers.cells)
            share = light.share(points.positions, points.shading).reshape(2, -1).max(axis=0) * light.color.mean()
            step = share * change[where, some]
            more = step > largest[some]
            some = some[more]
            bits[some], interval[some] = 1 << number | 1 << WHOLE + number, where[more]
            brings[some], largest[some] = share[more], step[more]
        return bits, interval, brings

    def _place(self, receivers: Receivers, edges: _Edges, seen: Int64, interval: Int64, bits: Int64) -> Float64:
        """Where (e,) on each edge, of which so much is seen (p, e) at places, something of the bits (e,) first differs
        in an interval (e,) from what it is at its beginning."""
        each = np.arange(len(interval))
        before, after = seen[interval, each], seen[interval + 1, each]
        low, width = _PLACES[interval], (_PLACES[1:] - _PLACES[:-1])[interval]
        differs = (before ^ after) & bits
        for _ in range(_NARROWINGS):
            width = width / (_BETWEEN + 1)
            between = self._on_edges(receivers, edges, low + np.arange(1, _BETWEEN + 1)[:, None] * width, differs)
            between = np.concatenate([between, after[None]])
            first = (((between ^ before) & differs) != 0).argmax(axis=0)
            low, after = low + first * width, between[first, each]
        return np.asarray(low + width / 2.0)

    def _on_edges(self, receivers: Receivers, edges: _Edges, places: Float64, asked: Int64 | None = None) -> Int64:
        """What is in sight (p, e) at places (p, e) of the edges; only what the bits (e,) ask for, if given."""
        points = edges.at(places, receivers.cells)
        solids = asked is None or bool((asked >= BARRED).any())
        lights = None if asked is None else np.tile(asked | asked >> WHOLE, len(places))
        sight = self._sights.sight(points, GAP * np.tile(edges.length, len(places)) if solids else None, lights)
        if solids:
            start = edges.at(np.full(places.shape, _PLACES[0]), receivers.cells)
            sight = sight + BARRED * self._sights.barred(start, points.positions)
        return sight.reshape(places.shape)

    def _shadows(
        self, receivers: Receivers, edges: _Edges, seen: Int64, interval: Int64, bits: Int64, brings: Float64
    ) -> _Crossings:
        """Where shadows of lights that bring so much (e,) cross the edges, if a line from end to end would miss any."""
        place = self._place(receivers, edges, seen, interval, bits)
        beside = np.clip(np.stack([place - _NEAR, place + _NEAR]), _PLACES[0], _PLACES[-1])
        places = np.concatenate([np.broadcast_to(_PLACES[:, None], (len(_PLACES), len(place))), beside])
        points = edges.at(places, receivers.cells)
        found = self._sights.direct(points, 0)
        self._sights.rays += found.rays
        light = found.grey.reshape(places.shape)
        # That of all places together: of a single one the rays hardly know it.
        noise = np.sqrt(found.variance.mean(axis=1).reshape(places.shape).mean(axis=0))
        # Steepness would not tell: a strip that is cut where a soft shadow begins is even, up to where it is full.
        missed, step = _off_the_line(light, places), np.minimum(np.ptp(light, axis=0), brings)
        matters = np.minimum(missed, brings) > np.maximum(_KINK * step, _CONTRAST * light.max(axis=0))
        matters &= missed > _SIGNIFICANT * noise
        return _Crossings(np.where(matters, place, np.nan), np.zeros(len(place)), step)

    def _outlines(self, receivers: Receivers, edges: _Edges, seen: Int64, interval: Int64, bits: Int64) -> _Crossings:
        """Where what stands on the surface crosses the edges, if it hides one side, or parts light from dark."""
        place = self._place(receivers, edges, seen, interval, bits)
        beside = np.clip(np.stack([place - _BESIDE, place + _BESIDE]), _PLACES[0], _PLACES[-1])
        points = edges.at(beside, receivers.cells)
        found, look = self._sights.workers.beside(
            partial(self._sights.direct, points, 1),
            partial(self._sights.look, points, GAP * np.tile(edges.length, 2), 0),
        )
        self._sights.rays += found.rays + look.rays
        one, other = found.grey.reshape(2, -1) + look.light
        parted = self._sights.barred(points.only(slice(0, len(place))), points.positions[len(place) :])
        parted &= np.abs(one - other) > _PARTED * np.maximum(one, other)
        # What is hidden says nothing, so next to it all of the light may be wrong.
        step = np.where(look.outlines, np.maximum(one, other), np.abs(one - other))
        covered = seen[interval, np.arange(len(place))] >= COVERED
        inward = np.where(look.outlines & (bits == COVERED), np.where(covered, -1.0, 1.0), 0.0)
        return _Crossings(np.where(look.outlines | parted, place, np.nan), inward, step)


def _larger_beside(values: Float64, number: Int64) -> Float64:
    """Of the values (c,) of the cells on both sides of each edge (e,), of a number (c, 3), the larger."""
    larger = np.zeros(int(number.max()) + 1)
    np.maximum.at(larger, number.ravel(), np.repeat(values, 3))
    return larger


def _off_the_line(light: Float64, places: Float64) -> Float64:
    """How far (e,) the light (p, e) at places, those of _PLACES first, is at most from a line from end to end."""
    along = (places - _PLACES[0]) / (_PLACES[-1] - _PLACES[0])
    line = (1.0 - along) * light[0] + along * light[len(_PLACES) - 1]
    return np.asarray(np.abs(light - line).max(axis=0))


def _off_the_ends(place: Float64, inward: Float64, margin: Float64) -> Float64:
    """Places (n,) at least so far (n,) from both ends of their edges; nan where there is no such place, or none is
    needed. What is covered may be cut off late, but not early: then its dark would show."""
    first, second = place < margin, place > 1.0 - margin
    place = np.where(first & (inward > 0), margin, np.where(second & (inward < 0), 1.0 - margin, place))
    return np.where((place < margin) | (place > 1.0 - margin) | (margin > 0.4), np.nan, place)
