"""What every case leaves behind for the table in docs/reliability.md: properties in pytest's own XML report; and those
of the long run, which takes hours, in build/fuzz.jsonl as each ends."""

from __future__ import annotations

import json
from pathlib import Path

import bpy
import pytest
from hypothesis import settings

settings.register_profile("fuzz")
#: A line for each test of `make fuzz`: name, verdict, what it has told, and what was wrong.
LONG_RUN = Path(__file__).resolve().parents[2] / "build" / "fuzz.jsonl"


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    if report.when == "call" and settings.default is settings.get_profile("fuzz"):
        LONG_RUN.parent.mkdir(exist_ok=True)
        verdict = "ok" if report.passed else "FAILED" if report.failed else "skipped"
        told = {"name": report.nodeid.split("::")[-1], "verdict": verdict, **dict(report.user_properties)}
        if report.failed:
            told["problem"] = report.longreprtext
        with LONG_RUN.open("a", encoding="utf-8") as lines:
            lines.write(json.dumps(told, default=str) + "\n")


@pytest.fixture(scope="session", autouse=True)
def _blender(record_testsuite_property):
    """Which Blender this is, and whether as a Python module or as the program."""
    kind = "program" if bpy.app.binary_path else "module"
    record_testsuite_property("blender", f"{bpy.app.version_string} ({kind})")


@pytest.fixture
def told(record_property):
    """Tell what a case is about, and assert that it keeps its bound.

    exact: the true figure, or None where only the bound is known; got: what came out; allowed: how far it may be off.
    """

    def tell(case: str, exact: float, got: float, allowed: float, catches: str = "") -> None:
        for name, value in (("case", case), ("exact", exact), ("got", got), ("allowed", allowed), ("catches", catches)):
            record_property(name, value)
        assert abs(got - exact) <= allowed, f"{case}: {got} instead of {exact}, more than {allowed} away. {catches}"

    return tell


@pytest.fixture
def long_run() -> bool:
    """Whether this is `make fuzz`, which repeats what `make test` does a few times."""
    return settings.default is settings.get_profile("fuzz")
