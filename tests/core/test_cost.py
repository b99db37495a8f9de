"""What work costs, and whether there is room for it."""

from __future__ import annotations

import timeit
from dataclasses import replace
from threading import Barrier

import numpy as np
import pytest

from radiosity_baker.core import bake as pipeline
from radiosity_baker.core import cost
from radiosity_baker.core.cost import Machine, Work, calibrate, free_memory_mb, refuse_without_room
from radiosity_baker.core.pilot import Pilot
from radiosity_baker.core.scene import Scene, SceneError
from radiosity_baker.core.settings import Settings

MACHINE = Machine(ray=1e-6, number=1e-8, closed=0.5, threads=2)


def test_the_machine_is_measured_on_the_scene(build):
    open_floor = calibrate(Pilot(Scene((build.quad(),), (build.grey,))), 1)
    room = calibrate(Pilot(Scene((build.box(inward=True),), (build.grey,))), 2)
    assert open_floor.closed < 0.01
    assert room.closed > 0.99
    # Both are grey, and nothing comes back to the floor.
    assert room.reflected == pytest.approx(0.5, abs=0.01)
    assert open_floor.reflected < 0.01
    assert (open_floor.threads, room.threads) == (1, 2)
    assert min(room.ray, room.number, open_floor.ray) > 0


def test_threads_are_timed_while_all_of_them_are_busy(build, monkeypatch):
    all_here = Barrier(2, timeout=10.0)
    monkeypatch.setattr(cost, "_fastest", lambda *_: all_here.wait() + 1.0)
    # Neither the rays nor the numbers of one thread wait for those of the other.
    assert calibrate(Pilot(build.furnished_room()), 2).number > 0.0
    assert not all_here.broken


def test_a_number_costs_little_more_than_to_look_it_up(build):
    """Not what some processors have quick instructions for: sorted numbers took 6 ns with them and 60 ns without, and
    bakes that took a second were priced at five."""
    numbers, index = np.random.default_rng(1).random(8192), np.random.default_rng(2).permutation(8192)
    looked_up = min(timeit.repeat(lambda: numbers[index], number=1, repeat=100)) / len(numbers)
    found = [calibrate(Pilot(Scene((build.box(inward=True),), (build.grey,))), 1).number for _ in range(5)]
    assert looked_up / 2.0 < min(found) < 12.0 * looked_up


def test_costs_add_up():
    """Of rays, which need nothing else, and of all the rest, which is why effects can be priced one by one."""
    one, other = Work(transport=1000, gather=2000, shadow=500, patches=100), Work(cells=300, own=50, fits=2)
    both = replace(one, cells=300, own=50, fits=2)
    assert MACHINE.seconds(both) == pytest.approx(MACHINE.seconds(one) + MACHINE.seconds(other))
    assert both.memory_mb == pytest.approx(one.memory_mb + other.memory_mb)


def test_more_threads_save_what_they_share():
    work = Work(gather=1000, cells=10)
    alone = replace(MACHINE, threads=1)
    assert MACHINE.seconds(work) < alone.seconds(work) < 2 * MACHINE.seconds(work)


def test_rays_that_escape_make_no_form_factors():
    work = Work(transport=1000)
    assert replace(MACHINE, closed=0.0).seconds(work) == pytest.approx(1000 * MACHINE.ray)
    assert MACHINE.seconds(work) > 1000 * MACHINE.ray


def test_free_memory_is_known_here():
    free = free_memory_mb()
    assert free is not None
    assert free > 100


def test_what_does_not_fit_is_refused_with_the_numbers(build, monkeypatch):
    monkeypatch.setattr(cost, "free_memory_mb", lambda: 20.0)
    with pytest.raises(SceneError, match=r"need about 1,234 MB of memory, and 20 MB are free"):
        refuse_without_room(1234.0)
    refuse_without_room(19.0)
    monkeypatch.setattr(pipeline, "make_receivers", None)  # before anything is made
    with pytest.raises(SceneError, match="20 MB are free"):
        pipeline.bake(build.furnished_room(), Settings(triangles=100_000))
    monkeypatch.setattr(cost, "free_memory_mb", lambda: None)
    refuse_without_room(1e9)
