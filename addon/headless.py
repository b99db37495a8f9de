"""The ways in without a window, all with the same arguments (see `command_line`).

- By the bpy module: `radiosity-baker bake IN.blend ...`
- By this file: `blender --background IN.blend --python <extension>/addon/headless.py -- bake ...`
- By the enabled extension: `blender --command radiosity_baker bake IN.blend ...`
"""

from __future__ import annotations

import importlib
import importlib.util
import sys
import traceback
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import bpy

NO_EMBREEX = (
    "radiosity-baker: The ray tracer 'embreex' is missing: install and enable the extension's package for this "
    "platform, and start Blender without --factory-startup."
)

#: What Blender keeps of the registered command; dropping it there unregisters the command.
_registered: list[Any] = []


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command line (None: the process's own) and return its exit code.

    0 success, 2 unusable input, 130 interrupted, 1 an error in this program, with its traceback.
    """
    try:
        command_line = importlib.import_module(f"{_package()}.addon.command_line")
        return command_line.run(sys.argv[1:] if arguments is None else arguments)
    except Exception as problem:  # noqa: BLE001 - Blender would print it and report success to the shell
        if isinstance(problem, ModuleNotFoundError) and problem.name == "embreex":
            print(NO_EMBREEX, file=sys.stderr)
            return 2
        traceback.print_exc()
        return 1


def register_command() -> None:
    """Make `blender --command radiosity_baker` known. Raises RuntimeError when it is already."""
    _registered.append(bpy.utils.register_cli_command("radiosity_baker", main))


def unregister_command() -> None:
    while _registered:
        bpy.utils.unregister_cli_command(_registered.pop())


def _package() -> str:
    """The name of the package this file belongs to.

    Blender runs the file of `--python` outside of any package: then it is the enabled extension's if the file lies in
    there, or else a package loaded from the folder above.
    """
    if __package__:
        return __package__.rpartition(".")[0]
    init = Path(__file__).resolve().parent.parent / "__init__.py"
    for name, module in list(sys.modules.items()):
        if getattr(module, "__file__", None) and Path(module.__file__).resolve() == init:
            return name
    spec = importlib.util.spec_from_file_location("radiosity_baker", init)
    package = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = package
    spec.loader.exec_module(package)
    return spec.name


if __name__ == "__main__":
    exit_code = main(sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else [])
    if exit_code:  # else Blender goes on with its own command line, and quits by itself at its end
        sys.exit(exit_code)
