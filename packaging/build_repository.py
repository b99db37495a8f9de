"""Make a static extension repository of the built packages, with Blender's own extension tool.

Usage: python packaging/build_repository.py [PACKAGES [FOLDER]], by a Python that has the `bpy` module. FOLDER
(build/repository) then holds the packages of PACKAGES (build/extension) and the listing index.json. Put on a web
server, its address with /index.json behind it is what Blender asks for under Preferences > Get Extensions >
Repositories > Add Remote Repository.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

from build_extension import ROOT, blender_scripts


def build_repository(packages: Path, folder: Path) -> Path:
    """Copy the packages and list them; the path of the listing."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for package in sorted(packages.glob("radiosity_baker-*.zip")):
        shutil.copy2(package, folder)
    tool = [sys.executable, str(blender_scripts() / "addons_core/bl_pkg/cli/blender_ext.py")]
    subprocess.run([*tool, "server-generate", "--repo-dir", str(folder)], check=True)
    return folder / "index.json"


def main() -> None:
    given = dict(enumerate(map(Path, sys.argv[1:])))
    packages, folder = given.get(0, ROOT / "build" / "extension"), given.get(1, ROOT / "build" / "repository")
    print(build_repository(packages, folder))


if __name__ == "__main__":
    main()
