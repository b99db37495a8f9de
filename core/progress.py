"""How a running bake talks to whoever started it, and how it is stopped."""

from __future__ import annotations

import threading
from collections.abc import Callable

from .result import BakeResult

#: Of a whole bake, a stage of unknown length; of a stage, a chunk of work.
_LITTLE, _STEP = 0.05, 0.02


class Cancelled(Exception):
    """The person who started the bake stopped it; nothing was written."""


class Progress:
    """Where a bake is. Written by the thread that bakes, read by any other.

    stage: name of the running stage. fraction: 0 to 1 over the whole bake. error: the estimated error so far, or None.
    expected: seconds that the whole bake was predicted to take, or None. watched: whether someone wants to see the
    light before it is done.
    """

    def __init__(self, *, watched: bool = False) -> None:
        self.stage = ""
        self.fraction = 0.0
        self.error: float | None = None
        self.expected: float | None = None
        self.watched = watched
        self._until = 0.0
        self._cancel = threading.Event()

    def cancel(self) -> None:
        self._cancel.set()

    def check(self) -> None:
        """Raise Cancelled if someone asked to stop. Called once per chunk of work, by any thread."""
        if self._cancel.is_set():
            raise Cancelled("The bake was cancelled; nothing was changed.")

    def report(self, stage: str, fraction: float, error: float | None = None, until: float | None = None) -> None:
        """A stage, or a part of one, begins at `fraction` of the bake and ends at `until`; or a little later."""
        self.check()
        self.stage, self.fraction = stage, max(fraction, self.fraction)
        self._until = fraction + _LITTLE if until is None else until
        if error is not None:
            self.error = error

    def step(self) -> None:
        """A chunk of work is done. Nobody knows of how many, so each takes the same share of what is left of the
        stage: the bar never stands still, and never goes back."""
        self.fraction += _STEP * max(self._until - self.fraction, 0.0)

    def show(self, so_far: Callable[[], BakeResult]) -> None:
        """A pass is complete. `so_far` gives its light as a result of its own, and is called only if `watched`."""
