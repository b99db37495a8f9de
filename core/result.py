"""What a bake gives back: values per corner, and a report."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any

from .scene import Float32, Float64, Int32


@dataclass(frozen=True, eq=False)
class BakedObject:
    """A receiver with its light.

    vertices (v, 3) float64 world space; the input's own vertices come first, in their order. triangles (t, 3) int32.
    parent (t,) int32: the input triangle each came from. barycentric (t, 3, 3) float64: [triangle, corner] are the
    weights of the three corners of the parent. Without tessellation these are the input triangles themselves.
    layers: name to (t, 3, 3) float32, [triangle, corner, channel], W/(m^2 sr).
    """

    name: str
    vertices: Float64
    triangles: Int32
    parent: Int32
    barycentric: Float64
    layers: dict[str, Float32]


@dataclass(frozen=True)
class Effect:
    """One thing light can do, whether this bake simulates it, and why in words a person understands."""

    name: str
    active: bool
    reason: str


@dataclass
class Report:
    """What a bake did and how good it is; `as_dict` is the report.json of the headless contract."""

    seconds: dict[str, float] = field(default_factory=dict)
    patches: int = 0
    rays: dict[str, int] = field(default_factory=dict)
    iterations: int = 0
    threads: int = 1
    estimated_error: dict[str, float] = field(default_factory=dict)
    energy: dict[str, float] = field(default_factory=dict)
    effects: list[Effect] = field(default_factory=list)
    objects: list[dict[str, Any]] = field(default_factory=list)
    vertices: dict[str, int] = field(default_factory=dict)
    peak_memory_mb: float = 0.0
    warnings: list[str] = field(default_factory=list)
    version: str = ""

    def as_dict(self) -> dict[str, Any]:
        return asdict(self)


@dataclass(frozen=True, eq=False)
class BakeResult:
    objects: tuple[BakedObject, ...]
    report: Report
