"""What a bake will simulate, why, and what that will cost."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from .contrast import Contrast, contrast
from .cost import Machine, Work, calibrate
from .direct.emitters import emitting_pieces
from .direct.illumination import MOST_ASKED, MOST_CONTOURED, Source
from .direct.sky import split_bright
from .direct.sources import sources
from .effects import (
    LAMPS,
    choose_effects,
    colour,
    emitters_by_rays,
    goes_on,
    mean_of_sky,
    power_by_area,
    sky,
    sky_lights,
)
from .form_factors.sides import SITES
from .openings import find_openings
from .patches import unit_space
from .pilot import Pilot, look_for_sky
from .result import Effect
from .scene import Float64, Scene, SunLamp
from .settings import Settings, asked_error
from .sky import Sky
from .tessellation import edge_for_count, predicted_count
from .textures import varies
from .unevenness import unevenness

#: Effects that need rays over the hemisphere.
LOOKING = ("bounces", "sky")
#: Effects by which rays go on from what they meet.
ONWARD = ("transparency", "mirrors", "clear glass")
#: What no single effect costs: points, fit and layers.
REST = "the rest"
#: With how many times fewer triangles than asked for the receivers start, to get finer where light calls for it.
_COARSEST = 16.0
#: Triangles and patches below which a bake shows next to nothing.
_FEWEST = 1500
#: Lights that each half of the rays asks at a point, at least, where there are too many.
_FEWEST_LIGHTS = 4
#: Choosing among many emitting triangles costs as much as this many lamps.
_TREE_COST = 8
#: Relative errors that sampling leaves after two passes, and the triangles, with as many rays and on as many cells as
#: named: typical of the scenes of `make bench`. Sampling falls with the cube root of the cells, since neighbours share
#: what they learn; resolution with the square root.
_TYPICAL_SAMPLING, _TYPICAL_RESOLUTION, _TYPICAL_RAYS, _TYPICAL_CELLS = 0.008, 0.01, 32, 20_000
#: Share of the asked error that triangles leave which are added where light calls for them: typical too.
LEFT_TO_TRIANGLES = 0.7
#: Rays of a sample point, at most, where there are more because cells are few.
_MOST_RAYS = 128
#: How many times as many cells as is typical count as dense: then a few rays less of each lose nothing.
_DENSE = 4.0
#: Errors that the panel shows the price of.
PRICED_ERRORS = (0.05, 0.02, 0.01, 0.005)
#: Asked error from which on patches for rays grow fewer with its square, down to half, and nobody looks whether they
#: leave more of it than they should: that costs what it brings.
_ROUGH = 0.05
#: How many times as many patches there are after those have been split that light breaks in: typical. Where light is
#: harsher than this, more are wanted, by its square: typical of a furnished room and of a stage.
_MORE_PATCHES, _HARSH = 1.6, 0.25
#: Openings are looked for where so large a part of the receivers sees little of the sky, and the rays of one point
#: there tell of it with so much noise, relative to all light.
_INSIDE, _SHOWS = 0.1, 0.1
#: Cells that are split where light bends, by the power of what the harshness of light is to the error: typical of those
#: scenes.
_CALLED, _CALLED_POWER = 190, 1.75
#: Cells that there are in all where pools of light call for more, for each unit of unevenness and of light that has not
#: bounced, over the error: typical of a hall, and of rooms, with 12 to 40 lamps.
_POOLS = 4.7
#: Where they are fewer than one in so many of the first cells, one round more finds them all: typical as well.
_FEW_CALLED = 5.0
#: Cells that triangles which are kept gain at most where light breaks, for each cell; and those that others gain where
#: contours cut them, for each that contours cross of those that they start from: typical.
_MOST_CROSSED, _CUT = 0.25, 3.7
#: Finding that takes so many rounds at most, passes over all cells in each, and rays of each point that look around.
BEND_ROUNDS, BEND_PASSES, BEND_RAYS = 4, 4, 16
#: Up to which asked error more samples hide the noise of triangles of many sizes, and how many times as many more than
#: there are anyway.
_HIDES_NOISE, HIDING = 0.05, 1.0
#: Contours take so many points for each cell.
_CONTOUR_POINTS = 12
#: Share of the cells in which the shadow of one lamp ends; error from which on these need many points.
_CROSSED, _UNCERTAIN = 0.05, 0.05
#: Each step of thrift leaves this share of the work.
_THRIFT, _MOST_THRIFT = 0.8, 24


@dataclass(frozen=True)
class Effort:
    """How hard a bake works.

    error: relative, to aim at; triangles: at most, where no size is asked for, or cells in those that are kept;
    coarsest: with how many times fewer adaptation starts; growth: how many times as many it may add where a size is
    asked for; patches: wanted number; most_patches: up to how many there may be if those leave too much of the error, 0
    for none; transport_rays: of a patch side; shadow_rays: to a lamp with size; lights: asked at a point by each half
    of the rays where there are too many; gather_rays: of a sample point, unless cells are few; passes over all cells
    before the error is first estimated, boundary_passes over the cells where shadow boundaries leave the light
    uncertain; tolerance: of the solve; threshold: form factor under which pairs are culled; emitters_by_rays: emitting
    triangles are too many to be lamps; channels: 3, or 1 where everything is grey.
    """

    error: float
    triangles: int
    coarsest: float
    growth: float
    estimator: str
    patches: int
    most_patches: int
    transport_rays: int
    shadow_rays: int
    lights: int
    gather_rays: int
    passes: int
    boundary_passes: int
    tolerance: float
    threshold: float
    emitters_by_rays: bool
    channels: int

    @property
    def shadow_rays_of_site(self) -> int:
        """From each of the points of a patch to a lamp: what those miss the others of the same patch find."""
        return max(self.shadow_rays // SITES, 2)

    def rays_of_point(self, cells: float) -> int:
        """Rays of a sample point on so many cells: gather_rays, and twice or four times as many where cells are so few
        that these cost next to nothing beside what else a bake does."""
        doublings = np.clip(np.rint(np.log2(_TYPICAL_CELLS / max(cells, 1.0)) / 2.0), 0, 2)
        return max(min(self.gather_rays * 2 ** int(doublings), _MOST_RAYS), self.gather_rays)


@dataclass(frozen=True)
class Plan:
    """scene: with nothing in it but the effects that are simulated; effects with their reasons; how hard to work; the
    cost predicted from a short calibration of this machine: costs, seconds by effect and of all together (REST)."""

    scene: Scene
    effects: tuple[Effect, ...]
    effort: Effort
    cells: int
    costs: dict[str, float]
    seconds: float
    memory_mb: float

    @property
    def looks_around(self) -> bool:
        """Whether any effect needs rays over the hemisphere."""
        return self.effort.emitters_by_rays or any(self.active(name) for name in LOOKING)

    @cached_property
    def sources(self) -> tuple[list[Source], list[Source], Sky]:
        """What light is asked for straight, and what is left to rays; see `direct.sources`."""
        scene = self.scene
        with_lights, with_portals = self.active("sky lights"), self.active("portals")
        return sources(scene, scene.surroundings(), unit_space(scene), sky_lights=with_lights, portals=with_portals)

    def active(self, name: str) -> bool:
        """Whether an effect is simulated."""
        return next(effect.active for effect in self.effects if effect.name == name)


def plan(scene: Scene, settings: Settings, effort: Effort | None = None) -> Plan:
    """Decide and predict. Traces a few thousand rays to know this machine; changes nothing.

    effort: to work just so hard, instead of as hard as the settings call for.
    """
    pilot = Pilot(scene)
    chosen = choose(scene, settings, pilot, effort)
    return price(chosen, settings, pilot, calibrate(pilot, settings.threads), fixed=effort is not None)


def choose(scene: Scene, settings: Settings, pilot: Pilot, effort: Effort | None = None) -> Plan:
    """What the scene calls for, with no price yet: that takes no time worth mentioning, but under a sky some rays."""
    scene, sees_sky = _look_for_sky(scene, settings, pilot)
    effects, scene = choose_effects(scene, settings, sees_sky=sees_sky)
    return Plan(scene, effects, effort or choose_effort(scene, settings), 0, {}, 0.0, 0.0)


def price(chosen: Plan, settings: Settings, pilot: Pilot, machine: Machine, *, fixed: bool = False) -> Plan:
    """The chosen plan with its price on a machine, as the pilot of the scene has found it, and thriftier where there is
    too little time for it, unless its effort is fixed."""
    prices, effort = _Prices(chosen, settings, pilot, machine), chosen.effort
    planned = prices.of(effort)
    if fixed or settings.seconds is None or planned.seconds <= settings.seconds:
        return planned
    # Too little time for all: the least thrift that meets it, by bisection, or as much as still shows something.
    enough, short = _MOST_THRIFT, 0
    while enough - short > 1:
        middle = (enough + short) // 2
        met = prices.of(thriftier(effort, middle)).seconds <= settings.seconds
        enough, short = (middle, short) if met else (enough, middle)
    planned = prices.of(thriftier(effort, enough))
    return replace(planned, seconds=max(planned.seconds, settings.seconds))


def thriftier(effort: Effort, steps: int) -> Effort:
    """Less of everything that can be less: triangles where the mesh has them not itself, patches, and rays."""
    share = _THRIFT**steps
    rays = share**0.5
    return replace(
        effort,
        triangles=max(int(effort.triangles * share), min(effort.triangles, _FEWEST)),
        coarsest=max(effort.coarsest * share, 1.0),
        growth=effort.growth * min(share, 0.3),
        patches=max(int(effort.patches * share), min(effort.patches, _FEWEST // 4)),
        transport_rays=max(8 * int(effort.transport_rays * rays / 8), 16),
        gather_rays=max(2 * int(effort.gather_rays * rays / 2), 8),
        shadow_rays=max(2 * int(effort.shadow_rays * rays / 2), 2),
        lights=max(int(effort.lights * rays), min(effort.lights, _FEWEST_LIGHTS)),
        boundary_passes=max(2 * int(effort.boundary_passes * rays / 2), 2),
    )


def plan_with_prices(
    scene: Scene, settings: Settings, errors: tuple[float, ...] = PRICED_ERRORS
) -> tuple[Plan, dict[float, Plan]]:
    """The plan, and what each of these errors would cost instead: one look at scene and machine for all."""
    pilot = Pilot(scene)
    chosen, machine = choose(scene, settings, pilot), calibrate(pilot, settings.threads)
    asked = {error: replace(settings, error=error, seconds=None) for error in errors}
    prices = _Prices(chosen, asked[errors[0]], pilot, machine)
    costs = {error: prices.of(choose_effort(chosen.scene, wish)) for error, wish in asked.items()}
    return price(chosen, settings, pilot, machine), costs


def _look_for_sky(scene: Scene, settings: Settings, pilot: Pilot) -> tuple[Scene, bool]:
    """The scene with portals where the sky shines into rooms, if some of the receivers are inside and rays would find
    it with noise that shows; and whether it is to be seen at all. A sky that could bring more than a tenth of the asked
    error by ways that are too narrow for the rays counts as seen."""
    if not settings.effects.get("sky", True) or not sky(scene, settings).active:
        return scene, True
    found = look_for_sky(pilot)
    unseen, others = np.pi * mean_of_sky(scene), power_by_area(scene)
    error = asked_error(settings)
    if found.none:
        return scene, unseen * found.doubt > error / 10.0 * others or sky_lights(scene, settings).active
    noise = unseen * np.sqrt(found.openness / gather_rays(error))
    shows = found.inside >= _INSIDE and noise > _SHOWS * (unseen * found.openness + others)
    if not shows or not settings.effects.get("portals", True):
        return scene, True
    return replace(scene, portals=(*scene.portals, *find_openings(found, pilot))), True


class _Prices:
    """Plans of one scene by effort."""

    def __init__(self, chosen: Plan, settings: Settings, pilot: Pilot, machine: Machine) -> None:
        self._unpriced = chosen
        self._pilot = pilot
        self._settings = settings
        self._machine = machine
        self._own = sum(len(o.triangles) for o in chosen.scene.objects)
        self._cells: dict[int, int] = {}

    def of(self, effort: Effort) -> Plan:
        """The plan with its cells, seconds and memory filled in."""
        unpriced = replace(self._unpriced, effort=effort, cells=self._count(effort.triangles))
        works = self._works(unpriced)
        costs = {name: self._machine.seconds(work) for name, work in works.items()}
        memory = sum(work.memory_mb for work in works.values())
        return replace(unpriced, costs=costs, seconds=sum(costs.values()), memory_mb=memory)

    def _count(self, triangles: int) -> int:
        """How many triangles the receivers have when about so many of one size would cover them."""
        if triangles not in self._cells:
            receivers = self._unpriced.scene.receivers()
            vertices, own = [o.vertices for o in receivers], [o.triangles for o in receivers]
            edge = self._settings.size or edge_for_count(vertices, own, triangles)
            self._cells[triangles] = predicted_count(vertices, own, edge)
        return self._cells[triangles]

    def _adapted(self, planned: Plan) -> float:
        """Cells after adaptation: where they are put where light calls for them, those it starts from, once they are
        cut, and what the asked error calls for; else those there are, and more along its boundaries."""
        effort = planned.effort
        if effort.coarsest > 1.0:
            coarse = self._coarse(effort)
            return coarse + min(_CUT * self._crossed * coarse + self._called(effort), effort.triangles)
        crossed = 0.01 / effort.error if self._settings.tessellate else min(0.01 / effort.error, _MOST_CROSSED)
        return planned.cells + min(crossed * planned.cells, effort.growth * effort.triangles)

    def _patches(self, effort: Effort) -> float:
        """Wanted patches: more than there are first where light is harsh, if there may be."""
        more = max((self._harshness / _HARSH) ** 2, 1.0)
        return max(min(more * effort.patches, effort.most_patches), effort.patches)

    def _called(self, effort: Effort) -> float:
        """Cells that are added where light bends."""
        called = self._called_by_light(effort)
        return self._coarser_than(max(called, 1.0)) * called

    def _called_by_light(self, effort: Effort) -> float:
        """The same if no triangle of the receivers' own were so small already."""
        straight = 1.0 - self._machine.reflected
        shadows = _CALLED * (self._harshness / effort.error) ** _CALLED_POWER
        pools = _POOLS * self._unevenness * straight / effort.error - self._coarse(effort)
        return float(min(max(shadows, pools), effort.triangles))

    def _rounds(self, effort: Effort) -> float:
        """Of finding where light bends: one sees that nothing is coarse, if so."""
        if effort.coarsest <= 1.0:
            return 0.0
        calling = _FEW_CALLED * self._called_by_light(effort) * effort.coarsest / max(effort.triangles, 1)
        return 1.0 + self._coarser_than(effort.triangles) * min(0.2 / effort.error, BEND_ROUNDS - 1.0, calling)

    def _coarser_than(self, cells: float) -> float:
        """Share of the receivers' surface in triangles of their own that are larger than so many equal ones would be:
        only these are split."""
        return float(self._own_areas[self._own_areas * cells > 1.0].sum())

    @property
    def _lights_cut(self) -> bool:
        """Whether lights are so few that triangles are cut along their shadows."""
        return sum(self._lights.values()) <= MOST_CONTOURED

    @cached_property
    def _lights(self) -> dict[str, int]:
        """How many there are of each kind, those to choose from as many as they cost."""
        planned, scene = self._unpriced, self._unpriced.scene
        lights = {name: sum(isinstance(lamp, kind) for lamp in scene.lamps) for name, kind in LAMPS.items()}
        lights["sky lights"] = len(split_bright(scene.sky)[1]) if planned.active("sky lights") else 0
        lights["portals"] = len(scene.portals) if planned.active("portals") else 0
        chosen_from = planned.active("emitting surfaces") and not planned.effort.emitters_by_rays
        lights["emitting surfaces"] = len(emitting_pieces(scene)) or _TREE_COST * chosen_from
        return lights

    @cached_property
    def _contrast(self) -> Contrast:
        """Of the light straight from lamps, emitting surfaces and what of the sky is asked for straight."""
        chosen = self._unpriced
        others, of_sky, by_rays = chosen.sources
        other = (1.0 - self._machine.closed) * by_rays.mean_irradiance
        if chosen.effort.emitters_by_rays:
            other += self._emitted
        return contrast(self._pilot, [*others, *of_sky], chosen.effort.lights, other)

    @property
    def _crossed(self) -> float:
        """Share of the cells that contours cross, if lights are so few that triangles are cut along their shadows."""
        return self._contrast.crossed if self._lights_cut else 0.0

    @property
    def _emitted(self) -> float:
        """About how much light of emitting surfaces falls on all surfaces, W/m^2."""
        return power_by_area(replace(self._unpriced.scene, lamps=()))

    @property
    def _harshness(self) -> float:
        """The same contrast, relative to all light, bounces too."""
        return self._contrast.light * (1.0 - self._machine.reflected)

    @cached_property
    def _unevenness(self) -> float:
        """Of the lamps' light, beside that of emitting surfaces and what the sky and suns bring where it is open."""
        scene = self._unpriced.scene
        suns = sum(float(np.mean(lamp.irradiance)) for lamp in scene.lamps if isinstance(lamp, SunLamp))
        open_air = (1.0 - self._machine.closed) * (np.pi * mean_of_sky(scene) + suns)
        return unevenness(self._pilot, scene.lamps, open_air + self._emitted)

    @cached_property
    def _own_areas(self) -> Float64:
        """Of the receivers' own triangles, as shares of all."""
        area = self._pilot.receiving_areas
        return np.asarray(area / max(float(area.sum()), float(np.finfo(float).tiny)))

    def _coarse(self, effort: Effort) -> int:
        return self._count(max(int(effort.triangles / effort.coarsest), 1))

    def _surveyed(self, effort: Effort) -> float:
        """Points that tell where light bends."""
        if effort.coarsest <= 1.0:
            return 0.0
        cells = self._coarse(effort) + self._called(effort) / 2.0
        return self._rounds(effort) * BEND_PASSES * cells

    def _works(self, planned: Plan) -> dict[str, Work]:
        """What each effect calls for, and what serves them all (REST)."""
        effort = planned.effort
        cells = self._adapted(planned)
        passes = self._passes(effort, cells)
        surveyed = self._surveyed(effort)
        patches = _MORE_PATCHES * self._patches(effort) if planned.looks_around else 0.0
        count = sum(self._lights.values())
        asked = effort.lights / count if count > MOST_ASKED else 1.0
        crossed = (1.0 - (1.0 - _CROSSED) ** count) * min(_UNCERTAIN / effort.error, 1.0) ** 2
        points = cells * (passes + effort.boundary_passes * crossed)
        if surveyed and self._lights_cut:
            points += _CONTOUR_POINTS * cells
        on_sides = 2 * SITES * patches * effort.shadow_rays_of_site
        per_light = asked * (effort.shadow_rays * (points + surveyed) + on_sides)
        # At the sides of both halves, and before that at both sides of the patches that light may vary in.
        choices = points + surveyed + 4 * SITES * patches if count > MOST_ASKED else 0.0
        works = {
            name: Work(shadow=per_light * number, choices=choices * number)
            for name, number in self._lights.items()
            if number
        }
        if planned.looks_around:
            looks = passes * (1.0 + hiding(self._settings.tessellate, effort.error))
            # One look serves all that it may meet: it counts for the first of them.
            first = next((name for name in LOOKING if planned.active(name)), "emitting surfaces")
            look = replace(
                works.get(first, Work()),
                transport=2 * patches * effort.transport_rays,
                gather=cells * looks * effort.rays_of_point(cells) + surveyed * BEND_RAYS,
                patches=patches,
            )
            works[first] = look
            onward = next((name for name in ONWARD if planned.active(name)), None)
            if onward:
                works[onward] = Work(gather=self._machine.onward * (look.transport + look.gather))
        # Each round has a fit of the cells that there are by then, and cuts them along contours, as the end does after
        # more than one.
        rounds = self._rounds(effort)
        looked_at = surveyed / BEND_PASSES
        fits = 1 + min(passes / effort.passes - 1.0, 1.0) + looked_at / max(cells, 1.0)
        contours = looked_at + cells * float(np.clip(rounds - 1.0, 0.0, 1.0))
        crossing = self._crossed * contours if contours else 0.0
        rest = Work(cells=cells, own=self._own, fits=fits, contours=contours, crossed=crossing, rounds=rounds)
        return {**works, REST: rest}

    def _passes(self, effort: Effort, cells: float) -> float:
        if self._settings.error is None:
            return effort.passes
        finer = cells / _TYPICAL_CELLS
        rays = effort.rays_of_point(cells) / _TYPICAL_RAYS
        sampling, rest = _TYPICAL_SAMPLING**2 / finer ** (2 / 3) / rays, _TYPICAL_RESOLUTION**2 / finer
        if effort.coarsest > 1.0 and cells < effort.triangles:
            # Triangles are added until what they leave is what was asked for, and no further.
            rest = (LEFT_TO_TRIANGLES * effort.error) ** 2
        return effort.passes * max(sampling / max(effort.error**2 - rest, rest / 4), 1.0)


