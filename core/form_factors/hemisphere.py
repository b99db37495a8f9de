"""The hemisphere estimator: what the rays of a patch hit is its row of form factors.

Rows sum to at most one by construction, nothing is singular, and the cost is linear in patches (Malley 1988).
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, fields
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..hemisphere import Codes, Hemispheres
from ..parallel import Workers
from ..patches import Patches
from ..sampling import stream
from ..scene import Bool, Float32, Float64, Int32
from ..sky import DARK, Sky
from ..visibility import Visibility
from .rows import Rows
from .sides import SITES, Sides, even_sides, open_parts

Index = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Opening:
    """How open some sides are to the sky: share (s,) of the rays that escapes, or (s, 3) where they are tinted, and
    light (s, k), the mean over all rays of what Sky.light says they bring."""

    share: Float64
    light: Float64

    def scaled(self, factors: Float64) -> Opening:
        """The same with all of side i times factors[i]."""
        return Opening(self.share * factors, self.light * factors[:, None])


class Exchanged(NamedTuple):
    """What the rays of some sides (s,) found. rows: form factors; one matrix for each channel if anything on the way is
    coloured. opening: what leaves the scene. lost (s,) or (s, 3): share that mirrors and glass swallow. glints (s, 3):
    irradiance from emitting surfaces off mirrors, None if there is none. rays: how many it took, by purpose."""

    sides: Sides
    rows: tuple[Rows, ...]
    opening: Opening
    lost: Float64
    glints: Float64 | None
    rays: Counter[str]


def hemisphere_rows(
    patches: Patches, visibility: Visibility, workers: Workers, *, rays: int, seed: int, purpose: str, sky: Sky = DARK
) -> Exchanged:
    """Form factors between the sides of patches, from `rays` rays a side; and what of them leaves the scene.

    Fronts are always sampled, and both sides of what transmits. Backs are sampled once a ray has met them, then what
    those meet, until nothing new is met. What only lets through or mirrors has no light of its own and no sides.
    """
    count = len(patches)
    hemispheres = Hemispheres(patches, visibility, rays // SITES, stream(seed, "patterns " + purpose), sky)
    fresh = _first_sides(patches)
    met = np.zeros(2 * count, dtype=bool)
    met[fresh] = True
    cast_of_each = SITES * hemispheres.rays
    looks: list[_Look] = []
    cast = Counter[str]()
    while len(fresh):
        name = f"{purpose} {len(looks)}"
        look = _look_around(even_sides(patches, fresh, seed, name), hemispheres, workers, seed, name)
        cast["transport"] += len(fresh) * rays
        reached = np.zeros(2 * count, dtype=bool)
        # What points under a solid meet is reached as well: those of receivers may lie there.
        reached[look.column] = True
        partly, contact = open_parts(look.sides(patches), look.behind, look.met_by, hemispheres, seed, name)
        cast += contact
        if len(partly.side):
            anew = _look_around(partly, hemispheres, workers, seed, f"{name} open")
            look = _Look.joined([look.without(partly.side), anew])
            cast["transport"] += len(partly.side) * rays
        looks.append(look)
        reached[look.column] = True
        fresh = np.flatnonzero(reached & ~met).astype(np.int32)
        met |= reached
    look = _Look.joined(looks)
    sides = look.sides(patches)
    number = np.full(2 * count, -1, dtype=np.int32)
    number[look.side] = np.arange(len(look.side), dtype=np.int32)
    pointers = np.concatenate([[0], np.cumsum(look.length)]).astype(np.int64)
    columns = number[look.column]
    # One column of hits for each channel, or one for all.
    weights = np.atleast_2d(look.hits.T / cast_of_each).astype(np.float32)
    rows = tuple(Rows(pointers, columns, channel) for channel in weights)
    if patches.optics is None:
        opening = Opening(look.escaped / cast_of_each, look.skylight / cast_of_each)
        return Exchanged(sides, (_mutual(rows[0], sides),), opening, np.zeros(len(look.side)), None, cast)
    escaped = look.escaped / cast_of_each
    found = escaped + np.stack([r.row_sums() for r in rows], axis=1).reshape(escaped.shape)
    if patches.optics.tinted:
        # A few rays whose tints are over one, as others' are under it, may bring more than all there is.
        over = np.maximum(found, 1.0)
        escaped, found = escaped / over, found / over
    opening = Opening(escaped, look.skylight / cast_of_each)
    lost = 1.0 - found
    glints = np.pi * look.glints / cast_of_each if look.glints.any() else None
    cast += Counter({"onward": int(look.onward.sum()), "cut off": int(look.cut.sum())})
    rows = tuple(_mutual(matrix, sides) for matrix in rows)
    return Exchanged(sides, rows, opening, np.maximum(lost, 0.0), glints, cast)


def _first_sides(patches: Patches) -> Int32:
    """All fronts, and the backs of what transmits; but nothing at which no ray stops."""
    count = len(patches)
    stops = np.ones(count, dtype=bool) if patches.coverage is None else patches.coverage > 0.0
    chosen = np.concatenate([stops, np.zeros(count, dtype=bool)])
    if patches.transmission is not None:
        chosen[count:] = stops & (patches.transmission > 0.0).any(axis=1)
    return np.flatnonzero(chosen).astype(np.int32)


@dataclass(frozen=True, eq=False)
class _Look:
    """What the rays of some sides met: the sides as in Sides, the share of each site's rays that met backs, how many
    entries each has, the side met (global number), the hits on it and the rays that escaped, tinted (., 3) if anything
    is; the sum of the light that these brought (s, k); emission (s, 3) seen in mirrors; and for each chunk the rays
    that went on, and those cut off."""

    side: Int32
    points: Float64
    normals: Float64
    open_share: Float64
    behind: Float64
    length: Index
    column: Int32
    hits: Index | Float64
    escaped: Index | Float64
    skylight: Float64
    glints: Float64
    onward: Index
    cut: Index

    def sides(self, patches: Patches) -> Sides:
        return Sides(patches, self.side, self.points, self.normals, self.open_share)

    @staticmethod
    def joined(looks: list[_Look]) -> _Look:
        return _Look(*(np.concatenate([getattr(part, f.name) for part in looks]) for f in fields(_Look)))

    def met_by(self, chosen: Bool) -> Bool:
        """Which of the sides (s,) the chosen (s,) ones met."""
        return np.isin(self.side, self.column[np.repeat(chosen, self.length)])

    def without(self, side: Int32) -> _Look:
        """The same, but for what some of the sides met."""
        kept = ~np.isin(self.side, side)
        of_entries = dict.fromkeys(("column", "hits"), np.repeat(kept, self.length))
        of_all = dict.fromkeys(("onward", "cut") if len(self.glints) else ("onward", "cut", "glints"), slice(None))
        chosen = of_entries | of_all
        return _Look(*(getattr(self, f.name)[chosen.get(f.name, kept)] for f in fields(_Look)))


def _look_around(sides: Sides, hemispheres: Hemispheres, workers: Workers, seed: int, purpose: str) -> _Look:
    patches = sides.patches
    codes = hemispheres.codes
    light = hemispheres.sky.light
    tinted = patches.optics is not None and patches.optics.tinted
    glows = patches.optics is not None and bool(patches.emission.any())

    def work(number: int, part: slice) -> tuple[Any, ...]:
        rng = stream(seed, "rows " + purpose, number)
        origins, axes = sides.points[part].reshape(-1, 3), sides.normals[part].reshape(-1, 3)
        looks = hemispheres.cast(origins, axes, axes, rng)
        met = looks.code.reshape(-1, SITES, hemispheres.rays)
        behind = codes.of_backs(met).mean(axis=2)
        # The codes of sides are their numbers; here it is all one by which texel a ray escaped.
        columns = np.minimum(met, codes.escaped).reshape(len(met), -1)
        tint = None if looks.tint is None else looks.tint.reshape(*columns.shape, 3)
        glints = np.zeros((len(met) if glows else 0, 3))
        if glows and looks.mirrored is not None:
            seen = looks.mirrored.reshape(columns.shape) & (columns < codes.lost)
            ray = np.flatnonzero(seen)
            radiance = patches.emission_of(columns.reshape(-1)[ray])
            shown = radiance if tint is None else radiance * tint.reshape(-1, 3)[ray]
            np.add.at(glints, ray // columns.shape[1], shown)
        texel = met.reshape(len(met), -1) - codes.escaped
        skylight = _light_of_escaped(light, texel, columns == codes.escaped, tint)
        if not tinted:
            columns.sort(axis=1)
        entries = _tinted_lengths(columns, tint, codes) if tinted else _run_lengths(columns, codes)
        return behind, *entries, skylight, glints, np.array([looks.onward]), np.array([looks.cut])

    chunk = max(1, hemispheres.chunk // SITES)
    parts = zip(*workers.map(work, len(sides.side), chunk), strict=True)
    return _Look(sides.side, sides.points, sides.normals, sides.open_share, *(np.concatenate(p) for p in parts))


def _light_of_escaped(light: Float32, texel: Int32, escaped: Bool, tint: Float32 | None) -> Float64:
    """Sums (n, k) of light (texels, k) over the escaped among the rays (n, r) of each side, tinted (n, r, k)."""
    side = np.nonzero(escaped)[0]
    brought = light[texel[escaped]]
    if tint is not None and brought.size:
        brought *= tint[escaped]
    sums = [np.bincount(side, channel, len(texel)) for channel in brought.T]
    return np.stack(sums, axis=1) if sums else np.zeros((len(texel), 0))


def _run_lengths(columns: Int32, codes: Codes) -> tuple[Index, Int32, Index, Index]:
    """Sorted columns (n, k) to entries: how many each row has, their columns and their hits; and the rays escaped."""
    rays = columns.shape[1]
    new = np.ones(columns.shape, dtype=bool)
    new[:, 1:] = columns[:, 1:] != columns[:, :-1]
    start = np.flatnonzero(new)
    hits = np.diff(start, append=columns.size)
    column = columns.reshape(-1)[start]
    kept = column < codes.lost
    length = np.bincount(start[kept] // rays, minlength=len(columns))
    return length, column[kept], hits[kept], np.count_nonzero(columns == codes.escaped, axis=1)


def _tinted_lengths(columns: Int32, tint: Float32 | None, codes: Codes) -> tuple[Index, Int32, Float64, Float64]:
    """The same for rays that bring tints (n, k, 3), None where all are one: hits and escaped rays count by them."""
    weight = np.ones((*columns.shape, 3), dtype=np.float32) if tint is None else tint
    order = np.argsort(columns, axis=1, kind="stable")
    columns = np.take_along_axis(columns, order, axis=1)
    weight = np.take_along_axis(weight, order[:, :, None], axis=1).astype(np.float64)
    length, column, _, _ = _run_lengths(columns, codes)
    new = np.ones(columns.shape, dtype=bool)
    new[:, 1:] = columns[:, 1:] != columns[:, :-1]
    start = np.flatnonzero(new)
    hits = np.add.reduceat(weight.reshape(-1, 3), start, axis=0)[columns.reshape(-1)[start] < codes.lost]
    return length, column, hits, np.einsum("nk,nkc->nc", columns == codes.escaped, weight)


def _mutual(rows: Rows, sides: Sides) -> Rows:
    """Leave out what a back sees of a front that lies under a solid in part, unless the front sees the back too: a back
    inside that solid sees the part that is hidden, and would lead the light of the open part inside.

    With few rays most sides that see each other are found from one of them only, so this is asked nowhere else.
    """
    partly, back = sides.open_share < 1.0, sides.back
    owner, column = rows.owners(), rows.columns.astype(np.int64)
    doubtful = np.flatnonzero(back[owner] & (partly & ~back)[column])
    if not len(doubtful):
        return rows
    mutual = np.isin(owner[doubtful] * len(rows) + column[doubtful], column * len(rows) + owner)
    kept = np.ones(len(owner), dtype=bool)
    kept[doubtful[~mutual]] = False
    length = np.bincount(owner[kept], minlength=len(rows))
    return Rows(np.concatenate([[0], np.cumsum(length)]).astype(np.int64), rows.columns[kept], rows.weights[kept])
