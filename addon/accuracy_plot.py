"""The picture of the ladder: true error against seconds.

matplotlib is no part of the extension, so it is asked for only here, and may be missing.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..core.ladder import Clock, Measure, Step, frontier, knee

#: Colour and marker of the first series and of every further one, from Okabe and Ito's palette for all kinds of eyes.
_STYLES = (
    ("#0072b2", "o"),
    ("#56b4e9", "D"),
    ("#009e73", "s"),
    ("#e69f00", "^"),
    ("#cc79a7", "v"),
    ("#8c6bb1", "P"),
    ("#a6761d", "X"),
    ("#4d4d4d", "<"),
    ("#66a61e", ">"),
    ("#f0c000", "h"),
    ("#1f9e9e", "p"),
)
_CYCLES = ("#d0312d", "*")
_AXES: tuple[tuple[Measure, str], ...] = (
    ("surface_error", "Surface error"),
    ("typical_error", "Typical error: without the worst 2 % of the points"),
)
#: Errors above this are off the scale; their marks stand on the upper edge.
_TOP = 3.0
_CLOCKS = {"seconds": "seconds", "processor_seconds": "processor seconds"}


class NoPlotting(Exception):
    """matplotlib is not installed. The message says so."""


def draw(path: Path, title: str, steps: Sequence[Step], clock: Clock) -> None:
    """Write a PNG. Raises NoPlotting without matplotlib."""
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg  # noqa: PLC0415 - only who plots needs it
        from matplotlib.figure import Figure  # noqa: PLC0415
        from matplotlib.ticker import LogLocator  # noqa: PLC0415
    except ImportError as missing:
        raise NoPlotting("No plot was drawn, since matplotlib is not installed.") from missing
    figure = Figure(figsize=(12.5, 6.2), layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    figure.suptitle(title, fontsize=13, fontweight="bold")
    axes = figure.subplots(1, 2)
    for axis, (measure, heading) in zip(axes, _AXES, strict=True):
        _panel(axis, heading, steps, measure, clock)
        for direction in (axis.xaxis, axis.yaxis):
            direction.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=5, frameon=False, fontsize=9)
    figure.savefig(path, format="png", dpi=110, metadata={"Software": None})


def _panel(axis: Any, heading: str, steps: Sequence[Step], measure: Measure, clock: Clock) -> None:
    shown = [step for step in steps if step.measurable and getattr(step, measure) > 0.0]
    best = frontier(shown, measure, clock)
    axis.plot(
        [getattr(s, clock) for s in best],
        [min(getattr(s, measure), _TOP) for s in best],
        color="#222222",
        linewidth=1.2,
        alpha=0.7,
        zorder=1,
        label="frontier: nothing is both faster and better",
    )
    styles = iter(_STYLES)
    for series in dict.fromkeys(step.series for step in steps):
        colour, marker = _CYCLES if series == "Cycles" else next(styles)
        own = [step for step in shown if step.series == series]
        axis.plot(
            [getattr(s, clock) for s in own],
            [min(getattr(s, measure), _TOP) for s in own],
            linestyle=":" if series == "Cycles" else "none",
            color=colour,
            marker=marker,
            markersize=11 if series == "Cycles" else 6.5,
            markeredgecolor="white",
            markeredgewidth=0.7,
            clip_on=False,
            zorder=3,
            label=series,
        )
    _mark_knee(axis, knee(best, measure, clock), measure, clock)
    _logarithmic(axis, clock)
    if any(getattr(step, measure) > _TOP for step in shown):
        axis.set_ylim(top=_TOP)
        axis.annotate("off the scale", (0.99, 0.975), xycoords="axes fraction", fontsize=8, ha="right", va="top")
    axis.set_title(heading, fontsize=10.5, pad=12)
    axis.set_ylabel("true error, relative to the mean radiance")


def _mark_knee(axis: Any, turn: Step | None, measure: Measure, clock: Clock) -> None:
    if turn is None:
        return
    at = (getattr(turn, clock), getattr(turn, measure))
    axis.plot(*at, marker="o", markersize=17, markerfacecolor="none", markeredgecolor="#222222", zorder=4)
    axis.annotate(
        f"knee: {at[1]:.1%} in {at[0]:.1f} s\n{turn.label}",
        at,
        xytext=(0.04, 0.04),
        textcoords="axes fraction",
        fontsize=9,
        arrowprops={"arrowstyle": "-", "color": "#222222", "linewidth": 0.8, "shrinkB": 9},
    )


def _logarithmic(axis: Any, clock: Clock) -> None:
    axis.set_xscale("log")
    axis.set_yscale("log")
    for direction in (axis.xaxis, axis.yaxis):
        direction.set_minor_formatter("")
    axis.xaxis.set_major_formatter(lambda seconds, _: f"{seconds:g}")
    axis.yaxis.set_major_formatter(lambda error, _: f"{100 * error:g} %")
    axis.set_xlabel(_CLOCKS[clock])
    axis.margins(0.12)
    axis.grid(visible=True, which="major", color="#d8d8d8", linewidth=0.8)
    axis.grid(visible=True, which="minor", color="#eeeeee", linewidth=0.5)
    axis.set_axisbelow(True)
    for side in ("top", "right"):
        axis.spines[side].set_visible(False)
