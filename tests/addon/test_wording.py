"""What the panel and the command line say of a bake."""

from types import SimpleNamespace

import pytest

from radiosity_baker.addon import wording

REPORT = {
    "objects": [{"triangles": 1000}, {"triangles": 234}],
    "seconds": {"total": 3.21},
    "estimated_error": {"total": 0.0182, "sampling": 0.008, "transport": 0.005, "resolution": 0.015},
    "energy": {"emitted": 10.0, "absorbed": 9.1, "escaped": 0.9, "residual": 1e-4},
}


def test_summary_says_what_was_done_and_how_good_it_is():
    assert wording.summary(REPORT) == "Baked 2 objects, 1,234 triangles in 3.2 s, estimated error 1.8 %"


def test_error_names_its_causes():
    assert wording.error_lines(REPORT) == ["Estimated error 1.8 %: sampling 0.8 %, transport 0.5 %, resolution 1.5 %"]


def test_ledger_in_words():
    line = wording.energy_line(REPORT).replace("\N{NO-BREAK SPACE}", " ")
    assert line == "Of 10 W given off, 9.1 W were absorbed and 0.9 W escaped; less than 0.1 % is not accounted for"


def test_ledger_that_does_not_close_says_so():
    leak = REPORT | {"energy": {"emitted": 10.0, "absorbed": 8.0, "escaped": 0.9, "residual": -1.1}}
    assert wording.energy_line(leak).endswith("; 11.0 % is not accounted for")


@pytest.mark.parametrize(
    ("job", "said"),
    [
        ({}, "Starting 0 %"),
        ({"stage": "gather", "fraction": 0.434}, "Gather 43 %"),
        ({"stage": "gather", "fraction": 0.5, "error": 0.0213}, "Gather 50 %, error 2.1 %"),
        ({"stage": "gather", "cancelling": True}, "Cancelling"),
        ({"stage": "gather", "keeping": True}, "Keeping"),
        ({"stage": "layers", "writing": True}, "Writing"),
        ({"stage": "layers", "ended": True}, "Waiting for Object Mode"),
    ],
)
def test_stage_of_a_running_bake(job, said):
    progress = SimpleNamespace(**{"stage": "", "fraction": 0.0, "error": None} | job)
    running = SimpleNamespace(progress=progress, poll=lambda: "ended" in job)
    for state in ("cancelling", "keeping", "writing"):
        setattr(running, state, state in job)
    assert wording.stage(running) == said


def test_time_left_is_told_once_it_is_known():
    assert wording.time_line(SimpleNamespace(elapsed=2.0, remaining=None)) == "0:02 so far"
    assert wording.time_line(SimpleNamespace(elapsed=2.0, remaining=63.0)) == "0:02 so far, about 1:03 left"


def test_nothing_is_said_of_what_is_not_known():
    dark = REPORT | {"estimated_error": {}, "energy": {"emitted": 0.0}, "objects": [{"triangles": 2}]}
    assert wording.summary(dark) == "Baked 1 object, 2 triangles in 3.2 s"
    assert wording.error_lines(dark) == []
    assert wording.energy_line(dark) == ""


def test_clock():
    assert [wording.clock(seconds) for seconds in (0.9, 65.0, 3600.0)] == ["0:00", "1:05", "60:00"]
