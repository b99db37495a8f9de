"""Measures the scenes of the benchmark and the samples, all or those named: their rows in docs/vertex_colours.md."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from ..bench.scenes import SAMPLES, SCENES
from .measure import Measured, Scale, measure

DOCS = Path(__file__).resolve().parents[1]
ALL = [*SCENES, *SAMPLES]
CACHE = DOCS.parent / "build" / "bench"
BEGIN, END = "<!-- measured -->\n", "<!-- end -->\n"
_HEAD = ["scene", "triangles that follow the light", "a bake", "converged", "even triangles", "converged", "best fit",
         "Cycles converged", "even triangles", "converged"]  # fmt: skip


def document(text: str, measured: Sequence[Measured]) -> str:
    """The document with the rows of the measured scenes renewed; all other words stay."""
    head, _, rest = text.partition(BEGIN)
    table, _, tail = rest.partition(END)
    rows = {line.split(" | ")[0].removeprefix("| "): line for line in table.splitlines()[2:]}
    rows |= {one.scene: f"| {' | '.join(_cells(one))} |" for one in measured}
    lines = [f"| {' | '.join(_HEAD)} |", f"| --- |{' ---: |' * (len(_HEAD) - 1)}"]
    lines += [rows[name] for name in ALL if name in rows]
    return f"{head}{BEGIN}" + "".join(f"{line}\n" for line in lines) + f"{END}{tail}"


def _cells(one: Measured) -> list[str]:
    return [one.scene, f"{one.triangles:,}", f"{one.single:.2%}", str(one.followed), f"{one.even_triangles:,}",
            str(one.even), str(one.best), str(one.cycles), f"{one.finer_triangles:,}", str(one.finer)]  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(prog="make colours", description=__doc__)
    parser.add_argument("scenes", nargs="*", choices=[*ALL, []], help="measure these; else all")
    report = DOCS / "vertex_colours.md"
    for name in parser.parse_args().scenes or ALL:
        one = measure(name, Scale(), CACHE)
        print(" | ".join(_cells(one)), flush=True)
        report.write_text(document(report.read_text(encoding="utf-8"), [one]), encoding="utf-8")


if __name__ == "__main__":
    main()
