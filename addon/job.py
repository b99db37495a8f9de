"""A bake that runs beside Blender: a worker thread around `core.bake`, which touches numpy and Embree only.

The thread is handed arrays and hands arrays back; whoever started it looks in from Blender's main thread. One bake at
a time: a second would only halve the speed of both, and both would write to the same attributes.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any, ClassVar

from ..core import bake as pipeline
from ..core.memory import Memory
from ..core.progress import Cancelled, Progress
from ..core.result import BakeResult
from ..core.scene import Scene, SceneError
from ..core.settings import Settings


class BakeJob:
    """Start it, poll it, and take its result; all from one thread, the main one.

    picture: made by the thread of the light of every pass, to show it; the light itself is kept as well, to stop there.
    """

    running: ClassVar[BakeJob | None] = None
    """The bake that is under way in this Blender, if any."""

    memory: ClassVar[Memory] = Memory()
    """The last bake, for the next one to build upon: a lamp that is dimmed takes no bake from the start."""

    _leaving: ClassVar[list[threading.Thread]] = []

    def __init__(self, picture: Callable[[BakeResult], Any] | None = None) -> None:
        self.progress = Progress() if picture is None else _Watched(picture)
        self.cancelling = False
        self.keeping = False
        self.writing = False
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
            self._outcome = pipeline.bake(scene, settings, self.progress, memory=BakeJob.memory)
        except BaseException as problem:  # noqa: BLE001 - kept whole, and raised again by `result` in the main thread
            self._outcome = problem

    def poll(self) -> bool:
        """Is there an outcome, for `result` to tell? Who stops a bake need not wait for it."""
        return self._thread is not None and (self.cancelling or self.keeping or not self._thread.is_alive())

    def cancel(self) -> None:
        """Ask the bake to stop. It does so at its next chunk of work; whatever it still brings is dropped."""
        self.cancelling = True
        self.progress.cancel()

    def keep(self) -> None:
        """Ask the bake to stop, and take the light of its last complete pass for the result."""
        self.keeping = self.latest is not None
        if self.keeping:
            self.progress.cancel()

    @property
    def latest(self) -> BakeResult | None:
        """The light of the last complete pass, where a picture is asked for."""
        return self.progress.latest if isinstance(self.progress, _Watched) else None

    @property
    def picture(self) -> Any:
        """The picture of the last complete pass, or None."""
        return self.progress.picture if isinstance(self.progress, _Watched) else None

    def wait_for_picture(self, seconds: float) -> None:
        """Until there is a picture, and no longer than that."""
        if isinstance(self.progress, _Watched):
            self.progress.drawn.wait(seconds)

    def result(self) -> BakeResult:
        """Free the desk for the next bake, and return the result or raise what the bake raised.

        Waits for the thread unless the bake was stopped.
        """
        self._close(wait=not (self.cancelling or self.keeping))
        if self.cancelling:
            raise Cancelled("The bake was cancelled; nothing was changed.")
        if isinstance(self._outcome, BakeResult):
            return self._outcome
        latest = self.latest
        if latest is not None and self.keeping and isinstance(self._outcome, Cancelled | None):
            latest.report.warnings.append("The bake was stopped early: bake again for the accuracy that was asked for.")
            return latest
        raise self._outcome or RuntimeError("The bake was never started.")

    def stop(self) -> None:
        """Cancel, wait for the thread and forget the result: the file or the add-on is about to go away."""
        self.cancel()
        self._close(wait=True)

    @staticmethod
    def wait_for_leaving() -> None:
        """Wait for the threads of bakes that were stopped before their next chunk of work was done."""
        while BakeJob._leaving:
            BakeJob._leaving.pop().join()

    def _close(self, *, wait: bool) -> None:
        if self._thread is not None:
            if wait:
                self._thread.join()
            elif self._thread.is_alive():
                BakeJob._leaving = [thread for thread in (*BakeJob._leaving, self._thread) if thread.is_alive()]
        if BakeJob.running is self:
            BakeJob.running = None

    @property
    def elapsed(self) -> float:
        """Seconds since the start."""
        return time.perf_counter() - self._started

    @property
    def remaining(self) -> float | None:
        """Seconds that are left, at first as predicted, then as the part so far went; None while neither is known."""
        done, expected = self.progress.fraction, self.progress.expected
        if expected is not None:
            return (1.0 - done) * max(expected, self.elapsed)
        return self.elapsed * (1.0 - done) / done if done >= 0.05 else None


class _Watched(Progress):
    """Keeps the light of the last complete pass, and its picture."""

    def __init__(self, draw: Callable[[BakeResult], Any]) -> None:
        super().__init__(watched=True)
        self.latest: BakeResult | None = None
        self.picture: Any = None
        self.drawn = threading.Event()
        self._draw = draw

    def show(self, so_far: Callable[[], BakeResult]) -> None:
        self.check()
        self.latest = so_far()
        self.picture = self._draw(self.latest)
        self.drawn.set()
