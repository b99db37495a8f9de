"""Runs the benchmark and writes its tables into docs/speed.md and all figures into build/bench/bench.json.

Without arguments everything, in about half an hour on two idle cores; the words around the tables stay as they were.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ...core.comparison import reference_noise
from ...core.parallel import thread_count
from ...core.plan import choose_effort
from ...core.settings import Settings
from .measure import Run, bake_often, bake_with_noise, cycles_runs, make_reference
from .scenes import SCENES

DOCS = Path(__file__).resolve().parents[1]
FOLDER = DOCS.parent / "build" / "bench"
BEGIN, END = "<!-- measured -->\n", "<!-- end -->\n"
#: What a stated error may be, relative to the true one.
HONEST = (0.7, 1.5)


@dataclass(frozen=True)
class Scale:
    """triangles of the even meshes that Cycles bakes too, and of those that follow the light, at most; asked errors;
    samples of Cycles; points of the reference and its paths; sizes of the growth; patches of the original scheme; how
    many times short bakes are measured."""

    even: int
    triangles: int
    errors: tuple[float, ...]
    cycles: tuple[int, ...]
    points: int
    paths: int
    sizes: tuple[int, ...]
    patches: tuple[int, ...]
    times: int


FULL = Scale(
    even=20_000,
    triangles=12_000,
    errors=(0.2, 0.1, 0.05, 0.03, 0.02, 0.01),
    cycles=(16, 64, 256),
    points=2_000,
    paths=256,
    sizes=(1_000, 10_000, 100_000, 1_000_000),
    patches=(1_000, 3_000, 10_000),
    times=3,
)
QUICK = Scale(
    even=400,
    triangles=500,
    errors=(0.2, 0.1),
    cycles=(1, 4),
    points=100,
    paths=16,
    sizes=(500, 1_000),
    patches=(100, 300),
    times=1,
)
#: Where growth is measured, and the original scheme: in a closed scene the light of its rows would grow for ever.
_GROWING, _OPEN = "doorway", "cornell_box"


@dataclass(frozen=True, eq=False)
class Beside:
    """Bakes of one scene: of even meshes, that are kept, and of meshes that follow the light, at each asked error; and
    Cycles' on the even meshes. reference_noise: of both kinds."""

    reference_noise: tuple[float, float]
    kept: list[Run]
    own: list[Run]
    cycles: list[Run]


def against_cycles(name: str, scale: Scale, threads: int) -> Beside:
    """One scene in all ways."""
    even = make_reference(name, scale.points, scale.paths, FOLDER, scale.even)
    kept, own = [], []
    for error in scale.errors:
        settings = Settings(tessellate=False, triangles=scale.even, error=error, threads=threads)
        baked = bake_with_noise(name, f"{error:.0%} asked, even", settings, even, scale.times)
        kept.append(baked.run)
        _say(name, baked.run)
    rivals = cycles_runs(baked, scale.cycles, even, threads, scale.times)
    for run in rivals:
        _say(f"{name}, Cycles", run)
    modelled = make_reference(name, scale.points, scale.paths, FOLDER)
    for error in scale.errors:
        settings = Settings(triangles=scale.triangles, error=error, threads=threads)
        own.append(bake_often(name, f"{error:.0%} asked", settings, modelled, scale.times).run)
        _say(name, own[-1])
    noise = [reference_noise(reference.radiance[reference.visible]) for reference in (even, modelled)]
    return Beside((noise[0], noise[1]), kept, own, rivals)


def growth(scale: Scale, threads: int) -> Iterator[Run]:
    """The same scene modelled with more and more triangles of its own, all of them kept, at 5 %."""
    for size in scale.sizes:
        settings = Settings(tessellate=False, triangles=size, error=0.05, threads=threads)
        run = bake_often(_GROWING, f"{size:,} asked", settings, None, scale.times).run
        _say("growth", run)
        yield run


def original_scheme(scale: Scale, threads: int) -> Iterator[Run]:
    """Centroid form factors and plain shooting, beside the hemisphere at as many patches."""
    reference = make_reference(_OPEN, scale.points, scale.paths, FOLDER)
    for patches in scale.patches:
        for estimator in ("centroid", "hemisphere"):
            asked = Settings(triangles=scale.triangles, error=None, estimator=estimator, threads=threads)
            effort = replace(choose_effort(reference.scene, asked), patches=patches)
            run = bake_often(_OPEN, f"{estimator}, {patches:,} patches", asked, reference, scale.times, effort).run
            _say("original scheme", run)
            yield run


