"""What work costs on this machine: seconds from a few rays traced and numbers summed here and now, memory from what is
kept. The ratios were measured on the scenes of `make bench`; machines share them better than seconds.
"""

from __future__ import annotations

import ctypes
import os
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Barrier, BrokenBarrierError
from time import perf_counter

import numpy as np

from .parallel import Workers, thread_count
from .pilot import Pilot
from .progress import Progress
from .sampling import stream
from .scene import SceneError

#: Rays, and numbers, that measure how fast this machine is.
_CALIBRATION = 1 << 13
#: Of these, rays from one point: as in a bake, where one after the other starts there.
_LOOKS = 8
#: How often the rays are timed, and the numbers, which take so little that a moment's disturbance is all of it.
_LONG, _BRIEF = 3, 20
#: Seconds that a thread waits for the others: a busy machine may not start them all.
_PATIENCE = 1.0
#: Beyond Embree's own time, in numbers summed by one thread. That all threads share: of a ray that gathers, of one that
#: looks for a lamp, of the choice whether to ask one, of a transport ray that meets something and so makes a form
#: factor, of a cell in each fit.
_LOOK, _AIM, _CHOOSE, _FORM_FACTOR, _FIT = 21.0, 70.0, 22.0, 52.0, 1000.0
#: That one thread bears alone: of a form factor in the balance, of a cell in each fit, of a cell and a patch while they
#: are split, and of a triangle that is there already; of a cell that contours are looked for in, and one they cross.
_BALANCE, _ASSEMBLE, _SPLIT_CELL, _SPLIT_PATCH, _OWN = 25.0, 680.0, 1500.0, 5500.0, 1400.0
_CONTOUR, _CROSSED = 1100.0, 30_000.0
#: Of any bake, however small, and of any round of finding where light bends.
_FIXED, _ROUND = 2.6e7, 1.4e7
#: Bytes held at once for each cell, patch and triangle that is there already.
_CELL_BYTES, _PATCH_BYTES, _OWN_BYTES = 1700.0, 15_000.0, 600.0


@dataclass(frozen=True)
class Work:
    """What a bake has to do. transport, gather, shadow: rays; cells: the triangles that light is fitted to; own: the
    triangles that the scene itself has; fits: how often the light is fitted to so many; contours: cells that they are
    looked for in, crossed: those that they cross; rounds of finding where light bends; choices: of which lights to ask,
    one for each at each point."""

    transport: float = 0.0
    gather: float = 0.0
    shadow: float = 0.0
    cells: float = 0.0
    patches: float = 0.0
    own: int = 0
    fits: float = 1.0
    contours: float = 0.0
    crossed: float = 0.0
    rounds: float = 0.0
    choices: float = 0.0

    @property
    def memory_mb(self) -> float:
        """By how much the process grows, in MB: whatever it holds already is not free anyway."""
        return (self.cells * _CELL_BYTES + self.patches * _PATCH_BYTES + self.own * _OWN_BYTES) / 1e6


@dataclass(frozen=True)
class Machine:
    """How fast this machine is on one scene. ray: seconds that all threads together need for one; number: seconds that
    one thread needs to look one up and add it to a sum, as the rows of a sparse matrix do, which no processor has quick
    instructions for that another lacks; closed: share of the rays that meet something; onward: that go on from there;
    reflected: mean over the rays of the albedo of what they meet, which is the share of all light that has bounced."""

    ray: float
    number: float
    closed: float
    threads: int
    onward: float = 0.0
    reflected: float = 0.0

    def seconds(self, work: Work) -> float:
        looks, factors = work.gather + work.shadow, work.transport * self.closed
        shared = work.gather * _LOOK + work.shadow * _AIM + work.choices * _CHOOSE
        shared += factors * _FORM_FACTOR + work.cells * work.fits * _FIT
        alone = factors * _BALANCE + work.cells * (work.fits * _ASSEMBLE + _SPLIT_CELL)
        alone += work.patches * _SPLIT_PATCH + work.own * _OWN + bool(work.cells) * _FIXED
        alone += work.contours * _CONTOUR + work.crossed * _CROSSED + work.rounds * _ROUND
        return self.ray * (looks + work.transport) + self.number * (shared / self.threads + alone)


