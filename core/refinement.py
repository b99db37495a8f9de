"""Sampling until the asked error or the asked time is met, and the light that comes of it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import partial
from math import ceil
from typing import Any

import numpy as np

from .accuracy import (
    COARSENING,
    UNKNOWN,
    ErrorEstimate,
    Fitted,
    cross_validate,
    estimate_error,
    fit_halves,
    level_error,
)
from .clock import Clock
from .noise import samples_wanted
from .parallel import Workers
from .plan import LEFT_TO_TRIANGLES, Effort, hiding
from .receivers import cell_colours
from .reconstruction import Fit, Samples
from .scene import Bool, Float64, Scene
from .settings import Settings
from .survey import Survey
from .textures import Colours
from .transport import in_three_channels

#: Squared sampling error, relative to that of the rest, which no longer shows beside it.
_HIDDEN = 0.25
#: Up to which error fits are as near to the best as they can be; and how many times as far from it at most, beyond.
_TIGHT, _MOST_LOOSE = 0.01, 10.0
#: Up to how many cells one thread alone fits them sooner than several, which would wait for the interpreter in turn.
_ALONE = 8_000
#: How often the error is estimated anew, and how many times as many passes each time at most: more cannot be foreseen.
_MOST_ROUNDS, _MOST_GROWTH = 3, 4


#: Of a survey, and of what was found in it: one with finer triangles and as many passes' samples to recall, and what
#: share of the triangles' error it will leave; or None.
Finer = Callable[[Survey, "FittedSurvey"], tuple[Survey, float] | None]


@dataclass(frozen=True, eq=False)
class Light:
    """Fitted light at the vertices (v, ...): irradiance W/m^2 by where it came from, and how far it can be trusted.

    reflected, sky, emitted, lamps (v, 3); alphas (v,): the smoothing of direct and, if any, indirect light; error;
    cell_error (c,) mean square of each cell's radiance error. No valid sample tells of some vertices (v,): they were
    filled from their neighbours, or are hidden so deep inside solids that they stay dark.
    buried (e,): output triangles inside solids.
    """

    reflected: Float64
    sky: Float64
    emitted: Float64
    lamps: Float64
    alphas: tuple[Float64, ...]
    error: ErrorEstimate
    cell_error: Float64
    filled: Bool
    hidden: Bool
    buried: Bool

    @property
    def arriving(self) -> Float64:
        """All of the irradiance (v, 3), from wherever."""
        return self.lamps + self.reflected + self.emitted + self.sky


def refine(
    survey: Survey,
    scene: Scene,
    settings: Settings,
    effort: Effort,
    workers: Workers,
    clock: Clock,
    show: Callable[[Survey, Light], None],
    finer: Finer | None = None,
) -> tuple[Survey, Light]:
    """Passes, and finer triangles, until the estimated error, or the clock, says so. show: takes the light after each
    pass, if watched; finer: gives finer triangles where these leave too much of an asked error, if that can be and no
    time is set."""
    seconds = settings.seconds or np.inf
    asked = settings.error or 0.0

    def fitted(begin: float, error: float | None = None) -> tuple[Light, FittedSurvey]:
        with clock.stage("fit", begin, error):
            judged, buried = workers.beside(partial(judge_samples, survey, scene, workers), survey.buried)
        left = seconds - clock.elapsed - clock.seconds["fit"]
        more = more_samples(survey, left / clock.seconds["gather"])
        if more > 0.0:
            with clock.stage("gather", begin + 0.02, error):
                hide_noise(survey, judged, more)
        with clock.stage("fit", begin + 0.03, error):
            return fit_light(survey, judged, buried, workers)

    passes = effort.passes - survey.passes % effort.passes
    with clock.stage("gather", 0.3):
        _run_passes(survey, passes, clock, show)
        if clock.elapsed < seconds:
            survey.refine_boundaries(effort.boundary_passes)
    tried: list[tuple[int, ErrorEstimate]] = []
    for round_number in range(_MOST_ROUNDS):
        fits = clock.seconds.get("fit", 0.0)
        light, found = fitted(0.75 + 0.05 * round_number)
        if clock.progress.watched:
            show(survey, light)
        if settings.error is None and settings.seconds is None:
            break
        tried.append((survey.passes, light.error))
        with clock.stage("tessellate", 0.79 + 0.05 * round_number, light.error.total):
            split = finer(survey, found) if finer and _too_coarse(light.error, settings) else None
        left = seconds - clock.elapsed - (clock.seconds["fit"] - fits)
        more = passes_wanted(tried, asked, split[1] if split else 1.0)
        more = int(min(more, max(left, 0.0) * passes / clock.seconds["gather"])) // 2 * 2
        if split is None and more < 2:
            break
        with clock.stage("gather", 0.8 + 0.05 * round_number, light.error.total):
            if split:
                finest, _ = split
                finest.catch_up(survey.passes)
                survey = finest
                # What other triangles left tells nothing of what passes on these have lowered.
                tried.clear()
            for _ in range(more):
                survey.run_pass()
            survey.refine_boundaries(more)
        passes += more
    else:
        light, _ = fitted(0.95, light.error.total)
    return survey, light


def _run_passes(survey: Survey, passes: int, clock: Clock, show: Callable[[Survey, Light], None]) -> None:
    for number in range(passes):
        begin, end = (0.3 + 0.4 * n / passes for n in (number, number + 1))
        clock.progress.report("gather", begin, until=end)
        survey.run_pass()
        if clock.progress.watched:
            show(survey, average_light(survey))


def _too_coarse(error: ErrorEstimate, settings: Settings) -> bool:
    """Whether triangles leave too much of the asked error; whoever has set a time has none to begin again with."""
    asked = settings.error or 0.0
    return settings.seconds is None and error.total > asked > 0.0 and error.resolution > LEFT_TO_TRIANGLES * asked


def passes_wanted(tried: list[tuple[int, ErrorEstimate]], asked: float, left: float = 1.0) -> int:
    """How many more passes, an even number, bring the total error to what is asked, or sampling to where it no longer
    shows beside the rest. tried: how many passes there were at each fit, and the error they left; left: the share of
    what the triangles leave of it that finer ones will.

    The squared sampling error is a / passes + b. What is fixed, b, is the noise of the patches, which no pass lowers;
    it is known from the second fit on.
    """
    passes, error = tried[-1]
    rest = error.transport**2 + (left * error.resolution) ** 2
    target = max(asked**2 - rest, _HIDDEN * rest)
    sampling, fixed = error.sampling**2, 0.0
    if sampling <= target:
        return 0
    if len(tried) > 1:
        before, earlier = tried[-2]
        falling = max(earlier.sampling**2 - sampling, 0.0) / (passes / before - 1.0)
        fixed = max(sampling - falling, 0.0)
    wanted = (sampling - fixed) / max(target - fixed, fixed, 1e-30)
    return max(2 * ceil(passes * (min(wanted, _MOST_GROWTH) - 1.0) / 2.0), 0)


def fit_light(survey: Survey, judged: Judged, buried: Bool, workers: Workers) -> tuple[Light, FittedSurvey]:
    """Least squares onto the vertices, for direct and indirect light each as smooth as it was judged, and its error;
    and what that was found from. buried (e,): output triangles inside solids."""
    found = fit_samples(survey, judged, workers)
    transport = _squared_transport_error(survey, found.fits)
    error, cell_error = estimate_error(
        found.fits, transport, found.area, found.shown, found.radiance, survey.missed_sky
    )
    return replace(found.light, error=error, cell_error=cell_error, buried=buried), found


def _squared_transport_error(survey: Survey, fits: list[Fitted]) -> Float64:
    """(c,) of the mean irradiance: by patches that are too large, and by a wrong level of all reflected light."""
    around, receivers = survey.surroundings, survey.receivers
    by_patches = survey.coarser[0] * survey.coarser[1] / COARSENING**2
    if around is None:
        return by_patches
    reflected = fits[1].values[:, around.reflected].mean(axis=1)
    return by_patches + (level_error(around.level_doubts) * receivers.at_cells(reflected)) ** 2


@dataclass(frozen=True, eq=False)
class Judged:
    """How smooth direct and, if any, indirect light are, on one structure. area (c,): of the cells, as far as they are
    in sight; loose: how many times as far as usual fits may be from the best."""

    fit: Fit
    parts: list[Fitted]
    colours: Colours
    area: Float64
    loose: float


@dataclass(frozen=True, eq=False)
class FittedSurvey:
    """The fits of direct and, if any, indirect light on one structure, and the light that they are, with nothing known
    of its error. area (c,): of the cells, as far as they are in sight; shown (c,): what a squared error of the mean
    irradiance counts in this light, mean square over the channels; radiance: the mean, W/(m^2 sr)."""

    fits: list[Fitted]
    light: Light
    area: Float64
    shown: Float64
    radiance: float

    @property
    def unresolved(self) -> Float64:
        """(c,) squared error of the radiance, times the area, that smaller triangles would not leave. What smoothing
        takes for want of samples they do not bring back."""
        return np.asarray(self.area * self.shown * sum(fitted.unresolved for fitted in self.fits))


def judge_samples(survey: Survey, scene: Scene, workers: Workers) -> Judged:
    """Find how smooth each kind of light is, from all samples so far."""
    receivers = survey.receivers
    fit = Fit(receivers, survey.lumped, survey.invalid)
    colours = cell_colours(scene, receivers)
    area = receivers.cells.area * survey.share_in_sight
    loose = min(max(survey.error / _TIGHT, 1.0), _MOST_LOOSE)

    each = _each(survey, workers)

    def judged(halves: list[Samples]) -> Fitted:
        return cross_validate(fit, halves, area, colours.shown_in_white, loose, each)

    return Judged(fit, list(each(judged, survey.sampled)), colours, area, loose)


def _each(survey: Survey, workers: Workers) -> Callable[..., Iterable[Any]]:
    """A `map` for fits on the survey's cells."""
    return workers.each if len(survey.receivers.cells) > _ALONE else map


