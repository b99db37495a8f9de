"""From patches to the light they reflect: rows of form factors, balance, direct light, solve."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace

import numpy as np

from .direct.illumination import DirectLight
from .form_factors.analytic import analytic_rows
from .form_factors.centroid import centroid_rows
from .form_factors.hemisphere import Opening, hemisphere_rows
from .form_factors.rows import Rows, balance, one_sided, symmetric_exchange
from .form_factors.sides import SITES, Sides
from .parallel import Workers
from .patches import Patches
from .plan import Effort, Plan
from .sampling import stream
from .scene import ALBEDO_LIMIT, Float32, Float64
from .sky import Sky
from .solver import Solution, contraction, shoot_until, solve, solve_both_sides
from .visibility import Visibility

#: The two independent solutions, by the names of their streams of random numbers.
HALVES = "first half", "second half"
_CHUNK = 2048


@dataclass(frozen=True, eq=False)
class Exchange:
    """Light between sides: exchange areas G_ij or plain rows F_ij, one matrix for each channel if anything on the way
    is coloured; what escapes; the shares (s, 1) or (s, 3) that are lost to mirrors and glass; irradiance (s, 3) from
    emitting surfaces off mirrors, or None; the area (s,) by which the rays saw each side more than they saw from it;
    and the rays cast, by purpose."""

    sides: Sides
    rows: tuple[Rows, ...]
    opening: Opening
    lost: Float64
    glints: Float64 | None
    one_sided: Float64
    rays: Counter[str]
    reciprocal: bool


@dataclass(frozen=True, eq=False)
class Transport:
    """Solved light on patch sides.

    incoming (s, 3): irradiance W/m^2 straight from the sources; reached (s,): the share of each side that rays say is
    lit by any. rays cast, by purpose. mirrored_emission: whether rays saw emitting surfaces in mirrors.
    """

    exchange: Exchange
    incoming: Float64
    reached: Float64
    solution: Solution
    rays: Counter[str]
    mirrored_emission: bool = False

    @property
    def sides(self) -> Sides:
        return self.exchange.sides

    @property
    def escape(self) -> Float64:
        """(s, 1) or (s, 3) share of a side's hemisphere that is open."""
        return self.exchange.opening.share.reshape(self.lost.shape)

    @property
    def lost(self) -> Float64:
        """(s, 1) or (s, 3) share of a side's hemisphere that mirrors and glass swallow."""
        return self.exchange.lost

    @property
    def reflected(self) -> Float64:
        """(s, 3) radiosity W/m^2: albedo times irradiance, and what comes through from the other side."""
        return reflected(self.sides, self.solution.irradiance)

    def by_code(self, values: Float64) -> Float32:
        """Values (s, k) of sides as a table over ray codes but those of the sky; nothing for lost rays and unreached
        sides."""
        table = np.zeros((2 * len(self.sides.patches) + 1, values.shape[1]), dtype=np.float32)
        table[self.sides.side] = values
        return table

    def over_coarser_patches(self, values: Float64) -> Float64:
        """Values (s, k) averaged over groups of about four neighbouring patches."""
        groups = self.sides.patches.coarser_groups
        group = groups[self.sides.patch] + self.sides.back * (int(groups.max()) + 1)
        area = np.bincount(group, self.sides.area)
        means = [np.bincount(group, self.sides.area * v) / np.maximum(area, 1e-300) for v in values.T]
        return np.stack(means, axis=1)[group]

    def level_doubts(self) -> tuple[float, float]:
        """By what share of itself all reflected light may be too bright or too dark: by what rays saw from one side
        alone, and by how much more is absorbed when the patches that light comes from are larger.

        What is emitted is absorbed in the end, so where little is absorbed at each bounce the level of the light hangs
        on a small loss. To first order a loss that is misjudged by a share of what is emitted changes it by that share.
        """
        emitted = float(self.sides.area @ self.incoming.mean(axis=1))
        if emitted <= 0.0 or not self.sides.albedo.any():
            return 0.0, 0.0
        sent = self.reflected
        grey = sent.mean(axis=1)
        if len(self.exchange.rows) == 1:
            sent = grey[:, None]
        gained = _received(self.exchange, self.over_coarser_patches(sent) - sent)
        absorbed = gained.mean(axis=1) - reflected(self.sides, gained).mean(axis=1)
        return float(self.exchange.one_sided @ grey) / emitted, float(self.sides.area @ absorbed) / emitted

    def energy(self, channels: Float64 | float = 1.0 / 3.0) -> dict[str, float]:
        """Where the light went, in W: what reached the surfaces first, what they absorbed, what left by the openings,
        and what the solve left unshot. The first is the sum of the others. channels (3,): what each counts."""
        metres = self.sides.patches.space.metres
        area = self.sides.area[:, None] * metres**2 * channels
        emitted = float(np.sum(area * self.incoming))
        absorbed = float(np.sum(area * (self.solution.irradiance - self.reflected + self.lost * self.reflected)))
        escaped = float(np.sum(area * self.escape * self.reflected))
        residual = emitted - absorbed - escaped
        return {"emitted": emitted, "absorbed": absorbed, "escaped": escaped, "residual": residual}


