"""The doors between the rooms: core knows no Blender, imports are relative, and nothing imports in circles."""

from __future__ import annotations

import ast
import graphlib
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
MODULES = sorted([ROOT / "__init__.py", *(ROOT / "core").rglob("*.py"), *(ROOT / "addon").rglob("*.py")])
BLENDER = {
    "aud",
    "bgl",
    "bl_ext",
    "bl_math",
    "blf",
    "bmesh",
    "bpy",
    "bpy_extras",
    "freestyle",
    "gpu",
    "imbuf",
    "mathutils",
}
#: What Blender's review of extensions refuses, and no bake needs.
REFUSED = {"ensurepip", "ftplib", "http", "pip", "requests", "socket", "subprocess", "urllib", "urllib3"}


def name_of(path: Path) -> str:
    """`core.scene` for core/scene.py, `core` for core/__init__.py and the empty name for the root."""
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix("__init__").removesuffix(".")


def relative_imports(path: Path, names: set[str]) -> Iterator[str]:
    """Names of the package's own modules that `path` imports, at its top or inside a function."""
    package = path.parent.relative_to(ROOT).parts
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.level:
            assert node.level <= len(package) + 1, f"{path.name}:{node.lineno} leaves the package"
            start = [*package[: len(package) + 1 - node.level], *(node.module or "").split(".")]
            origin = ".".join(part for part in start if part)
            for alias in node.names:
                inner = f"{origin}.{alias.name}".removeprefix(".")
                yield inner if inner in names else origin


def absolute_imports(path: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level:
            yield (node.module or "").partition(".")[0]


@pytest.mark.parametrize("path", MODULES, ids=name_of)
def test_imports_of_the_package_are_relative_and_nothing_refused_is_used(path: Path):
    own_names = {"addon", "core", "radiosity_baker"}
    assert not set(absolute_imports(path)) & (own_names | REFUSED)


@pytest.mark.parametrize("path", MODULES, ids=name_of)
def test_no_module_edits_the_search_path(path: Path):
    touched = [
        node.lineno
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.Attribute) and node.attr == "path" and ast.unparse(node.value) == "sys"
    ]
    assert not touched


@pytest.mark.parametrize("path", [path for path in MODULES if name_of(path).startswith("core")], ids=name_of)
def test_core_imports_neither_blender_nor_the_addon(path: Path):
    assert not set(absolute_imports(path)) & BLENDER
    names = {name_of(module) for module in MODULES}
    assert all(name.startswith("core") for name in relative_imports(path, names))


def test_no_modules_import_in_circles():
    names = {name_of(path) for path in MODULES}
    graph = {name_of(path): set(relative_imports(path, names)) for path in MODULES}
    list(graphlib.TopologicalSorter(graph).static_order())  # raises CycleError, which names the circle


def test_core_runs_without_blender():
    modules = [f"radiosity_baker.{name_of(path)}" for path in MODULES if name_of(path).startswith("core")]
    check = f"import sys, {', '.join(modules)}; sys.exit(bool({BLENDER} & set(sys.modules)))"
    assert subprocess.run([sys.executable, "-c", check], check=False).returncode == 0
