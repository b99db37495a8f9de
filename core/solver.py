"""Radiosity between patch sides: accumulated and residual light, pass by pass, and a fast finish.

H = E + F (albedo * H): the irradiance of a side is what comes straight from the sources plus what all sides it sees
reflect. Albedo stands on the receiver's side, so black surfaces and zero channels need no special case.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from .form_factors.rows import Rows
from .parallel import Workers
from .scene import Float64

#: Shooting passes before the finish: what the first bounces bring is what a person watches.
_WATCHED_PASSES = 2
_MAXIMUM_ITERATIONS = 200
#: A relative error that rounding leaves.
_SOLVED = 1e-12
#: Of the brightest side's light: a dim room (10 lux) beside what the sun brings to the roof above it (100,000 lux).
#: With much less, rounding would leave more than the smallest tolerances allow.
_DIMMEST = 1e-4
#: Former directions that a new one is made independent of.
_REMEMBERED = 12


@dataclass(frozen=True, eq=False)
class Solution:
    """irradiance (s, c) W/m^2; iterations done; bound: provably no less than the largest error that is left, relative
    to the channel's largest irradiance."""

    irradiance: Float64
    iterations: int
    bound: float


def shoot(
    factors: Rows, albedo: Float64, direct: Float64, workers: Workers | None = None
) -> Iterator[tuple[Float64, Float64]]:
    """Accumulated and residual irradiance (s, c), pass by pass: each pass shoots all that is unshot.

    Cohen, Chen, Wallace, Greenberg 1988, all patches at once. Runs for as long as the caller wants more.
    """
    accumulated = np.array(direct, dtype=np.float64)
    residual = np.array(direct, dtype=np.float64)
    while True:
        yield accumulated, residual
        residual = factors.apply(albedo * residual, workers)
        accumulated = accumulated + residual


def shoot_until(
    factors: Rows, albedo: Float64, direct: Float64, tolerance: float, workers: Workers | None = None
) -> Solution:
    """Plain shooting passes until what a pass brings is under `tolerance`, as the original program did.

    With rows that sum to more than one the light may grow for ever; after the last allowed pass it stands as it is.
    """
    for done, (accumulated, residual) in enumerate(shoot(factors, albedo, direct, workers)):
        left = _relative(residual, accumulated)
        if left <= tolerance or done == _MAXIMUM_ITERATIONS:
            break
    return Solution(accumulated, done, left)


def contraction(factors: Rows, albedo: Float64) -> float:
    """Q = the most that any side gets back where all are lit by one: a bounce brings at most q times what is brightest.

    By the sides that send, not by the one that receives: a dark plate over a white floor gets what the floor loses.
    """
    return float(np.max(factors.apply(albedo.max(axis=1)), initial=0.0))


def solve(
    exchange: Rows, area: Float64, albedo: Float64, direct: Float64, tolerance: float, workers: Workers | None = None
) -> Solution:
    """Irradiance H (s, c) of each side, to a relative error of at most `tolerance` of each channel's largest, and
    until what is left at each side is as small beside the side's own light.

    exchange: symmetric exchange areas G_ij = A_i F_ij; area (s,); albedo, direct (s, c). With z = sqrt(albedo) H the
    system (A - s G s) z = s A E is symmetric and positive definite, and conjugate gradients finish what shooting began.
    """
    factors = exchange.scaled(1.0 / area)
    q = contraction(factors, albedo)
    for done, (accumulated, residual) in enumerate(shoot(factors, albedo, direct, workers)):
        # Nowhere does a later pass bring more than q times the pass before it: the rest of the series is geometric.
        bound = _relative(residual * q, accumulated) / max(1.0 - q, 1e-12)
        if bound <= tolerance:
            return Solution(accumulated, done, bound)
        if done == _WATCHED_PASSES:
            break
    return _conjugate_gradients(exchange, factors, area, albedo, direct, accumulated, tolerance, q, workers)


