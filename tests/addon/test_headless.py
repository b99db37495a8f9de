"""The command line keeps its contract: what it writes, what it refuses, and that it writes all or nothing."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import bpy
import numpy as np
import pytest

from radiosity_baker.addon import command_line, preview
from radiosity_baker.addon.colour_storage import EXPOSURE_KEY, Storage
from radiosity_baker.addon.headless import main, register_command, unregister_command
from radiosity_baker.core import self_test
from radiosity_baker.core.result import BakeResult, Report
from radiosity_baker.core.settings import Settings

TETRAHEDRON = {
    "vertices": ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)),
    "faces": ((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)),
}


@pytest.fixture
def scene_file(tmp_path: Path, add_mesh, add_lamp) -> Path:
    """A floor and a tetrahedron under a lamp of 100 W, none selected, saved without compression."""
    add_mesh("Floor", vertices=((-2, -2, -1), (2, -2, -1), (2, 2, -1), (-2, 2, -1)))
    add_mesh("Thing", **TETRAHEDRON)
    add_lamp("POINT", {"energy": 100.0}, location=(0.5, 0.5, 2.0))
    for item in bpy.context.view_layer.objects:
        item.select_set(False)
    path = tmp_path / "in" / "scene.blend"
    path.parent.mkdir()
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=False)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return path


@pytest.fixture
def out(tmp_path: Path) -> Path:
    folder = tmp_path / "out"
    folder.mkdir()
    return folder


def bake(path: Path, out: Path, *more: str) -> int:
    """Onto the corners the meshes have, which takes no time; other results override."""
    return main(["bake", str(path), "--output", str(out / "baked.blend"), "--result", "keep", "--error", "0.2", *more])


@pytest.fixture
def painted(monkeypatch: pytest.MonkeyPatch):
    """In place of a bake, for tests of what happens around it: every corner becomes grey."""

    def paint(_context, objects, settings, *, result_mode, attribute, storage, progress):
        assert not settings.tessellate
        assert result_mode == "keep"
        assert storage == Storage()
        for item in objects:
            values = item.data.color_attributes.new(attribute, "FLOAT_COLOR", "CORNER").data
            values.foreach_set("color", np.full(4 * len(values), 0.5, np.float32))
        progress.report("paint", 1.0)
        facts = [{"name": item.name, "attribute": attribute, "triangles": 1, "corners": 3} for item in objects]
        return BakeResult((), Report(seconds={"total": 1.0}, objects=facts)), list(objects)

    monkeypatch.setattr(command_line, "bake_objects", paint)


def colours(name: str, attribute: str = "Radiosity") -> np.ndarray:
    data = bpy.data.objects[name].data.color_attributes[attribute].data
    return np.array([corner.color[:3] for corner in data])


def test_the_output_holds_the_light_and_the_input_is_untouched(scene_file: Path, out: Path):
    before = scene_file.read_bytes()
    assert bake(scene_file, out) == 0
    assert scene_file.read_bytes() == before
    assert sorted(path.name for path in out.iterdir()) == ["baked.blend"]
    bpy.ops.wm.open_mainfile(filepath=str(out / "baked.blend"))
    # At a floor's corner: 0.8 * 100 / (4 pi^2) * 3 / r^3, with r^2 = 9 + dx^2 + dy^2; the tetrahedron adds and hides.
    nearest = 0.8 * 100 / (4 * np.pi**2) * 3 / (9 + 1.5**2 + 1.5**2) ** 1.5
    assert colours("Floor").max() == pytest.approx(nearest, rel=0.5)
    assert (colours("Thing") >= 0.0).all()
    assert colours("Thing").max() > 0.0


def test_report_and_preview_come_beside_it(scene_file: Path, out: Path, capsys):
    extras = ["--report", str(out / "report.json"), "--preview", str(out / "preview.png")]
    assert bake(scene_file, out, *extras) == 0
    assert sorted(path.name for path in out.iterdir()) == ["baked.blend", "preview.png", "report.json"]
    image = bpy.data.images.load(str(out / "preview.png"))
    assert max(image.pixels[:]) > 0.5
    report = json.loads((out / "report.json").read_text())
    assert {
        "seconds", "patches", "rays", "iterations", "threads", "estimated_error", "energy", "effects", "objects",
        "peak_memory_mb", "warnings", "version",
    } <= set(report)  # fmt: skip
    assert report["seconds"]["total"] > 0.0
    assert set(report["energy"]) == {"emitted", "absorbed", "escaped", "residual"}
    assert {"total", "sampling", "transport", "resolution"} <= set(report["estimated_error"])
    assert report["rays"]["total"] > 0
    assert report["patches"] > 0
    assert {effect["name"] for effect in report["effects"] if effect["active"]}
    assert {(entry["name"], entry["triangles"], entry["corners"]) for entry in report["objects"]} == {
        ("Floor", 2, 4),
        ("Thing", 4, 12),
    }
    assert report["version"] == subprocess_version()
    summary = capsys.readouterr().out.strip().splitlines()[-1]
    assert summary.startswith("Baked 2 objects, 6 triangles in ")
    assert "Estimated error" in summary


def subprocess_version() -> str:
    """What `radiosity-baker --version` prints, by the console script of this environment."""
    script = Path(sys.executable).parent / "radiosity-baker"
    run = subprocess.run([str(script), "--version"], capture_output=True, text=True, check=True)
    return run.stdout.splitlines()[-1]


@pytest.mark.usefixtures("painted")
def test_it_says_nothing_when_quiet(scene_file: Path, out: Path, capsys):
    assert bake(scene_file, out, "--quiet") == 0
    captured = capsys.readouterr()
    assert captured.out == captured.err == ""


def test_named_objects_and_attribute_and_layers(scene_file: Path, out: Path):
    assert bake(scene_file, out, "--objects", "Thing", "--attribute", "Glow", "--layers", "light") == 0
    bpy.ops.wm.open_mainfile(filepath=str(out / "baked.blend"))
    assert {"Glow", "Glow Light"} <= set(bpy.data.objects["Thing"].data.color_attributes.keys())
    assert not bpy.data.objects["Floor"].data.color_attributes


@pytest.mark.parametrize("compress", [False, True])
@pytest.mark.usefixtures("painted")
def test_the_output_is_compressed_as_the_input_is(scene_file: Path, out: Path, compress: bool):
    bpy.ops.wm.open_mainfile(filepath=str(scene_file))
    bpy.ops.wm.save_as_mainfile(filepath=str(scene_file), compress=compress)
    assert bake(scene_file, out) == 0
    assert (out / "baked.blend").read_bytes().startswith(b"BLENDER") is not compress


@pytest.mark.usefixtures("painted")
def test_baking_a_file_over_itself_keeps_a_backup(scene_file: Path):
    before = scene_file.read_bytes()
    backup = scene_file.with_name("scene.blend1")
    backup.unlink(missing_ok=True)
    assert main(["bake", str(scene_file), "--output", str(scene_file), "--result", "keep", "--error", "0.2"]) == 0
    assert backup.read_bytes() == before
    assert scene_file.read_bytes() != before


@pytest.mark.usefixtures("painted")
def test_the_file_that_is_open_is_baked_when_none_is_given(scene_file: Path, out: Path):
    bpy.ops.wm.open_mainfile(filepath=str(scene_file))
    bpy.data.objects["Thing"].name = "Renamed"  # only the open file knows
    assert main(["bake", "--output", str(out / "baked.blend"), "--result", "keep", "--objects", "Renamed"]) == 0


@pytest.mark.usefixtures("painted")
def test_scripts_in_the_file_are_not_run(scene_file: Path, out: Path):
    marker = out.parent / "ran"
    bpy.ops.wm.open_mainfile(filepath=str(scene_file))
    text = bpy.data.texts.new("evil.py")
    text.write(f"open({str(marker)!r}, 'w')")
    text.use_module = True
    bpy.ops.wm.save_as_mainfile(filepath=str(scene_file))
    bpy.context.preferences.filepaths.use_scripts_auto_execute = True
    assert bake(scene_file, out) == 0
    assert not marker.exists()


def no_light(path: Path) -> None:
    _edit(path, lambda: bpy.data.lights.remove(bpy.data.lights[0]))


def empty_mesh(path: Path) -> None:
    def clear() -> None:  # the mesh is another one once the file is open
        bpy.data.objects["Thing"].data.clear_geometry()

    _edit(path, clear)


def no_mesh(path: Path) -> None:
    _edit(path, lambda: [bpy.data.objects.remove(bpy.data.objects[name]) for name in ("Floor", "Thing")])


def linked_mesh(path: Path) -> None:
    """Thing comes from a library."""
    library = path.with_name("library.blend")
    bpy.ops.wm.open_mainfile(filepath=str(path))
    bpy.data.libraries.write(str(library), {bpy.data.objects["Thing"]})
    bpy.data.objects.remove(bpy.data.objects["Thing"])
    with bpy.data.libraries.load(str(library), link=True) as (_, wanted):
        wanted.objects = ["Thing"]
    bpy.context.scene.collection.objects.link(wanted.objects[0])
    bpy.ops.wm.save_as_mainfile(filepath=str(path))


def unreadable(path: Path) -> None:
    path.write_bytes(b"this is no Blender file")


def missing(path: Path) -> None:
    path.unlink()


def nothing(path: Path) -> None:
    """The file is fine; the arguments are not."""


def _edit(path: Path, change) -> None:
    bpy.ops.wm.open_mainfile(filepath=str(path))
    change()
    bpy.ops.wm.save_as_mainfile(filepath=str(path))


@pytest.mark.parametrize(
    "case",
    [
        (missing, [], ["scene.blend", "check the path"]),
        (unreadable, [], ["scene.blend", "Blender file"]),
        (no_light, [], ["light", "add"]),
        (no_mesh, [], ["mesh", "add"]),
        (empty_mesh, ["--objects", "Thing"], ["'Thing'"]),
        (linked_mesh, ["--objects", "Thing"], ["'Thing'", "link"]),
        (nothing, ["--objects", "Floor,Nobody"], ["'Nobody'"]),
        (nothing, ["--objects", "Lamp"], ["'Lamp'", "mesh"]),
        (nothing, ["--output", "{out}/deeper/baked.blend"], ["deeper", "create"]),
        (nothing, ["--report", "{out}/deeper/report.json"], ["deeper", "create"]),
        (nothing, ["--output", "{out}/baked.obj"], ["baked.obj", ".blend"]),
        (nothing, ["--preview", "{out}/preview.gif"], ["preview.gif", ".png"]),
        (nothing, ["--report", "{out}"], ["out", "file name"]),
        (nothing, ["--layers", "combined,shine"], ["shine", "indirect"]),
        (nothing, ["--seconds", "3"], ["--seconds", "--error"]),
        (nothing, ["--error", "0"], ["0"]),
        (nothing, ["--threads", "-1"], ["-1"]),
        (nothing, ["--result", "maybe"], ["maybe", "replace"]),
    ],
    ids=lambda case: " ".join([case[0].__name__, *case[1]]),
)
def test_unusable_input_is_named_with_a_remedy_and_nothing_is_written(scene_file: Path, out: Path, capsys, case):
    spoil, more, said = case
    spoil(scene_file)
    before = sorted(scene_file.parent.iterdir())
    capsys.readouterr()
    assert bake(scene_file, out, *[text.format(out=out) for text in more]) == 2
    problem = capsys.readouterr().err
    assert problem.startswith("radiosity-baker")
    assert len(problem.strip().splitlines()) == 1
    for word in said:
        assert word in problem
    assert not list(out.iterdir())
    assert sorted(scene_file.parent.iterdir()) == before


def test_the_plan_names_effects_reasons_and_cost(scene_file: Path, out: Path, capsys):
    assert main(["plan", str(scene_file)]) == 0
    said = capsys.readouterr().out
    assert re.search(r"^on +point lamps: .*Lamp", said, re.MULTILINE)
    assert re.search(r"^off +sky: ", said, re.MULTILINE)
    assert re.search(r"^on +point lamps: .*\(about [\d.]+ s\)$", said, re.MULTILINE)
    assert re.search(r"^About [\d.]+ s and [\d,]+ MB\.$", said, re.MULTILINE)
    assert main(["plan", str(out / "none.blend")]) == 2


def test_effects_are_switched_by_name(scene_file: Path, capsys):
    assert main(["plan", str(scene_file), "--without", "point lamps,bounces", "--with", "sky"]) == 0
    said = capsys.readouterr().out
    for line in (
        "off  point lamps: switched off by hand",
        "off  bounces: switched off",
        "on   sky: switched on by hand",
    ):
        assert line in said
    assert main(["plan", str(scene_file), "--without", "moon"]) == 2
    assert "unknown effect 'moon': choose from point lamps" in capsys.readouterr().err


def test_without_a_file_or_a_command_it_says_so(out: Path, capsys):
    assert main(["bake", "--output", str(out / "baked.blend")]) == 2
    assert "No file to bake" in capsys.readouterr().err
    assert main([]) == 2
    assert "COMMAND" in capsys.readouterr().err


def test_an_interrupt_leaves_nothing_behind(scene_file: Path, out: Path, monkeypatch, capsys):
    def interrupted(*_, progress, **__):
        os.kill(os.getpid(), signal.SIGINT)
        progress.check()
        pytest.fail("the bake went on after Ctrl-C")

    monkeypatch.setattr(command_line, "bake_objects", interrupted)
    handler = signal.getsignal(signal.SIGINT)
    assert bake(scene_file, out) == 130
    assert "nothing was written" in capsys.readouterr().err
    assert not list(out.iterdir())
    assert signal.getsignal(signal.SIGINT) is handler


@pytest.mark.usefixtures("painted")
def test_a_failure_at_the_very_end_leaves_the_old_files(scene_file: Path, out: Path, monkeypatch, capsys):
    (out / "baked.blend").write_text("old")
    (out / "report.json").write_text("old")

    def fail(*_, **__):
        raise RuntimeError("no graphics")

    monkeypatch.setattr(command_line, "render_preview", fail)
    extras = ["--report", str(out / "report.json"), "--preview", str(out / "preview.png")]
    assert bake(scene_file, out, *extras) == 1
    assert "no graphics" in capsys.readouterr().err
    assert {path.name: path.read_text() for path in out.iterdir()} == {"baked.blend": "old", "report.json": "old"}


def test_goal_and_result_become_settings(monkeypatch, scene_file: Path, out: Path):
    asked = []

    def remember(_context, _objects, settings, **_):
        asked.append(settings)
        raise command_line.SceneError("enough")

    monkeypatch.setattr(command_line, "bake_objects", remember)
    blend = ["bake", str(scene_file), "--output", str(out / "baked.blend")]
    for more in (["--seconds", "3"], ["--error", "0.1", "--result", "keep", "--seed", "7", "--threads", "2"], []):
        assert main([*blend, *more]) == 2
    assert asked == [
        Settings(error=None, seconds=3.0),
        Settings(error=0.1, tessellate=False, seed=7, threads=2),
        Settings(),
    ]


def test_how_colours_are_stored_is_what_was_asked(scene_file: Path, out: Path):
    assert bake(scene_file, out, "--domain", "point", "--type", "byte", "--exposure", "-2") == 0
    bpy.ops.wm.open_mainfile(filepath=str(out / "baked.blend"))
    mesh = bpy.data.objects["Floor"].data
    stored = mesh.color_attributes["Radiosity"]
    assert (stored.domain, stored.data_type) == ("POINT", "BYTE_COLOR")
    assert dict(mesh[EXPOSURE_KEY]) == {"Radiosity": 0.25}


def test_blender_runs_the_file_by_its_path(root: Path, scene_file: Path, out: Path):
    """As `blender --python addon/headless.py -- ...` does: without a package, the arguments after the dashes."""
    as_blender = "import runpy, sys; path, *sys.argv[1:] = sys.argv[1:]; runpy.run_path(path, run_name='__main__')"
    headless = str(root / "addon" / "headless.py")

    def run(*arguments: str) -> subprocess.CompletedProcess:
        command = [sys.executable, "-c", as_blender, headless, "--background", "--", *arguments]
        return subprocess.run(command, capture_output=True, text=True, check=False)

    done = run("plan", str(scene_file))
    assert done.returncode == 0, done.stderr
    assert "point lamps" in done.stdout
    refused = run("bake", str(scene_file), "--output", str(out / "nowhere" / "baked.blend"))
    assert refused.returncode == 2
    assert "nowhere" in refused.stderr


def test_the_command_can_be_registered_again_after_it_was_unregistered():
    for _ in range(2):
        register_command()
        unregister_command()


@pytest.fixture(autouse=True)
def small_pictures(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(preview, "WIDTH", 64)


def outcomes(*errors: float) -> list[self_test.Outcome]:
    return [self_test.Outcome(f"case {number}", 1.0, 1.0 + e, e, 0.5) for number, e in enumerate(errors)]


def test_the_self_test_prints_case_exact_got_error_and_verdict(monkeypatch, capsys):
    monkeypatch.setattr(self_test, "run_all", lambda _: iter(outcomes(0.0, 0.25)))
    assert main(["self-test"]) == 0
    heading, first, second, summary = capsys.readouterr().out.splitlines()
    assert heading.split() == ["case", "exact", "got", "error", "verdict"]
    assert first.split() == ["case", "0", "1", "1", "0.0e+00", "ok"]
    assert second.split() == ["case", "1", "1", "1.25", "2.5e-01", "ok"]
    assert summary.startswith("All 2 closed forms came out right.")


def test_the_self_test_fails_loudly(monkeypatch, capsys):
    monkeypatch.setattr(self_test, "run_all", lambda _: iter(outcomes(0.0, 0.75, float("nan"))))
    assert main(["self-test", "--quiet"]) == 1
    captured = capsys.readouterr()
    assert captured.out == ""
    assert "2 of 3 closed forms came out wrong" in captured.err
    assert bpy.app.version_string in captured.err
