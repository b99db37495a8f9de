"""What the command line can do: bake a file, say what that would take, measure what accuracy costs, and test itself."""

from __future__ import annotations

import argparse
import io
import json
import os
import platform
import shutil
import signal
import sys
import tomllib
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, redirect_stdout
from dataclasses import replace
from pathlib import Path
from typing import NoReturn

import bpy
import numpy as np

from ..core import self_test
from ..core.effects import EFFECTS
from ..core.ladder import QUICK, Scale
from ..core.plan import plan
from ..core.progress import Cancelled, Progress
from ..core.result import Report
from ..core.scene import SceneError
from ..core.settings import LAYERS, Settings
from . import accuracy_plot, accuracy_report, properties, wording
from .accuracy import Asked, measure
from .bake_scene import bake_frames, bake_objects, frame_attribute
from .colour_storage import DataType, Domain, Storage
from .preview import render_preview
from .scene_reader import pick_receivers, read_scene

SUCCESS, FAILED, UNUSABLE, INTERRUPTED = 0, 1, 2, 130

#: Triangles of the middle of the accuracy ladder.
_TRIANGLES = 20_000

#: Names of where and how attributes hold colours.
_DOMAINS: dict[str, Domain] = {"corner": "CORNER", "point": "POINT"}
_DATA_TYPES: dict[str, DataType] = {"float": "FLOAT_COLOR", "byte": "BYTE_COLOR"}

MANIFEST = Path(__file__).resolve().parent.parent / "blender_manifest.toml"


class SelfTestError(Exception):
    """A closed form came out wrong. The message says how many, and what to do."""


class FileError(Exception):
    """A file cannot be read or written as asked. The message names it and the remedy."""


def run(arguments: Sequence[str]) -> int:
    """Parse and run one command line. Returns the exit code; problems have been printed to stderr."""
    try:
        options = _parser().parse_args(arguments)
    except SystemExit as stop:  # argparse has said what it has to say; Blender must not quit half-way for it
        return int(stop.code or SUCCESS)
    progress = Progress() if options.quiet else PrintedProgress()
    try:
        with _interruptible(progress), properties.known():
            options.command(options, progress)
    except (FileError, SceneError) as problem:
        print(f"radiosity-baker: {problem}", file=sys.stderr)
        return UNUSABLE
    except SelfTestError as problem:
        print(f"radiosity-baker: {problem}", file=sys.stderr)
        return FAILED
    except (Cancelled, KeyboardInterrupt):
        print("radiosity-baker: Interrupted; nothing was written.", file=sys.stderr)
        return INTERRUPTED
    return SUCCESS


class PrintedProgress(Progress):
    """Prints a line when a stage begins, and within a stage at every tenth of the bake."""

    def __init__(self) -> None:
        super().__init__()
        self._printed: tuple[str, int] | None = None

    def report(self, stage: str, fraction: float, error: float | None = None, until: float | None = None) -> None:
        super().report(stage, fraction, error, until)
        step = (stage, int(10 * fraction))
        if step != self._printed:
            self._printed = step
            quality = "" if self.error is None else f", estimated error {wording.percent(self.error)}"
            print(f"{fraction:4.0%}  {stage}{quality}", flush=True)


