"""Work in slices does what work at once does, and cleans up where it is stopped."""

import threading

import pytest

from radiosity_baker.addon.slices import Slices, at_once, breathe


@pytest.fixture
def log():
    return []


def steps(log):
    try:
        for number in range(3):
            log.append((yield lambda n=number: (n, threading.current_thread() is threading.main_thread())))
            yield breathe
    finally:
        log.append("clean")
    return "done"


def test_at_once_everything_is_done_in_this_thread(log):
    assert at_once(steps(log)) == "done"
    assert log == [(0, True), (1, True), (2, True), "clean"]


def test_in_slices_the_arrays_are_worked_on_by_another_thread(log):
    slices = Slices(steps(log))
    while not slices.advance(0.001):
        pass
    assert slices.outcome == "done"
    assert log == [(0, False), (1, False), (2, False), "clean"]


def test_a_slice_does_not_wait_for_long_work():
    go_on = threading.Event()

    def wait():
        yield go_on.wait
        return "done"

    slices = Slices(wait())
    assert not slices.advance(0.01)
    go_on.set()
    while not slices.advance(0.01):
        pass
    assert slices.outcome == "done"


def test_stopped_it_cleans_up(log):
    slices = Slices(steps(log))
    slices.advance(0.0)
    while not log:
        slices.advance(0.001)
        if log:
            break
    slices.stop()
    assert log[-1] == "clean"


def test_what_the_work_raises_arrives():
    def fail():
        yield lambda: 1 / 0

    with pytest.raises(ZeroDivisionError):
        Slices(fail()).advance(10.0)