def sooner(ours: Sequence[Run], rival: Run, measure: str) -> float:
    """How many times as long the rival takes as our fastest bake that is at least as good; nan when none is."""
    good = [run.seconds for run in ours if getattr(run, measure) <= getattr(rival, measure)]
    return rival.seconds / min(good) if good else float("nan")


def report(results: dict[str, Any]) -> str:
    """The tables of docs/speed.md."""
    threads = results["threads"]
    text = f"On {threads} threads.\n"
    if results["scenes"]:
        text += "\n### Against Cycles: how many times as fast\n\n" + _table(*_ratios(results["scenes"]))
        text += "\n### Every bake\n\n" + _table(*_runs(results["scenes"], threads))
        text += "\n" + _honesty(results["scenes"])
    if results["growth"]:
        text += "\n### Growth\n\n" + _table(*_growth(results["growth"], threads)) + "\n" + _exponent(results["growth"])
    if results["original"]:
        text += "\n### The original scheme\n\n" + _table(*_original(results["original"]))
    return text


def _ratios(scenes: dict[str, Beside]) -> tuple[list[str], list[list[str]]]:
    head: list[str] = []
    rows: list[list[str]] = []
    every: list[list[float]] = []
    for name, beside in scenes.items():
        wins = [(f"noise of {rival.name}", sooner(beside.kept, rival, "noise")) for rival in beside.cycles]
        wins += [(f"error of {rival.name}", sooner(beside.kept, rival, "surface")) for rival in beside.cycles]
        wins += [(f"error, own triangles, of {r.name}", sooner(beside.own, r, "surface")) for r in beside.cycles]
        every.append([win for _, win in wins])
        rows.append([_plain(name), f"{beside.cycles[0].triangles:,}", *(_times(win) for win in every[-1])])
        head = ["scene", "triangles", *(title for title, _ in wins)]
    # None as good is the slowest there can be: it counts as zero.
    rows.append(["**median**", "", *(_times(win) for win in np.median(np.nan_to_num(every), axis=0))])
    return head, rows


def _runs(scenes: dict[str, Beside], threads: int) -> tuple[list[str], list[list[str]]]:
    head = ["scene", "bake", "triangles", "patches", "Mrays", "seconds", "processor s", "of Embree alone",
            "predicted s", "noise", "surface error", "typical", "bias", "stated", "stated / true"]  # fmt: skip
    rows = []
    for name, beside in scenes.items():
        rows += [_our_row(_plain(name), run, threads) for run in [*beside.kept, *beside.own]]
        rows += [_rival_row(_plain(name), run) for run in beside.cycles]
    return head, rows


def _our_row(scene: str, run: Run, threads: int) -> list[str]:
    return [
        scene, run.name, f"{run.triangles:,}", f"{run.patches:,}", f"{run.rays['total'] / 1e6:.2f}",
        f"{run.seconds:.2f}", f"{run.processor:.2f}", f"{run.seconds * threads / run.embree:.1f} x",
        f"{run.predicted:.2f}", "" if np.isnan(run.noise) else f"{run.noise:.2%}", f"{run.surface:.2%}",
        f"{run.typical:.2%}", f"{run.bias:+.2%}", f"{run.stated:.2%}", f"{_honest(run):.2f}" if run.surface else "",
    ]  # fmt: skip


def _rival_row(scene: str, run: Run) -> list[str]:
    return [
        scene, f"Cycles, {run.name}", f"{run.triangles:,}", "", "", f"{run.seconds:.2f}", f"{run.processor:.2f}", "",
        "", f"{run.noise:.2%}", f"{run.surface:.2%}", f"{run.typical:.2%}", f"{run.bias:+.2%}", "", "",
    ]  # fmt: skip


def _honest(run: Run) -> float:
    return run.stated / run.surface


def _honesty(scenes: dict[str, Beside]) -> str:
    ours = [run for beside in scenes.values() for run in [*beside.kept, *beside.own]]
    # An error of zero is one that the noise of the reference hides.
    ratios, off = [_honest(run) for run in ours if run.surface], [run.predicted / run.seconds for run in ours]
    within = sum(HONEST[0] <= ratio <= HONEST[1] for ratio in ratios)
    good = sum(1 / 1.5 <= ratio <= 1.5 for ratio in off)
    return (
        f"Stated over true error: {within} of {len(ratios)} within {HONEST[0]} to {HONEST[1]}, smallest "
        f"{min(ratios):.2f}, largest {max(ratios):.2f}. Predicted over actual seconds: {good} of {len(off)} within a "
        f"factor of 1.5, smallest {min(off):.2f}, largest {max(off):.2f}.\n"
    )


