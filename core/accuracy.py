"""How far the baked light is from the true light, estimated from the bake itself.

Three causes, independent enough to add as squares:
- sampling: how much the fits of two independent halves of all samples differ;
- transport: how much the gathered light changes when the patches it comes from are twice as large, and what follows
  from that for the patches there are (Richardson's extrapolation); and how well the loss is known that its level is a
  matter of;
- resolution: what the triangles cannot show, however long one computes: by how much the shown light bends from triangle
  to triangle, by what is left of the samples' distance from it once their own noise is taken away, and by what
  smoothing has taken.
All are root mean squares over the receivers' surface, relative to the mean radiance (design: the surface error).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from itertools import repeat
from typing import Any

import numpy as np

from .reconstruction import Fit, Samples, Smoothing, within
from .scene import Bool, Float64


@dataclass(frozen=True, eq=False)
class Fitted:
    """A fit: alpha (v,); the limits (v, k) of its values; vertex values (v, k) of all samples together, and their mean
    light (v,); squared error of each cell (c,) of the mean light: by sampling, by what the triangles cannot show, by
    what smoothing has taken; the mean light of the halves; how many samples of each cell (c,) told so."""

    alpha: Float64
    limits: tuple[Float64, Float64]
    values: Float64
    grey: Float64
    sampling: Float64
    unresolved: Float64
    smoothed: Float64
    halves: _Halves
    tried: Float64


@dataclass(frozen=True)
class ErrorEstimate:
    """Relative surface errors: 0.02 is 2 %."""

    sampling: float
    transport: float
    resolution: float

    @property
    def total(self) -> float:
        return float(np.sqrt(self.sampling**2 + self.transport**2 + self.resolution**2))

    def scaled(self, factor: float) -> ErrorEstimate:
        """The same causes, relative to another light."""
        return ErrorEstimate(factor * self.sampling, factor * self.transport, factor * self.resolution)

    def as_dict(self) -> dict[str, float]:
        """By name, with their total; empty where nothing is known."""
        if not np.isfinite(self.total):
            return {}
        parts = {"sampling": self.sampling, "transport": self.transport, "resolution": self.resolution}
        return {"total": self.total, **parts}


UNKNOWN = ErrorEstimate(np.inf, np.inf, np.inf)

#: How much the fit may weigh smoothness, from hardly to a lot.
ALPHAS = (0.02, 0.5, 5.0, 50.0)
#: Share of the vertices that are too few to go on smoothing for.
_FEW = 0.01
#: Mean squared jump of the gradient over mean squared error, of the least smooth fit of a step and of a parabola.
STEP_BEND, PARABOLA_BEND = 6.0, 70.0
#: Between these all are as likely, until samples tell more; here in steps of two percent.
_BENDS = np.geomspace(STEP_BEND, PARABOLA_BEND, 129)
#: How often bends are averaged with those around them.
_BLURS = 2
#: Relative error up to which the halves are fitted: they only tell errors that are larger.
_ROUGH = 2e-3
#: How many times as bright as its samples' mean a vertex begins at most.
_MOST_BRIGHTER = 4.0
#: Standard deviations beyond which nothing happens by chance.
_SURE = 3.0
#: By what share of itself the samples' own noise may be misjudged: the two sets of rays that tell are not quite
#: independent.
_MISJUDGED = 0.01
#: By how much the light changes with coarser patches, over its error with the patches there are. Triangles that lie
#: four to a square become a square: the second moments that blur the light grow by three (A/9 of a right-angled
#: triangle, A/3 of a square). The error falls with the length to the power of 1.5: with its square everywhere else, but
#: it is largest in a strip beside edges that is as wide as a patch, where it falls with the length itself.
COARSENING = 3.0**0.75 - 1.0


def fit_halves(
    fit: Fit, halves: list[Samples], judged: Fitted, loose: float = 1.0, each: Callable[..., Any] = map
) -> Fitted:
    """Fit with the alpha that `cross_validate` has found, in all channels. Of some cells there may be more samples
    since. loose, each: as there."""
    if (_tried(halves) > judged.tried).any():
        judged = _with_more_samples(fit, halves, judged, loose, each)
    limits, together = judged.limits, fit.system(*halves)
    start = _in_colour(judged.grey, fit.averages(together), halves[0].to_grey)
    light = fit.solve_within(together, judged.alpha, limits, start, loose, each)
    return replace(judged, values=light, grey=light @ halves[0].to_grey)


def _with_more_samples(
    fit: Fit, halves: list[Samples], judged: Fitted, loose: float, each: Callable[..., Any]
) -> Fitted:
    """What is judged, and the mean light of the halves, once some cells have more samples.

    Whoever takes the light for a random function weighs its jumps by the variance of a sample over that of a jump
    (Wahba 1978), so alpha falls as the number of samples grows. What smoothing took before still counts as resolution.
    """
    limits = fit.limits(*halves)
    before, now = (fit.receivers.vertex_means(tried) for tried in (judged.tried, _tried(halves)))
    fewer = np.divide(before, now, out=np.ones_like(now), where=now > 0.0)
    alpha = np.maximum(judged.alpha * fewer, np.minimum(judged.alpha, ALPHAS[0]))
    systems = [fit.system(half.grey()) for half in halves]
    start = judged.halves.first[:, None], judged.halves.second[:, None]
    values = each(fit.solve, systems, repeat(alpha), start, repeat(_ROUGH * loose))
    fitted = _Halves(*_shown(values, limits, alpha, halves[0].to_grey))
    sampling = fitted.spread(fit) / 4.0
    return replace(judged, alpha=alpha, limits=limits, halves=fitted, grey=fitted.mean, sampling=sampling)


def _shown(
    values: Iterable[Float64], limits: tuple[Float64, Float64], alpha: Smoothing, to_grey: Float64
) -> tuple[Float64, ...]:
    """Fits (v, 1) of the mean light as they would be shown (v,), within limits: a wild vertex with hardly a sample in
    sight counts for little."""
    low, high = (limit @ to_grey for limit in within(limits, alpha))
    return tuple(np.clip(fitted[:, 0], low, high) for fitted in values)


def _tried(halves: list[Samples]) -> Float64:
    return np.asarray(halves[0].tried + halves[1].tried, dtype=np.float64)


def cross_validate(
    fit: Fit, halves: list[Samples], area: Float64, shown: Float64, loose: float = 1.0, each: Callable[..., Any] = map
) -> Fitted:
    """The alpha at which, around each vertex, each half of the samples best predicts the other, judged by the mean
    light; and that light: half of what both halves have.

    area (c,) of the cells, as far as they are in sight; shown (c,): what a squared error of the light there counts.
    loose: how many times as far as usual fits may be from the best. each: a `map` that may use threads.
    """
    to_grey, limits = halves[0].to_grey, fit.limits(*halves)
    grey = list(each(Samples.grey, halves))
    systems = list(each(fit.system, grey))
    tried: list[_Halves] = []
    told: list[Float64] = []
    best = [fit.averages(system) for system in systems]
    smoother = fit.measured
    level = np.zeros(len(smoother), dtype=np.int8)
    for alpha in ALPHAS:
        # Where less smoothing was better already, that fit stays. The first one tells how light bends: it is near.
        rough = _ROUGH * (loose if tried else 1.0)
        values = list(each(fit.solve, systems, repeat(alpha), best, repeat(rough), repeat(~smoother)))
        first, second = _shown(values, limits, alpha, to_grey)
        predicted = sum(each(fit.squared_residual, grey, (second, first))) / 2
        if tried:
            # Cells beside a fit that stayed, which holds them back, have no say.
            better = np.where(fit.at_corners(smoother).all(axis=1), told[-1] - predicted, 0.0)
            smoother = smoother & (fit.nearby(area * better) > 0.0)
            if smoother.sum() <= _FEW * len(smoother):
                break
            level[smoother] = len(tried)
        else:
            bend = _averaged_around(fit.bending(*values), fit)
        # Only the first and the last are asked for again: large meshes need the room.
        told = [*told[:1], predicted]
        tried.append(_Halves(first, second))
        best = [np.where(smoother[:, None], fresh, kept) for fresh, kept in zip(values, best, strict=True)]
    sharpest, own_level = tried[0], fit.at_corners(level)
    own_noise = (grey[0].noise + grey[1].noise) / np.maximum(grey[0].count + grey[1].count, 1.0)
    distance = told[0] - sharpest.spread(fit) / 2.0
    unresolved = _unresolved_by_kind(fit.broken, bend, distance, own_noise, area * shown)
    sampling, smoothed = np.zeros((2, len(area)))
    for number, fitted in enumerate(tried):
        share = (own_level == number).mean(axis=1)
        sampling += share * fitted.spread(fit) / 4.0
        smoothed += share * fitted.smoothed_by(sharpest, fit)
    last = _Halves(best[0][:, 0], best[1][:, 0])
    return Fitted(
        alpha=np.array(ALPHAS)[level],
        limits=limits,
        values=last.mean[:, None],
        grey=last.mean,
        sampling=sampling,
        unresolved=unresolved,
        smoothed=smoothed,
        halves=last,
        tried=_tried(halves),
    )


def _averaged_around(values: Float64, fit: Fit) -> Float64:
    """Values (c,) averaged with those of the cells around: in a single cell noise bends as much as light does."""
    for _ in range(_BLURS):
        values = fit.receivers.at_cells(fit.receivers.vertex_means(values))
    return values


def _in_colour(grey: Float64, averages: Float64, to_grey: Float64) -> Float64:
    """Averages (v, k), made as bright as a fit (v,) of the mean light: noise that the channels share is gone."""
    before = averages @ to_grey
    lit = before > 0.0
    brighter = np.divide(grey, before, out=np.ones_like(before), where=lit)
    return averages * np.clip(brighter, 0.0, _MOST_BRIGHTER)[:, None]


@dataclass(frozen=True, eq=False)
class _Halves:
    """The fits of both halves at the vertices (v,)."""

    first: Float64
    second: Float64

    @property
    def mean(self) -> Float64:
        """(v,) half of what both have."""
        return (self.first + self.second) / 2.0

    def spread(self, fit: Fit) -> Float64:
        """(c,) squared difference of the halves."""
        return squared_mean(fit.at_corners(self.first - self.second))

    def smoothed_by(self, sharper: _Halves, fit: Fit) -> Float64:
        """(c,) squared change from a sharper fit, unbiased: the product of what two independent halves say of it."""
        one, other = self.first - sharper.first, self.second - sharper.second
        return (squared_mean(fit.at_corners(one + other)) - squared_mean(fit.at_corners(one - other))) / 4.0


def _unresolved_by_kind(broken: Bool, bend: Float64, distance: Float64, noise: Float64, weight: Float64) -> Float64:
    """As `_unresolved`, but the cells (c,) beside a break (c,) and the others each for themselves: what the samples
    tell beside a contour says nothing of smooth light."""
    unseen = np.zeros_like(bend)
    for kind in (broken, ~broken):
        unseen[kind] = _unresolved(bend[kind], distance[kind], noise[kind], weight[kind])
    # Nothing bends over a break: what light does beside one that is not straight, only the samples tell. Of a single
    # cell they tell too little as often as too much, so that is no more in all than what is left in all.
    left = (distance - noise)[broken]
    unseen[broken] = np.maximum(_shared_out(float(weight[broken] @ left), left, weight[broken]), unseen[broken])
    return unseen


def _shared_out(in_all: float, where: Float64, weight: Float64) -> Float64:
    """A weighted sum over cells, if above zero, in proportion to what is above zero of other values (c,)."""
    above = np.maximum(where, 0.0)
    return np.asarray(above * (in_all / float(weight @ above))) if in_all > 0.0 else np.zeros_like(above)


def _unresolved(bend: Float64, distance: Float64, noise: Float64, weight: Float64) -> Float64:
    """Squared error (c,) of the least smooth fit, from two witnesses: its own bends, and what is left of the samples'
    squared distance (c,) from it without their noise (c,).

    A bend is certain, but whether it means a step, a kink or a curve is not: then the error is a sixth to a seventieth
    of it. What is left is right on average, but a small difference of large numbers, however many there are: the noise
    is not known any better than _MISJUDGED. Between them Bayes' rule decides. Where surely more is left than a step
    would leave, light changes inside cells, so that halves do not agree how it bends: then only the samples tell.
    """
    left = distance - noise
    doubt = float(np.sum((weight * left) ** 2)) + (_MISJUDGED * float(weight @ noise)) ** 2
    in_all, bends = float(weight @ left), max(float(weight @ bend), 0.0)
    told = _posterior_mean(bends / _BENDS, _BENDS, in_all, doubt)
    surely = in_all - _SURE * np.sqrt(doubt)
    return _shared_out(told, bend, weight) if surely <= told else _shared_out(surely, left, weight)


def _posterior_mean(candidates: Float64, prior: Float64, measured: float, variance: float) -> float:
    """The mean of what may be, (n,) with weights (n,) before, now that it has been measured."""
    # What is measured without doubt is still told apart in steps only.
    sure = (1e-6 * float(candidates.max())) ** 2
    off = (candidates - measured) ** 2 / (2.0 * max(variance, sure, float(np.finfo(float).tiny)))
    likely = prior * np.exp(off.min() - off)
    return float(candidates @ likely / likely.sum())


def squared_mean(corners: Float64) -> Float64:
    """Mean (c,) over each triangle of the square of linear functions with corner values (c, 3)."""
    x, y, z = corners.T
    return np.asarray((x * (x + y + z) + y * (y + z) + z * z) / 6.0)


def level_error(doubts: tuple[tuple[float, float], ...]) -> float:
    """Relative error of all reflected light together, from what the halves say of it: by their rays, and with coarser
    patches.

    What both halves see alike stays in their mean, but of what rays do by chance only half, squared: and should they
    cancel by chance, at least that.
    """
    by_rays, by_coarser = np.array(doubts).T
    squared = max(float(by_rays.mean() ** 2), float(np.mean(by_rays**2)) / len(by_rays))
    return float(np.sqrt(squared + np.mean((by_coarser / COARSENING) ** 2)))


def estimate_error(
    parts: list[Fitted], transport: Float64, area: Float64, shown: Float64, scale: float, missed: float = 0.0
) -> tuple[ErrorEstimate, Float64]:
    """The three errors relative to the mean radiance, and the squared error (c,) of each cell's radiance.

    parts: the fits whose sum is the light; transport (c,): squared error of the mean irradiance by transport.
    shown (c,): mean square over the channels of albedo / pi, from mean irradiance to radiance; scale: mean radiance,
    W/(m^2 sr); missed: irradiance that may be there though no ray has found it, W/m^2. It counts as transport, and to
    the light that errors are relative to: where no other is, all is in doubt, which is an error of 1.
    """
    weight = area * shown / (area.sum() or 1.0)
    scale += missed * float(np.sqrt(weight.sum()))
    if scale <= 0:
        return ErrorEstimate(0.0, 0.0, 0.0), np.zeros_like(area)
    causes = [
        [p.sampling for p in parts],
        [transport + missed**2],
        # Noise may make a little smoothing less than none, in all: that hides nothing of what triangles cannot show.
        [square for p in parts for square in (p.unresolved, p.smoothed)],
    ]
    relative = [np.sqrt(sum(max(float(weight @ square), 0.0) for square in cause)) / scale for cause in causes]
    local = sum(np.maximum(sum(cause), 0.0) for cause in causes) * shown
    return ErrorEstimate(*relative), local
