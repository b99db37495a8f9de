"""What the ladder measured, for people and programs: a CSV, a table with its reading, and a plot."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from ..core.ladder import Clock, Step, frontier, knee
from .accuracy import Asked, Reference

#: Stated over true error may lie between these to be called honest.
HONEST = (0.7, 1.5)

_COLUMNS = (
    ("", "left"),
    ("series", "left"),
    ("setting", "left"),
    ("triangles", "right"),
    ("patches", "right"),
    ("Mrays", "right"),
    ("seconds", "right"),
    ("processor s", "right"),
    ("surface error", "right"),
    ("typical", "right"),
    ("dark points too", "right"),
    ("bias", "right"),
    ("stated", "right"),
    ("stated / true", "right"),
)


def write_csv(path: Path, steps: Sequence[Step]) -> None:
    """One line a step, every figure in full; errors as fractions."""
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, fieldnames=[*asdict(steps[0]), "honesty"], lineterminator="\n")
        writer.writeheader()
        for step in steps:
            writer.writerow({**asdict(step), "honesty": step.honesty})


def markdown(asked: Asked, reference: Reference, steps: Sequence[Step], clock: Clock) -> str:
    """The reading in a few sentences, and the table."""
    return f"# Accuracy of {asked.path.name}\n\n{_reading(asked, reference, steps, clock)}\n{_table(steps, clock)}"


def _reading(asked: Asked, reference: Reference, steps: Sequence[Step], clock: Clock) -> str:
    dark = 1.0 - reference.visible.mean()
    paths = f"3 x {asked.samples:,} paths of Cycles each"
    lines = [
        f"Reference: {asked.points:,} points, {paths}, noise {reference.noise:.2%}; {dark:.1%} get no light.",
        "Errors are relative to the mean radiance. Seconds include reading from and writing to Blender.",
    ]
    front = frontier(steps, clock=clock)
    turn = knee(front, clock=clock)
    if turn is not None:
        lines.append(
            f"The knee: {turn.series}, {turn.label}, with {turn.surface_error:.2%} in {getattr(turn, clock):.1f} s. "
            "Beyond it, more time buys little."
        )
    lines += [_against(step, steps, clock) for step in steps if step.series == "Cycles"]
    stated = [step.honesty for step in steps if step.honesty is not None]
    if stated:
        honest = sum(HONEST[0] <= ratio <= HONEST[1] for ratio in stated)
        lines.append(
            f"Stated over true error: {honest} of {len(stated)} within {HONEST[0]} to {HONEST[1]}, "
            f"smallest {min(stated):.2f}, largest {max(stated):.2f}."
        )
    return "".join(f"- {line}\n" for line in lines)


def _against(rival: Step, steps: Sequence[Step], clock: Clock) -> str:
    """How much sooner than Cycles a bake is at least as good, by both errors."""
    took = getattr(rival, clock)
    compared = []
    for measure in ("surface_error", "typical_error"):
        error = getattr(rival, measure)
        as_good = [getattr(s, clock) for s in steps if s.series != "Cycles" and getattr(s, measure) <= error]
        here = (
            f"takes {min(as_good):.1f} s here, {took / min(as_good):.2g} times as fast"
            if as_good
            else "is not reached here"
        )
        compared.append(f"its {measure.replace('_', ' ')} of {error:.2%} {here}")
    return f"Cycles at {rival.label} takes {took:.1f} s on the same mesh: {'; '.join(compared)}."


def _table(steps: Sequence[Step], clock: Clock) -> str:
    best = frontier(steps, clock=clock)
    turn = knee(best, clock=clock)
    header = [name for name, _ in _COLUMNS]
    rule = ["---:" if side == "right" else "---" for _, side in _COLUMNS]
    rows = [_row(step, "knee" if step is turn else "best" if step in best else "") for step in steps]
    return "".join(f"| {' | '.join(cells)} |\n" for cells in [header, rule, *rows])


def _row(step: Step, mark: str) -> list[str]:
    stated = "" if step.estimated_error is None else percent(step.estimated_error)
    return [
        mark,
        step.series,
        step.label,
        f"{step.triangles:,}",
        f"{step.patches:,}" if step.patches else "",
        f"{step.rays / 1e6:.2f}" if step.rays else "",
        f"{step.seconds:.2f}",
        f"{step.processor_seconds:.2f}",
        f"{percent(step.surface_error)} ± {percent(step.uncertainty)}",
        percent(step.typical_error),
        f"{percent(step.everywhere_surface_error)}, {percent(step.everywhere_typical_error)}",
        percent(step.bias, "+"),
        stated,
        "" if step.honesty is None else f"{step.honesty:.2f}",
    ]


def percent(share: float, sign: str = "") -> str:
    """With two digits after the point; what has diverged only by its magnitude."""
    return f"{share:{sign}.2%}" if abs(share) < 10.0 else f"{100.0 * share:{sign}.0e} %"
