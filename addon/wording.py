"""What a bake did, in words: for the panel, the status bar and the command line.

Each function takes a report as `core.result.Report.as_dict` gives it.
"""

from typing import Any


def summary(report: dict[str, Any]) -> str:
    """What a bake did and how good it is, in one line."""
    error = report["estimated_error"].get("total")
    quality = "" if error is None else f", estimated error {percent(error)}"
    return f"Baked {what_was_baked(report)}{quality}"


def what_was_baked(report: dict[str, Any]) -> str:
    objects = report["objects"]
    triangles = sum(entry["triangles"] for entry in objects)
    return f"{count('object', len(objects))}, {triangles:,} triangles in {report['seconds']['total']:.1f} s"


def error_lines(report: dict[str, Any]) -> list[str]:
    """The stated error, and the three causes it comes from."""
    error = report["estimated_error"]
    if "total" not in error:
        return []
    causes = [f"{cause} {percent(share)}" for cause, share in error_causes(report)]
    return [f"Estimated error {percent(error['total'])}: {', '.join(causes)}"]


def error_causes(report: dict[str, Any]) -> list[tuple[str, float]]:
    """The parts of the stated error, each a share of the mean light."""
    error = report["estimated_error"]
    return [(cause, error[cause]) for cause in ("sampling", "transport", "resolution") if cause in error]


def energy_line(report: dict[str, Any]) -> str:
    """The energy ledger in words; empty where no light was given off."""
    energy = report["energy"]
    if not energy.get("emitted"):
        return ""
    emitted, absorbed, escaped, residual = (
        watts(energy[name]) for name in ("emitted", "absorbed", "escaped", "residual")
    )
    return f"Of {emitted} given off, {absorbed} were absorbed and {escaped} escaped; {residual} are not accounted for"


def count(noun: str, number: int) -> str:
    return f"{number} {noun}" if number == 1 else f"{number:,} {noun}s"


def percent(share: float) -> str:
    return f"{100.0 * share:.1f} %"


def watts(power: float) -> str:
    """With a space that does not break, since the panel wraps the line it stands in."""
    return f"{power:.3g}\N{NO-BREAK SPACE}W"


def clock(seconds: float) -> str:
    return f"{int(seconds) // 60}:{int(seconds) % 60:02d}"
