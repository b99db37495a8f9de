"""A few rays before the bake: what they cost on this machine, and where they find the sky."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from .patches import Patches, PatchMeshes, Space, make_patches, split_objects, triangle_geometry, unit_space
from .sampling import cosine_patterns, frames, stream
from .scene import Bool, Float32, Float64, Int32, Scene
from .tessellation import Int64
from .visibility import Path, Visibility, offset_along

#: Patches of a scene for pilot rays.
_PATCHES = 2048
#: Points of the receivers and rays from each; the same again, until so many rays have found the sky from inside rooms.
_POINTS, _RAYS, _ROUNDS, _ENOUGH = 1024, 32, 4, 200
#: Share of a point's rays that escape up to which it lies inside a room: beyond, rays find the sky well enough.
_NARROW = 0.25
#: Of rays that all find nothing, so many over their number may find something: less likely than one in a thousand.
_SURE = 7.0
#: Where no ray has found the sky: paths from the receivers, and how often each is scattered.
_PATHS, _TURNS = 4096, 8


@dataclass(frozen=True, eq=False)
class Pilot:
    """A scene in a few patches, made ready for rays once there is need of them.

    Raises SceneError then when no object of the scene is there for light.
    """

    scene: Scene

    @cached_property
    def _split(self) -> PatchMeshes:
        return split_objects(self.scene.surroundings(), _PATCHES)

    @cached_property
    def space(self) -> Space:
        return unit_space(self.scene)

    @cached_property
    def patches(self) -> Patches:
        return make_patches(self.scene.surroundings(), self.space, self._split)

    @cached_property
    def visibility(self) -> Visibility:
        return Visibility(self.patches.corners, self.patches.optics)

    def like(self, space: Space, split: PatchMeshes) -> Patches | None:
        """The pilot's patches, where they are of the same triangles: where all of these are smaller than patches."""
        here = self.patches.space
        placed = np.array_equal(space.center, here.center) and space.metres == here.metres
        return self.patches if placed and split.same_triangles(self._split) else None

    def visibility_for(self, patches: Patches) -> Visibility:
        """What is visible among some patches: what is ready, where they are of the same triangles."""
        plain = patches.optics is None and self.patches.optics is None
        if plain and np.array_equal(patches.corners, self.patches.corners):
            return self.visibility
        return Visibility(patches.corners, patches.optics)

    def look_around(self, points: Float64, normals: Float64, rays: int, rng: np.random.Generator) -> Look:
        """Cosine-distributed rays from points (n, 3) on surfaces with unit normals (n, 3), n * rays of them."""
        turn = rng.random(len(points), dtype=np.float32) * np.float32(2.0 * np.pi)
        pattern = cosine_patterns(len(points), rays, rng)
        directions = (pattern @ frames(normals.astype(np.float32), turn)).reshape(-1, 3)
        origins = np.repeat(offset_along(points, normals), rays, axis=0)
        return Look(origins, directions, self.visibility.follow(origins, directions, rng))

    @cached_property
    def _receivers(self) -> tuple[Float64, Float64, Float64]:
        """Corners (t, 3, 3) of the receivers' triangles, their unit normals and areas."""
        corners = np.concatenate([o.vertices[o.triangles] for o in self.scene.receivers()])
        corners = self.space.normalise(corners)
        return corners, *triangle_geometry(corners)

    @property
    def receiving_areas(self) -> Float64:
        """Of the receivers' triangles (t,), in the unit box."""
        return self._receivers[2]

    def on_receivers(self, count: int, rng: np.random.Generator) -> tuple[Float64, Float64]:
        """Points (n, 3) spread at random over the receivers, and the normals (n, 3) there."""
        corners, normals, _ = self._drawn(count, rng)
        return _somewhere_in(corners, rng), normals

    def pairs_on_receivers(self, count: int, cells: int, rng: np.random.Generator) -> tuple[Float64, Float64, Float64]:
        """Pairs of points (n, 3), spread at random over the receivers, in one triangle each and no further from each
        other than they are in one of so many equal cells; and the normals (n, 3) there."""
        corners, normals, area = self._drawn(count, rng)
        one, another = (_somewhere_in(corners, rng) for _ in range(2))
        nearer = np.minimum(np.sqrt(self.receiving_areas.sum() / cells / area), 1.0)
        return one, one + nearer[:, None] * (another - one), normals

    def _drawn(self, count: int, rng: np.random.Generator) -> tuple[Float64, Float64, Float64]:
        """Corners (n, 3, 3), normals and areas of triangles of the receivers, drawn at random by their areas."""
        area = self.receiving_areas
        chosen = rng.choice(len(area), size=count, p=area / area.sum())
        corners, normals, area = (of_all[chosen] for of_all in self._receivers)
        return corners, normals, area

    def where_hit(self, path: Path, rng: np.random.Generator) -> tuple[Float64, Float64]:
        """A point of each triangle that was hit, and its normal on that side; of rays that hit something."""
        triangle = path.hit[path.hit >= 0]
        normals, way = self.patches.normals[triangle], path.directions[path.hit >= 0]
        side = -np.sign(np.einsum("nk,nk->n", normals, way))
        return _somewhere_in(self.patches.corners[triangle], rng), normals * side[:, None]


