"""A bake that runs beside Blender: a worker thread around `core.bake`, which touches numpy and Embree only.

The thread is handed arrays and hands arrays back; whoever started it looks in from Blender's main thread. One bake at
a time: a second would only halve the speed of both, and both would write to the same attributes.
"""

from __future__ import annotations

import threading
import time
from typing import ClassVar

from ..core import bake as pipeline
from ..core.progress import Cancelled, Progress
from ..core.result import BakeResult
from ..core.scene import Scene, SceneError
from ..core.settings import Settings


class BakeJob:
    """Start it, poll it, and take its result; all from one thread, the main one."""

    running: ClassVar[BakeJob | None] = None
    """The bake that is under way in this Blender, if any."""

    def __init__(self) -> None:
        self.progress = Progress()
        self.cancelling = False
        self._started = time.perf_counter()
        self._outcome: BakeResult | BaseException | None = None
        self._thread: threading.Thread | None = None

    def start(self, scene: Scene, settings: Settings) -> None:
        """Begin to bake. Raises SceneError when another bake is still running."""
        if BakeJob.running is not None:
            raise SceneError("A bake is already running: wait for it, or cancel it in the Radiosity panel.")
        self._started = time.perf_counter()
        # A daemon: Blender must be able to quit even if the thread never came to look at the cancel flag.
        self._thread = threading.Thread(target=self._work, args=(scene, settings), name="radiosity bake", daemon=True)
        BakeJob.running = self
        self._thread.start()

    def _work(self, scene: Scene, settings: Settings) -> None:
        try:
            self._outcome = pipeline.bake(scene, settings, self.progress)
        except BaseException as problem:  # noqa: BLE001 - kept whole, and raised again by `result` in the main thread
            self._outcome = problem

    def poll(self) -> bool:
        """Has the thread ended?"""
        return self._thread is not None and not self._thread.is_alive()

    def cancel(self) -> None:
        """Ask the bake to stop. It does so at its next chunk of work; until then `poll` stays False."""
        self.cancelling = True
        self.progress.cancel()

    def result(self) -> BakeResult:
        """Wait for the thread, free the desk for the next bake, and return the result or raise what the bake raised."""
        self._close()
        if isinstance(self._outcome, BakeResult):
            if self.cancelling:
                raise Cancelled("The bake was cancelled; nothing was changed.")
            return self._outcome
        raise self._outcome or RuntimeError("The bake was never started.")

    def stop(self) -> None:
        """Cancel, wait for the thread and forget the result: the file or the add-on is about to go away."""
        self.cancel()
        self._close()

    def _close(self) -> None:
        if self._thread is not None:
            self._thread.join()
        if BakeJob.running is self:
            BakeJob.running = None

    @property
    def elapsed(self) -> float:
        """Seconds since the start."""
        return time.perf_counter() - self._started

    @property
    def remaining(self) -> float | None:
        """Seconds that are left if the rest goes as fast as the part so far; None while that would be a guess."""
        fraction = self.progress.fraction
        if fraction < 0.05:
            return None
        return self.elapsed * (1.0 - fraction) / fraction
