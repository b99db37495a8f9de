"""Threads of numpy's own: none while a bake runs, and afterwards as before."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from threading import Barrier

import pytest

from radiosity_baker.core import blas
from radiosity_baker.core.blas import one_thread
from radiosity_baker.core.parallel import Workers
from radiosity_baker.core.progress import Progress

needs_openblas = pytest.mark.skipif(blas._openblas() is None, reason="numpy came without OpenBLAS")


@pytest.fixture
def three_threads():
    before = blas._threads()
    blas._set_threads(3)
    yield
    blas._set_threads(before)


@needs_openblas
@pytest.mark.usefixtures("three_threads")
def test_a_bake_keeps_it_on_one_thread_and_gives_back_what_there_was():
    with Workers(2, Progress()):
        assert blas._threads() == 1
    assert blas._threads() == 3


@needs_openblas
@pytest.mark.usefixtures("three_threads")
def test_it_is_given_back_after_a_fault():
    with pytest.raises(MemoryError), Workers(2, Progress()):
        raise MemoryError
    assert blas._threads() == 3


@needs_openblas
@pytest.mark.usefixtures("three_threads")
def test_the_last_of_two_bakes_gives_it_back():
    both = Barrier(2, timeout=5)

    def bake(_: int) -> None:
        with one_thread:
            both.wait()

    with ThreadPoolExecutor(2) as pool:
        list(pool.map(bake, range(2)))
    assert blas._threads() == 3


def test_a_numpy_without_it_bakes_as_well(monkeypatch):
    monkeypatch.setattr(blas, "_openblas", lambda: None)
    with one_thread:
        assert blas._threads() == 1
