"""Chunks of work: the same cut and the same order with any number of threads, and a stop between any two."""

from __future__ import annotations

import subprocess
import sys
import threading
import time

import pytest

from radiosity_baker.core.parallel import Workers, thread_count
from radiosity_baker.core.progress import Cancelled, Progress


def chunks(threads: int, count: int, chunk: int) -> list[tuple[int, int, int]]:
    with Workers(threads, Progress()) as workers:
        return list(workers.map(lambda number, part: (number, part.start, part.stop), count, chunk))


@pytest.mark.parametrize(("count", "chunk"), [(10, 3), (9, 3), (1, 5), (0, 5)])
def test_chunks_cover_the_items_once_and_in_order(count, chunk):
    cut = chunks(1, count, chunk)
    assert [number for number, _, _ in cut] == list(range(len(cut)))
    assert [item for _, start, stop in cut for item in range(start, stop)] == list(range(count))
    assert all(stop - start <= chunk for _, start, stop in cut)
    assert chunks(3, count, chunk) == cut


def test_results_come_in_order_whichever_is_done_first():
    def late_first(number: int, _: slice) -> int:
        time.sleep(0.05 if number == 0 else 0.0)
        return number

    with Workers(2, Progress()) as workers:
        assert list(workers.map(late_first, 6, 1)) == list(range(6))


def test_threads_work_at_the_same_time():
    """Each waits for the other; one after the other they would wait for ever."""
    both = threading.Barrier(2, timeout=5)
    with Workers(2, Progress()) as workers:
        list(workers.map(lambda *_: both.wait(), 2, 1))


@pytest.mark.parametrize("threads", [1, 2])
def test_no_chunk_begins_after_a_stop(threads):
    progress, stopped, late = Progress(), threading.Event(), []

    def work(number: int, _: slice) -> None:
        if stopped.is_set():
            late.append(number)
        if number == 3:
            progress.cancel()
            stopped.set()
        elif number > 3:
            # Or another thread might be through with all of them while this one has not come to stop.
            stopped.wait(timeout=5)

    with Workers(threads, progress) as workers, pytest.raises(Cancelled):
        list(workers.map(work, 1000, 1))
    # Each other thread may have looked just before the stop, and begun just after it.
    assert len(late) <= threads - 1


def test_an_error_in_a_chunk_comes_out():
    def fail(*_: object) -> None:
        raise ZeroDivisionError

    with Workers(2, Progress()) as workers, pytest.raises(ZeroDivisionError):
        list(workers.map(fail, 4, 1))


def test_threads_are_as_asked_or_as_many_as_there_are_cores():
    assert thread_count(3) == 3
    assert thread_count(0) >= 1


def test_blender_can_quit_while_chunks_wait():
    """The main thread ends while another works off 1,000 chunks of 50 ms: Python waits for those that were handed over,
    not for all of them."""
    quits = """
import threading, time
from radiosity_baker.core.parallel import Workers
from radiosity_baker.core.progress import Progress
def bake():
    with Workers(2, Progress()) as workers:
        for _ in workers.map(lambda *_: time.sleep(0.05), 1000, 1):
            begun.set()
begun = threading.Event()
threading.Thread(target=bake, daemon=True).start()
begun.wait()
print(time.time())
"""
    run = subprocess.run([sys.executable, "-c", quits], capture_output=True, text=True, check=True)
    assert time.time() - float(run.stdout) < 1000 * 0.05 / 2 / 3


@pytest.mark.parametrize("threads", [1, 2])
def test_work_may_call_for_work_on_the_threads_that_do_it(threads):
    """With all threads at it and none left over, waiting for each other they would wait for ever."""
    nested = f"""
from radiosity_baker.core.parallel import Workers
from radiosity_baker.core.progress import Progress
with Workers({threads}, Progress()) as workers:
    inner = lambda ten: list(workers.each(lambda one: ten + one, range(9)))
    assert list(workers.each(inner, (10, 20, 30))) == [[ten + one for one in range(9)] for ten in (10, 20, 30)]
"""
    subprocess.run([sys.executable, "-c", nested], check=True, timeout=20)


def test_calls_beside_each_other_share_the_threads():
    """Each chunk waits for one of the other's: if a call waited for its first chunk while it has another to do, or for
    the other call, both would wait for ever."""
    both = threading.Barrier(2, timeout=5)
    with Workers(2, Progress()) as workers:

        def call(name: str) -> str:
            return name + "".join(workers.map(lambda number, _: str(both.wait() * 0 + number), 3, 1))

        assert workers.beside(lambda: call("a"), lambda: call("b")) == ["a012", "b012"]
