"""What every case leaves behind for the table in docs/reliability.md: properties in pytest's own XML report."""

from __future__ import annotations

import pytest
from hypothesis import settings

settings.register_profile("fuzz")


@pytest.fixture
def told(record_property):
    """Tell what a case is about, and assert that it keeps its bound.

    exact: the true figure, or None where only the bound is known; got: what came out; allowed: how far it may be off.
    """

    def tell(case: str, exact: float, got: float, allowed: float, catches: str = "") -> None:
        for name, value in (("case", case), ("exact", exact), ("got", got), ("allowed", allowed), ("catches", catches)):
            record_property(name, value)
        assert abs(got - exact) <= allowed, f"{case}: {got} instead of {exact}, more than {allowed} away. {catches}"

    return tell


@pytest.fixture
def long_run() -> bool:
    """Whether this is `make fuzz`, which repeats what `make test` does a few times."""
    return settings.get_current_profile_name() == "fuzz"
