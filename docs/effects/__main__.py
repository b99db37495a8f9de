"""Measures the scenes, all or those named, and renews their rows in docs/effects.md."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from .catalogue import EffectScene, all_scenes
from .measure import FULL, Measured, measure
from .together import table

DOCS = Path(__file__).resolve().parents[1]
CACHE = DOCS.parent / "build" / "effects"
_TOGETHER = """\
## What effects cost together

One stage under a lamp, to which one thing after the other is added, with as many triangles and passes each time: what
each costs alone, and what all down to its row cost, beside the sum of what the parts cost alone. No thing slows down
what has nothing to do with it. Where there are veils, each ray to a lamp looks for what is first in its way, which
takes longer than whether anything is: so a veil costs a little more with more lamps. Seconds are good to a quarter on a
machine that has other work to do; rays are exact.
"""
_HEAD = "| Scene | Simulated | Typical error | Noise of reference | Bias | Processor seconds | Million rays | |"
_RULE = "| --- | --- | ---: | ---: | ---: | ---: | --- | --- |"


def document(text: str, scenes: dict[str, EffectScene], measured: Sequence[Measured], costs: Sequence[str] = ()) -> str:
    """The document with the rows of the measured scenes renewed, kind by kind, and the table of costs if it is given;
    the words before the tables stay."""
    text, _, old = text.partition(_TOGETHER.partition("\n")[0])
    costs = costs or [line for line in old.splitlines() if line.startswith("|")]
    rows = {line.split(" | ")[0].removeprefix("| "): line for line in text.splitlines() if line.startswith("| ")}
    rows |= {one.scene.name: f"| {' | '.join(_cells(one))} |" for one in measured}
    rows = {name: rows[name] for name in scenes if name in rows}
    good = sum(row.endswith("| good |") for row in rows.values())
    words = text.partition("\n## ")[0].partition("\n**Result.**")[0].rstrip()
    parts = [words, f"**Result.** {good} of {len(rows)} scenes are good."]
    for kind in dict.fromkeys(scenes[name].kind for name in rows):
        own = [row for name, row in rows.items() if scenes[name].kind == kind]
        parts.append("\n".join([f"## {kind.replace('_', ' ').capitalize()}\n", _HEAD, _RULE, *own]))
    if costs:
        parts += [_TOGETHER.rstrip(), "\n".join(costs)]
    return "\n\n".join(parts) + "\n"


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
    parser.add_argument(
        "names", nargs="*", metavar="SCENE", help="scenes, kinds of scenes or 'together'; else all of these"
    )
    parser.add_argument("--list", action="store_true", help="only say which scenes there are")
    options = parser.parse_args()
    scenes = all_scenes()
    chosen = [s for s in scenes.values() if not options.names or {s.name, s.kind} & set(options.names)]
    for scene in chosen:
        if options.list:
            print(f"{scene.kind}: {scene.name}")
            continue
        measured = measure(scene, FULL, CACHE)
        print(" | ".join(_cells(measured)), flush=True)
        _renew(scenes, [measured])
    if not options.list and (not options.names or "together" in options.names):
        _renew(scenes, [], list(table()))


def _renew(scenes: dict[str, EffectScene], measured: Sequence[Measured], costs: Sequence[str] = ()) -> None:
    report = DOCS / "effects.md"
    report.write_text(document(report.read_text(encoding="utf-8"), scenes, measured, costs), encoding="utf-8")


if __name__ == "__main__":
    main()
