"""Which cells are split: the worst, as many as it takes, and no more than there is room for."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_baker.core.splitting import over_fair_share, until_allowed

WEIGHT = np.array([1.0, 8.0, 0.0, 4.0, 2.0, -3.0])
PLENTY = 1000


@pytest.mark.parametrize(
    ("allowed", "chosen"), [(12.0, []), (11.0, [1]), (7.0, [1]), (6.9, [1, 3]), (2.9, [1, 3, 4]), (0.0, [1, 3, 4, 0])]
)
def test_the_worst_go_until_the_others_are_allowed(allowed, chosen):
    assert until_allowed(WEIGHT, allowed, PLENTY).tolist() == chosen


def test_no_more_than_there_is_room_for():
    assert until_allowed(WEIGHT, 0.0, 10).tolist() == [1, 3]
    assert until_allowed(WEIGHT, 0.0, 4).tolist() == []
    assert over_fair_share(WEIGHT, 0.5, 10).tolist() == [1, 3]


def test_more_than_a_fair_share_each():
    assert over_fair_share(WEIGHT, 2.0, PLENTY).tolist() == [1, 3]
