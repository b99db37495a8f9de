"""Many emitting triangles as one light: each shadow ray goes to one of them, chosen down a tree by what it may bring.

Every node of a binary tree knows the power, the place, the size and the slant of the triangles below it. From the root
down, one of two children is chosen in proportion to an estimate of what it brings; a wrong estimate costs noise, never
truth, for what arrives is divided by the chance of its choice. A. Conty Estevez and C. Kulla, Importance sampling of
many lights with adaptive tree splitting (2018); here slants are second moments of the normals, since both sides shine.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..patches import triangle_geometry
from ..scene import Bool, Float32, Float64
from .solid_angle import triangle_directions

#: Cosines at the receiver and at the emitter are taken for at least this: no triangle that may shine has no chance.
_LEAST_COSINE, _LEAST_SLANT = 0.02, 0.1
#: Triangles that look larger than this (area / distance^2) are sampled by solid angle, smaller ones by area.
_LARGE = 0.02


@dataclass(frozen=True, eq=False)
class Shots:
    """Ways (3, r, n) from points to places on emitters, and the irradiance (3, r, n) that each brings if it is free, as
    the only one of r."""

    towards: Float32
    brings: Float32


class EmitterTree:
    """corners (t, 3, 3) in the unit box, radiance (t, 3) of triangles; one_sided (t,): those that shine from their
    front alone, None for none."""

    def __init__(self, corners: Float64, radiance: Float64, one_sided: Bool | None = None) -> None:
        normals, area = triangle_geometry(corners)
        center = corners.mean(axis=1)
        order, cuts = _halve(center)
        corners, normals, area, center, radiance = (a[order] for a in (corners, normals, area, center, radiance))
        self._corners = np.ascontiguousarray(corners.transpose(1, 2, 0))
        self._normals, self._area = normals.T.copy(), area
        self._one_sided = None if one_sided is None or not one_sided.any() else one_sided[order]
        self._color = (np.pi * radiance.T).astype(np.float32)
        power = area * radiance.mean(axis=1)
        spread = ((corners - center[:, None]) ** 2).sum(axis=(1, 2)) / 12 + (center**2).sum(axis=1)
        x, y, z = normals.T
        columns = np.column_stack([np.ones_like(power), center, spread, x * x, y * y, z * z, x * y, y * z, z * x])
        weighed = power[:, None] * columns
        self._levels = [_level(_sums(weighed, cut)) for cut in cuts]
        self._triangle = np.minimum(cuts[-1][:-1], len(area) - 1)

    def shoot(self, points: Float32, shading: Float32, unit: Float32) -> Shots:
        """From points (3, n) with shading normals (3, n), for points (3, r, n) of the unit cube."""
        node, chance = self._choose(points, shading, unit[0])
        triangle = self._triangle[node]
        corners = self._corners[:, :, triangle] - points[:, None]
        area = self._area[triangle]
        root = np.sqrt(unit[1])
        towards = corners[0] + root * ((1 - unit[2]) * (corners[1] - corners[0]) + unit[2] * (corners[2] - corners[0]))
        squared = np.maximum((towards * towards).sum(axis=0), 1e-30)
        depth = np.abs((towards * self._normals[:, triangle]).sum(axis=0))
        solid = area * depth / squared**1.5
        large = np.nonzero(area > _LARGE * (corners.mean(axis=0) ** 2).sum(axis=0))
        if len(large[0]):
            directions, angle = triangle_directions(corners[:, :, *large], unit[1:, None, *large].astype(np.float64))
            slant = (directions[:, 0] * self._normals[:, triangle[large]]).sum(axis=0)
            plane = (corners[0][:, *large] * self._normals[:, triangle[large]]).sum(axis=0)
            reach = plane / np.where(slant == 0, 1e-30, slant)
            usable = (angle > 1e-5) & (reach > 0)
            large = tuple(index[usable] for index in large)
            towards[:, *large] = (directions[:, 0] * reach)[:, usable]
            squared[large] = (towards[:, *large] ** 2).sum(axis=0)
            solid[large] = angle[usable]
        cosine = np.maximum((towards * shading[:, None]).sum(axis=0), 0) / np.sqrt(squared)
        if self._one_sided is not None:
            behind = (towards * self._normals[:, triangle]).sum(axis=0) > 0
            solid[self._one_sided[triangle] & behind] = 0.0
        brings = self._color[:, triangle] * (cosine * solid / (np.pi * chance)).astype(np.float32)
        return Shots(towards.astype(np.float32), brings)

    def _choose(self, points: Float32, shading: Float32, unit: Float32) -> tuple[NDArray[np.int64], Float32]:
        """A leaf (r, n) for each point and number (r, n), and the chance (r, n) that it is chosen."""
        node = np.zeros(unit.shape, dtype=np.int64)
        chance = np.ones(unit.shape, dtype=np.float32)
        rest = unit
        for level in self._levels[1:]:
            left = _promise(level[:, 2 * node], points, shading)
            right = _promise(level[:, 2 * node + 1], points, shading)
            share = left / np.maximum(left + right, np.float32(1e-37))
            go_left = rest < share
            taken = np.where(go_left, share, 1 - share)
            rest = np.where(go_left, rest, rest - share) / np.maximum(taken, np.float32(1e-30))
            rest = np.minimum(rest, np.float32(1 - 1e-7))
            chance *= taken
            node = 2 * node + ~go_left
        return node, chance


def _promise(facts: Float32, points: Float32, shading: Float32) -> Float32:
    """What nodes (11, r, n) may bring to points (3, n) with shading normals (3, n), in any unit."""
    power, spread = facts[0], facts[4]
    x, y, z = facts[1:4] - points[:, None]
    squared = x * x + y * y + z * z
    height = x * shading[0] + y * shading[1] + z * shading[2] + np.sqrt(spread)
    apart = squared + spread + np.float32(1e-12)
    cosine = np.clip(height / np.sqrt(apart), _LEAST_COSINE, 1)
    xx, yy, zz, xy, yz, zx = facts[5:]
    slant = x * x * xx + y * y * yy + z * z * zz + 2 * (x * y * xy + y * z * yz + z * x * zx)
    slant = np.sqrt(np.maximum(slant, 0) / np.maximum(squared, np.float32(1e-12)))
    return np.asarray(power * cosine * (slant + _LEAST_SLANT) / apart)


def _sums(weighed: Float64, cut: NDArray[np.int64]) -> Float64:
    """(m, 11) over the triangles from each cut to the next. Differences of running sums would leave to triangles
    without area what rounding leaves of the others."""
    sums = np.zeros((len(cut) - 1, weighed.shape[1]))
    filled = cut[1:] > cut[:-1]
    sums[filled] = np.add.reduceat(weighed, cut[:-1][filled], axis=0)
    return sums


def _level(sums: Float64) -> Float32:
    """What is known (11, m) of the nodes of a level, from sums (m, 11) over their triangles weighed by power: power,
    mean place (3), mean squared distance from it, and the moments xx, yy, zz, xy, yz, zx of the normals."""
    power = sums[:, :1]
    means = sums[:, 1:] / np.maximum(power, 1e-300)
    means[:, 3] = np.maximum(means[:, 3] - (means[:, :3] ** 2).sum(axis=1), 0)
    return np.ascontiguousarray(np.concatenate([power, means], axis=1).T, dtype=np.float32)


def _halve(center: Float64) -> tuple[NDArray[np.int64], list[NDArray[np.int64]]]:
    """An order of the places (t, 3), and for each level of the tree where its nodes begin and end in it: each node is
    cut in half along its longest side, until none holds two."""
    order = np.arange(len(center))
    cuts = [np.array([0, len(center)])]
    while np.diff(cuts[-1]).max() > 1:
        cut = cuts[-1]
        node = np.repeat(np.arange(len(cut) - 1), np.diff(cut))
        low, high = np.full((len(cut) - 1, 3), np.inf), np.full((len(cut) - 1, 3), -np.inf)
        np.minimum.at(low, node, center[order])
        np.maximum.at(high, node, center[order])
        axis = np.argmax(high - low, axis=1)
        order = order[np.lexsort((center[order, axis[node]], node))]
        middle = (cut[:-1] + cut[1:] + 1) // 2
        cuts.append(np.concatenate([np.column_stack([cut[:-1], middle]).ravel(), cut[-1:]]))
    return order, cuts
