"""One thread for numpy's own library of matrix products while light is baked.

OpenBLAS hands even small products to threads of its own, which then spin for milliseconds on the cores that trace rays:
on two cores a bake took half as long again, and twice the processor time.
"""

from __future__ import annotations

import ctypes
import threading
from functools import cache
from itertools import product
from pathlib import Path

import numpy as np


class _OneThread:
    """Keeps OpenBLAS on the caller's thread; as it was again when the last of several callers is done. Does nothing
    where numpy came without it."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._callers, self._before = 0, 1

    def __enter__(self) -> None:
        with self._lock:
            if self._callers == 0:
                self._before = _threads()
                _set_threads(1)
            self._callers += 1

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._callers -= 1
            if self._callers == 0:
                _set_threads(self._before)


#: To be entered as often as one likes, from any thread.
one_thread = _OneThread()


def _threads() -> int:
    return int(_call("get_num_threads") or 1)


def _set_threads(count: int) -> None:
    _call("set_num_threads", count)


def _call(name: str, *arguments: int) -> int | None:
    library = _openblas()
    # Builds differ in what they put around the names, to get along with other copies.
    for prefix, suffix in product(("scipy_", ""), ("64_", "")):
        function = getattr(library, f"{prefix}openblas_{name}{suffix}", None)
        if function is not None:
            return int(function(*arguments))
    return None


@cache
def _openblas() -> ctypes.CDLL | None:
    """The OpenBLAS that came with numpy and is loaded already; None where there is none."""
    package = Path(np.__file__).parent
    for folder in (package.with_name("numpy.libs"), package / ".dylibs"):
        for path in sorted(folder.glob("*openblas*")):
            return ctypes.CDLL(str(path))
    return None
