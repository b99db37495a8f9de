"""What Blender is told about the extension is true, and true of pyproject.toml and the pinned wheels as well."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
MANIFEST = tomllib.loads((ROOT / "blender_manifest.toml").read_text())
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]

#: Blender's platforms, and how the names of their wheels end.
PLATFORMS = {
    "linux-x64": "linux_2_28_x86_64.whl",
    "windows-x64": "win_amd64.whl",
    "macos-arm64": "macosx_13_0_arm64.whl",
    "macos-x64": "macosx_13_0_x86_64.whl",
}


def test_it_names_the_project_as_pyproject_does():
    assert MANIFEST["id"] == PROJECT["name"].replace("-", "_") == "radiosity_baker"
    assert MANIFEST["version"] == PROJECT["version"]
    assert MANIFEST["license"] == [f"SPDX:{PROJECT['license']['text']}"] == ["SPDX:GPL-3.0-or-later"]


def test_it_starts_with_the_first_blender_that_unpacks_the_right_wheel():
    assert MANIFEST["blender_version_min"] == "4.3.0"


def test_the_tagline_fits_blenders_rules():
    assert len(MANIFEST["tagline"]) <= 64
    assert MANIFEST["tagline"][-1].isalnum()


@pytest.mark.parametrize("platform", PLATFORMS)
def test_each_platform_has_one_wheel_per_python(platform: str):
    wheels = [wheel for wheel in MANIFEST["wheels"] if wheel.endswith(PLATFORMS[platform])]
    assert platform in MANIFEST["platforms"]
    assert sorted(re.findall(r"-(cp\d+)-cp\d+-", " ".join(wheels))) == ["cp311", "cp313"]


def test_nothing_else_is_listed():
    assert set(MANIFEST["platforms"]) == set(PLATFORMS)
    assert len(MANIFEST["wheels"]) == 2 * len(PLATFORMS)


def test_every_wheel_is_of_the_pinned_release_and_has_a_sum_of_its_own():
    pinned = (ROOT / "packaging" / "wheels.txt").read_text()
    release = re.search(r"^embreex==(\S+)", pinned, re.MULTILINE)[1]
    sums = re.findall(r"--hash=sha256:([0-9a-f]{64})\b", pinned)
    assert all(wheel.startswith(f"./wheels/embreex-{release}-cp") for wheel in MANIFEST["wheels"])
    assert len(set(sums)) == len(sums) == len(MANIFEST["wheels"])


def test_the_libraries_it_carries_are_credited():
    credit = " ".join(MANIFEST["copyright"])
    notice = (ROOT / "licenses" / "NOTICE.md").read_text()
    for library in ("embreex", "Embree", "oneTBB"):
        assert library in credit
        assert library in notice
    for text in re.findall(r"`([\w.-]+\.txt)`", notice):
        assert (ROOT / "licenses" / text).stat().st_size > 1000
