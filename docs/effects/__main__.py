"""Measures the scenes, all or those named, a line for each, and renews docs/effects.md when all were measured."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from .catalogue import all_scenes
from .measure import FULL, Measured, measure

DOCS = Path(__file__).resolve().parents[1]
CACHE = DOCS.parent / "build" / "effects"
_HEAD = "| Scene | Simulated | Typical error | Noise of reference | Bias | Processor seconds | Million rays | |\n"
_RULE = "| --- | --- | ---: | ---: | ---: | ---: | --- | --- |\n"


def table(measured: Sequence[Measured]) -> str:
    """A row for each scene, kind by kind."""
    text, kind = "", ""
    for one in measured:
        if one.scene.kind != kind:
            kind = one.scene.kind
            text += f"\n## {kind.replace('_', ' ').capitalize()}\n\n{_HEAD}{_RULE}"
        text += f"| {' | '.join(_cells(one))} |\n"
    return text


def _cells(one: Measured) -> list[str]:
    rays = ", ".join(f"{purpose} {count / 1e6:.2f}" for purpose, count in one.rays.items() if purpose != "total")
    return [
        one.scene.name,
        ", ".join(one.active),
        f"{one.typical:.1%}",
        f"{one.noise:.1%}",
        f"{one.bias:+.1%} ± {one.bias_error:.1%}",
        f"{one.seconds:.1f}",
        rays or "none",
        "; ".join(one.complaints()) or "good",
    ]


def main() -> None:
    parser = argparse.ArgumentParser(prog="effects", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="SCENE", help="scenes or kinds of scenes; else all")
    parser.add_argument("--list", action="store_true", help="only say which scenes there are")
    options = parser.parse_args()
    scenes = all_scenes()
    chosen = [s for s in scenes.values() if not options.names or {s.name, s.kind} & set(options.names)]
    measured = []
    for scene in chosen:
        if options.list:
            print(f"{scene.kind}: {scene.name}")
            continue
        measured.append(measure(scene, FULL, CACHE))
        print(" | ".join(_cells(measured[-1])), flush=True)
    if measured and len(chosen) == len(scenes):
        _write(measured)


def _write(measured: Sequence[Measured]) -> None:
    """Put the table where the document has it; what people wrote before it stays."""
    document = DOCS / "effects.md"
    words = document.read_text(encoding="utf-8").partition("\n## ")[0].rstrip()
    good = sum(not one.complaints() for one in measured)
    summary = f"{good} of {len(measured)} scenes are good; the median typical error is {_median(measured):.1%}."
    words = words.partition("\n**Result.**")[0].rstrip()
    document.write_text(f"{words}\n\n**Result.** {summary}\n{table(measured)}", encoding="utf-8")


def _median(measured: Sequence[Measured]) -> float:
    return float(np.median([one.typical for one in measured]))


if __name__ == "__main__":
    main()
