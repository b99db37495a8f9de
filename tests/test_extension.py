"""The packages hold what runs and nothing else, and the one for this machine bakes in a Blender that has just it."""

from __future__ import annotations

import json
import math
import os
import platform
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

#: Wheel suffixes by the package name's ending.
WHEELS = {
    "linux_x64": "manylinux_2_28_x86_64.whl",
    "windows_x64": "win_amd64.whl",
    "macos_arm64": "macosx_13_0_arm64.whl",
    "macos_x64": "macosx_13_0_x86_64.whl",
}
THIS_MACHINE = {
    ("Linux", "x86_64"): "linux_x64",
    ("Windows", "AMD64"): "windows_x64",
    ("Darwin", "arm64"): "macos_arm64",
    ("Darwin", "x86_64"): "macos_x64",
}


@pytest.fixture(scope="module")
def packages(root: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The packages, freshly built and validated by Blender's own tool, by platform."""
    folder = tmp_path_factory.mktemp("extension")
    build = [sys.executable, str(root / "packaging" / "build_extension.py"), str(folder)]
    subprocess.run(build, check=True, capture_output=True)
    return {path.stem.split("-")[-1]: path for path in folder.glob("*.zip")}


def test_there_is_one_package_per_platform(packages: dict[str, Path]):
    assert set(packages) == set(WHEELS)


@pytest.mark.parametrize("name", WHEELS)
def test_a_package_holds_only_what_runs(packages: dict[str, Path], name: str):
    with zipfile.ZipFile(packages[name]) as package:
        files = set(package.namelist())
    wheels = {file for file in files if file.startswith("wheels/")}
    licences = {file for file in files if file.startswith("licenses/")}
    modules = {file for file in files if file.startswith(("core/", "addon/"))}
    assert files - wheels - licences - modules == {"blender_manifest.toml", "__init__.py", "LICENSE"}
    assert len(wheels) == 2
    assert all(wheel.endswith(WHEELS[name]) for wheel in wheels)
    assert {"core/bake.py", "addon/headless.py"} <= modules
    assert all(module.endswith(".py") for module in modules)
    assert "licenses/NOTICE.md" in licences


@pytest.fixture(scope="module")
def bare_environment(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Environment variables for a Python (-S) that sees this one's bpy but no embreex and no radiosity_baker.

    An embreex beside bpy would hide the one that the package carries.
    """
    links = tmp_path_factory.mktemp("site")
    for path in Path(next(p for p in sys.path if p.endswith("site-packages"))).iterdir():
        if path.suffix != ".pth" and not path.name.startswith(("embreex", "__editable__")):
            (links / path.name).symlink_to(path)
    user = tmp_path_factory.mktemp("user")
    return os.environ | {"PYTHONPATH": str(links), "BLENDER_USER_RESOURCES": str(user)}


def test_the_installed_package_bakes(root: Path, packages: dict[str, Path], bare_environment: dict[str, str]):
    package = packages[THIS_MACHINE[platform.system(), platform.machine()]]
    script = root / "tests" / "bake_with_package.py"
    run = subprocess.run(
        [sys.executable, "-S", str(script), str(package)],
        env=bare_environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stdout + run.stderr
    seen = json.loads(run.stdout.splitlines()[-1])
    user = Path(bare_environment["BLENDER_USER_RESOURCES"]).resolve()
    assert Path(seen["embreex"]).resolve().is_relative_to(user)
    assert seen["package"] == "bl_ext.user_default.radiosity_baker"
    # 0.8 * 100 / (4 pi^2) * 2 / r^3 with r = 2 below the lamp and sqrt(12) at a corner, within what triangles of 0.3 m
    # show.
    light = 0.8 * 100 / (4 * math.pi**2) * 2
    assert seen["brightest"] == pytest.approx(light / 2**3, rel=0.05)
    assert seen["darkest"] == pytest.approx(light / 12**1.5, rel=0.05)
    assert seen["headless"] == 0
    assert seen["registered_after_disabling"] is False
