"""What becomes of a ray at a surface: it goes straight on, is mirrored, is absorbed, or stops.

A ray stops where the diffuse part of a surface is met; what it finds there is what a patch sends out. The rest goes on.
One random number decides, by the largest channel of each share, so grey surfaces leave a ray's weight at one, and only
coloured ones give it a tint. Probabilities and tints are the same from both sides and both ways along a path, so what
two patches exchange through glass and mirrors stays reciprocal.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, cast

import numpy as np

from .sampling import frames
from .scene import Bool, Float64, Int32, Scene, Surface, Texture
from .textures import look_up

#: What may happen to a ray, in the order of the columns of `Optics.tints`.
CLEAR, GLASS, GLINT, MIRROR, ABSORBED, STOPS = range(6)
#: Least share of the rays that stop at a surface that emits: they are what finds its light.
_FEWEST_STOPS = 0.1


class Onward(NamedTuple):
    """Rays (n,) after they met a surface: outcome; unit directions (n, 3); tint (n, 3) of what goes on."""

    outcome: Int32
    directions: Float64
    tint: Float64


def stopping_share(surface: Surface) -> float:
    """Share of the rays on the opaque part of a surface that stop there; its albedo and emission are theirs alone."""
    diffuse = max(np.add(surface.albedo, surface.transmission))
    onward = max(surface.glass) + max(surface.mirror)
    if max(surface.emission) > 0:
        diffuse = max(diffuse, _FEWEST_STOPS)
    return float(np.clip(diffuse, 1.0 - onward, max(1.0 - onward / 2.0, diffuse / max(diffuse + onward, 1.0))))


@dataclass(frozen=True, eq=False)
class Optics:
    """Where rays go on, among t triangles with s surfaces.

    normals, base (t, 3): unit normal and any point of each triangle; surface (t,); goes_on, veils, blocks (t,): rays
    may go on there, shadow rays pass in part, or are stopped for good. opacity (s,); shares (s, 3): probabilities to
    pass where nothing is opaque, and on the opaque part to meet glass and a mirror; tints (s, 6, 3) after each outcome;
    clear, glass (s, 3) tints of shadow rays; ior, roughness (s,). tinted: whether any tint is not one. holes: textures
    of the opacity by surface; corners, uv (t, 3, 2 and 3) of the triangles, None without holes.
    """

    normals: Float64
    base: Float64
    surface: Int32
    goes_on: Bool
    veils: Bool
    blocks: Bool
    opacity: Float64
    shares: Float64
    tints: Float64
    clear: Float64
    glass: Float64
    ior: Float64
    roughness: Float64
    tinted: bool
    holes: dict[int, Texture]
    corners: Float64
    uv: Float64 | None

    def meet(self, triangle: Int32, origins: Float64, directions: Float64) -> Float64:
        """Points (n, 3) where rays cross the planes of the triangles (n,) they hit."""
        normal = self.normals[triangle]
        height = np.einsum("nk,nk->n", self.base[triangle] - origins, normal)
        slope = np.einsum("nk,nk->n", directions, normal)
        distance = np.divide(height, slope, out=np.zeros_like(height), where=slope != 0.0)
        return origins + distance[:, None] * directions

    def opacity_at(self, triangle: Int32, points: Float64) -> Float64:
        """Opacity (n,) at points (n, 3) of the triangles (n,)."""
        surface = self.surface[triangle]
        opacity = self.opacity[surface]
        for number, texture in self.holes.items():
            own = np.flatnonzero(surface == number)
            if len(own) and self.uv is not None:
                weights = barycentric(self.corners[triangle[own]], points[own])
                opacity[own] *= look_up(texture, np.einsum("nc,nck->nk", weights, self.uv[triangle[own]]))[:, 0]
        return opacity

    def scatter(self, triangle: Int32, points: Float64, directions: Float64, rng: np.random.Generator) -> Onward:
        """What becomes of rays with directions (n, 3) at the points (n, 3) where they hit the triangles (n,)."""
        surface, normal = self.surface[triangle], self.normals[triangle]
        unit = directions / np.linalg.norm(directions, axis=1, keepdims=True)
        slope = np.einsum("nk,nk->n", unit, normal)
        opacity = self.opacity_at(triangle, points)
        shares = self.shares[surface]
        glint = fresnel(np.abs(slope), self.ior[surface])
        likely = np.stack(
            [
                (1.0 - opacity) * shares[:, 0],
                opacity * shares[:, 1] * (1.0 - glint),
                opacity * shares[:, 1] * glint,
                opacity * shares[:, 2],
                (1.0 - opacity) * (1.0 - shares[:, 0]),
            ]
        )
        outcome = (rng.random(len(triangle)) >= np.cumsum(likely, axis=0)).sum(axis=0).astype(np.int32)
        turned = np.flatnonzero((outcome == GLINT) | (outcome == MIRROR))
        facing = -np.sign(slope[turned, None]) * normal[turned]
        rough = np.where(outcome[turned] == MIRROR, self.roughness[surface[turned]], 0.0)
        unit[turned] = mirrored(unit[turned], facing, rough, rng)
        return Onward(outcome, unit, self.tints[surface, outcome])

    def passing(self, triangle: Int32, points: Float64, directions: Float64) -> Float64:
        """Share (n, 3) of the light along directions (n, 3) that goes straight through points of the triangles (n,)."""
        surface = self.surface[triangle]
        slope = np.einsum("nk,nk->n", directions, self.normals[triangle]) / np.linalg.norm(directions, axis=1)
        opacity = self.opacity_at(triangle, points)
        enters = opacity * (1.0 - fresnel(np.abs(slope), self.ior[surface]))
        return (1.0 - opacity)[:, None] * self.clear[surface] + enters[:, None] * self.glass[surface]


def make_optics(
    scene: Scene, surface: Int32, shadowless: Bool, corners: Float64, normals: Float64, uv: Float64 | None
) -> Optics | None:
    """For triangles with corners (t, 3, 3), unit normals (t, 3), surface (t,) into the scene's; shadowless (t,): lamps
    shine through them; uv (t, 3, 2) of the corners where opacity varies. None when all rays stop where they first meet
    something and everything casts shadows."""
    surfaces = scene.surfaces
    opacity = np.array([s.opacity for s in surfaces])
    holes = {number: s.opacity_texture for number, s in enumerate(surfaces) if s.opacity_texture is not None}
    sheer = (opacity < 1.0) | np.isin(np.arange(len(surfaces)), list(holes))
    clear, glass, mirror = (
        np.array([getattr(s, name) for s in surfaces], dtype=np.float64) for name in ("transparent", "glass", "mirror")
    )
    most_clear, most_glass, most_mirror = clear.max(axis=1), glass.max(axis=1), mirror.max(axis=1)
    stops = np.array([stopping_share(s) for s in surfaces])
    room = np.divide(1.0 - stops, most_glass + most_mirror, out=np.ones_like(stops), where=stops < 1.0)
    shares = np.stack([most_clear, most_glass * room, most_mirror * room], axis=1)
    lets_through = sheer & (most_clear > 0.0) | (opacity > 0.0) & (most_glass > 0.0)
    special = sheer | (opacity > 0.0) & (most_glass + most_mirror > 0.0)
    if not special[np.unique(surface)].any() and not shadowless.any():
        return None
    tints = np.ones((len(surfaces), 6, 3))
    for outcome, tint, share in (
        (CLEAR, clear, shares[:, 0]),
        (GLASS, glass, shares[:, 1]),
        (GLINT, glass, shares[:, 1]),
        (MIRROR, mirror, shares[:, 2]),
    ):
        tints[:, outcome] = np.divide(tint, share[:, None], out=np.ones_like(tint), where=share[:, None] > 0.0)
    return Optics(
        normals=normals,
        base=corners[:, 0],
        surface=surface,
        goes_on=special[surface],
        veils=lets_through[surface] & ~shadowless,
        blocks=~lets_through[surface] & ~shadowless,
        opacity=opacity,
        shares=shares,
        tints=tints,
        clear=clear,
        glass=glass,
        ior=np.array([s.ior for s in surfaces]),
        roughness=np.array([s.roughness for s in surfaces]),
        holes=holes,
        corners=corners,
        uv=uv,
        tinted=bool(np.abs(tints[np.unique(surface)] - 1.0).max() > 1e-6),
    )


def barycentric(corners: Float64, points: Float64) -> Float64:
    """Weights (n, 3) of the corners of triangles (n, 3, 3) at points (n, 3) in their planes."""
    one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    way = points - corners[:, 0]
    normal = np.cross(one, two)
    square = np.maximum(np.einsum("nk,nk->n", normal, normal), np.finfo(float).tiny)
    second = np.einsum("nk,nk->n", np.cross(way, two), normal) / square
    third = np.einsum("nk,nk->n", np.cross(one, way), normal) / square
    return np.stack([1.0 - second - third, second, third], axis=1)


def fresnel(cosine: Float64, ior: Float64) -> Float64:
    """Share (n,) of unpolarised light that a smooth face of glass reflects; 0 for an index of refraction of one.

    From inside it is taken for the same angle as outside, as for the two faces of a pane (Born and Wolf 1959, 1.5.2).
    """
    inside = np.sqrt(np.maximum(ior**2 - 1.0 + cosine**2, 1e-12))
    across = (inside - cosine) / (inside + cosine)
    along = (cosine * (inside + cosine) - 1.0) / (cosine * (inside - cosine) + 1.0)
    return cast(Float64, np.where(ior > 1.0, 0.5 * across**2 * (1.0 + along**2), 0.0))


def mirrored(directions: Float64, normals: Float64, roughness: Float64, rng: np.random.Generator) -> Float64:
    """Unit directions (n, 3) after a reflection at surfaces that face them with unit normals (n, 3).

    Rough ones (n,) turn the normal to that of a facet that the ray sees, by the GGX distribution with
    alpha = roughness^2 (Dupuy and Benyoub 2023, "Sampling visible GGX normals with spherical caps"). What would go into
    the surface leaves it after further facets: nothing is lost.
    """
    facet = normals.copy()
    rough = np.flatnonzero(roughness > 0.0)
    if len(rough):
        axes = frames(normals[rough].astype(np.float32), np.zeros(len(rough), np.float32)).astype(np.float64)
        alpha = roughness[rough, None] ** 2 * [1.0, 1.0, 0.0] + [0.0, 0.0, 1.0]
        seen = np.einsum("nij,nj->ni", axes, -directions[rough]) * alpha
        seen /= np.linalg.norm(seen, axis=1, keepdims=True)
        angle, height = 2.0 * np.pi * rng.random(len(rough)), rng.random(len(rough))
        z = (1.0 - height) * (1.0 + seen[:, 2]) - seen[:, 2]
        around = np.sqrt(np.clip(1.0 - z * z, 0.0, 1.0))
        cap = np.stack([around * np.cos(angle), around * np.sin(angle), z], axis=1)
        local = (cap + seen) * alpha
        turned = np.einsum("nij,ni->nj", axes, local)
        facet[rough] = turned / np.maximum(np.linalg.norm(turned, axis=1, keepdims=True), 1e-12)
    out = directions - 2.0 * np.einsum("nk,nk->n", directions, facet)[:, None] * facet
    height = np.einsum("nk,nk->n", out, normals)
    return cast(Float64, out + (np.abs(height) - height)[:, None] * normals)
