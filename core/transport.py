"""From patches to the light they reflect: rows of form factors, balance, direct light, solve."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .direct.illumination import DirectLight
from .form_factors.hemisphere import SITES, Sides, hemisphere_rows
from .form_factors.rows import Rows, balance, symmetric_exchange
from .parallel import Workers
from .patches import Patches
from .sampling import stream
from .scene import Float32, Float64
from .solver import Solution, solve
from .visibility import Visibility

_CHUNK = 2048


@dataclass(frozen=True, eq=False)
class Transport:
    """Solved light on patch sides.

    reflected (s, 3) radiosity W/m^2, albedo times irradiance; direct (s, 3) irradiance straight from the sources;
    escape (s,): the share of a side's hemisphere that is open.
    """

    sides: Sides
    exchange: Rows
    escape: Float64
    direct: Float64
    solution: Solution
    rays: dict[str, int]

    @property
    def reflected(self) -> Float64:
        return self.sides.albedo * self.solution.irradiance

    def by_code(self, values: Float64) -> Float32:
        """Values (s, k) of sides as a table over ray codes; nothing for escaped and lost rays and unreached sides."""
        patches = self.sides.patches
        table = np.zeros((2 * len(patches), values.shape[1]))
        table[self.sides.side] = values
        codes = np.concatenate([table[patches.patch], table[patches.patch + len(patches)], np.zeros_like(table[:2])])
        return codes.astype(np.float32)


def make_transport(
    patches: Patches,
    visibility: Visibility,
    direct_light: DirectLight,
    sky: Float64,
    workers: Workers,
    *,
    rays: int,
    shadow_rays: int,
    tolerance: float,
    seed: int,
    purpose: str,
) -> Transport:
    """Rows from `rays` rays a side, balanced to be reciprocal and closed; direct light; the solution to `tolerance`.

    `purpose` names the streams of random numbers: two purposes give two independent answers to one question.
    """
    sides, rows, escape = hemisphere_rows(patches, visibility, workers, rays=rays, seed=seed, purpose=purpose)
    exchange = symmetric_exchange(rows, sides.area, np.full(len(sides.side), float(rays)))
    exchange = balance(exchange, sides.area * (1.0 - escape))
    direct, cast = light_on_sides(sides, direct_light, workers, shadow_rays, seed, purpose)
    direct += np.pi * escape[:, None] * sky
    albedo = sides.albedo.astype(np.float64)
    solution = solve(exchange, sides.area, albedo, direct, tolerance)
    rows_cast = len(sides.side) * (rays // SITES) * SITES
    return Transport(sides, exchange, escape, direct, solution, {"transport": rows_cast, "shadow": cast})


def light_on_sides(
    sides: Sides, direct_light: DirectLight, workers: Workers, shadow_rays: int, seed: int, purpose: str
) -> tuple[Float64, int]:
    """Mean irradiance (s, 3) of each side straight from lamps and emitting surfaces, and the rays it took."""
    sites = [sides.sites(seed, "light " + purpose, number) for number in range(SITES)]

    def work(number: int, part: slice) -> tuple[Float64, int]:
        rng = stream(seed, "light on sides " + purpose, number)
        parts = [direct_light.at(p[part], n[part], n[part], shadow_rays, rng) for p, n in sites]
        return sum(p.irradiance for p in parts) / SITES, sum(p.rays for p in parts)

    irradiance, rays = zip(*workers.map(work, len(sides.side), _CHUNK), strict=True)
    return np.concatenate(irradiance), sum(rays)
