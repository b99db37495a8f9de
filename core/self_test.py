"""Whether this installation computes what is known: every closed form, beside what came out.

Runs inside any Blender, so that a person, or a report of a bug, can tell a broken build from a hard scene.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from .bake import bake
from .closed_forms import FormFactor, KnownLight, form_factors, known_light
from .form_factors.analytic import analytic_rows
from .form_factors.centroid import centroid_rows
from .form_factors.hemisphere import hemisphere_rows
from .form_factors.rows import Rows
from .form_factors.sides import Sides
from .parallel import Workers
from .patches import Patches, make_patches, split_objects, triangle_geometry, unit_space
from .plan import choose_effort
from .progress import Progress
from .result import BakeResult
from .scene import Float64, Scene, Surface
from .settings import Estimator, Settings
from .visibility import Visibility

#: Those that promise something; the centroid formula is there for comparison.
ESTIMATORS: tuple[Estimator, ...] = ("analytic", "hemisphere")
#: What the analytic estimator promises of a whole surface, relative.
ANALYTIC_ERROR = 1e-3
#: Rays of each patch of the hemisphere estimator, and how many standard deviations they may be off: 1 in 16,000.
_RAYS, _SIGMAS = 256, 4.0


@dataclass(frozen=True)
class Outcome:
    """exact and got, where they differ most; error: their difference; allowed: the bound it must keep."""

    case: str
    exact: float
    got: float
    error: float
    allowed: float

    @property
    def passed(self) -> bool:
        return self.error <= self.allowed


def run_all(progress: Progress) -> Iterator[Outcome]:
    """Check every closed form, each as soon as it is asked for. Raises Cancelled when progress says so."""
    checks = [partial(check_form_factor, factor, estimator) for factor in form_factors() for estimator in ESTIMATORS]
    checks += [partial(check_light, known, estimator) for known in known_light() for estimator in ESTIMATORS]
    for check in checks:
        progress.check()
        yield check()


def table(outcomes: Iterable[Outcome]) -> Iterator[str]:
    """Lines: case, exact, got, error, verdict."""
    yield f"{'case':<56}{'exact':>14}{'got':>14}{'error':>10}  verdict"
    for o in outcomes:
        verdict = "ok" if o.passed else f"FAILED: at most {o.allowed:.1e}"
        yield f"{o.case:<56}{o.exact:14.9g}{o.got:14.9g}{o.error:10.1e}  {verdict}"


def check_form_factor(known: FormFactor, estimator: Estimator, patches: int | None = None) -> Outcome:
    """The form factor, by an estimator, with the shapes cut into about so many patches.

    The centroid formula promises nothing: its outcome is only for comparison.
    """
    got, deviation = estimate_form_factor(known, estimator, patches or (200 if estimator == "hemisphere" else 2))
    allowed = {
        "analytic": ANALYTIC_ERROR * known.exact,
        # Rays start a hair off their surface: along an edge that two shapes share some are lost.
        "hemisphere": _SIGMAS * deviation + 1e-4,
        "centroid": np.inf,
    }[estimator]
    name = f"{known.name} ({estimator})"
    return Outcome(name, known.exact, got, abs(got - known.exact), float(allowed + known.slack * known.exact))


def estimate_form_factor(known: FormFactor, estimator: Estimator, wanted: int) -> tuple[float, float]:
    """The form factor from the first to the second shape, and its standard deviation: from how much two independent
    estimates differ, patch by patch; 0 for what is not sampled."""
    # The albedo tells the shapes apart once they are cut into patches.
    objects = (known.first, replace(known.second, surface=known.second.surface + 1))
    scene = Scene(objects, (Surface("first", (0.25, 0, 0)), Surface("second", (0.5, 0, 0))))
    patches = make_patches(scene, unit_space(scene), split_objects(scene, wanted))
    halves = []
    with Workers(1, Progress()) as workers:
        for purpose in ("one", "other"):
            sides, rows = _rows(patches, Visibility(patches.corners), workers, estimator, purpose)
            own = (sides.albedo[:, 0] == 0.25) & ~sides.back
            arrived = rows.apply((sides.albedo[:, 0] == 0.5) & ~sides.back)[own]
            halves.append(sides.area[own] * arrived / sides.area[own].sum())
    one, other = halves
    deviation = 0.0 if estimator != "hemisphere" else float(np.sqrt(np.sum((one - other) ** 2)) / 2)
    return float(one.sum() + other.sum()) / 2, deviation


def _rows(
    patches: Patches, visibility: Visibility, workers: Workers, estimator: Estimator, purpose: str
) -> tuple[Sides, Rows]:
    if estimator == "hemisphere":
        found = hemisphere_rows(patches, visibility, workers, rays=_RAYS, seed=0, purpose=purpose)
        return found.sides, found.rows[0]
    by_pairs = centroid_rows if estimator == "centroid" else analytic_rows
    estimate = by_pairs(patches, visibility, workers, threshold=0.0, seed=0, purpose=purpose)
    return estimate.sides, estimate.rows


def check_light(known: KnownLight, estimator: Estimator = "hemisphere", *, tessellate: bool = True) -> Outcome:
    """A small bake of the scene, at the corner where it is farthest from the truth, or its mean."""
    settings = Settings(size=known.edge, error=0.02, estimator=estimator, tessellate=tessellate)
    patches = 500 if estimator == "hemisphere" else 150
    effort = replace(choose_effort(known.scene, settings), patches=patches, tolerance=1e-5, threshold=0.0)
    result = bake(known.scene, settings, effort=effort)
    stated = result.report.estimated_error["total"]
    return compare(f"{known.name} ({estimator})", known, *corners_of(result), stated)


def compare(name: str, known: KnownLight, points: Float64, radiance: Float64, area: Float64, stated: float) -> Outcome:
    """Places (n, 3) metres, radiance (n, 3) W/(m^2 sr) and area (n,) that each stands for, of corners; the error that
    the bake states."""
    exact, got = known.exact(points), radiance[:, 0]
    slack = known.slack
    if known.mean:
        exact, got = np.array([exact.mean()]), np.array([got @ area / area.sum()])
        slack = stated
    else:
        seen = area > 0  # Nobody sees a face without area.
        exact, got = exact[seen], got[seen]
    worst = int(np.argmax(np.abs(got - exact)))
    error = abs(float(got[worst] - exact[worst])) if np.isfinite(radiance).all() else np.inf
    # Values are kept in single precision.
    allowed = (slack + 1e-7) * float(np.abs(exact).max())
    return Outcome(name, float(exact[worst]), float(got[worst]), error, allowed)


def corners_of(result: BakeResult) -> tuple[Float64, Float64, Float64]:
    """Places (n, 3), combined radiance (n, 3) and a third of the triangle's area (n,) of all corners of a bake."""
    places = [o.vertices[o.triangles] for o in result.objects]
    area = np.concatenate([triangle_geometry(corners)[1] for corners in places])
    radiance = np.concatenate([o.layers["combined"] for o in result.objects]).astype(np.float64)
    return np.concatenate(places).reshape(-1, 3), radiance.reshape(-1, 3), np.repeat(area / 3, 3)
