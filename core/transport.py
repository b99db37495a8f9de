"""From patches to the light they reflect: rows of form factors, balance, direct light, solve."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .direct.illumination import DirectLight
from .form_factors.analytic import analytic_rows
from .form_factors.centroid import centroid_rows
from .form_factors.hemisphere import Opening, Sides, hemisphere_rows
from .form_factors.rows import Rows, balance, symmetric_exchange
from .parallel import Workers
from .patches import Patches, coarser_groups
from .plan import Effort, Plan
from .sampling import stream
from .scene import Float32, Float64
from .sky import Sky
from .solver import Solution, shoot_until, solve
from .visibility import Visibility

_CHUNK = 1024


@dataclass(frozen=True, eq=False)
class Transport:
    """Solved light on patch sides.

    escape (s,): share of a side's hemisphere that is open. incoming (s, 3): irradiance W/m^2 straight from the sources.
    rays cast, by purpose.
    """

    sides: Sides
    escape: Float64
    incoming: Float64
    solution: Solution
    rays: dict[str, int]

    @property
    def reflected(self) -> Float64:
        """(s, 3) radiosity W/m^2: albedo times irradiance."""
        return self.sides.albedo * self.solution.irradiance

    def by_code(self, values: Float64) -> Float32:
        """Values (s, k) of sides as a table over ray codes but those of the sky; nothing for lost rays and unreached
        sides."""
        patches = self.sides.patches
        table = np.zeros((2 * len(patches), values.shape[1]))
        table[self.sides.side] = values
        codes = np.concatenate([table[patches.patch], table[patches.patch + len(patches)], np.zeros_like(table[:1])])
        return codes.astype(np.float32)

    def over_coarser_patches(self, values: Float64) -> Float64:
        """Values (s, k) averaged over groups of about four neighbouring patches."""
        groups = coarser_groups(self.sides.patches)
        group = groups[self.sides.patch] + self.sides.back * (int(groups.max()) + 1)
        area = np.bincount(group, self.sides.area)
        means = [np.bincount(group, self.sides.area * v) / np.maximum(area, 1e-300) for v in values.T]
        return np.stack(means, axis=1)[group]

    def energy(self) -> dict[str, float]:
        """Where the light went, in W: what reached the surfaces first, what they absorbed, what left by the openings,
        and what the solve left unshot. The first is the sum of the others."""
        metres = self.sides.patches.space.metres
        area = self.sides.area[:, None] * metres**2 / 3.0
        emitted = float(np.sum(area * self.incoming))
        absorbed = float(np.sum(area * (self.solution.irradiance - self.reflected)))
        escaped = float(np.sum(area * self.escape[:, None] * self.reflected))
        residual = emitted - absorbed - escaped
        return {"emitted": emitted, "absorbed": absorbed, "escaped": escaped, "residual": residual}


@dataclass(frozen=True, eq=False)
class Exchange:
    """Light between sides: exchange areas G_ij or plain rows F_ij, what escapes, and the rays cast."""

    sides: Sides
    rows: Rows
    opening: Opening
    rays: int
    reciprocal: bool


def solve_halves(
    patches: Patches,
    visibility: Visibility,
    direct_light: DirectLight,
    sky: Sky,
    plan: Plan,
    workers: Workers,
    seed: int,
) -> tuple[Transport, ...]:
    """Two independent solutions, each with rays of its own; none when the plan has nothing for rays to look for."""
    if not plan.looks_around:
        return ()
    if not plan.active("bounces"):
        patches = replace(patches, albedo=np.zeros_like(patches.albedo))
    return tuple(
        make_transport(patches, visibility, direct_light, sky, plan.effort, workers, seed=seed, purpose=half)
        for half in ("first half", "second half")
    )


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
    exchange = estimate_exchange(patches, visibility, effort, workers, seed, purpose, sky)
    sides = exchange.sides
    incoming, shadow_rays = light_on_sides(sides, direct_light, workers, effort.shadow_rays, seed, purpose)
    incoming += exchange.opening.light @ sky.irradiance
    if effort.emitters_by_rays:
        rows = exchange.rows.scaled(1.0 / sides.area) if exchange.reciprocal else exchange.rows
        incoming += rows.apply(np.pi * sides.emission, workers)
    albedo = sides.albedo.astype(np.float64)
    if exchange.reciprocal:
        solution = solve(exchange.rows, sides.area, albedo, incoming, effort.tolerance, workers)
    else:
        solution = shoot_until(exchange.rows, albedo, incoming, effort.tolerance, workers)
    rays = {"transport": exchange.rays, "shadow": shadow_rays}
    return Transport(sides, exchange.opening.share, incoming, solution, rays)


def estimate_exchange(
    patches: Patches, visibility: Visibility, effort: Effort, workers: Workers, seed: int, purpose: str, sky: Sky
) -> Exchange:
    """Rows of form factors, made reciprocal and closed together; the centroid baseline stays as it comes."""
    if effort.estimator == "hemisphere":
        sides, rows, opening = hemisphere_rows(
            patches, visibility, workers, rays=effort.transport_rays, seed=seed, purpose=purpose, sky=sky
        )
        samples = np.full(len(rows), float(effort.transport_rays))
        exchange = balance(symmetric_exchange(rows, sides.area, samples), sides.area * (1.0 - opening.share), workers)
        return Exchange(sides, exchange, opening, len(rows) * effort.transport_rays, reciprocal=True)
    estimator = analytic_rows if effort.estimator == "analytic" else centroid_rows
    estimate = estimator(patches, visibility, workers, threshold=effort.threshold, seed=seed, purpose=purpose, sky=sky)
    if effort.estimator == "centroid":
        return Exchange(estimate.sides, estimate.rows, estimate.opening, estimate.rays, reciprocal=False)
    area = estimate.sides.area
    exchange = balance(symmetric_exchange(estimate.rows, area), area * (1.0 - estimate.opening.share), workers)
    return Exchange(estimate.sides, exchange, estimate.opening, estimate.rays, reciprocal=True)


def light_on_sides(
    sides: Sides, direct_light: DirectLight, workers: Workers, shadow_rays: int, seed: int, purpose: str
) -> tuple[Float64, int]:
    """Mean irradiance (s, 3) of each side straight from lamps and emitting surfaces, and the rays it took."""

    def work(number: int, part: slice) -> tuple[Float64, int]:
        rng = stream(seed, "light on sides " + purpose, number)
        normals = sides.normals[part].reshape(-1, 3)
        light = direct_light.at(sides.points[part].reshape(-1, 3), normals, normals, shadow_rays, rng)
        seen = ~sides.hidden[part]
        total = np.einsum("snk,sn->sk", light.irradiance.reshape(*seen.shape, 3), seen)
        return total / seen.sum(axis=1)[:, None], light.rays

    irradiance, rays = zip(*workers.map(work, len(sides.side), _CHUNK), strict=True)
    return np.concatenate(irradiance), sum(rays)
