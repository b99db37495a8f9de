"""Rays over the hemisphere: what they meet is a form factor, within the error that counting hits has.

A share F counted with N rays has a standard deviation of at most sqrt(F (1 - F) / N) (less, as the rays are
stratified). Everything here is asked to lie within four of them.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from radiosity_baker.core.form_factors.hemisphere import hemisphere_rows
from radiosity_baker.core.form_factors.sides import site_points
from radiosity_baker.core.hemisphere import Codes, Hemispheres
from radiosity_baker.core.sampling import stream
from radiosity_baker.core.scene import Scene, Surface
from radiosity_baker.core.shapes import box
from radiosity_baker.core.visibility import Visibility

SIX = tuple(Surface(str(k), (0.1 * (k + 1),) * 3) for k in range(6))
UP = np.array([[0.0, 0, 1]])


def binomial(share: float, rays: int) -> float:
    """Four standard deviations of a share counted with so many rays."""
    return 4 * np.sqrt(share * (1 - share) / rays)


def looker(patches, rays) -> Hemispheres:
    return Hemispheres(patches, Visibility(patches.corners), rays, np.random.default_rng(0))


def look(patches, point, normal, rays=4096, shading=None, count=50):
    """Codes (count * rays,) from one point in metres."""
    where = np.tile(patches.space.normalise(np.array(point, float)), (count, 1))
    normals = np.tile(np.array(normal, float), (count, 1))
    shading = normals if shading is None else np.tile(np.array(shading, float), (count, 1))
    return looker(patches, rays).cast(where, normals, shading, np.random.default_rng(1)).code.ravel()


def rows_of(patches, workers, rays, purpose="test"):
    visibility = Visibility(patches.corners)
    found = hemisphere_rows(patches, visibility, workers, rays=rays, seed=0, purpose=purpose)
    return found.sides, found.rows[0], found.opening


def between_surfaces(sides, rows, inside=True) -> np.ndarray:
    """F (6, 6) between the six surfaces, of the sides that are inside."""
    label = np.rint(sides.albedo[:, 0] * 10).astype(int) - 1
    own = (label[:, None] == np.arange(6)) * np.reshape(inside, (-1, 1)).astype(float)
    received = rows.apply(own)
    return (own * sides.area[:, None]).T @ received / (own.T @ sides.area)[:, None]


@pytest.mark.parametrize(("faces_down", "side"), [(True, "front"), (False, "back")])
def test_a_parallel_square_is_met_as_often_as_its_form_factor_says(build, faces_down, side):
    """Catalogue: element to parallel unit square at its corner, 0.138531606 at distance one; four of them about it.
    Whether its front or its back is met, the code tells."""
    u, v = ((0, 2, 0), (2, 0, 0)) if faces_down else ((2, 0, 0), (0, 2, 0))
    patches = build.patches(Scene((build.quad(corner=(-1, -1, 1), u=u, v=v),), SIX), 2)
    codes = look(patches, (0, 0, 0), (0, 0, 1))
    count = len(patches)
    fronts, backs = (codes < count).mean(), ((codes >= count) & (codes < 2 * count)).mean()
    met = fronts if side == "front" else backs
    assert met == pytest.approx(4 * 0.138531606, abs=binomial(0.554, len(codes)))
    assert fronts * backs == 0
    assert (codes == Codes(count).escaped).mean() == pytest.approx(1 - met)


def test_the_code_is_that_of_the_patch_met(build):
    patches = build.patches(Scene((build.box(inward=True, surface=range(6)),), SIX), 12)
    codes = look(patches, (0.5, 0.5, 0.0), (0, 0, 1))
    below = (patches.corners.max(axis=1)[:, 2] < -0.99)[patches.members[patches.first[:-1]]]
    assert codes.max() < len(patches)
    assert not below[codes].any()
    seen = np.bincount(codes, minlength=12)[~below]
    assert (seen > 0).all()


def test_rays_about_a_shading_normal_that_start_below_the_surface_are_lost(build):
    """About a normal at 60 degrees, light from below the surface has the weight (1 - cos 60) / 2 = 1/4."""
    patches = build.patches(Scene((build.quad(corner=(0, 0, 50)),), SIX), 2)
    tilted = (np.sqrt(0.75), 0, 0.5)
    codes = look(patches, (0, 0, 0), (0, 0, 1), shading=tilted)
    assert (codes == Codes(len(patches)).lost).mean() == pytest.approx(0.25, abs=binomial(0.25, len(codes)))


def test_the_two_halves_of_the_rays_are_each_a_whole_hemisphere(build):
    patches = build.patches(Scene((build.quad(corner=(-1, -1, 1), u=(0, 2, 0), v=(2, 0, 0)),), SIX), 2)
    codes = look(patches, (0, 0, 0), (0, 0, 1), rays=64, count=3000).reshape(3000, 2, 32)
    share = (codes < len(patches)).mean(axis=(0, 2))
    assert share == pytest.approx(4 * 0.138531606, abs=binomial(0.554, 3000 * 32))
    halves = (codes < len(patches.area)).mean(axis=2)
    assert abs(np.corrcoef(halves.T)[0, 1]) < 4 / np.sqrt(3000), "independent, so that their difference is the error"


def test_rows_and_what_escapes_add_up_to_one(build, workers):
    block, floor = build.box(), build.quad(corner=(-2, -2, -0.5), u=(5, 0, 0), v=(0, 5, 0))
    patches = build.patches(Scene((floor, block), SIX), 400)
    sides, rows, opening = rows_of(patches, workers, 64)
    assert not sides.back.any()
    assert rows.row_sums() + opening.share == pytest.approx(1.0, abs=64 * 2.0**-24)
    height = sides.points[:, :, 2].min(axis=1)
    assert (opening.share[height > height.max() - 1e-9] == 1).all(), "the top sees only the sky"


def test_a_closed_room_lets_nothing_escape(build, workers):
    patches = build.patches(Scene((build.box(inward=True),), SIX), 400)
    sides, _, opening = rows_of(patches, workers, 256)
    assert opening.share.max() == 0
    assert len(sides.side) == len(patches), "its outside is not part of it"


@pytest.mark.parametrize("turned", [(), (1, 3, 5)])
def test_the_faces_of_a_cube_see_each_other_as_the_catalogue_says(build, workers, turned):
    """Whichever way they face; and though so few rays leave a patch that hardly two find each other."""
    room = build.box(inward=True, surface=range(6))
    faces = np.where(np.isin(room.surface, turned)[:, None], room.triangles[:, ::-1], room.triangles)
    patches = build.patches(Scene((build.triangles("room", room.vertices, faces, room.surface),), SIX), 1200)
    sides, rows, opening = rows_of(patches, workers, 64)
    truth = np.full((6, 6), 0.200043776)
    opposite = np.arange(6) ^ 1
    truth[np.arange(6), opposite] = 0.199824896
    np.fill_diagonal(truth, 0.0)
    rays = 64 * len(patches) // 6
    inside = opening.share == 0
    assert inside.sum() == len(patches)
    assert between_surfaces(sides, rows, inside) == pytest.approx(truth, abs=binomial(0.2, rays))


def test_octants_of_a_sphere_see_each_other_alike(build, workers):
    """Inside a sphere F_ij = A_j / A for any two patches. Flat patches do not see themselves, so what an octant of 256
    sees of itself is less by one in 256 of an eighth, and what it sees of the others more by a seventh of that."""
    ball = build.sphere(level=4, inward=True)
    octant = ball.vertices[ball.triangles].mean(axis=1) > 0
    # Six surfaces are enough for five octants and the rest.
    surface = np.minimum(octant @ [1, 2, 4], 5).astype(np.int32)
    patches = build.patches(Scene((build.triangles("ball", ball.vertices, ball.triangles, surface),), SIX), 2048)
    sides, rows, _ = rows_of(patches, workers, 256)
    share = np.array([1, 1, 1, 1, 1, 3]) / 8
    rays = 256 * len(patches) // 8
    assert between_surfaces(sides, rows) == pytest.approx(
        np.tile(share, (6, 1)), abs=binomial(1 / 8, rays) + 3 / 8 / 256
    )


def test_backs_take_part_where_rays_meet_them(build, workers):
    """A plane that shows its back to the floor: front and back of the plane, front of the floor."""
    floor = build.quad("floor", (-1, -1, 0), (3, 0, 0), (0, 3, 0), surface=0)
    plane = build.quad("plane", (0, 0, 1), surface=1)
    patches = build.patches(Scene((floor, plane), SIX), 200)
    sides, rows, opening = rows_of(patches, workers, 256)
    of_plane = sides.albedo[:, 0] > 0.15
    assert (of_plane & sides.back).sum() == (of_plane & ~sides.back).sum()
    assert not sides.back[~of_plane].any()
    assert (sides.normals[sides.back] @ UP[0] == -1).all()
    # The floor and the back of the plane see each other: A_i F_ij = A_j F_ji.
    back = (of_plane & sides.back).astype(float)
    ground = (~of_plane).astype(float)
    forth, home = sides.area @ (ground * rows.apply(back)), sides.area @ (back * rows.apply(ground))
    slack = binomial(forth / (sides.area @ ground), 256 * int(ground.sum())) * (sides.area @ ground)
    assert forth == pytest.approx(home, abs=2 * slack)
    assert opening.share[of_plane & ~sides.back] == pytest.approx(1.0)


def test_sites_are_spread_over_the_area_of_their_patch(build):
    """On a large and a small triangle of one patch, points fall by area: their mean is the patch's centroid."""
    ball = build.sphere(level=5)
    patches = build.patches(Scene((ball,), SIX), 60)
    sides = np.repeat(np.int32(0), 4000)
    points, normals = site_points(patches, sides, np.random.default_rng(0).random((len(sides), 1, 3)))
    own = patches.patch == 0
    share = patches.area[own] / patches.area[own].sum()
    centroid = share @ patches.corners[own].mean(axis=1)
    spread = points.reshape(-1, 3).std(axis=0)
    assert (np.abs(points.mean(axis=(0, 1)) - centroid) <= 4 * spread / np.sqrt(4000)).all()
    facing = share @ patches.normals[own]
    assert normals.mean(axis=(0, 1)) == pytest.approx(facing, abs=4 * normals.std() / np.sqrt(4000))


