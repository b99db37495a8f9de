"""What goes wrong on purpose: stops at any moment, workers that fail, full disks, locked and broken files.

Each fault must end the bake with what was thrown, leave no thread, no half-written file and no changed mesh behind, and
the next bake must be as if nothing had been. Seen to fail: a pool that is not shut down, an output written in place.
"""

from __future__ import annotations

import resource
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np
import pytest

from radiosity_baker.addon import bake_scene
from radiosity_baker.addon.headless import main
from radiosity_baker.core.bake import bake
from radiosity_baker.core.plan import choose_effort
from radiosity_baker.core.progress import Cancelled, Progress
from radiosity_baker.core.scene import PointLamp, Scene, SceneError, Surface
from radiosity_baker.core.settings import Settings
from radiosity_baker.core.shapes import box, quad

SCENE = Scene(
    (quad("floor", (-1, -1, 0), (3, 0, 0), (0, 3, 0)), box("box", (0, 0, 0), (0.5, 0.5, 0.5))),
    (Surface("grey", (0.5,) * 3),),
    (PointLamp("lamp", (0.2, -0.5, 1.5), (10.0,) * 3, 0.1),),
    (1.0, 1.0, 1.0),
)
SETTINGS = Settings(triangles=60, error=0.2, threads=2)
EFFORT = replace(choose_effort(SCENE, SETTINGS), patches=60, transport_rays=32, growth=0.5)


class Fuse(Progress):
    """Throws at the n-th look at whether to go on, in whichever thread that is."""

    def __init__(self, moment: float, fault: BaseException) -> None:
        super().__init__()
        self.moment, self.fault, self.looks = moment, fault, 0
        self._lock = threading.Lock()

    def check(self) -> None:
        with self._lock:
            self.looks += 1
            looks = self.looks
        if looks >= self.moment:
            raise type(self.fault)(*self.fault.args)  # one that is raised again holds on to all it has gone through
        super().check()


def light(result) -> bytes:
    return b"".join(o.layers["combined"].tobytes() for o in result.objects)


def workers() -> list[threading.Thread]:
    return [thread for thread in threading.enumerate() if thread.name.startswith("radiosity")]


@pytest.mark.parametrize("fault", [Cancelled("stop"), MemoryError("none left"), RuntimeError("a worker broke")])
def test_a_fault_at_any_moment_leaves_nothing_behind(fault, long_run, record_property):
    """A stop, memory that runs out, a bug in a worker: 8 moments of each kind, 1,000 in the long run."""
    whole = Fuse(np.inf, fault)
    expected = light(bake(SCENE, SETTINGS, whole, EFFORT))
    moments = np.linspace(1, whole.looks, 1000 if long_run else 8).astype(int)
    record_property("injected", len(moments))
    for moment in moments:
        with pytest.raises(type(fault), match=str(fault)):
            bake(SCENE, SETTINGS, Fuse(moment, fault), EFFORT)
        assert not workers(), f"threads still run after a fault at look {moment} of {whole.looks}"
    assert light(bake(SCENE, SETTINGS, effort=EFFORT)) == expected


def test_two_bakes_at_once_do_not_know_of_each_other():
    expected = light(bake(SCENE, SETTINGS, effort=EFFORT))
    with ThreadPoolExecutor(2) as both:
        results = both.map(lambda _: light(bake(SCENE, SETTINGS, effort=EFFORT)), range(4))
    assert all(result == expected for result in results)


def test_many_bakes_in_one_process_hold_on_to_nothing(long_run, record_property):
    """20 bakes, 200 in the long run, after 5 that fill caches: no thread stays, and the process's peak memory grows by
    less than a tenth of a MB for each, a hundredth of what one bake holds."""
    count = 200 if long_run else 20
    record_property("injected", count)
    for _ in range(5):
        bake(SCENE, SETTINGS, effort=EFFORT)
    before, alive = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, threading.active_count()
    for _ in range(count):
        bake(SCENE, SETTINGS, effort=EFFORT)
    assert threading.active_count() == alive
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 102.4 * count


