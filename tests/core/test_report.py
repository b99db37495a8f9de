"""What the report says of the process."""

from __future__ import annotations

from pathlib import Path

import pytest

from radiosity_baker.core.report import peak_memory_mb

STATUS = Path("/proc/self/status")


@pytest.mark.skipif(not STATUS.exists(), reason="only Linux tells in another way")
def test_the_peak_of_memory_is_in_millions_of_bytes():
    lines = dict(line.split(":", 1) for line in STATUS.read_text().splitlines())
    # The system sums up what threads hold every now and then only; kibibytes for kilobytes would be 2.4 % off.
    assert peak_memory_mb() == pytest.approx(int(lines["VmHWM"].split()[0]) * 1024 / 1e6, rel=0.01)
