"""How far the baked light is from the true light, estimated from the bake itself.

Three causes, independent enough to add as squares:
- sampling: how much the fits of two independent halves of all samples differ;
- transport: how much the gathered light changes when the patches it comes from are twice as large;
- resolution: what is left of the samples' distance from the other half's fit once their own noise is taken away. No
  amount of computing lowers it on the same vertices.
All are root mean squares over the receivers' surface, relative to the mean radiance (design: the surface error).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .reconstruction import Fit, Samples
from .scene import Float64


@dataclass(frozen=True, eq=False)
class Fitted:
    """A fit: alpha; vertex values (v, k) of all samples together, and their mean light (v,); squared error of each cell
    (c,) by sampling and by resolution, of the mean light."""

    alpha: float
    values: Float64
    grey: Float64
    sampling: Float64
    resolution: Float64


@dataclass(frozen=True)
class ErrorEstimate:
    """Relative surface errors: 0.02 is 2 %."""

    sampling: float
    transport: float
    resolution: float

    @property
    def total(self) -> float:
        return float(np.sqrt(self.sampling**2 + self.transport**2 + self.resolution**2))

    def as_dict(self) -> dict[str, float]:
        """By name, with their total; empty where nothing is known."""
        if not np.isfinite(self.total):
            return {}
        parts = {"sampling": self.sampling, "transport": self.transport, "resolution": self.resolution}
        return {"total": self.total, **parts}


UNKNOWN = ErrorEstimate(np.inf, np.inf, np.inf)

#: How much the fit may weigh smoothness, from hardly to a lot.
ALPHAS = (0.02, 0.5, 5.0)


def fit_halves(fit: Fit, halves: list[Samples], area: Float64) -> Fitted:
    """Fit with the alpha at which each half of the samples best predicts the other (cross-validation), judged by the
    mean light. area (c,) of the cells."""
    grey = [half.grey() for half in halves]
    systems = [fit.system(half) for half in grey]
    lowest, alpha = np.inf, ALPHAS[0]
    residual = spread = np.zeros(len(area))
    values: list[Float64 | None] = [None, None]
    for candidate in ALPHAS:
        values = [fit.solve(system, candidate, start) for system, start in zip(systems, values, strict=True)]
        first, second = (fit.at_corners(v)[..., 0] for v in values if v is not None)
        predicted = (grey[0].squared_residual(second) + grey[1].squared_residual(first)) / 2
        score = float(area @ predicted)
        if score > lowest:
            break
        lowest, alpha, residual, spread = score, candidate, predicted, squared_mean(first - second)
    count = np.maximum(grey[0].count + grey[1].count, 1.0)
    own_noise = (grey[0].noise + grey[1].noise) / count
    merged = halves[0] + halves[1]
    together = fit.solve_within(fit.system(merged), alpha, merged)
    return Fitted(alpha, together, together @ halves[0].to_grey, spread / 4.0, residual - own_noise - spread / 2.0)


def squared_mean(corners: Float64) -> Float64:
    """Mean (c,) over each triangle of the square of linear functions with corner values (c, 3)."""
    return np.asarray((corners.sum(axis=1) ** 2 + (corners**2).sum(axis=1)) / 12.0)


def estimate_error(
    parts: list[Fitted], coarser: Float64, area: Float64, reflectance: Float64, scale: float
) -> tuple[ErrorEstimate, Float64]:
    """The three errors relative to the mean radiance, and the squared error (c,) of each cell's radiance.

    parts: the fits whose sum is the light; coarser (c,): change of the grey irradiance with coarser patches.
    reflectance (c,): root mean square over the channels of albedo / pi, from grey irradiance to radiance; scale: mean
    radiance, W/(m^2 sr), times what colour takes from the mean of squares.
    """
    if scale <= 0:
        return ErrorEstimate(0.0, 0.0, 0.0), np.zeros_like(area)
    weight = area * reflectance**2 / area.sum()
    sampling = sum(p.sampling for p in parts)
    resolution = sum(p.resolution for p in parts)
    causes = [np.sqrt(max(float(weight @ cause), 0.0)) / scale for cause in (sampling, coarser**2, resolution)]
    local = np.maximum(sampling + coarser**2 + np.maximum(resolution, 0.0), 0.0) * reflectance**2
    return ErrorEstimate(causes[0], causes[1], causes[2]), local
