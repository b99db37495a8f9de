"""Run the hard cases on each Blender that has an environment here, for docs/reliability.md: `make reliability`.

With the argument `tables` only the tables are written anew, of the last run. What the last `make fuzz` has tried so far
has a column of its own.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree as ET

ROOT = Path(__file__).resolve().parent.parent
#: Environments as the Makefile names them.
ENVIRONMENTS = (".venv-4.5", ".venv", ".venv-3.13", ".venv-5.3")
#: pytest's report of each, and of the program, where tests/gui/cases.py leaves it.
REPORTS = {name: ROOT / "build" / f"reliability{name}.xml" for name in (*ENVIRONMENTS, ".blender")}
HEADING = """# What was tried to break it

Written by `make reliability`: the hard cases of [tests/hard_cases](../tests/hard_cases) on each Blender that has an
environment here as a Python module (`make test`, `make test-4.5` and `make test-5.3` set them up), and in the program
itself, with the extension as it is installed (`tests/gui/run --cases`). Exact values come from closed forms; what a
result may be off is derived where the case is defined. A case of the furnace has radiance 2 at every corner, whatever
stands in it. Below the cases: what random scenes must keep, and which faults are injected, with how often, here and in
the last long run (`make fuzz`, on one Blender). `radiosity-baker self-test` prints the closed forms in any Blender.
"""
#: What the long run leaves behind, as tests/hard_cases/conftest.py writes it.
LONG_RUN = ROOT / "build" / "fuzz.jsonl"


def main() -> None:
    """Run, and write the tables."""
    if "tables" not in sys.argv:
        for name, report in REPORTS.items():
            report.unlink(missing_ok=True)
            python = ROOT / name / "bin" / "python"
            if python.exists():
                _run(python, report)
        subprocess.run([ROOT / "tests" / "gui" / "run", "--cases"], check=False)  # noqa: S603 - a script of ours
    reports = [ET.parse(path) for path in REPORTS.values() if path.exists()]  # noqa: S314 - pytest's own reports
    lines = _tables([_blender(report) for report in reports], [_outcomes(report) for report in reports])
    (ROOT / "docs" / "reliability.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


def _run(python: Path, report: Path) -> None:
    report.parent.mkdir(exist_ok=True)
    kept = [f"--junitxml={report}", "-o", "junit_family=xunit1"]
    command = [python, "-m", "pytest", "--quiet", "tests/hard_cases", *kept]
    subprocess.run(command, cwd=ROOT, check=False)  # noqa: S603 - a failure is a line of the table


def _blender(report: ET.ElementTree) -> str:
    """What tests/hard_cases/conftest.py says of the Blender that ran them."""
    return next(p.get("value", "") for p in report.iterfind("testsuite/properties/property"))


def _outcomes(report: ET.ElementTree) -> dict[str, dict[str, str]]:
    """Properties of each test, by its name, with its verdict."""
    cases = {}
    for case in report.iter("testcase"):
        failed = case.find("failure") is not None or case.find("error") is not None
        skipped = case.find("skipped") is not None
        verdict = "FAILED" if failed else "skipped" if skipped else "ok"
        told = {p.get("name", ""): p.get("value", "") for p in case.iter("property")}
        cases[case.get("name", "")] = {**told, "verdict": verdict}
    return cases


def _long_run() -> dict[str, str]:
    """What the last long run has tried of each test, by its name, and what came of it."""
    lines = LONG_RUN.read_text(encoding="utf-8").splitlines() if LONG_RUN.exists() else []
    return {told["name"]: f"{told.get('injected', 1)} {told['verdict']}" for told in map(json.loads, lines)}


def _tables(versions: list[str], results: list[dict[str, dict[str, str]]]) -> list[str]:
    lines, long_run = [HEADING], _long_run()
    lines.append("| Case | Exact | Allowed | " + " | ".join(f"Blender {v}" for v in versions) + " |")
    lines.append("|---|---|---|" + "---|" * len(versions))
    others = []
    for name in dict.fromkeys(name for result in results for name in result):
        rows = [result.get(name, {"verdict": "not run"}) for result in results]
        told = next((row for row in rows if "case" in row), None)
        if told is None:
            others.append((name, rows))
            continue
        got = [f"{float(row['got']):.6g} {row['verdict']}" if "got" in row else row["verdict"] for row in rows]
        exact, allowed = float(told["exact"]), float(told["allowed"])
        lines.append(f"| {told['case']} | {exact:.6g} | {allowed:.1e} | {' | '.join(got)} |")
    lines += ["", "| Property or fault | Injected | " + " | ".join(f"Blender {v}" for v in versions) + " | Long run |"]
    lines.append("|---|---|" + "---|" * len(versions) + "---|")
    for name, rows in others:
        if all(row["verdict"] == "skipped" for row in rows):
            continue
        injected = next((row["injected"] for row in rows if "injected" in row), "1")
        title = name.removeprefix("test_").replace("_", " ").replace("|", "/").replace("\n", " ")
        verdicts = " | ".join(row["verdict"] for row in rows)
        lines.append(f"| {title} | {injected} | {verdicts} | {long_run.get(name, '')} |")
    return lines


if __name__ == "__main__":
    main()
