"""How many passes are worth their time."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_baker.core.accuracy import ErrorEstimate
from radiosity_baker.core.refinement import _too_coarse, passes_wanted
from radiosity_baker.core.settings import Settings


def left(falling, fixed=0.0, rest=0.0, at=2):
    """The error after `at` passes, when two leave `falling` beside what is fixed."""
    return at, ErrorEstimate(float(np.sqrt(falling**2 * 2 / at + fixed**2)), rest, 0.0)


def test_noise_falls_with_the_root_of_the_passes():
    assert passes_wanted([left(0.02)], asked=0.02 / np.sqrt(3.0)) == 4
    assert passes_wanted([left(0.02)], asked=0.0201) == 0


def test_what_the_rest_leaves_is_for_sampling():
    """3, 4 and 5 %: after 0.03 of resolution there is room for 0.04 of sampling in 0.05."""
    assert passes_wanted([left(0.0401, rest=0.03)], asked=0.05) == 2
    assert passes_wanted([left(0.0399, rest=0.03)], asked=0.05) == 0


def test_no_pass_is_spent_where_it_does_not_show():
    """Half of the rest adds an eighth to the total: less is not worth a pass, whatever was asked."""
    assert passes_wanted([left(0.049, rest=0.1)], asked=0.01) == 0
    assert passes_wanted([left(0.069, rest=0.1)], asked=0.01) == 2


def test_the_noise_of_the_patches_is_seen_from_the_second_fit_on():
    """Passes lower only what falls: once that is no more than what stays, more of them are wasted."""
    first, second = left(0.01, fixed=0.02, at=2), left(0.01, fixed=0.02, at=8)
    assert passes_wanted([first], asked=0.01) == 6
    assert passes_wanted([first, second], asked=0.01) == 0
    reachable = [left(0.04, fixed=0.01, at=2), left(0.04, fixed=0.01, at=8)]
    # (0.0004 - 0.0001) is to be left of the 0.0004 that falls with 8 passes: four thirds of them.
    assert passes_wanted(reachable, asked=0.02) == pytest.approx(8 / 3, abs=2)


def test_it_looks_again_before_it_spends_much():
    assert passes_wanted([left(0.5)], asked=0.001) == 6
    assert passes_wanted([left(0.5, at=8)], asked=0.001) == 24
    assert passes_wanted([left(0.5)], asked=0.0) == 6


def test_samples_are_for_what_finer_triangles_will_leave():
    """Triangles leave 0.05 of 0.05 and finer ones 0.03: there is room for 0.04 of sampling."""
    assert passes_wanted([(2, ErrorEstimate(0.0401, 0.0, 0.05))], 0.05, 0.6) == 2
    assert passes_wanted([(2, ErrorEstimate(0.0399, 0.0, 0.05))], 0.05, 0.6) == 0
    assert passes_wanted([(2, ErrorEstimate(0.0399, 0.0, 0.05))], 0.05) == 4


@pytest.mark.parametrize(
    ("sampling", "resolution", "settings", "split"),
    [
        (0.01, 0.019, Settings(error=0.02), True),
        (0.001, 0.019, Settings(error=0.02), False),  # it is as good as was asked
        (0.02, 0.012, Settings(error=0.02), False),  # samples are what is missing
        (0.01, 0.019, Settings(error=0.02, seconds=5.0), False),
        (0.01, 0.019, Settings(error=None), False),
    ],
)
def test_triangles_are_split_again_only_where_they_are_to_blame(sampling, resolution, settings, split):
    assert _too_coarse(ErrorEstimate(sampling, 0.0, resolution), settings) is split
