"""`radiosity-baker accuracy`: Cycles as a reference, the ladder against it, and what is written of it."""

from __future__ import annotations

import csv
import sys
from dataclasses import fields, replace
from pathlib import Path

import bpy
import numpy as np
import pytest

from radiosity_baker.addon import accuracy, accuracy_plot, command_line, oracle
from radiosity_baker.addon.accuracy_report import markdown, percent
from radiosity_baker.addon.headless import main
from radiosity_baker.addon.scene_reader import pick_receivers, read_scene
from radiosity_baker.core.comparison import scatter
from radiosity_baker.core.ladder import Scale, Step

HEIGHT, ENERGY, ALBEDO = 2.0, 100.0, 0.5


@pytest.fixture
def lit_plane(add_mesh, add_lamp, add_material):
    """A square of 4 m, tilted faces none, under a point lamp: the only light there is comes straight."""
    plane = add_mesh("Plane", vertices=((-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)))
    plane.data.materials.append(add_material("ShaderNodeBsdfDiffuse", Color=(ALBEDO, ALBEDO, ALBEDO, 1.0)))
    add_lamp("POINT", {"energy": ENERGY, "shadow_soft_size": 0.0}, location=(0, 0, HEIGHT))
    return plane


def direct(position):
    """Radiance of the plane: albedo / pi times the irradiance of a point lamp, energy / (4 pi) cos / d^2."""
    d = np.sqrt((position**2).sum(axis=1) + HEIGHT**2)
    return ALBEDO / np.pi * ENERGY / (4 * np.pi) * HEIGHT / d**3


def read(names=None):
    receivers = pick_receivers(bpy.context.scene, bpy.context.view_layer, names)
    return read_scene(bpy.context.evaluated_depsgraph_get(), receivers, tessellate=True)[0]


@pytest.mark.usefixtures("lit_plane")
def test_cycles_tells_the_light_at_points_of_a_surface():
    scene = read()
    points = scatter(scene, 200, seed=1)
    radiance = oracle.true_radiance(bpy.context, scene, points, samples=1, seed=0, threads=0)
    # A point lamp has no noise. The probes' corners lie within 1e-4 of the point, where light changes by as much.
    assert np.allclose(radiance, direct(points.position)[:, None, None], rtol=1e-3)
    assert {obj.name for obj in bpy.data.objects} == {"Plane", "Lamp"}
    assert "Probes" not in bpy.data.meshes


def test_probes_have_the_material_and_the_normal_of_the_surface(add_mesh, add_lamp, add_material):
    roof = add_mesh(
        "Roof", ((-1, 0, 0), (-1, 1, 0), (0, 0, 1), (0, 1, 1), (1, 0, 0), (1, 1, 0)), ((0, 2, 3, 1), (2, 4, 5, 3))
    )
    for name, value in (("dark", 0.1), ("light", 0.8)):
        roof.data.materials.append(add_material("ShaderNodeBsdfDiffuse", name, Color=(value, value, value, 1.0)))
    roof.data.polygons.foreach_set("material_index", [0, 1])
    roof.data.shade_smooth()
    add_lamp("SUN", {"energy": 2.0, "angle": 0.0})
    scene = read()
    points = scatter(scene, 100, seed=1)
    radiance = oracle.true_radiance(bpy.context, scene, points, samples=1, seed=0, threads=0)
    albedo = np.where(points.position[:, 0] < 0, 0.1, 0.8)
    cosine = points.shading[:, 2]
    assert np.ptp(cosine) > 0.2
    assert np.allclose(radiance, (albedo * 2.0 * cosine / np.pi)[:, None, None], rtol=1e-3)


@pytest.mark.usefixtures("lit_plane")
def test_probes_do_not_shade_each_other():
    scene = read()
    points = scatter(scene, 20, seed=1)
    under_each_other = np.zeros((20, 3))
    under_each_other[:, 2] = 1e-4 * np.arange(20)
    points = replace(points, position=under_each_other)
    radiance = oracle.true_radiance(bpy.context, scene, points, samples=1, seed=0, threads=0)
    # 1.9 mm of 2 m nearer is 0.2 % brighter.
    assert np.allclose(radiance, direct(np.zeros((1, 3))), rtol=3e-3)


@pytest.fixture
def scene_file(tmp_path: Path, lit_plane, add_mesh, monkeypatch) -> Path:
    """The plane in a file, beside it another that comes first by name only, and a ladder of few steps for them."""
    add_mesh("Aside", ((4, -2, 0), (8, -2, 0), (8, 2, 0), (4, 2, 0))).data.materials.append(lit_plane.active_material)
    path = tmp_path / f"{lit_plane.name.lower()}.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    tiny = Scale(
        200, (1.0,), passes=(2,), errors=(0.2,), pair_patches=(20,), thresholds=(1e-3,), cycles=(1,), knobs=False
    )
    monkeypatch.setattr(command_line, "QUICK", tiny)
    return path


def run(path: Path, *more: str) -> int:
    return main(["accuracy", str(path), "--quick", "--points", "300", "--samples", "4", *more])


