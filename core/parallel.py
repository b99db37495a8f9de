"""A fixed cut of work into chunks, so that the result does not depend on how many threads did it."""

from __future__ import annotations

import os
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from typing import Any, Self, TypeAlias, TypeVar

from .blas import one_thread
from .progress import Progress

Result = TypeVar("Result")
_Task: TypeAlias = Callable[[], None]

#: Calls for each thread that are handed over ahead of those whose results were taken. When Blender quits, Python waits
#: for all that were handed over, and takes no more.
_AHEAD = 4


def thread_count(asked: int) -> int:
    """The asked number of threads, or one for each core this process may use."""
    if asked > 0:
        return asked
    affinity = getattr(os, "sched_getaffinity", None)
    return len(affinity(0)) if affinity else os.cpu_count() or 1


class Workers:
    """Threads that work off chunks. numpy and Embree release the interpreter inside their loops, so these scale."""

    def __init__(self, threads: int, progress: Progress) -> None:
        self.threads = thread_count(threads)
        self.progress = progress
        self._here = threading.local()
        self._pool = ThreadPoolExecutor(self.threads, "radiosity", self._enter_thread)

    def __enter__(self) -> Self:
        one_thread.__enter__()
        return self

    def _enter_thread(self) -> None:
        self._here.is_one = True

    def __exit__(self, *_: object) -> None:
        self._pool.shutdown(wait=True, cancel_futures=True)
        one_thread.__exit__()

    def map(self, function: Callable[[int, slice], Result], count: int, chunk: int) -> Iterator[Result]:
        """function(chunk number, slice) over `count` items, results in order. Raises Cancelled between chunks."""

        def work(number: int) -> Result:
            done = function(number, slice(number * chunk, min((number + 1) * chunk, count)))
            self.progress.step()
            return done

        return self.each(work, range(-(-count // chunk)))

    def each(self, function: Callable[..., Result], *items: Iterable[Any]) -> Iterator[Result]:
        """As the built-in map, but on the threads, also from within one. Raises Cancelled before an item."""

        def work(arguments: tuple[Any, ...]) -> Result:
            self.progress.check()
            return function(*arguments)

        calls = list(zip(*items, strict=False))  # some are endless repetitions
        # A single one is done sooner here than it is handed over.
        return self._ahead(work, calls) if len(calls) > 1 else map(work, calls)

    def beside(self, *calls: Callable[[], Any]) -> list[Any]:
        """Results of calls that do not depend on each other: while one does what only one thread can, the others go
        on."""
        return list(self.each(lambda call: call(), calls))

    def _ahead(self, work: Callable[[Any], Result], calls: list[Any]) -> Iterator[Result]:
        """Results of all calls in order, each begun only a few ahead of those that were taken."""
        under_way: deque[tuple[Future[Result], list[_Task]]] = deque()
        # One of the threads does itself what no other has begun: all could be waiting for each other.
        helps = getattr(self._here, "is_one", False)

        def begin(call: Any) -> None:
            # The pool holds nothing but the box: large results must not wait with it until a thread has time.
            future: Future[Result] = Future()
            under_way.append((future, [partial(_fulfil, future, work, call)]))
            self._pool.submit(_open, under_way[-1][1])

        def taken() -> Result:
            future, box = under_way.popleft()
            for other, theirs in ((future, box), *under_way) if helps else ():
                if other.done():
                    break
                _open(theirs)
            return future.result()

        try:
            for call in calls:
                if len(under_way) == _AHEAD * self.threads:
                    yield taken()
                begin(call)
            while under_way:
                yield taken()
        finally:
            for _, box in under_way:
                box.clear()


def _open(box: list[_Task]) -> None:
    """Do the task in a box, unless it was taken out by whoever came first."""
    try:
        task = box.pop()
    except IndexError:
        return
    task()


def _fulfil(future: Future[Result], work: Callable[[Any], Result], argument: Any) -> None:
    try:
        future.set_result(work(argument))
    except BaseException as error:  # noqa: BLE001 - whoever takes the result gets it
        future.set_exception(error)