def more_samples(survey: Survey, time: float) -> float:
    """How many times as many samples of indirect light as before there are to be had to hide noise, if all of them take
    no longer than `time` times as long as those before."""
    if survey.surroundings is None:
        return 0.0
    return hiding(survey.receivers.tessellated, survey.error) * float(np.clip(time, 0.0, 1.0))


def hide_noise(survey: Survey, judged: Judged, more: float) -> None:
    """More samples of indirect light, so many times as many as before, where its noise would show."""
    seen = survey.receivers.at_cells(judged.parts[0].grey + judged.parts[1].grey)
    indirect = judged.parts[1]
    # Of cells that had more samples before: what as many as usual would leave.
    noise = indirect.sampling * indirect.tried / survey.passes
    survey.top_up(samples_wanted(judged.fit, survey.passes, more, judged.area, noise, seen))


def fit_samples(survey: Survey, judged: Judged, workers: Workers) -> FittedSurvey:
    """Fit all samples so far, as smoothly as each kind of light was judged to want it."""
    each = _each(survey, workers)

    def fitted(halves: list[Samples], part: Fitted) -> Fitted:
        return fit_halves(judged.fit, halves, part, judged.loose, each)

    receivers, area = survey.receivers, survey.receivers.cells.area
    fits = list(each(fitted, survey.sampled, judged.parts))
    alphas, colours = tuple(f.alpha for f in fits), judged.colours
    light = _light(survey, [f.values for f in fits], alphas, UNKNOWN, np.zeros(len(area)), judged.fit)
    arriving = receivers.at_cells(light.arriving)
    # An error is of the colour of the light: in red light a red surface shows all of it, a blue one nothing.
    grey = arriving.mean(axis=1, keepdims=True)
    tint = np.divide(arriving, grey, out=np.ones_like(arriving), where=grey > 0.0)
    shown = np.mean((tint * colours.albedo / np.pi) ** 2, axis=1)
    radiance = colours.emission + colours.albedo * arriving / np.pi
    return FittedSurvey(fits, light, judged.area, shown, float(area @ radiance.mean(axis=1) / area.sum()))


