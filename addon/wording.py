"""What a bake does and did, in words: for the panel, the status bar and the command line.

A report is what `core.result.Report.as_dict` gives.
"""

from typing import Any

from bpy.app.translations import pgettext_iface as tr

from .job import BakeJob


def summary(report: dict[str, Any]) -> str:
    """What a bake did and how good it is, in one line."""
    error = report["estimated_error"].get("total")
    baked = what_was_baked(report)
    return baked if error is None else tr("{baked}, estimated error {error}").format(baked=baked, error=percent(error))


def what_was_baked(report: dict[str, Any]) -> str:
    objects = report["objects"]
    return tr("Baked {objects}, {triangles} in {seconds} s").format(
        objects=count("object", len(objects)),
        triangles=count("triangle", sum(entry["triangles"] for entry in objects)),
        seconds=f"{report['seconds']['total']:.1f}",
    )


def error_lines(report: dict[str, Any]) -> list[str]:
    """The stated error, and the three causes it comes from."""
    error = report["estimated_error"]
    if "total" not in error:
        return []
    causes = ", ".join(f"{tr(cause)} {percent(share)}" for cause, share in error_causes(report))
    return [tr("Estimated error {error}: {causes}").format(error=percent(error["total"]), causes=causes)]


def error_causes(report: dict[str, Any]) -> list[tuple[str, float]]:
    """The parts of the stated error, each a share of the mean light."""
    error = report["estimated_error"]
    return [(cause, error[cause]) for cause in ("sampling", "transport", "resolution") if cause in error]


def energy_line(report: dict[str, Any]) -> str:
    """The energy ledger in words; empty where no light was given off."""
    energy = report["energy"]
    if not energy.get("emitted"):
        return ""
    emitted, absorbed, escaped = (watts(energy[name]) for name in ("emitted", "absorbed", "escaped"))
    lost = abs(energy["residual"]) / energy["emitted"]
    unaccounted = percent(lost) if lost >= 0.0005 else tr("less than 0.1 %")
    return tr(
        "Of {emitted} given off, {absorbed} were absorbed and {escaped} escaped; {unaccounted} is not accounted for"
    ).format(emitted=emitted, absorbed=absorbed, escaped=escaped, unaccounted=unaccounted)


def stage(job: BakeJob) -> str:
    """Where a running bake is, short enough for a bar in a narrow panel."""
    if job.cancelling:
        return tr("Cancelling")
    if job.writing:
        return tr("Writing")
    if job.keeping:
        return tr("Keeping")
    if job.poll():
        return tr("Waiting for Object Mode")
    progress = job.progress
    done = f"{tr(progress.stage.capitalize() or 'Starting')} {100.0 * progress.fraction:.0f} %"
    return done if progress.error is None else f"{done}, {tr('error')} {percent(progress.error)}"


def time_line(job: BakeJob) -> str:
    so_far = tr("{time} so far").format(time=clock(job.elapsed))
    if job.remaining is None:
        return so_far
    return f"{so_far}, " + tr("about {time} left").format(time=clock(job.remaining))


def count(noun: str, number: int) -> str:
    return f"{number:,} {tr(noun if number == 1 else f'{noun}s')}"


def percent(share: float) -> str:
    return f"{100.0 * share:.1f} %"


def watts(power: float) -> str:
    """With a space that does not break, since the panel wraps the line it stands in."""
    return f"{power:.3g}\N{NO-BREAK SPACE}W"


def clock(seconds: float) -> str:
    return f"{int(seconds) // 60}:{int(seconds) % 60:02d}"