def _bake(options: argparse.Namespace, progress: Progress) -> None:
    """Bake a file into another one. Nothing is written before all of it is there."""
    _check_destinations([path for path in (options.output, options.report, options.preview) if path is not None])
    source = _open(options.input)
    compress = _is_compressed(source)
    receivers = pick_receivers(bpy.context.scene, bpy.context.view_layer, options.objects)
    how = {
        "result_mode": options.result,
        "attribute": options.attribute,
        "storage": Storage(_DOMAINS[options.domain], _DATA_TYPES[options.type], options.exposure),
        "progress": progress,
    }
    shown = options.attribute
    if options.frames:
        result, baked = bake_frames(bpy.context, receivers, _settings(options), options.frames, **how)
        shown = frame_attribute(options.attribute, options.frames[0])
    else:
        result, baked = bake_objects(bpy.context, receivers, _settings(options), **how)
    result.report.version = _version()
    with ExitStack() as unfinished:
        # Entered first, moved into place last: whoever sees the .blend finds the report and the preview beside it.
        blend = unfinished.enter_context(_moved_into_place(options.output))
        if options.report is not None:
            _write_report(unfinished.enter_context(_moved_into_place(options.report)), result.report)
        _save(blend, compress=compress)
        if options.preview is not None:
            picture = unfinished.enter_context(_moved_into_place(options.preview))
            render_preview(bpy.context.scene, baked, picture, attribute=shown)
        progress.check()
        if options.output.exists() and options.output.samefile(source):
            shutil.copy2(source, f"{source}1")  # Blender's own habit when it saves over a file
    _say_what_was_done(result.report, quiet=options.quiet)


def _plan(options: argparse.Namespace, progress: Progress) -> None:
    """Say which effects a bake would simulate and why, and what it would cost."""
    _open(options.input)
    receivers = pick_receivers(bpy.context.scene, bpy.context.view_layer, options.objects)
    settings = _settings(options)
    scene, _ = read_scene(bpy.context.evaluated_depsgraph_get(), receivers, tessellate=settings.tessellate)
    progress.check()
    outlook = plan(scene, settings)
    for effect in outlook.effects:
        cost = f" (about {outlook.costs[effect.name]:.2f} s)" if effect.name in outlook.costs else ""
        print(f"{'on ' if effect.active else 'off'}  {effect.name}: {effect.reason}{cost}")
    for warning in scene.warnings:
        print(f"radiosity-baker: warning: {warning}", file=sys.stderr)
    print(f"About {outlook.seconds:.1f} s and {outlook.memory_mb:,.0f} MB.")


def _accuracy(options: argparse.Namespace, progress: Progress) -> None:
    """Bake a file at many efforts and by Cycles, and write how wrong each was: ladder.csv, ladder.md and ladder.png.

    The file itself stays as it is. True light is computed once by Cycles and kept in the output folder.
    """
    path = options.input or _open(None)
    folder = options.output or path.with_name(f"{path.stem}-accuracy")
    _check_destinations([folder / "ladder.csv"] if folder.exists() else [folder])

    def open_receivers() -> list[bpy.types.Object]:
        _open(path)
        return pick_receivers(bpy.context.scene, bpy.context.view_layer, options.objects)

    def say(line: str) -> None:
        if not options.quiet:
            print(line, flush=True)

    open_receivers()  # so that a file that cannot be used leaves no folder behind
    folder.mkdir(exist_ok=True)
    scale, few = (QUICK, True) if options.quick else (Scale(_TRIANGLES), False)
    asked = Asked(
        path,
        folder,
        replace(scale, triangles=options.triangles or scale.triangles),
        Settings(seed=options.seed, threads=options.threads),
        points=options.points or (1_000 if few else 4_000),
        samples=options.samples or (64 if few else 512),
    )
    reference, steps = measure(asked, open_receivers, progress, say)
    clock = "processor_seconds" if options.processor_time else "seconds"
    table = accuracy_report.markdown(asked, reference, steps, clock)
    with ExitStack() as unfinished:
        names = ("ladder.csv", "ladder.md")
        figures, report = (unfinished.enter_context(_moved_into_place(folder / name)) for name in names)
        accuracy_report.write_csv(figures, steps)
        report.write_text(table, encoding="utf-8")
        progress.check()
    try:
        with _moved_into_place(folder / "ladder.png") as picture:
            accuracy_plot.draw(picture, f"What accuracy costs in {path.name}", steps, clock)
    except accuracy_plot.NoPlotting as problem:
        say(str(problem))
    say(f"\n{table}\nWritten to {folder}.")


