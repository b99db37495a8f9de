"""How a running bake talks to whoever started it, and how it is stopped."""

from __future__ import annotations

import threading


class Cancelled(Exception):
    """The person who started the bake stopped it; nothing was written."""


class Progress:
    """Where a bake is. Written by the thread that bakes, read by any other.

    stage: name of the running stage. fraction: 0 to 1 over the whole bake. error: the estimated error so far, or None.
    """

    def __init__(self) -> None:
        self.stage = ""
        self.fraction = 0.0
        self.error: float | None = None
        self._cancel = threading.Event()

    def cancel(self) -> None:
        self._cancel.set()

    def check(self) -> None:
        """Raise Cancelled if someone asked to stop. Called once per chunk of work, by any thread."""
        if self._cancel.is_set():
            raise Cancelled("The bake was cancelled; nothing was changed.")

    def report(self, stage: str, fraction: float, error: float | None = None) -> None:
        self.check()
        self.stage, self.fraction = stage, fraction
        if error is not None:
            self.error = error