def _conjugate_gradients(
    exchange: Rows,
    factors: Rows,
    area: Float64,
    albedo: Float64,
    direct: Float64,
    start: Float64,
    tolerance: float,
    q: float,
    workers: Workers | None,
) -> Solution:
    root = np.sqrt(albedo)
    weight = 1.0 / area[:, None]

    def operator(z: Float64) -> Float64:
        return area[:, None] * z - root * exchange.apply(root * z, workers)

    z = root * start
    residual = root * area[:, None] * direct - operator(z)
    preconditioned = weight * residual
    direction = preconditioned.copy()
    energy = np.sum(residual * preconditioned, axis=0)
    iteration, bounds = 0, np.full(direct.shape[1], np.inf)
    while (bounds > tolerance).any() and iteration < _MAXIMUM_ITERATIONS:
        iteration += 1
        image = operator(direction)
        # A channel that is solved to rounding rests while others go on: what is left of it points nowhere.
        step = energy / np.maximum(np.sum(direction * image, axis=0), np.finfo(float).tiny) * (bounds > _SOLVED)
        z = z + step * direction
        residual = residual - step * image
        preconditioned = weight * residual
        fresh = np.sum(residual * preconditioned, axis=0)
        direction = preconditioned + fresh / np.maximum(energy, np.finfo(float).tiny) * direction
        energy = fresh
        # One more pass would move the reflected light, root z, by root times the scaled residual.
        bounds = _relative_by_channel(root * preconditioned, root * z) / max(1.0 - q, 1e-12)
    irradiance = direct + factors.apply(root * z, workers)
    return Solution(irradiance, _WATCHED_PASSES + iteration, float(bounds.max()))


def solve_both_sides(
    returning: Callable[[Float64], Float64], area: Float64, direct: Float64, q: float, tolerance: float
) -> Solution:
    """Irradiance H (s, c) with H = direct + returning(H), where surfaces reflect and transmit diffusely.

    returning: F R, with R the symmetric matrix of albedos on the diagonal and transmissions between the two sides of a
    patch. Where more is transmitted than reflected R is indefinite, and no root of it makes the system symmetric and
    positive definite. But F is self-adjoint and at most 1 in the inner product weighed by area (s,), and R at most the
    largest albedo + transmission: with q < 1 their product, I - F R has a positive definite symmetric part, for which
    generalised conjugate residuals converge (Eisenstat, Elman, Schultz 1983). What is left of H is at most 1 / (1 - q)
    times the residual, in the largest norm as well, since the rows of F R sum to at most q.
    """
    accumulated, residual = direct.copy(), returning(direct)
    former: list[tuple[Float64, Float64, Float64]] = []
    iteration = 0
    while True:
        bound = _relative(residual, accumulated) / max(1.0 - q, 1e-12)
        if bound <= tolerance or iteration == _MAXIMUM_ITERATIONS:
            return Solution(accumulated, iteration, bound)
        iteration += 1
        direction = residual
        image = direction - returning(direction)
        for old, old_image, energy in former:
            along = area @ (image * old_image) / energy
            direction, image = direction - along * old, image - along * old_image
        energy = np.maximum(area @ (image * image), np.finfo(float).tiny)
        step = area @ (residual * image) / energy
        accumulated, residual = accumulated + step * direction, residual - step * image
        former = [*former[1 - _REMEMBERED :], (direction, image, energy)]


def _relative(change: Float64, whole: Float64) -> float:
    """The largest change (s, c) of any side, relative to its own light; see `_relative_by_channel`."""
    return float(_relative_by_channel(change, whole).max())


def _relative_by_channel(change: Float64, whole: Float64) -> Float64:
    """Relative to each side's own light, or _DIMMEST of the brightest side's if that is more: a room is solved however
    bright the day is outside."""
    light = np.abs(whole)
    scale = np.maximum(np.maximum(light, _DIMMEST * light.max(axis=0)), np.finfo(float).tiny)
    return np.asarray((np.abs(change) / scale).max(axis=0))