def _self_test(options: argparse.Namespace, progress: Progress) -> None:
    """Compute what is known in closed form, in this Blender on this machine, and say how far off each came out."""
    outcomes = []

    def remember() -> Iterator[self_test.Outcome]:
        for outcome in self_test.run_all(progress):
            outcomes.append(outcome)
            yield outcome

    for line in self_test.table(remember()):
        if not options.quiet:
            print(line, flush=True)
    failed = sum(not outcome.passed for outcome in outcomes)
    where = (
        f"Radiosity Baker {_version()}, Blender {bpy.app.version_string}, Python {platform.python_version()}, "
        f"numpy {np.__version__}, {platform.platform()}"
    )
    if failed:
        raise SelfTestError(
            f"{failed} of {len(outcomes)} closed forms came out wrong: do not trust bakes made here, and report this "
            f"table with this line. {where}."
        )
    if not options.quiet:
        print(f"All {len(outcomes)} closed forms came out right. {where}.")


def _say_what_was_done(report: Report, *, quiet: bool) -> None:
    facts = report.as_dict()
    for warning in report.warnings:
        print(f"radiosity-baker: warning: {warning}", file=sys.stderr)
    if not quiet:
        print(". ".join([wording.what_was_baked(facts), *wording.error_lines(facts)]) + ".")


def _settings(options: argparse.Namespace) -> Settings:
    asked = {"seconds": options.seconds, "error": None} if options.seconds else {"error": options.error}
    return Settings(
        tessellate=options.result != "keep",
        size=options.size,
        triangles=options.triangles,
        seed=options.seed,
        threads=options.threads,
        layers=options.layers,
        effects=dict.fromkeys(options.with_, True) | dict.fromkeys(options.without, False),
        **asked,
    )


def _open(path: Path | None) -> Path:
    """Load a .blend without running what scripts it holds, or take the one Blender has open; the file's path."""
    if path is None:
        if not bpy.data.filepath:
            raise FileError("No file to bake: give the .blend file after the command.")
        return Path(bpy.data.filepath)
    if not path.is_file():
        raise FileError(f"{path} is not there: check the path of the .blend file.")
    try:
        bpy.ops.wm.open_mainfile(filepath=str(path), load_ui=False, use_scripts=False)
    except RuntimeError as problem:
        reason = str(problem).strip().removeprefix("Error: ")
        raise FileError(
            f"{path} cannot be read by Blender {bpy.app.version_string}: "
            f"check that it is a Blender file, and not one of a newer version. ({reason})"
        ) from problem
    return path


def _version() -> str:
    return tomllib.loads(MANIFEST.read_text(encoding="utf-8"))["version"]


def _is_compressed(path: Path) -> bool:
    with path.open("rb") as file:
        return file.read(7) != b"BLENDER"


def _check_destinations(paths: Sequence[Path]) -> None:
    for path in paths:
        if not path.parent.is_dir():
            raise FileError(f"The folder {path.parent} is not there: create it, or write {path.name} somewhere else.")
        if path.is_dir():
            raise FileError(f"{path} is a folder: add a file name.")
        if not os.access(path.parent, os.W_OK):
            raise FileError(f"The folder {path.parent} cannot be written to: write {path.name} somewhere else.")


@contextmanager
def _moved_into_place(path: Path) -> Iterator[Path]:
    """A temporary name beside `path`, which takes the place of `path` when the block ends well and goes when not."""
    temporary = path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")
    try:
        yield temporary
        temporary.replace(path)
    except OSError as problem:
        reason = problem.strerror or problem
        raise FileError(
            f"{path} cannot be written ({reason}): is the disk full, or the file open in another program?"
        ) from problem
    finally:
        temporary.unlink(missing_ok=True)


def _save(path: Path, *, compress: bool) -> None:
    try:
        with redirect_stdout(io.StringIO()):  # Blender says that it saved the file, by its temporary name
            bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True, compress=compress)
    except RuntimeError as problem:
        raise FileError(f"The baked file cannot be saved in {path.parent}: is the disk full? ({problem})") from problem