def _growth(runs: Sequence[Run], threads: int) -> tuple[list[str], list[list[str]]]:
    head = [
        "triangles",
        "seconds",
        "predicted s",
        "of Embree alone",
        "stated error",
        "peak MB",
        "of it the bake's",
        "predicted",
        "Mrays",
    ]
    return head, [
        [f"{run.triangles:,}", f"{run.seconds:.2f}", f"{run.predicted:.2f}",
         f"{run.seconds * threads / run.embree:.1f} x", f"{run.stated:.2%}", f"{run.peak_mb:,.0f}",
         f"{run.added_mb:,.0f}", f"{run.predicted_mb:,.0f}", f"{run.rays['total'] / 1e6:.1f}"]
        for run in runs
    ]  # fmt: skip


def _exponent(runs: Sequence[Run]) -> str:
    count, seconds = (np.log([getattr(run, name) for run in runs]) for name in ("triangles", "seconds"))
    return f"Seconds grow as the number of triangles to the power of {np.polyfit(count, seconds, 1)[0]:.2f}.\n"


def _original(runs: Sequence[Run]) -> tuple[list[str], list[list[str]]]:
    return ["bake", "patches", "seconds", "surface error", "typical", "bias", "stated"], [
        [run.name, f"{run.patches:,}", f"{run.seconds:.2f}", f"{run.surface:.2%}", f"{run.typical:.2%}",
         f"{run.bias:+.2%}", f"{run.stated:.2%}"]
        for run in runs
    ]  # fmt: skip


def _table(head: list[str], rows: list[list[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "".join(f"| {' | '.join(cells)} |\n" for cells in lines)


def _times(win: float) -> str:
    return f"{win:.3g}" if win > 0.0 else ""


def _plain(name: str) -> str:
    return name.replace("_", " ").capitalize()


def _say(where: str, run: Run) -> None:
    print(
        f"{where}: {run.name}, {run.triangles:,} triangles, {run.seconds:.2f} s, noise {run.noise:.2%}, surface error "
        f"{run.surface:.2%}, stated {run.stated:.2%}",
        flush=True,
    )


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="make bench", description=__doc__)
    parser.add_argument("scenes", nargs="*", choices=[*SCENES, []], help="measure these against Cycles; else all")
    parser.add_argument("--parts", default="growth,scenes,original", help="what to measure, with commas between")
    parser.add_argument("--threads", type=int, default=0)
    parser.add_argument("--quick", action="store_true", help="a few seconds of everything, to see that it works")
    parser.add_argument("--tables", action="store_true", help="only write the tables of the last run anew")
    parser.add_argument("--output", type=Path, help="where the tables go; docs/speed.md by default")
    asked = parser.parse_args(arguments)
    if asked.tables:
        _write(_read(), asked.output or DOCS / "speed.md")
        return 0
    scale, parts = QUICK if asked.quick else FULL, asked.parts.split(",")
    results: dict[str, Any] = {"threads": thread_count(asked.threads)}
    results["growth"] = list(growth(scale, asked.threads)) if "growth" in parts else []
    names = asked.scenes or list(SCENES) if "scenes" in parts else []
    results["scenes"] = {name: against_cycles(name, scale, asked.threads) for name in names}
    results["original"] = list(original_scheme(scale, asked.threads)) if "original" in parts else []
    _write(results, asked.output or DOCS / "speed.md")
    return 0


def _write(results: dict[str, Any], document: Path) -> None:
    """The tables into the document, between the two marks; the figures into a JSON file."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    plain = {
        **results,
        "growth": [asdict(run) for run in results["growth"]],
        "original": [asdict(run) for run in results["original"]],
        "scenes": {name: asdict(beside) for name, beside in results["scenes"].items()},
    }
    (FOLDER / "bench.json").write_text(json.dumps(plain, indent=1), encoding="utf-8")
    before = document.read_text(encoding="utf-8") if document.exists() else f"# Speed\n\n{BEGIN}{END}"
    head, _, rest = before.partition(BEGIN)
    document.write_text(f"{head}{BEGIN}{report(results)}{END}{rest.partition(END)[2]}", encoding="utf-8")


def _read() -> dict[str, Any]:
    """What the last run has measured."""
    plain = json.loads((FOLDER / "bench.json").read_text(encoding="utf-8"))
    runs = {part: [Run(**run) for run in plain[part]] for part in ("growth", "original")}
    scenes = {
        name: Beside(
            tuple(beside["reference_noise"]),
            *([Run(**run) for run in beside[kind]] for kind in ("kept", "own", "cycles")),
        )
        for name, beside in plain["scenes"].items()
    }
    return {"threads": plain["threads"], **runs, "scenes": scenes}


if __name__ == "__main__":
    sys.exit(main())