@dataclass(frozen=True, eq=False)
class Look:
    """Rays (n, 3) in the unit box, and where they ended."""

    origins: Float32
    directions: Float32
    path: Path

    @property
    def escaped(self) -> Bool:
        return np.asarray(self.path.hit == -1)

    @property
    def straight(self) -> Bool:
        """Which end in the direction in which they began."""
        return np.asarray(np.einsum("nk,nk->n", self.path.directions, self.directions) > 1.0 - 1e-5)


@dataclass(frozen=True, eq=False)
class Escapes:
    """How rays from the receivers found the sky.

    origins, directions (n, 3) float32 in the unit box, of those that left straight from points that see little of it;
    inside: the share of such points; openness: the share of the rays from them that did. none: no ray did from
    anywhere, straight or not; then up to a share `doubt` of all rays may all the same.
    """

    origins: Float32
    directions: Float32
    inside: float
    openness: float
    none: bool
    doubt: float

    def __len__(self) -> int:
        return len(self.origins)

    def only(self, chosen: Bool | Int32 | Int64) -> Escapes:
        return replace(self, origins=self.origins[chosen], directions=self.directions[chosen])


def look_for_sky(pilot: Pilot) -> Escapes:
    """Rays from the receivers until enough have left, or it is clear that hardly any do."""
    origins: list[Float32] = []
    directions: list[Float32] = []
    left, escaped, within = 0, False, 0
    for number in range(_ROUNDS):
        rng = stream(0, "look for sky", number)
        look = pilot.look_around(*pilot.on_receivers(_POINTS, rng), _RAYS, rng)
        narrow = np.repeat(look.escaped.reshape(-1, _RAYS).mean(axis=1) <= _NARROW, _RAYS)
        kept = look.escaped & narrow & look.straight
        origins.append(look.origins[kept])
        directions.append(look.directions[kept])
        left += int(kept.sum())
        within += int(narrow.sum())
        escaped |= bool(look.escaped.any())
        if left >= _ENOUGH or (escaped and not left):
            break
    none = not escaped and not _wanders_out(pilot)
    cast = len(origins) * _POINTS * _RAYS
    return Escapes(
        np.concatenate(origins), np.concatenate(directions), within / cast, left / max(within, 1), none, _SURE / cast
    )


def _wanders_out(pilot: Pilot) -> bool:
    """Whether some path of light from the receivers ends in the sky, after any number of turns; for all that is known,
    where light passes through walls."""
    if pilot.patches.transmission is not None:
        return True
    rng = stream(0, "wander")
    points, normals = pilot.on_receivers(_PATHS, rng)
    for _ in range(_TURNS):
        look = pilot.look_around(points, normals, 1, rng)
        if look.escaped.any():
            return True
        points, normals = pilot.where_hit(look.path, rng)
        if not len(points):
            break
    return False


def _somewhere_in(corners: Float64, rng: np.random.Generator) -> Float64:
    """A random point (n, 3) of each triangle (n, 3, 3)."""
    return np.einsum("nc,nck->nk", rng.dirichlet((1.0, 1.0, 1.0), len(corners)), corners)