def calibrate(pilot: Pilot, threads: int) -> Machine:
    """Trace a few thousand rays from the receivers on as many threads as the bake will have (0: all)."""
    threads = thread_count(threads)
    patches, visibility = pilot.patches, pilot.visibility
    rng = stream(0, "calibration")
    points, normals = (np.repeat(v, _LOOKS, axis=0) for v in pilot.on_receivers(_CALIBRATION // _LOOKS, rng))
    directions = rng.normal(size=(_CALIBRATION, 3))
    directions = directions / np.linalg.norm(directions, axis=1, keepdims=True) + normals
    origins = points + 1e-4 * normals
    rays = origins.astype(np.float32), directions.astype(np.float32)
    numbers, index, together = rng.random(_CALIBRATION), rng.permutation(_CALIBRATION), Barrier(threads)

    def taken(*_: object) -> tuple[float, float]:
        """Seconds for the rays and for the numbers. All threads start at once and are busy throughout, as in a bake:
        beside an idle core, or before another thread has woken up, the same takes half as long again, or less."""
        with suppress(BrokenBarrierError):
            together.wait(_PATIENCE)
        return _fastest(lambda: visibility.nearest(*rays), _LONG), _fastest(lambda: np.cumsum(numbers[index]), _BRIEF)

    hit = visibility.nearest(*rays)
    onward = 0.0 if patches.optics is None else np.mean(patches.optics.goes_on[hit] & (hit >= 0))
    with Workers(threads, Progress()) as workers:
        traced, ordered = np.mean(list(workers.map(taken, threads, 1)), axis=0).tolist()
    met = np.mean(hit >= 0)
    reflected = np.where(hit >= 0, patches.albedo.mean(axis=1)[patches.patch[hit]], 0.0).mean()
    ray, number = traced / (threads * _CALIBRATION), ordered / _CALIBRATION
    return Machine(ray, number, float(met), threads, float(onward), float(reflected))


def _fastest(work: Callable[[], object], times: int) -> float:
    """Seconds of the fastest of so many times: the first pays for memory, and others may be disturbed."""
    took = []
    for _ in range(times):
        begun = perf_counter()
        work()
        took.append(perf_counter() - begun)
    return min(took)


def refuse_without_room(memory_mb: float) -> None:
    """Raise SceneError if a bake that will hold so much more than now would not fit into memory."""
    free = free_memory_mb()
    if free is not None and memory_mb > free:
        raise SceneError(
            f"This bake would need about {memory_mb:,.0f} MB of memory, and {free:,.0f} MB are free: ask for fewer "
            "triangles or a larger error, or close other programs."
        )


def refuse_larger_scene(triangles: int) -> None:
    """Raise SceneError if nothing would be left for the bake of a scene of so many triangles: asked while it is read,
    for some files hold a few faces and millions of instances."""
    free = free_memory_mb()
    if free is not None and triangles * _OWN_BYTES / 1e6 > free:
        raise SceneError(
            f"The scene has more than {triangles:,} triangles, with all instances, and {free:,.0f} MB of memory are "
            "free: hide from rendering what the light does not need, or lower subdivisions and the number of instances."
        )


def patches_that_fit() -> float:
    """How many patches half of the memory that is free would hold."""
    free = free_memory_mb()
    return np.inf if free is None else free * 1e6 / _PATCH_BYTES / 2.0


def free_memory_mb() -> float | None:
    """How much memory this process may still take, in MB; None where the system does not tell."""
    if hasattr(ctypes, "windll"):
        return _free_on_windows()
    table = Path("/proc/meminfo")
    if table.exists():
        lines = dict(line.split(":", 1) for line in table.read_text(encoding="ascii").splitlines())
        return float(lines["MemAvailable"].split()[0]) / 1e3 if "MemAvailable" in lines else None
    # macOS tells the size of all memory; what others hold of it, it can compress or swap out.
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 1e6
    except (ValueError, OSError):
        return None


class _MemoryStatus(ctypes.Structure):
    """MEMORYSTATUSEX of the Windows API."""

    _fields_ = (
        ("length", ctypes.c_ulong),
        ("load", ctypes.c_ulong),
        *(
            (name, ctypes.c_ulonglong)
            for name in ("total", "free", "total_page", "free_page", "all", "rest", "extended")
        ),
    )


def _free_on_windows() -> float | None:
    status = _MemoryStatus(length=ctypes.sizeof(_MemoryStatus))
    kernel = getattr(ctypes, "windll").kernel32  # noqa: B009 - only Windows has it, and mypy runs elsewhere
    return status.free / 1e6 if kernel.GlobalMemoryStatusEx(ctypes.byref(status)) else None
