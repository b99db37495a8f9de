"""The hard cases in a real Blender, with the built extension: `tests/gui/run --cases` starts Blender with this script.

Needs pytest and hypothesis in Blender's Python. What the tests call `radiosity_baker` is here what Blender installed as
an extension, with the Embree that Blender gives it. pytest's report goes to cases.xml.
"""

import os
import sys
from pathlib import Path
from types import ModuleType

import pytest

DESK = Path(os.environ["DESK"])

package = ModuleType("radiosity_baker")
package.__path__ = sys.modules["bl_ext.user_default.radiosity_baker"].__path__
sys.modules[package.__name__] = package
os.chdir(package.__path__[0])
report = ["-o", "junit_family=xunit1", f"--junitxml={DESK / 'pictures' / 'cases.xml'}"]
sys.exit(pytest.main(["--quiet", "-p", "no:cacheprovider", *report, "tests/hard_cases"]))
