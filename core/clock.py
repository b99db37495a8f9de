"""Where the time of a bake goes, and where it stands."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from time import perf_counter

from .progress import Progress


class Clock:
    """Seconds by stage, told to whoever watches the progress."""

    def __init__(self, progress: Progress) -> None:
        self.progress = progress
        self.seconds: dict[str, float] = {}
        self._begun = perf_counter()

    @contextmanager
    def stage(
        self, name: str, fraction: float, error: float | None = None, until: float | None = None
    ) -> Iterator[None]:
        """Count the time inside as that of the stage `name`, which goes from `fraction` of the bake to `until`."""
        self.progress.report(name, fraction, error, until)
        begun = perf_counter()
        try:
            yield
        finally:
            self.seconds[name] = self.seconds.get(name, 0.0) + perf_counter() - begun

    @property
    def elapsed(self) -> float:
        return perf_counter() - self._begun
