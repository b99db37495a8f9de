"""The ladder: bakes of rising effort, how wrong each turned out to be, and what accuracy costs among them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from .plan import Effort, choose_effort
from .scene import Scene
from .settings import Estimator, Settings

Clock = Literal["seconds", "processor_seconds"]
Measure = Literal["surface_error", "typical_error"]


@dataclass(frozen=True, eq=False)
class Rung:
    """One bake of the ladder. series: which knob it turns; label: how far. The settings, and the effort to change."""

    series: str
    label: str
    settings: Settings
    changes: Mapping[str, Any] = field(default_factory=dict)

    def effort(self, scene: Scene) -> Effort | None:
        """The effort to force, or None where the settings themselves decide."""
        return replace(choose_effort(scene, self.settings), **self.changes) if self.changes else None


@dataclass(frozen=True)
class Step:
    """One bake, measured. Errors are relative to the mean true radiance; seconds with reading and writing included.

    processor_seconds: of all threads together, which other programs on the machine change less. patches and rays are 0
    and estimated_error is None for Cycles, which does not tell. uncertainty: standard error of surface_error. All
    leave the points out that get no light at all, mostly inside solids; the errors everywhere have them in.
    """

    series: str
    label: str
    triangles: int
    patches: int
    rays: int
    seconds: float
    processor_seconds: float
    surface_error: float
    uncertainty: float
    typical_error: float
    bias: float
    everywhere_surface_error: float
    everywhere_typical_error: float
    estimated_error: float | None

    @property
    def measurable(self) -> bool:
        """Whether the error stands out from the noise of its own measurement."""
        return self.surface_error > 2.0 * self.uncertainty

    @property
    def honesty(self) -> float | None:
        """Stated over true error: 1 is right, less is boasting. None where either is not known."""
        if self.estimated_error is None or not self.measurable:
            return None
        return self.estimated_error / self.surface_error


@dataclass(frozen=True)
class Scale:
    """How far the ladder reaches. triangles of its middle; the finest and coarsest mesh relative to that; passes of the
    samples; patches for the estimators that take pairs, and form factors under which they cull; samples of Cycles."""

    triangles: int
    meshes: tuple[float, ...] = (0.25, 1.0, 4.0)
    passes: tuple[int, ...] = (2, 8, 32)
    errors: tuple[float, ...] = (0.05, 0.02, 0.01)
    pair_patches: tuple[int, ...] = (300, 1000)
    thresholds: tuple[float, ...] = (1e-2, 1e-3, 1e-5)
    cycles: tuple[int, ...] = (16, 64, 256)
    knobs: bool = True


QUICK = Scale(
    2_000, (1.0,), passes=(2, 8), errors=(0.05,), pair_patches=(300,), thresholds=(1e-4,), cycles=(4, 16), knobs=False
)
#: Each knob alone, from the same middle: name of the effort's field to its values.
KNOBS: dict[str, tuple[int, ...]] = {
    "gather_rays": (8, 128),
    "shadow_rays": (1, 16),
    "boundary_passes": (0, 32),
    "transport_rays": (16, 256),
    "patches": (2000, 16000),
}
#: Triangles up to which all pairs of them are taken: the cost grows with the square, whatever the number of patches.
MOST_BY_PAIRS = 5_000
#: Passes of the middle, from which the knobs are turned and the estimators compared.
_PASSES = 8
_BY_PAIRS: tuple[Estimator, ...] = ("analytic", "centroid")


def rungs(scene: Scene, scale: Scale, settings: Settings) -> list[Rung]:
    """The whole ladder. settings: threads and seed; error, seconds, size, triangles and estimator are the ladder's.

    The estimators that take pairs are left out where the scene itself has too many triangles for them.
    """
    fixed = replace(settings, error=None, seconds=None, size=None, triangles=scale.triangles)
    ladder = []
    for factor in scale.meshes:
        triangles = int(scale.triangles * factor)
        mesh = replace(fixed, triangles=triangles)
        ladder += [Rung("mesh and passes", f"{triangles:,} triangles, {n} passes", mesh, {"passes": n})
                   for n in scale.passes]  # fmt: skip
    asked = [replace(fixed, error=error) for error in scale.errors]
    ladder += [Rung("asked error", f"{goal.error:.1%} asked", goal) for goal in asked]
    middle = {"passes": _PASSES}
    if scale.knobs:
        ladder += [
            Rung(name.replace("_", " "), f"{value:,} {name.replace('_', ' ')}", fixed, {**middle, name: value})
            for name, values in KNOBS.items()
            for value in values
        ]
    pairs = _BY_PAIRS if sum(len(o.triangles) for o in scene.objects) <= MOST_BY_PAIRS else ()
    for patches in scale.pair_patches:
        few = {**middle, "patches": patches}
        ladder.append(Rung("hemisphere", f"{patches:,} patches", fixed, few))
        for estimator in pairs:
            ladder += [
                Rung(
                    estimator,
                    f"{patches:,} patches, pairs above {threshold:g}",
                    replace(fixed, estimator=estimator),
                    {**few, "threshold": threshold},
                )
                for threshold in scale.thresholds
            ]
    return ladder


def frontier(steps: Sequence[Step], measure: Measure = "surface_error", clock: Clock = "seconds") -> list[Step]:
    """The steps that no other beats in both time and error, fastest first; only those whose error can be measured."""
    best: list[Step] = []
    for step in sorted(steps, key=lambda s: (getattr(s, clock), getattr(s, measure))):
        error = getattr(step, measure)
        if step.measurable and (not best or error < getattr(best[-1], measure)):
            best.append(step)
    return best


def knee(front: Sequence[Step], measure: Measure = "surface_error", clock: Clock = "seconds") -> Step | None:
    """Where more time stops paying: the step of a frontier that lies furthest below the line from its first to its
    last, on logarithmic axes. None where no step lies below that line (Satopaa et al., Kneedle, 2011)."""
    if len(front) < 3:
        return None
    time = np.log([getattr(step, clock) for step in front])
    error = np.log([getattr(step, measure) for step in front])
    along = (time - time[0]) / (time[-1] - time[0])
    below = (1.0 - along) - (error - error[-1]) / (error[0] - error[-1])
    deepest = int(np.argmax(below))
    return front[deepest] if below[deepest] > 1e-9 else None