def _write_report(path: Path, report: Report) -> None:
    path.write_text(json.dumps(report.as_dict(), indent=2) + "\n", encoding="utf-8")


@contextmanager
def _interruptible(progress: Progress) -> Iterator[None]:
    """The first Ctrl-C asks the bake to stop at its next chunk of work; a second one does not ask."""

    def stop(*_: object) -> None:
        progress.cancel()
        signal.signal(signal.SIGINT, signal.default_int_handler)

    before = signal.signal(signal.SIGINT, stop)
    try:
        yield
    finally:
        # Blender's own handler was not set from Python: there is nothing to put back but the default.
        signal.signal(signal.SIGINT, before or signal.SIG_DFL)


class _Parser(argparse.ArgumentParser):
    """Says in one line what is wrong, without the whole usage before it."""

    def error(self, message: str) -> NoReturn:
        self.exit(UNUSABLE, f"{self.prog}: {message}; see `{self.prog} --help`.\n")


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(prog="radiosity-baker", description="Bake the light of a Blender scene into colour attributes.")
    parser.add_argument("--version", action="version", version=_version())
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    bake = commands.add_parser("bake", help="bake a .blend file into another one", description=_bake.__doc__)
    _add_scene_arguments(bake)
    bake.set_defaults(command=_bake)
    bake.add_argument("--output", type=_file(".blend"), required=True, metavar="OUT.blend", help="the baked file")
    bake.add_argument("--attribute", default="Radiosity", help="name of the colour attribute (Radiosity)")
    bake.add_argument("--domain", choices=_DOMAINS, default="corner", help="what has a colour of its own (corner)")
    bake.add_argument("--type", choices=_DATA_TYPES, default="float", help="floats, or bytes from 0 to 1 (float)")
    bake.add_argument(
        "--exposure", type=_stops, default=0.0, metavar="STOPS", help="make the light brighter before it is stored (0)"
    )
    bake.add_argument(
        "--frames",
        type=_frames,
        metavar="1-10",
        help="bake moving lamps: layers for each frame, 'Radiosity 0001' and on",
    )
    bake.add_argument("--report", type=_file(""), metavar="FILE.json", help="write what was done and how well")
    bake.add_argument("--preview", type=_file(".png"), metavar="FILE.png", help="render a picture of the baked objects")
    outlook = commands.add_parser("plan", help="what a bake would simulate and cost", description=_plan.__doc__)
    _add_scene_arguments(outlook)
    outlook.set_defaults(command=_plan)
    ladder = commands.add_parser(
        "accuracy", help="measure what accuracy costs in seconds, against Cycles", description=_accuracy.__doc__
    )
    _add_accuracy_arguments(ladder)
    ladder.set_defaults(command=_accuracy)
    check = commands.add_parser(
        "self-test", help="compute what is known exactly, and compare", description=_self_test.__doc__
    )
    check.add_argument("--quiet", action="store_true", help="print problems only")
    check.set_defaults(command=_self_test)
    return parser


def _add_input_arguments(parser: argparse.ArgumentParser) -> None:
    """What every command needs: what to bake, and how the machine is used for it."""
    parser.add_argument(
        "input", type=_file(".blend"), nargs="?", metavar="IN.blend", help="the scene; else what is open"
    )
    parser.add_argument("--objects", type=_names, metavar="A,B", help="meshes to bake; else the selected, else all")
    parser.add_argument("--seed", type=_whole, default=Settings.seed, help="another seed, another noise (0)")
    parser.add_argument("--threads", type=_whole, default=Settings.threads, help="0, the default, takes every core")
    parser.add_argument("--quiet", action="store_true", help="print problems only")


