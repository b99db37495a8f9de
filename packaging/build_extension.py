"""Build and validate one extension package per platform, with Blender's own extension tool.

Usage: python packaging/build_extension.py [FOLDER], by a Python that has the `bpy` module. The packages go to FOLDER
(build/extension). Wheels that wheels/ does not hold yet are fetched by pip, which checks their pinned sums.
"""

from __future__ import annotations

import hashlib
import importlib.util
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PINNED = ROOT / "packaging" / "wheels.txt"
WHEELS = ROOT / "wheels"

#: pip's names for Blender's linux-x64, windows-x64, macos-arm64 and macos-x64.
PLATFORMS = ("manylinux_2_28_x86_64", "win_amd64", "macosx_13_0_arm64", "macosx_13_0_x86_64")
PYTHONS = ("3.11", "3.13")


def wheels_are_there() -> bool:
    """Whether wheels/ holds every wheel the manifest lists, each with a pinned sha256 sum."""
    listed = [ROOT / wheel for wheel in tomllib.loads((ROOT / "blender_manifest.toml").read_text())["wheels"]]
    pinned = PINNED.read_text()
    return all(path.exists() and hashlib.sha256(path.read_bytes()).hexdigest() in pinned for path in listed)


def fetch_wheels() -> None:
    """Let pip download the pinned wheels of every platform and Python."""
    for python in PYTHONS:
        for platform in PLATFORMS:
            choice = ["--only-binary=:all:", "--no-deps", "--python-version", python, "--platform", platform]
            pinned = ["--require-hashes", "--requirement", str(PINNED), "--dest", str(WHEELS)]
            subprocess.run([sys.executable, "-m", "pip", "download", "--quiet", *choice, *pinned], check=True)


def blender_scripts() -> Path:
    """The folder of Blender's own Python scripts, which the bpy module carries."""
    bpy = importlib.util.find_spec("bpy")
    if bpy is None or bpy.origin is None:
        raise SystemExit("This Python has no bpy module; `make extension` uses the one of the Makefile's environment.")
    return next(Path(bpy.origin).parent.glob("*/scripts"))


def build(folder: Path) -> list[Path]:
    """Build the packages of all platforms into `folder` and validate each; their paths, sorted."""
    folder.mkdir(parents=True, exist_ok=True)
    for stale in folder.glob("radiosity_baker-*.zip"):
        stale.unlink()
    scripts = blender_scripts()
    tool = [sys.executable, str(scripts / "addons_core/bl_pkg/cli/blender_ext.py")]
    tags = ["--valid-tags", str(scripts / "modules/_bpy_internal/extensions/tags.py")]
    split = ["build", "--split-platforms", "--source-dir", str(ROOT), "--output-dir", str(folder)]
    subprocess.run([*tool, *split, *tags], check=True)
    packages = sorted(folder.glob("*.zip"))
    for package in packages:
        subprocess.run([*tool, "validate", *tags, str(package)], check=True)
    return packages


def main() -> None:
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "build" / "extension"
    if not wheels_are_there():
        fetch_wheels()
    for package in build(folder):
        print(f"{package}: {package.stat().st_size / 1e6:.1f} MB")


if __name__ == "__main__":
    main()
