"""Patches cut where something stands on them, and finer where the light straight from the sources varies inside them.

A patch sends out one colour, so light that bends inside it matters as much as light that breaks: the floor at the edge
of a shadow, and the shade around a bulb.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .direct.illumination import DirectLight, Source
from .form_factors.sides import SITES, site_points
from .parallel import Workers
from .patch_contacts import cut_at_contacts, parted
from .patches import Patches, PatchMeshes, Space, make_patches, split_objects
from .pilot import Pilot
from .plan import Effort
from .sampling import stream
from .scene import Bool, Float64, Scene
from .splitting import over_fair_share
from .tessellation import Int64, split_each, split_triangles
from .visibility import Visibility

#: How often a patch is split into four at most, and how many times as many patches there may be in the end.
_LEVELS, _GROWTH = 6, 2
#: How far light may vary inside a patch, relative to the mean: what patches send out is blurred by distance.
_VARIATION = 0.5
#: Standard deviations by which the largest and the smallest of some points must differ to mean a variation.
_SIGNIFICANT = 4.0
_SHADOW_RAYS = 4
_CHUNK = 2048


def patches_by_light(
    scene: Scene, space: Space, lights: list[Source], effort: Effort, seed: int, workers: Workers, pilot: Pilot
) -> tuple[Patches, Visibility]:
    """About effort.patches patches, and more at contacts and where direct light varies; and what is visible among
    them."""
    split = split_objects(scene, effort.patches)
    patches = make_patches(scene, space, split, pilot.like(space, split))
    visibility = pilot.visibility_for(patches)
    light = DirectLight(lights, visibility, seed, effort.lights)
    triangles = len(patches.area)
    whole, split = split, cut_at_contacts(split, patches, visibility)
    if split is not whole:
        patches = make_patches(scene, space, split)
    fresh, fair = np.arange(len(patches)), 0.0
    for level in range(_LEVELS if lights else 0):
        mean, variation = _light_inside(patches, fresh, light, seed, level, workers)
        if level == 0:
            fair = (_VARIATION * float(patches.patch_area @ mean)) ** 2 / float(patches.patch_area.sum()) / len(patches)
        weight = variation**2 * patches.patch_area[fresh]
        uneven = fresh[over_fair_share(weight, fair, _GROWTH * effort.patches - len(patches))]
        if not len(uneven):
            break
        before, (split, changed) = split, _refined(split, patches, uneven)
        patches = make_patches(scene, space, split, patches if split.same_triangles(before) else None)
        fresh = np.unique(patches.patch[changed[patches.triangle]])
    patches = replace(patches, parted=parted(patches, visibility))
    # Patches of dense meshes get finer by fewer triangles each: the same triangles meet the rays.
    return patches, visibility if len(patches.area) == triangles else Visibility(patches.corners, patches.optics)


def _light_inside(
    patches: Patches, chosen: Int64, light: DirectLight, seed: int, level: int, workers: Workers
) -> tuple[Float64, Float64]:
    """Mean over the channels of the direct irradiance on the brighter side of each chosen patch (n,), and how far it
    varies inside the patch beyond what noise does, on the side where it varies more."""
    fronts = chosen.astype(np.int32)

    def work(number: int, part: slice) -> tuple[Float64, Float64]:
        rng = stream(seed, f"patch refinement {level}", number)
        points, normals = site_points(patches, fronts[part], rng.random((len(fronts[part]), 1, 3)))
        sides = []
        for turned in (normals, -normals):
            flat = turned.reshape(-1, 3)
            arriving = light.at(points.reshape(-1, 3), flat, flat, _SHADOW_RAYS, rng)
            grey = arriving.irradiance.mean(axis=1).reshape(-1, SITES)
            noise = np.sqrt(arriving.variance).mean(axis=1).reshape(-1, SITES)
            varies = np.ptp(grey, axis=1) - _SIGNIFICANT * np.sqrt((noise**2).mean(axis=1))
            sides.append((grey.mean(axis=1), np.maximum(varies, 0.0)))
        (front, back), (in_front, behind) = zip(*sides, strict=True)
        return np.maximum(front, back), np.maximum(in_front, behind)

    mean, variation = zip(*workers.map(work, len(fronts), _CHUNK), strict=True)
    return np.concatenate(mean), np.concatenate(variation)


def _refined(split: PatchMeshes, patches: Patches, uneven: Int64) -> tuple[PatchMeshes, Bool]:
    """Split the triangles of the uneven patches, or halve the patches where they are several triangles; and which of
    the new triangles (t,) are in another patch than before."""
    members = np.bincount(patches.patch)
    chosen = np.zeros(len(patches), dtype=bool)
    chosen[uneven] = True
    halvings, marked, changed = split.halvings.copy(), *np.zeros((2, len(split.halvings)), dtype=bool)
    grouped = patches.triangle[(chosen & (members > 1))[patches.patch]]
    halvings[grouped] += 1
    changed[grouped] = True
    marked[patches.triangle[(chosen & (members == 1))[patches.patch]]] = True
    meshes, source = split_each(split.meshes, marked, split_triangles)
    several = np.bincount(source, minlength=len(halvings)) > 1
    return replace(split, meshes=meshes, halvings=halvings[source]), (changed | several)[source]