@pytest.fixture
def scene_file(tmp_path: Path) -> Path:
    """A square under a lamp."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    mesh = bpy.data.meshes.new("Square")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [], [(0, 1, 2, 3)])
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    lamp.location = (0.5, 0.5, 1)
    lamp.data.energy = 10
    for item in (bpy.data.objects.new("Square", mesh), lamp):
        bpy.context.scene.collection.objects.link(item)
    path = tmp_path / "in.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=False)
    return path


def bake_file(path: Path, *more: str) -> int:
    out = path.with_name("out.blend")
    return main(["bake", str(path), "--output", str(out), "--result", "keep", "--error", "0.2", "--quiet", *more])


def test_a_disk_that_fills_up_while_saving(scene_file, capfd):
    """The system refuses every file over 20 kB, as a full disk would: the old output stays, and nothing beside it."""
    out = scene_file.with_name("out.blend")
    out.write_text("old")
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, limits[1]))
    try:
        code = bake_file(scene_file)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert code == 2
    assert "disk full" in capfd.readouterr().err
    assert out.read_text() == "old"
    assert sorted(p.name for p in scene_file.parent.iterdir()) == ["in.blend", "out.blend"]


def test_an_output_that_another_program_holds(scene_file, monkeypatch, capsys):
    def locked(*_):
        raise PermissionError(13, "used by another process")

    monkeypatch.setattr(Path, "replace", locked)
    assert bake_file(scene_file) == 2
    problem = capsys.readouterr().err
    assert "out.blend" in problem
    assert "another program" in problem
    assert [p.name for p in scene_file.parent.iterdir()] == ["in.blend"]


@pytest.mark.parametrize("share", [0.0, 0.001, 0.5, 0.99])
@pytest.mark.parametrize("compress", [False, True])
def test_a_file_that_is_cut_off(scene_file, capsys, compress, share):
    bpy.ops.wm.open_mainfile(filepath=str(scene_file))
    bpy.ops.wm.save_as_mainfile(filepath=str(scene_file), compress=compress)
    whole = scene_file.read_bytes()
    scene_file.write_bytes(whole[: int(share * len(whole))])
    assert bake_file(scene_file) == 2
    assert "in.blend" in capsys.readouterr().err
    assert not scene_file.with_name("out.blend").exists()


CHANGES = {
    "subdivided": lambda: bpy.data.objects["Square"].data.vertices.add(1),
    "deleted": lambda: bpy.data.objects.remove(bpy.data.objects["Square"]),
    "claimed": lambda: bpy.data.objects["Square"].data.attributes.new("Radiosity", "FLOAT", "POINT"),
}


@pytest.mark.parametrize("change", CHANGES)
def test_a_mesh_that_changes_during_the_bake(scene_file, monkeypatch, change):
    bpy.ops.wm.open_mainfile(filepath=str(scene_file))
    pipeline = bake_scene.bake

    def bake_meanwhile(*arguments, **more):
        CHANGES[change]()
        return pipeline(*arguments, **more)

    monkeypatch.setattr(bake_scene, "bake", bake_meanwhile)
    with pytest.raises(SceneError, match=r"'Square'"):
        bake_scene.bake_objects(
            bpy.context, [bpy.data.objects["Square"]], Settings(error=0.2, tessellate=False), result_mode="keep",
            attribute="Radiosity",
        )  # fmt: skip
    assert not bpy.data.meshes["Square"].color_attributes


# ---- Hostile files -------------------------------------------------------------------------------------------------


def test_a_file_from_the_internet_runs_nothing(scene_file, tmp_path):
    """A text that registers itself and a driver that calls Python, even where the preferences allow both. Seen to fail:
    a file that is opened as Blender's menu opens it."""
    marker = tmp_path / "ran"
    bpy.ops.wm.open_mainfile(filepath=str(scene_file))
    text = bpy.data.texts.new("evil.py")
    text.write(f"open({str(marker)!r}, 'w')")
    text.use_module = True
    driver = bpy.data.objects["Lamp"].driver_add("location", 0).driver
    driver.expression = f"__import__('pathlib').Path({str(marker)!r}).touch() or 0.5"
    bpy.ops.wm.save_as_mainfile(filepath=str(scene_file), compress=False)
    marker.unlink(missing_ok=True)
    allowed = bpy.context.preferences.filepaths.use_scripts_auto_execute
    bpy.context.preferences.filepaths.use_scripts_auto_execute = True
    try:
        assert bake_file(scene_file) == 0
    finally:
        bpy.context.preferences.filepaths.use_scripts_auto_execute = allowed
    assert not marker.exists()


@pytest.mark.parametrize(
    "name", ["../../up", "C:\\up", "a/b", "\u00fcber \u0416 \u65e5\u672c", "new\nline", "'quote\"", "%s{}", "x" * 63]
)
def test_names_of_any_characters(scene_file, name):
    """Names go into attributes and messages, and never into paths."""
    bpy.ops.wm.open_mainfile(filepath=str(scene_file))
    square = bpy.data.objects["Square"]
    square.name = square.data.name = name
    kept = square.name
    bpy.ops.wm.save_as_mainfile(filepath=str(scene_file), compress=False)
    assert bake_file(scene_file) == 0
    assert {p.name for p in scene_file.parent.iterdir()} <= {"in.blend", "in.blend1", "out.blend"}
    bpy.ops.wm.open_mainfile(filepath=str(scene_file.with_name("out.blend")))
    assert "Radiosity" in bpy.data.objects[kept].data.color_attributes


@pytest.mark.parametrize("attribute", ["position", ".corner_vert", "Mask"])
def test_an_attribute_that_is_not_ours_is_never_overwritten(scene_file, capsys, attribute):
    bpy.ops.wm.open_mainfile(filepath=str(scene_file))
    mesh = bpy.data.objects["Square"].data
    if attribute == "Mask":
        mesh.color_attributes.new("Mask", "BYTE_COLOR", "POINT")
    bpy.ops.wm.save_as_mainfile(filepath=str(scene_file), compress=False)
    assert bake_file(scene_file, "--attribute", attribute) == 2
    assert "did not make" in " ".join(capsys.readouterr().err.split())
    assert not scene_file.with_name("out.blend").exists()


def test_a_size_that_asks_for_a_billion_triangles_is_refused_with_numbers(scene_file, capsys):
    assert bake_file(scene_file, "--result", "replace", "--size", "0.00004") == 2
    problem = capsys.readouterr().err
    assert "triangles" in problem
    assert "GB" in problem