def _add_accuracy_arguments(parser: argparse.ArgumentParser) -> None:
    _add_input_arguments(parser)
    parser.add_argument("--output", type=_file(""), metavar="DIR", help="the folder to write to; else IN-accuracy")
    parser.add_argument("--quick", action="store_true", help="few and small steps, a coarse reference")
    parser.add_argument(
        "--triangles", type=_count, help=f"of the middle step ({_TRIANGLES:,}; quick {QUICK.triangles:,})"
    )
    parser.add_argument("--points", type=_count, help="where bakes are compared with the truth (4,000; quick 1,000)")
    parser.add_argument("--samples", type=_count, help="paths for each of a point's three estimates (512; quick 64)")
    parser.add_argument(
        "--processor-time", action="store_true", help="plot processor seconds: for a machine that others use as well"
    )


def _add_scene_arguments(parser: argparse.ArgumentParser) -> None:
    """What to bake and how well: the same for doing it and for planning it."""
    _add_input_arguments(parser)
    goal = parser.add_mutually_exclusive_group()
    goal.add_argument("--error", type=_positive, default=Settings.error, help="surface error to reach (0.02 is 2 %%)")
    goal.add_argument("--seconds", type=_positive, help="time to use instead")
    parser.add_argument(
        "--result",
        choices=("keep", "replace", "new"),
        default="new",
        help="light the mesh's own corners, tessellate the mesh, or (the default) add a tessellated copy",
    )
    fineness = parser.add_mutually_exclusive_group()
    fineness.add_argument(
        "--triangles",
        type=_count,
        default=Settings.triangles,
        help=f"that would cover the objects, before shadow edges are split finer ({Settings.triangles:,})",
    )
    fineness.add_argument("--size", type=_positive, metavar="METRES", help="longest edge of a triangle to use instead")
    parser.add_argument("--with", dest="with_", type=_effects, default=[], metavar="A,B", help="effects to simulate")
    parser.add_argument(
        "--without", type=_effects, default=[], metavar="A,B", help=f"effects to leave out, of: {', '.join(EFFECTS)}"
    )
    layers = f"besides combined, any of {', '.join(layer for layer in LAYERS if layer != 'combined')}"
    parser.add_argument("--layers", type=_layers, default=Settings.layers, metavar="A,B", help=layers)


def _file(suffix: str) -> Callable[[str], Path]:
    def convert(text: str) -> Path:
        path = Path(text).expanduser().absolute()
        if not path.name.lower().endswith(suffix):
            raise argparse.ArgumentTypeError(f"'{text}' does not end in {suffix}")
        return path

    return convert


def _names(text: str) -> list[str]:
    return [name.strip() for name in text.split(",") if name.strip()]


def _effects(text: str) -> list[str]:
    names = _names(text)
    for name in names:
        if name not in EFFECTS:
            raise argparse.ArgumentTypeError(f"unknown effect '{name}': choose from {', '.join(EFFECTS)}")
    return names


def _layers(text: str) -> tuple[str, ...]:
    names = _names(text)
    for name in names:
        if name not in LAYERS:
            raise argparse.ArgumentTypeError(f"unknown layer '{name}': choose from {', '.join(LAYERS)}")
    return tuple(layer for layer in LAYERS if layer == "combined" or layer in names)


def _frames(text: str) -> list[int]:
    """1-10, or 1,5,9, or both together; ascending and each once."""
    frames: set[int] = set()
    for part in text.split(","):
        first, _, last = part.partition("-")
        frames.update(range(_whole(first), _whole(last or first) + 1))
    if not frames:
        raise argparse.ArgumentTypeError(f"there are no frames in {text}: write the first before the last")
    return sorted(frames)


def _positive(text: str) -> float:
    value = float(text)
    if not 0.0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text} is not a number above 0")
    return value


def _stops(text: str) -> float:
    value = float(text)
    if not -32.0 <= value <= 32.0:
        raise argparse.ArgumentTypeError(f"{text} is not between -32 and 32")
    return value


def _count(text: str) -> int:
    value = int(text)
    if value <= 0:
        raise argparse.ArgumentTypeError(f"{text} is not above 0")
    return value


def _whole(text: str) -> int:
    value = int(text)
    if value < 0:
        raise argparse.ArgumentTypeError(f"{text} is below 0")
    return value