def in_three_channels(values: Float64) -> Float64:
    """Values (n, 3), or the same (n, 1) in each of three channels."""
    return values if values.shape[1] == 3 else np.repeat(values, 3, axis=1)


def reflected(sides: Sides, irradiance: Float64) -> Float64:
    """Radiosity (s, 3) W/m^2 that irradiance (s, 3) on both sides of all patches brings forth."""
    if sides.patches.transmission is None:
        return sides.albedo * irradiance
    return sides.albedo * irradiance + sides.transmitted(irradiance)


def solve_halves(
    patches: Patches,
    visibility: Visibility,
    direct_light: DirectLight,
    sky: Sky,
    plan: Plan,
    workers: Workers,
    seed: int,
) -> tuple[Transport, ...]:
    """Two independent solutions, each with rays of its own; none when the plan has nothing for rays to look for, or
    nothing is there at which one would stop."""
    if not plan.looks_around or (patches.coverage is not None and not patches.coverage.any()):
        return ()
    if not plan.active("bounces"):
        patches = replace(patches, albedo=np.zeros_like(patches.albedo), transmission=None)

    def solved(half: str) -> Transport:
        return make_transport(patches, visibility, direct_light, sky, plan.effort, workers, seed=seed, purpose=half)

    return tuple(workers.each(solved, HALVES))


def make_transport(
    patches: Patches,
    visibility: Visibility,
    direct_light: DirectLight,
    sky: Sky,
    effort: Effort,
    workers: Workers,
    *,
    seed: int,
    purpose: str,
) -> Transport:
    """Form factors by the planned estimator, direct light on every side, and the solution.

    `purpose` names the streams of random numbers: two purposes give two independent answers to one question.
    """
    sky = sky.in_colour(patches.coloured)
    exchange = estimate_exchange(patches, visibility, effort, workers, seed, purpose, sky)
    return fill_with_light(exchange, direct_light, sky, effort, workers, seed=seed, purpose=purpose)


def fill_with_light(
    exchange: Exchange,
    direct_light: DirectLight,
    sky: Sky | None,
    effort: Effort,
    workers: Workers,
    *,
    seed: int,
    purpose: str,
) -> Transport:
    """Direct light on every side, and all that the sides then send to each other. sky: the one of the exchange, or
    None for its light to be left out."""
    sides = exchange.sides
    straight, reached, shadow_rays = light_on_sides(
        sides, direct_light, workers, effort.shadow_rays_of_site, seed, purpose
    )
    incoming = straight.copy()
    if sky is not None:
        incoming += exchange.opening.light @ sky.irradiance
    if effort.emitters_by_rays:
        incoming += _received(exchange, np.pi * sides.emission, workers)
    elif exchange.glints is not None:
        incoming += exchange.glints
    reached = np.where((incoming > straight).any(axis=1), 1.0, reached)
    solution = _solve(exchange, incoming[:, : effort.channels], effort.tolerance, workers)
    solution = replace(solution, irradiance=in_three_channels(solution.irradiance))
    return Transport(
        exchange,
        incoming,
        reached,
        solution,
        exchange.rays + shadow_rays,
        mirrored_emission=exchange.glints is not None,
    )


def _received(exchange: Exchange, radiosity: Float64, workers: Workers | None = None) -> Float64:
    """Irradiance (s, 3) from the radiosity (s, 3) of all sides."""
    area = exchange.sides.area
    factors = [rows.scaled(1.0 / area) if exchange.reciprocal else rows for rows in exchange.rows]
    if len(factors) == 1:
        return factors[0].apply(radiosity, workers)
    channels = zip(factors, radiosity.T, strict=True)
    return np.stack([rows.apply(channel, workers) for rows, channel in channels], axis=1)


