"""Run the hard cases on each Blender that has an environment here, for docs/reliability.md: `make reliability`.

With the argument `tables` only the tables are written anew, of the last run.
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree as ET

ROOT = Path(__file__).resolve().parent.parent
#: Environments as the Makefile names them.
ENVIRONMENTS = (".venv-4.5", ".venv", ".venv-3.13")
HEADING = """# What was tried to break it

Written by `make reliability`: the hard cases of [tests/hard_cases](../tests/hard_cases) on each Blender that has an
environment here (`make test` and `make test-4.5` set them up). Exact values come from closed forms; what a result may
be off is derived where the case is defined. A case of the furnace has radiance 2 at every corner, whatever stands in
it. Below the cases: what random scenes must keep, and which faults are injected, with how often; `make fuzz` repeats
them {factor} times as often. `radiosity-baker self-test` prints the closed forms in any Blender.
"""


def main() -> None:
    """Run, and write the tables."""
    versions, results = [], []
    for environment in ENVIRONMENTS:
        python = ROOT / environment / "bin" / "python"
        if python.exists():
            versions.append(_version(python))
            report = ROOT / "build" / f"reliability{environment}.xml"
            if "tables" not in sys.argv:
                _run(python, report)
            results.append(_outcomes(report))
    (ROOT / "docs" / "reliability.md").write_text("\n".join(_tables(versions, results)) + "\n", encoding="utf-8")


def _version(python: Path) -> str:
    said = subprocess.run(  # noqa: S603 - this repository's own environment
        [python, "-c", "import bpy; print(*bpy.app.version, sep=chr(46))"], capture_output=True, text=True, check=True
    )
    return said.stdout.split()[-1]


def _run(python: Path, report: Path) -> None:
    report.parent.mkdir(exist_ok=True)
    command = [
        python,
        "-m",
        "pytest",
        "--quiet",
        "tests/hard_cases",
        f"--junitxml={report}",
        "-o",
        "junit_family=xunit1",
    ]
    subprocess.run(command, cwd=ROOT, check=False)  # noqa: S603 - a failure is a line of the table


def _outcomes(report: Path) -> dict[str, dict[str, str]]:
    """Properties of each test, by its name, with its verdict."""
    cases = {}
    for case in ET.parse(report).iter("testcase"):  # noqa: S314 - pytest's own report
        failed = case.find("failure") is not None or case.find("error") is not None
        skipped = case.find("skipped") is not None
        verdict = "FAILED" if failed else "skipped" if skipped else "ok"
        told = {p.get("name", ""): p.get("value", "") for p in case.iter("property")}
        cases[case.get("name", "")] = {**told, "verdict": verdict}
    return cases


def _tables(versions: list[str], results: list[dict[str, dict[str, str]]]) -> list[str]:
    factor = re.search(r"FUZZ_FACTOR = (\d+)", (ROOT / "tests/hard_cases/test_properties.py").read_text())
    lines = [HEADING.format(factor=factor[1] if factor else "")]
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
    lines += ["", "| Property or fault | Injected | " + " | ".join(f"Blender {v}" for v in versions) + " |"]
    lines.append("|---|---|" + "---|" * len(versions))
    for name, rows in others:
        if all(row["verdict"] == "skipped" for row in rows):
            continue
        injected = next((row["injected"] for row in rows if "injected" in row), "1")
        title = name.removeprefix("test_").replace("_", " ").replace("|", "/").replace("\n", " ")
        lines.append(f"| {title} | {injected} | " + " | ".join(row["verdict"] for row in rows) + " |")
    return lines


if __name__ == "__main__":
    main()