def rows(folder: Path) -> list[dict[str, str]]:
    with (folder / "ladder.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def test_the_ladder_is_climbed_and_told(scene_file: Path, capsys):
    before = scene_file.read_bytes()
    assert run(scene_file) == 0
    assert scene_file.read_bytes() == before
    folder = scene_file.with_name("plane-accuracy")
    names = sorted(path.name for path in folder.iterdir())
    assert names[:3] == ["ladder.csv", "ladder.md", "ladder.png"]
    assert len(names) == 4
    assert names[3].startswith("reference-")

    steps = rows(folder)
    assert [step["series"] for step in steps] == [
        "mesh and passes", "asked error", "hemisphere", "analytic", "centroid", "Cycles",
    ]  # fmt: skip
    for step in steps:
        # Direct light without a shadow, on triangles with edges h of at most 0.8 m: linear elements miss at most
        # h^2 / 8 of the second derivative, which is at most 3/4 of the largest light: 6 % of it, and that is 21 % of
        # the mean on both planes.
        assert float(step["surface_error"]) < 0.21
        assert abs(float(step["bias"])) < 0.21
        assert int(step["triangles"]) >= 2
        assert float(step["processor_seconds"]) > 0.0
    assert steps[-1]["estimated_error"] == ""
    assert float(steps[0]["honesty"]) > 0.0

    printed = capsys.readouterr().out
    assert "Reference: 300 points by Cycles" in printed
    assert (folder / "ladder.md").read_text() in printed
    image = bpy.data.images.load(str(folder / "ladder.png"))
    assert min(image.size) > 500


def test_the_reference_is_computed_once(scene_file: Path, monkeypatch, capsys):
    assert run(scene_file, "--quiet", "--output", str(scene_file.with_name("out"))) == 0
    assert "Reference" not in capsys.readouterr().out
    first = rows(scene_file.with_name("out"))
    with monkeypatch.context() as patch:
        patch.setattr(accuracy, "true_radiance", pytest.fail)
        assert run(scene_file, "--output", str(scene_file.with_name("out"))) == 0
    assert "Reference: taken from reference-" in capsys.readouterr().out
    again = rows(scene_file.with_name("out"))
    assert [step["surface_error"] for step in again] == [step["surface_error"] for step in first]


def test_the_reference_is_computed_again_for_other_points_or_another_file(scene_file: Path, monkeypatch):
    def stop(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(accuracy, "bake_objects", stop)
    folder = scene_file.with_name("plane-accuracy")
    references = []
    for more in ((), ("--points", "301"), ("--samples", "5"), ()):
        assert run(scene_file, *more) == 130
        references.append(len(list(folder.iterdir())))
    bpy.data.objects["Plane"].location.x = 1.0
    bpy.ops.wm.save_mainfile()
    assert run(scene_file) == 130
    assert [*references, len(list(folder.glob("reference-*.npz")))] == [1, 2, 3, 3, 4]


def test_without_matplotlib_the_table_is_written_and_a_line_says_so(scene_file: Path, monkeypatch, capsys):
    for name in ("matplotlib.backends.backend_agg", "matplotlib.figure"):
        monkeypatch.setitem(sys.modules, name, None)
    assert run(scene_file) == 0
    folder = scene_file.with_name("plane-accuracy")
    assert {path.name for path in folder.iterdir() if path.stem == "ladder"} == {"ladder.csv", "ladder.md"}
    assert "matplotlib is not installed" in capsys.readouterr().out


def test_matplotlib_is_not_loaded_before_it_draws():
    module = Path(accuracy_plot.__file__).read_text()
    assert "\nimport matplotlib" not in module
    assert "\nfrom matplotlib" not in module


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--objects", "Nobody"], "There is no object 'Nobody'"),
        (["--output", "{folder}/missing/out"], "The folder {folder}/missing is not there"),
        (["--points", "0"], "0 is not above 0"),
    ],
)
def test_what_cannot_be_measured_is_named_and_leaves_nothing(scene_file: Path, capsys, more, said):
    folder = scene_file.parent
    assert run(scene_file, *(text.format(folder=folder) for text in more)) == 2
    assert said.format(folder=folder) in capsys.readouterr().err
    assert [path.name for path in folder.iterdir()] == ["plane.blend"]


def test_an_interrupted_ladder_writes_no_table(scene_file: Path, monkeypatch):
    def interrupt(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(accuracy, "bake_objects", interrupt)
    assert run(scene_file) == 130
    assert not (scene_file.with_name("plane-accuracy") / "ladder.csv").exists()


def step(series, seconds, error, stated=None) -> Step:
    figures = {field.name: 0 for field in fields(Step)} | {"series": series, "label": "x", "seconds": seconds}
    return Step(**figures | {"surface_error": error, "typical_error": error, "estimated_error": stated})


def test_the_report_compares_with_cycles_and_judges_honesty():
    steps = [step("ours", 1.0, 0.1, 0.1), step("ours", 3.0, 0.02, 0.01), step("Cycles", 30.0, 0.05)]
    asked = accuracy.Asked(Path("room.blend"), Path(), Scale(1), None, 10, 20)
    reference = accuracy.Reference(None, None, np.ones((10, 3, 3)), np.arange(10) > 0)
    text = markdown(asked, reference, steps, "seconds")
    assert "10.0% get no light" in text
    assert "takes 30.0 s on the same mesh: its surface error of 5.00% takes 3.0 s here, 10 times as fast" in text
    assert "1 of 2 within 0.7 to 1.5, smallest 0.50, largest 1.00" in text
    table = [line for line in text.splitlines() if line.startswith("|")]
    assert [line.split("|")[1].strip() for line in table[2:]] == ["best", "best", ""]


def test_percentages_stay_readable_when_a_bake_diverges():
    assert percent(0.01234) == "1.23%"
    assert percent(-0.01234, "+") == "-1.23%"
    assert percent(5.6e5) == "6e+07 %"
