"""Work in slices, so that a window stays awake: some pieces by the main thread, some by another.

Who changes Blender's data is a generator. Where it yields, Blender may draw; what it yields is work on plain arrays,
for whichever thread is free, and it is handed the outcome.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from concurrent.futures import Future, ThreadPoolExecutor, wait
from time import perf_counter
from typing import Any, Generic, TypeVar

Work = Callable[[], Any]
Outcome = TypeVar("Outcome")
Steps = Generator[Work, Any, Outcome]


def breathe() -> None:
    """Work that is none: yielded where one piece ends and nothing is left to compute."""


def at_once(steps: Steps[Outcome]) -> Outcome:
    """All steps in a row, in this thread."""
    answer = None
    while True:
        try:
            work = steps.send(answer)
        except StopIteration as end:
            return end.value
        answer = work()


class Slices(Generic[Outcome]):
    """Steps that go on a little at every tick. `stop` ends them early, where they stand."""

    def __init__(self, steps: Steps[Outcome]) -> None:
        self._steps = steps
        self._thread = ThreadPoolExecutor(1, "radiosity write")
        self._pending: Future[Any] | None = None
        self.outcome: Outcome | None = None

    def advance(self, seconds: float) -> bool:
        """Go on for about so long; True when all is done. Raises what the steps raise."""
        end = perf_counter() + seconds
        while perf_counter() < end:
            if self._pending is not None:
                wait([self._pending], timeout=max(end - perf_counter(), 0.0))
                if not self._pending.done():
                    return False
            try:
                work = self._steps.send(None if self._pending is None else self._pending.result())
            except StopIteration as done:
                self.outcome = done.value
                self._thread.shutdown()
                return True
            except BaseException:
                self._thread.shutdown()
                raise
            self._pending = self._thread.submit(work)
        return False

    def stop(self) -> None:
        """Let the steps clean up behind them."""
        self._thread.shutdown(cancel_futures=True)
        self._steps.close()