def test_sites_of_a_back_face_the_other_way(build):
    patches = build.patches(Scene((build.quad(),), SIX), 2)
    _, normals = site_points(patches, np.array([0, 2], dtype=np.int32), np.random.default_rng(0).random((2, 1, 3)))
    assert normals[0, 0].tolist() == [0, 0, 1]
    assert normals[1, 0].tolist() == [0, 0, -1]


def test_other_streams_give_other_rays(build, workers):
    patches = build.patches(Scene((build.box(inward=True),), SIX), 100)
    visibility = Visibility(patches.corners)
    one, same, other = (
        hemisphere_rows(patches, visibility, workers, rays=64, seed=0, purpose=purpose).rows[0].weights.tobytes()
        for purpose in ("one", "one", "two")
    )
    assert one == same != other


def test_fewer_rays_look_at_the_same_surroundings(build):
    patches = build.patches(Scene((build.box(inward=True),), SIX), 100)
    few = looker(patches, 64).with_rays(8, stream(0, "few"))
    assert few.cast(np.zeros((5, 3)), np.tile(UP, (5, 1)), np.tile(UP, (5, 1)), stream(0, "rays")).code.shape == (5, 8)


def test_a_pillar_that_reaches_up_to_the_ceiling_is_a_solid(build):
    """Straight above the floor in it lie its own top, which shows its back, and the ceiling, which shows its front."""
    room, pillar = box("room", (-2, -2, 0), (2, 2, 3)), box("pillar", (-0.3, -0.3, 0), (0.3, 0.3, 3))
    room = replace(room, triangles=room.triangles[:, ::-1].copy())
    patches = build.patches(Scene((room, pillar), SIX), 2)
    points = np.column_stack([np.random.default_rng(0).uniform(-0.6, 0.6, (200, 2)), np.zeros(200)])
    inside = looker(patches, 16).inside(patches.space.normalise(points), np.tile(UP, (200, 1)))
    assert np.array_equal(inside, (np.abs(points[:, :2]) < 0.3).all(axis=1))
