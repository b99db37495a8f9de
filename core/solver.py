"""Radiosity between patch sides: accumulated and residual light, pass by pass, and a fast finish.

H = E + F (albedo * H): the irradiance of a side is what comes straight from the sources plus what all sides it sees
reflect. Albedo stands on the receiver's side, so black surfaces and zero channels need no special case.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from .form_factors.rows import Rows
from .scene import Float64

#: Shooting passes before the finish: what the first bounces bring is what a person watches.
_WATCHED_PASSES = 2
_MAXIMUM_ITERATIONS = 200


@dataclass(frozen=True, eq=False)
class Solution:
    """irradiance (s, c) W/m^2; iterations done; bound: largest relative error that is left, provably."""

    irradiance: Float64
    iterations: int
    bound: float


def shoot(factors: Rows, albedo: Float64, direct: Float64) -> Iterator[tuple[Float64, Float64]]:
    """Accumulated and residual irradiance (s, c), pass by pass: each pass shoots all that is unshot.

    Cohen, Chen, Wallace, Greenberg 1988, all patches at once. Runs for as long as the caller wants more.
    """
    accumulated = np.array(direct, dtype=np.float64)
    residual = np.array(direct, dtype=np.float64)
    while True:
        yield accumulated, residual
        residual = factors.apply(albedo * residual)
        accumulated = accumulated + residual


def contraction(factors: Rows, albedo: Float64) -> float:
    """q = the largest share of the light on any side that comes back from it: albedo times row sum."""
    return float(np.max(albedo.max(axis=1) * factors.row_sums(), initial=0.0))


def solve(exchange: Rows, area: Float64, albedo: Float64, direct: Float64, tolerance: float) -> Solution:
    """Irradiance H (s, c) of each side, to a relative error of at most `tolerance`.

    exchange: symmetric exchange areas G_ij = A_i F_ij; area (s,); albedo, direct (s, c). With z = sqrt(albedo) H the
    system (A - s G s) z = s A E is symmetric and positive definite, and conjugate gradients finish what shooting began.
    """
    factors = Rows(exchange.indptr, exchange.columns, (exchange.weights / area[exchange.owners()]).astype(np.float32))
    passes = shoot(factors, albedo, direct)
    for done in range(_WATCHED_PASSES + 1):
        accumulated, residual = next(passes)
        q = contraction(factors, albedo)
        scale = np.maximum(np.abs(accumulated).max(axis=0), np.finfo(float).tiny)
        bound = float(np.max(np.abs(residual).max(axis=0) * q / scale)) / max(1.0 - q, 1e-12)
        if bound <= tolerance:
            return Solution(accumulated, done, bound)
    return _conjugate_gradients(exchange, factors, area, albedo, direct, accumulated, tolerance)


def _conjugate_gradients(
    exchange: Rows, factors: Rows, area: Float64, albedo: Float64, direct: Float64, start: Float64, tolerance: float
) -> Solution:
    root = np.sqrt(albedo)
    weight = 1.0 / area[:, None]
    q = contraction(factors, albedo)

    def operator(z: Float64) -> Float64:
        return area[:, None] * z - root * exchange.apply(root * z)

    z = root * start
    residual = root * area[:, None] * direct - operator(z)
    preconditioned = weight * residual
    direction = preconditioned.copy()
    energy = np.sum(residual * preconditioned, axis=0)
    irradiance, bound = start, np.inf
    for iteration in range(1, _MAXIMUM_ITERATIONS + 1):
        image = operator(direction)
        step = energy / np.maximum(np.sum(direction * image, axis=0), np.finfo(float).tiny)
        z = z + step * direction
        residual = residual - step * image
        preconditioned = weight * residual
        fresh = np.sum(residual * preconditioned, axis=0)
        direction = preconditioned + fresh / np.maximum(energy, np.finfo(float).tiny) * direction
        energy = fresh
        irradiance = direct + factors.apply(root * z)
        # One more Jacobi step would move the light by at most this; the rest of the series is geometric.
        moved = np.abs(factors.apply(albedo * irradiance - root * z)).max(axis=0)
        scale = np.maximum(np.abs(irradiance).max(axis=0), np.finfo(float).tiny)
        bound = float(np.max(moved / scale)) / max(1.0 - q, 1e-12)
        if bound <= tolerance:
            break
    return Solution(np.maximum(irradiance, 0.0), _WATCHED_PASSES + iteration, bound)
