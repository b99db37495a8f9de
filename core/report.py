"""What a bake says of itself afterwards."""

from __future__ import annotations

import sys

import numpy as np

from .clock import Clock
from .patches import Patches
from .plan import Plan
from .refinement import Light
from .result import BakedObject, Report
from .scene import Float64
from .settings import Settings
from .survey import Survey
from .transport import Transport


def make_report(
    settings: Settings,
    plan: Plan,
    clock: Clock,
    patches: Patches,
    halves: tuple[Transport, ...],
    survey: Survey,
    light: Light,
    objects: tuple[BakedObject, ...],
) -> Report:
    """The report.json of the headless contract; reading and writing Blender's data add their own seconds."""
    rays = sum((half.rays for half in halves), survey.rays)
    return Report(
        seconds={"total": clock.elapsed, **clock.seconds},
        patches=len(patches),
        rays={"total": sum(rays.values()), **rays},
        iterations=max((h.solution.iterations for h in halves), default=0),
        threads=survey.workers.threads,
        estimated_error=light.error.as_dict(),
        energy=mean_energy(halves),
        effects=list(plan.effects),
        objects=[
            {"name": o.name, "attribute": "", "triangles": len(o.triangles), "corners": 3 * len(o.triangles)}
            for o in objects
        ],
        vertices={
            "all": survey.receivers.vertices,
            "filled": int(np.count_nonzero(light.filled)),
            "hidden": int(np.count_nonzero(light.hidden)),
        },
        peak_memory_mb=peak_memory_mb(),
        warnings=[
            *plan.scene.warnings,
            *_warnings(settings, light, survey, clock.elapsed, sum(len(o.triangles) for o in objects)),
        ],
    )


def mean_energy(halves: tuple[Transport, ...], channels: Float64 | float = 1.0 / 3.0) -> dict[str, float]:
    """The ledger of the light that both halves found, W, as Transport.energy tells it."""
    ledgers = [half.energy(channels) for half in halves]
    names = ("emitted", "absorbed", "escaped", "residual")
    return {name: sum(ledger[name] for ledger in ledgers) / max(len(ledgers), 1) for name in names}


def _warnings(settings: Settings, light: Light, survey: Survey, seconds: float, triangles: int) -> list[str]:
    warnings = []
    total = light.error.total
    if survey.missed_sky > 0.0 and light.error.transport > 0.99:
        warnings.append(
            "No light is found: the world shines, but no ray from the baked objects has left the scene. If there is an "
            "opening, place an area lamp in it, facing inward, and switch on its Portal."
        )
    elif 1.0 < total < np.inf:
        warnings.append(
            "The estimated error is larger than the light itself: a few places are far brighter than all others, as "
            "where a lamp touches a surface. The Error layer shows where; there only much smaller triangles help, or "
            "moving the lamp away."
        )
    elif settings.error is not None and np.inf > total > 1.1 * settings.error:
        cause = max(("sampling", "transport", "resolution"), key=lambda name: getattr(light.error, name))
        remedy = {
            "sampling": "allow more time, or ask for a smaller error, which makes all that is sampled finer",
            "transport": "ask for a smaller error, which makes the patches finer",
            "resolution": "use more and smaller triangles"
            if settings.tessellate
            else "subdivide the mesh, or do not keep it",
        }[cause]
        warnings.append(
            f"The estimated error is {total:.1%}, more than the {settings.error:.1%} asked for; most of it "
            f"is {cause}: {remedy}."
        )
    if settings.seconds is not None and seconds > 1.1 * settings.seconds:
        warnings.append(
            f"The bake took {seconds:.1f} s, more than the {settings.seconds:.1f} s asked for: {triangles:,} triangles "
            "take that long even with few rays. Allow more time, or simplify the meshes or bake fewer objects."
        )
    return warnings


def peak_memory_mb() -> float:
    """The most memory this process has held so far, in MB; 0 where the system does not tell."""
    try:
        import resource  # noqa: PLC0415 - Windows has no such module
    except ImportError:
        return 0.0
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / 1e6 if sys.platform == "darwin" else peak * 1024 / 1e6