def _solve(exchange: Exchange, incoming: Float64, tolerance: float, workers: Workers) -> Solution:
    sides, rows = exchange.sides, exchange.rows
    albedo = sides.albedo[:, : incoming.shape[1]].astype(np.float64)
    if not exchange.reciprocal:
        return shoot_until(rows[0], albedo, incoming, tolerance, workers)
    if sides.patches.transmission is not None:

        def returning(irradiance: Float64) -> Float64:
            return _received(exchange, reflected(sides, irradiance), workers)

        most = albedo + sides.patches.transmission[sides.patch]
        q = max(contraction(matrix.scaled(1.0 / sides.area), most) for matrix in rows)
        return solve_both_sides(returning, sides.area, incoming, q, tolerance)
    if len(rows) == 1:
        return solve(rows[0], sides.area, albedo, incoming, tolerance, workers)
    channels = [slice(c, c + 1) for c in range(3)]
    solved = [
        solve(matrix, sides.area, albedo[:, c], incoming[:, c], tolerance, workers)
        for matrix, c in zip(rows, channels, strict=True)
    ]
    return Solution(
        np.concatenate([s.irradiance for s in solved], axis=1),
        max(s.iterations for s in solved),
        max(s.bound for s in solved),
    )


def estimate_exchange(
    patches: Patches, visibility: Visibility, effort: Effort, workers: Workers, seed: int, purpose: str, sky: Sky
) -> Exchange:
    """Rows of form factors, made reciprocal and closed together; the centroid baseline stays as it comes."""
    if effort.estimator == "hemisphere":
        found = hemisphere_rows(
            patches, visibility, workers, rays=effort.transport_rays, seed=seed, purpose=purpose, sky=sky
        )
        area, samples = found.sides.area, np.full(len(found.sides.side), float(effort.transport_rays))
        lost = found.lost.reshape(len(area), -1)
        kept = 1.0 - found.opening.share.reshape(lost.shape) - lost
        rows = tuple(
            balance(symmetric_exchange(matrix, area, samples), area * share, workers)
            for matrix, share in zip(found.rows, kept.T, strict=True)
        )
        if patches.optics is not None and patches.optics.tinted:
            rows = tuple(_without_gain(matrix, found.sides, channel) for channel, matrix in enumerate(rows))
            lost = kept + lost - np.stack([matrix.row_sums() for matrix in rows], axis=1) / area[:, None]
        alone = sum((one_sided(matrix, area) for matrix in found.rows), np.zeros(len(area))) / len(rows)
        return Exchange(found.sides, rows, found.opening, lost, found.glints, alone, found.rays, reciprocal=True)
    estimator = analytic_rows if effort.estimator == "analytic" else centroid_rows
    estimate = estimator(patches, visibility, workers, threshold=effort.threshold, seed=seed, purpose=purpose, sky=sky)
    area, opening, rays = estimate.sides.area, estimate.opening, Counter(transport=estimate.rays)
    nothing, alone = np.zeros((len(area), 1)), one_sided(estimate.rows, area)
    if effort.estimator == "centroid":
        return Exchange(estimate.sides, (estimate.rows,), opening, nothing, None, alone, rays, reciprocal=False)
    matrix = balance(symmetric_exchange(estimate.rows, area), area * (1.0 - opening.share), workers)
    return Exchange(estimate.sides, (matrix,), opening, nothing, None, alone, rays, reciprocal=True)


def _without_gain(exchange: Rows, sides: Sides, channel: int) -> Rows:
    """The exchange areas, with less where chance lets a side receive more than all sides together can send.

    A patch at which few rays of a colour stop sends them more than all light, so that it is right on average; but few
    rays are no average, and light that grows from bounce to bounce has no solution.
    """
    patches = sides.patches
    sent = patches.albedo[:, channel] + (0.0 if patches.transmission is None else patches.transmission[:, channel])
    received = exchange.apply(sent[sides.patch]) / sides.area
    share = ALBEDO_LIMIT / np.maximum(received, ALBEDO_LIMIT)
    weights = exchange.weights * (share[exchange.owners()] * share[exchange.columns])  # so that both ways round alike
    return replace(exchange, weights=weights.astype(np.float32))


def light_on_sides(
    sides: Sides, direct_light: DirectLight, workers: Workers, shadow_rays: int, seed: int, purpose: str
) -> tuple[Float64, Float64, Counter[str]]:
    """Mean irradiance (s, 3) of each side straight from lamps and emitting surfaces, the share (s,) of it that these
    reach, and the rays it took."""

    def work(number: int, part: slice) -> tuple[Float64, Float64, Counter[str]]:
        rng = stream(seed, "light on sides " + purpose, number)
        normals = sides.normals[part].reshape(-1, 3)
        light = direct_light.at(sides.points[part].reshape(-1, 3), normals, normals, shadow_rays, rng)
        reached = light.reached.reshape(-1, SITES).mean(axis=1)
        return light.irradiance.reshape(-1, SITES, 3).mean(axis=1), reached, light.rays

    irradiance, reached, rays = zip(*workers.map(work, len(sides.side), _CHUNK), strict=True)
    return np.concatenate(irradiance), np.concatenate(reached), sum(rays, Counter())
