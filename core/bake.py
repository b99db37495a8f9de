"""The bake from start to end; read this as the table of contents."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache, partial

from .adaptation import Adaptation
from .baked import Baked
from .bending import Bends
from .check import check_cost, check_scene
from .clock import Clock
from .contours import Contours
from .cost import calibrate
from .direct.illumination import DirectLight, Source
from .memory import Memory
from .parallel import Workers
from .patch_count import patches_wanted
from .patch_refinement import patches_by_light
from .patches import Patches, Space, make_patches, split_objects, unit_space
from .pilot import Pilot
from .plan import Effort, Plan, choose, price
from .progress import Progress
from .receivers import Receivers, make_receivers
from .refinement import Finer, FittedSurvey, Light, average_light, refine
from .result import BakeResult
from .scene import Scene
from .settings import Settings
from .surroundings import Surroundings, look_up
from .survey import Survey
from .transport import Transport, solve_halves
from .visibility import Visibility

#: Triangles of the first look at the light.
_ROUGH = 8_000


def bake(
    scene: Scene,
    settings: Settings,
    progress: Progress | None = None,
    effort: Effort | None = None,
    memory: Memory | None = None,
) -> BakeResult:
    """Bake the light of a scene onto its receivers.

    effort: to work just so hard, instead of as hard as the settings call for. memory: of the last bake, to go on from
    where it can.
    Raises SceneError for a scene that cannot be baked or needs more memory than is free, Cancelled when progress says
    so.
    """
    clock = Clock(progress or Progress())
    recalled = memory.recall(scene, settings, clock) if memory else None
    if recalled is not None:
        return recalled
    given = scene

    def show(baked: Baked, light: Light) -> None:
        clock.progress.show(lambda: baked.result(light, settings, clock))

    with Workers(settings.threads, clock.progress) as workers:
        with clock.stage("plan", 0.0):
            scene = check_scene(scene)
            pilot = Pilot(scene)
            chosen = choose(scene, settings, pilot, effort)
            scene = chosen.scene
            space, around = unit_space(scene), scene.surroundings()
            others, of_sky, sky = chosen.sources
            lights = [*others, *of_sky]
            if clock.progress.watched and lights:
                show(*first_light(chosen, around, space, lights, settings, workers))
            planned = price(chosen, settings, pilot, calibrate(pilot, settings.threads), fixed=effort is not None)
            check_cost(planned)
            effort = planned.effort
            clock.progress.expected = planned.seconds

        def prepared(effort: Effort, pilot: Pilot) -> tuple[Patches, DirectLight]:
            patches, visibility = patches_by_light(around, space, lights, effort, settings.seed, workers, pilot)
            return patches, DirectLight(lights, visibility, settings.seed, effort.lights)

        def solved(patches: Patches, direct_light: DirectLight) -> tuple[tuple[Transport, ...], Surroundings | None]:
            visibility = direct_light.visibility
            halves = solve_halves(patches, visibility, direct_light, sky, planned, workers, settings.seed)
            return halves, look_up(patches, visibility, halves, sky, planned.effort, settings.seed)

        with clock.stage("tessellate", 0.03):
            receivers, (patches, direct_light) = workers.beside(
                partial(make_receivers, scene, space, settings, max(int(effort.triangles / effort.coarsest), 1)),
                partial(prepared, effort, pilot),
            )
            del pilot  # it holds a copy of the scene
        with clock.stage("transport", 0.1, until=0.28):
            halves, surroundings = solved(patches, direct_light)
            wanted, spent = patches_wanted(scene, receivers, direct_light, surroundings, effort, settings.seed, workers)
            if wanted > effort.patches:
                spent = sum((half.rays for half in halves), spent)
                patches, direct_light = prepared(replace(effort, patches=wanted), Pilot(scene))
                halves, surroundings = solved(patches, direct_light)
        sampled, sky_light = told_apart(direct_light, others, of_sky if "sky" in settings.layers else [])

        def begun_on(some: Receivers) -> Survey:
            around = surroundings and surroundings.from_cells(len(some.cells), effort, settings.seed)
            return Survey(some, sampled, around, effort, settings.seed, workers, sky_light)

        with clock.stage("tessellate", 0.28):
            survey, finer = finer_where_it_matters(
                begun_on, scene, receivers, direct_light, surroundings, effort, settings.seed, workers
            )
            survey.rays += spent
            del receivers  # large meshes need the room
        # One for each survey: what it has worked out, it shows again.
        so_far = lru_cache(1)(partial(Baked, planned, patches, halves))
        survey, light = refine(
            survey, scene, settings, effort, workers, clock, lambda survey, light: show(so_far(survey), light), finer
        )
        baked = so_far(survey)
    if memory:
        memory.remember(given, settings, baked, light)
    with clock.stage("layers", 0.97):
        return baked.result(light, settings, clock)


def told_apart(
    direct_light: DirectLight, others: list[Source], of_sky: list[Source]
) -> tuple[DirectLight, DirectLight | None]:
    """The direct light without that of the sky, and that of the sky, if there is any to be told apart."""
    if not of_sky:
        return direct_light, None
    return direct_light.only(others), direct_light.only(of_sky)


def first_light(
    chosen: Plan, around: Scene, space: Space, lights: list[Source], settings: Settings, workers: Workers
) -> tuple[Baked, Light]:
    """A rough look at the direct light, before anything is priced: whoever watches sees within a moment whether it is
    worth waiting."""
    receivers = make_receivers(
        replace(chosen.scene, objects=tuple(replace(o, size=None) for o in chosen.scene.objects)),
        space,
        replace(settings, size=None),
        min(chosen.effort.triangles, _ROUGH),
    )
    patches = make_patches(around, space, split_objects(around, 1))
    straight = DirectLight(lights, Visibility(patches.corners, patches.optics), settings.seed, chosen.effort.lights)
    survey = Survey(receivers, straight, None, chosen.effort, settings.seed, workers)
    survey.run_pass()
    return Baked(chosen, patches, (), survey), average_light(survey)


def finer_where_it_matters(
    begun_on: Callable[[Receivers], Survey],
    scene: Scene,
    receivers: Receivers,
    direct_light: DirectLight,
    surroundings: Surroundings | None,
    effort: Effort,
    seed: int,
    workers: Workers,
) -> tuple[Survey, Finer | None]:
    """A survey of the receivers, as `begun_on` starts one. Their triangles are cut where light breaks, and split where
    it bends if they start coarse; meshes that are kept are sampled more finely where light breaks. There a first pass
    tells where, which serves on. And what makes them finer yet, once more is known, if they started coarse."""
    contours = Contours(scene, direct_light, surroundings, seed, workers)

    def gone_on(earlier: Survey, receivers: Receivers) -> Survey:
        survey = begun_on(receivers)
        survey.recall(earlier)
        survey.rays += earlier.rays
        return survey

    if effort.coarsest > 1 and receivers.tessellated:
        limit = len(receivers.cells) + effort.triangles
        bends = Bends(receivers, limit, direct_light, surroundings, contours, effort, seed, workers)
        survey = begun_on(bends.refine(scene))
        survey.rays += bends.rays + contours.rays

        def finer(earlier: Survey, found: FittedSurvey) -> tuple[Survey, float] | None:
            cast = bends.rays + contours.rays
            split = bends.finer(earlier, found)
            earlier.rays += bends.rays + contours.rays - cast
            return (gone_on(earlier, split[0]), split[1]) if split else None

        return survey, finer
    survey = begun_on(receivers)
    survey.run_pass()
    adaptation = Adaptation(direct_light, surroundings, seed, workers)
    limit = len(receivers.cells) + int(effort.growth * effort.triangles)
    finest = adaptation.refine_receivers(survey, limit, effort.error)
    if finest.tessellated:
        finest = contours.cut(finest).receivers
    if finest is not receivers:
        survey = gone_on(survey, finest)  # which frees the first, before it needs room for more
        survey.run_pass()
    survey.rays += adaptation.rays + contours.rays
    return survey, None
