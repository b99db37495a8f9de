"""The worker thread: it ends, it can be stopped, and what it throws arrives."""

import threading

import pytest

from radiosity_baker.addon import job as module
from radiosity_baker.addon.job import BakeJob
from radiosity_baker.core.progress import Cancelled
from radiosity_baker.core.result import BakeResult, Report
from radiosity_baker.core.scene import Scene, SceneError
from radiosity_baker.core.settings import Settings

NOTHING = Scene(objects=(), surfaces=())


@pytest.fixture
def start(monkeypatch):
    jobs = []

    def begin(bake):
        monkeypatch.setattr(module.pipeline, "bake", bake)
        jobs.append(BakeJob())
        jobs[-1].start(NOTHING, Settings())
        return jobs[-1]

    yield begin
    for each in jobs:
        each.stop()


def bake_until_cancelled(_scene, _settings, progress, **_):
    while True:
        progress.report("wait", 0.5, 0.1)


def threads():
    return [thread for thread in threading.enumerate() if thread.name == "radiosity bake"]


def test_result_is_what_the_bake_returned(start):
    expected = BakeResult((), Report())
    job = start(lambda *_, **__: expected)
    assert job.result() is expected
    assert job.poll()
    assert not threads()
    assert BakeJob.running is None


def test_bakes_beside_the_main_thread(start):
    where = []
    start(lambda *_, **__: where.append(threading.current_thread()) or BakeResult((), Report())).result()
    assert where[0] is not threading.main_thread()


def test_cancel_ends_the_thread(start):
    job = start(bake_until_cancelled)
    assert not job.poll()
    job.cancel()
    assert job.cancelling
    with pytest.raises(Cancelled):
        job.result()
    BakeJob.wait_for_leaving()
    assert not threads()


def test_who_cancels_need_not_wait(start):
    go_on = threading.Event()
    job = start(lambda *_, **__: go_on.wait() and BakeResult((), Report()))
    job.cancel()
    assert job.poll()
    with pytest.raises(Cancelled):
        job.result()
    assert BakeJob.running is None
    assert threads()
    go_on.set()
    BakeJob.wait_for_leaving()
    assert not threads()


def test_kept_light_is_that_of_the_last_complete_pass(monkeypatch):
    passes = [BakeResult((), Report(patches=number)) for number in range(3)]
    at_work = threading.Event()

    def bake(_scene, _settings, progress, **_):
        for each in passes:
            progress.show(lambda each=each: each)
        at_work.set()
        while True:
            progress.report("gather", 0.5)

    monkeypatch.setattr(module.pipeline, "bake", bake)
    job = BakeJob(lambda result: result.report.patches)
    job.start(NOTHING, Settings())
    at_work.wait()
    assert job.picture == 2
    job.keep()
    assert job.result() is passes[-1]
    assert "stopped early" in passes[-1].report.warnings[0]
    BakeJob.wait_for_leaving()


def test_nothing_to_keep_does_not_stop_the_bake(start):
    job = start(bake_until_cancelled)
    job.keep()
    assert not job.keeping
    assert not job.poll()


def test_a_result_that_comes_after_the_cancel_is_dropped(start):
    go_on = threading.Event()
    job = start(lambda *_, **__: go_on.wait() and BakeResult((), Report()))
    job.cancel()
    go_on.set()
    with pytest.raises(Cancelled):
        job.result()


@pytest.mark.parametrize("problem", [SceneError("'Cube' is bad: mend it."), MemoryError("too many patches")])
def test_what_the_bake_raises_arrives_in_the_main_thread(start, problem):
    def bake(*_, **__):
        raise problem

    with pytest.raises(type(problem)) as caught:
        start(bake).result()
    assert caught.value is problem
    assert BakeJob.running is None


def test_one_bake_at_a_time(start):
    job = start(bake_until_cancelled)
    with pytest.raises(SceneError, match="already running"):
        start(bake_until_cancelled)
    job.stop()
    assert not threads()
    start(lambda *_, **__: BakeResult((), Report())).result()


def test_time_left_follows_the_progress(start):
    job = start(bake_until_cancelled)
    while job.progress.fraction == 0.0:
        assert job.remaining is None or job.progress.fraction > 0.0
    # Half is done, so as much time is left as went by.
    before, remaining, after = job.elapsed, job.remaining, job.elapsed
    assert before <= remaining <= after
