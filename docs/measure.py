"""Measures the sample scenes with `radiosity-baker accuracy` and writes accuracy.md and its pictures beside this file.

Run it with the Python of `.venv`: all samples, or those whose names are given; other arguments go to the command.
Scenes that are not measured now stay as they were, and so does what people wrote around the tables: only what stands
between the two comments that name a scene is replaced.
"""

from __future__ import annotations

import re
import shutil
import sys
from pathlib import Path

from radiosity_baker.addon.headless import main
from radiosity_baker.docs.bench.scenes import SAMPLES as SCENES

DOCS = Path(__file__).resolve().parent
SAMPLES = DOCS.parent / "sample_blends"
#: References stay here, so that measuring again costs only the bakes.
SCRATCH = DOCS.parent / "build" / "accuracy"


def measure(name: str, arguments: list[str]) -> str:
    """Climb the ladder of one sample; its part of accuracy.md."""
    folder = SCRATCH / name
    folder.mkdir(parents=True, exist_ok=True)
    if code := main(["accuracy", str(SAMPLES / f"{name}.blend"), "--output", str(folder), *arguments]):
        sys.exit(code)
    pictures = DOCS / "images"
    pictures.mkdir(exist_ok=True)
    shutil.copy2(folder / "ladder.png", pictures / f"accuracy_{name}.png")
    table = (folder / "ladder.md").read_text(encoding="utf-8").partition("\n\n")[2]
    return f"![True error against time](images/accuracy_{name}.png)\n\n{table}"


def put(text: str, name: str, part: str) -> str:
    """The text with a new part between the two lines that name the scene."""
    begin, end = f"<!-- measured: {name} -->\n", f"<!-- end: {name} -->\n"
    pattern = re.compile(f"{re.escape(begin)}.*?{re.escape(end)}", re.DOTALL)
    if not pattern.search(text):
        text += f"\n## {name.replace('_', ' ').capitalize()}\n\n{begin}{end}"
    return pattern.sub(lambda _: begin + part + end, text)


if __name__ == "__main__":
    options = [argument for argument in sys.argv[1:] if argument not in SCENES]
    report = DOCS / "accuracy.md"
    for scene in [name for name in SCENES if name in sys.argv] or SCENES:
        measured = measure(scene, options)
        before = report.read_text(encoding="utf-8") if report.exists() else "# Accuracy, and what it costs\n"
        report.write_text(put(before, scene, measured), encoding="utf-8")