def fit_alone(survey: Survey, alphas: tuple[Float64, ...]) -> Light:
    """The light with a smoothing that is given, and with nothing known of its error."""
    fit = Fit(survey.receivers, survey.lumped, survey.invalid)
    values = []
    for halves, alpha in zip(survey.sampled, alphas, strict=True):
        values.append(fit.solve_within(fit.system(*halves), alpha, fit.limits(*halves)))
    dark = np.zeros(len(survey.receivers.cells))
    return _light(survey, values, alphas, UNKNOWN, dark, fit)


def average_light(survey: Survey) -> Light:
    """The light so far, each vertex the mean of the samples around it: quick and rough, and with nothing known of its
    error."""
    cells = survey.receivers.cells
    corner = survey.receivers.corner_vertex[cells.element].ravel()
    count = survey.receivers.vertices

    def mean(halves: list[Samples]) -> Float64:
        total = halves[0] + halves[1]
        share = total.lumped * cells.area[:, None]
        weight = np.maximum(np.bincount(corner, share.ravel(), count), np.finfo(float).tiny)
        light = total.light * cells.area[:, None, None]
        channels = [np.bincount(corner, light[..., k].ravel(), count) / weight for k in range(light.shape[2])]
        return np.stack(channels, axis=1)

    return _light(survey, [mean(halves) for halves in survey.sampled], (), UNKNOWN, np.zeros(len(cells)), None)


def _light(
    survey: Survey,
    values: list[Float64],
    alphas: tuple[Float64, ...],
    error: ErrorEstimate,
    cell_error: Float64,
    fit: Fit | None,
) -> Light:
    """Vertex values (v, channels) of direct and, if any, indirect light, by where it came from."""
    around = survey.surroundings
    nowhere = np.zeros(survey.receivers.vertices, dtype=bool)
    dark = np.zeros((survey.receivers.vertices, 3))
    reflected, sky, emitted = dark, dark, dark
    if around:
        reflected = in_three_channels(values[1][:, around.reflected])
        sky = values[1][:, around.sky] @ around.hemispheres.sky.irradiance
        by_rays = around.emitted.stop > around.emitted.start
        emitted = in_three_channels(values[1][:, around.emitted]) if by_rays else dark
    lamps, of_sky = np.split(values[0], [values[0].shape[1] // (2 if survey.tells_sky_apart else 1)], axis=1)
    if survey.tells_sky_apart:
        sky = sky + in_three_channels(of_sky)
    return Light(
        reflected=reflected,
        sky=sky,
        emitted=emitted,
        lamps=in_three_channels(lamps),
        alphas=alphas,
        error=error,
        cell_error=cell_error,
        filled=fit.filled if fit else nowhere,
        hidden=fit.hidden & ~fit.filled if fit else nowhere,
        buried=np.zeros(survey.receivers.elements, dtype=bool),
    )