def choose_effort(scene: Scene, settings: Settings) -> Effort:
    """Finer patches and more rays for a smaller error; the quadratic estimators get fewer patches."""
    asked = asked_error(settings)
    onward = goes_on(scene)
    finer = float(np.clip(0.02 / asked, 0.1, 4.0))
    estimator = "hemisphere" if settings.estimator == "auto" or onward else settings.estimator
    # Who asks for little is to wait for little.
    by_rays = int(8192 * finer * float(np.clip(_ROUGH / asked, 0.5, 1.0)))
    patches = by_rays if estimator == "hemisphere" else int(1500 * finer)
    may_add = settings.error is not None and settings.seconds is None and asked < _ROUGH
    # Where light bends is no guide to where a texture has its detail.
    textured = any(varies(scene, o) for o in scene.receivers())
    return Effort(
        error=asked,
        triangles=settings.triangles if settings.tessellate else _sampled(settings.triangles, asked),
        coarsest=_COARSEST if settings.tessellate and settings.size is None and not textured else 1.0,
        growth=2.0,
        estimator=estimator,
        patches=patches,
        most_patches=settings.triangles if estimator == "hemisphere" and may_add else 0,
        # Few rays whose tints are over one, as others' are under it, are no average.
        transport_rays=64 if onward else 32,
        shadow_rays=4,
        lights=max(int(MOST_ASKED * min(0.02 / asked, 1.0)), _FEWEST_LIGHTS),
        gather_rays=gather_rays(asked, sum(len(o.triangles) for o in scene.receivers())),
        passes=2,
        boundary_passes=8,
        tolerance=min(asked / 20, 1e-3),
        threshold=1e-5,
        emitters_by_rays=emitters_by_rays(scene),
        channels=3 if settings.effects.get("colour") or colour(scene, settings).active else 1,
    )


def _sampled(triangles: int, error: float) -> int:
    """On how many cells light is sampled where triangles are kept, if these are not as many already: they show no
    more."""
    return max(int(triangles * min(0.02 / error, 1.0)), min(triangles, _FEWEST))


def hiding(tessellated: bool, error: float) -> float:
    """How many times as many samples of indirect light as there are anyway hide noise.

    Triangles of a mesh that is kept are about as large as each other and need none, and whoever asks for little has it
    sooner without.
    """
    return HIDING if tessellated and error <= _HIDES_NOISE else 0.0


def gather_rays(error: float, cells: int = 0) -> int:
    """Rays of a sample point: as many as bring its noise in proportion to the asked error, and more while they cost
    next to nothing. A power of two.

    cells: that there are at least; where they are more than usual their neighbours make up for rays.
    """
    dense = max(cells / _TYPICAL_CELLS, 1.0)
    called_for, for_nothing = 32 * (0.02 / error) ** 2 / dense ** (2 / 3), 36 * (0.02 / error) ** 0.5 / dense
    fewest = 4 if dense < _DENSE else 2
    return int(2 ** np.clip(np.rint(np.log2(max(called_for, for_nothing))), fewest, 6))
