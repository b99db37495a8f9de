"""The hard cases of the field notes, section 3, one by one.

A furnace judges geometry: where every surface glows with 1 and reflects a half, in a closed room, radiance is 2 on all
of them, whatever else stands there and however broken its mesh is. So many triangles glow that rays find them, hence
nothing is sampled but what a ray meets: the figure is exact at every corner, and a ray that leaks, gets lost or counts
twice shows at once. Seen to fail: rays that start on their surface, a hit's back taken for its front, a mean over
samples that counts hidden ones, a division by a triangle's area.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import combinations

import bpy
import numpy as np
import pytest

from radiosity_baker.addon.bake_scene import bake_objects
from radiosity_baker.core.bake import bake
from radiosity_baker.core.closed_forms import KnownLight
from radiosity_baker.core.form_factors.polygon import polygon_irradiance
from radiosity_baker.core.patches import triangle_geometry
from radiosity_baker.core.plan import choose_effort
from radiosity_baker.core.scene import AreaLamp, PointLamp, Scene, SceneObject, SunLamp, Surface
from radiosity_baker.core.self_test import compare, corners_of
from radiosity_baker.core.settings import Settings
from radiosity_baker.core.shapes import box, quad, sphere, triangles
from radiosity_baker.core.visibility import Visibility

GLOWING = Surface("glowing", (0.5, 0.5, 0.5), (1.0, 1.0, 1.0))
#: Sends back as much, but most of it on the other side: what reflects alone and what does not have a solver each.
LEAF = Surface("leaf", (0.2, 0.2, 0.2), (1.0, 1.0, 1.0), transmission=(0.3, 0.3, 0.3))
FLOOR = quad("floor", u=(1, 0, 0), v=(0, 1, 0))
SHEET = quad("low", u=(0.5, 0, 0), v=(0, 0.5, 0))
CORNERS = [(0.0, 0.0, 0.0), (0.5, 0.0, 0.0), (0.0, 0.5, 0.0)]


def wedge(degrees: float) -> SceneObject:
    x, z = 0.5 * np.cos(np.radians(degrees)), 0.5 * np.sin(np.radians(degrees))
    return triangles("wedge", [*CORNERS, (x, 0.0, z)], [[0, 1, 2], [0, 2, 3]])


def mirrored(body: SceneObject) -> SceneObject:
    return replace(body, vertices=body.vertices * (-1, 1, 1))


def flipped(body: SceneObject, faces: slice) -> SceneObject:
    turned = body.triangles.copy()
    turned[faces] = turned[faces, ::-1]
    return replace(body, triangles=turned)


def crowd(count: int) -> list[SceneObject]:
    crumb = box("crumb").vertices * 1e-3
    places = np.random.default_rng(0).uniform(-0.5, 0.5, (count, 3))
    return [replace(box(f"crumb {k}"), vertices=crumb + place) for k, place in enumerate(places)]


#: What stands in the furnace, and what it catches.
FURNISHED: dict[str, tuple[Callable[[], list[SceneObject]], str]] = {
    "knife wedge of 0.1 degrees": (lambda: [wedge(0.1)], "rays that start beyond the other side"),
    "wedge of 179.9 degrees": (lambda: [wedge(179.9)], "neighbours in one plane that see each other"),
    "box standing on a box": (
        lambda: [box("low", (-0.5, -0.5, -0.5), (0.5, 0.5, 0)), box("high", (-0.2, -0.2, 0), (0.1, 0.1, 0.4))],
        "black rings at contacts",
    ),
    "boxes side by side, faces coinciding": (
        lambda: [box("left", (-0.5, 0, 0), (0, 0.5, 0.5)), box("right", (0, 0, 0), (0.5, 0.5, 0.5))],
        "light between faces that coincide",
    ),
    "boxes crossing, vertices inside a solid": (
        lambda: [box("one", (-0.5, 0, 0), (0.2, 0.5, 0.5)), box("two", (-0.1, 0.2, -0.3), (0.5, 0.4, 0.3))],
        "vertices inside solids that are dark",
    ),
    "box in a box": (lambda: [box("in", (0, 0, 0), (0.2, 0.2, 0.2)), box("out", (-0.3,) * 3, (0.5,) * 3)], "nesting"),
    "vertex exactly on another face": (
        lambda: [
            quad("floor", (-0.5, -0.5, 0), (1, 0, 0), (0, 1, 0)),
            triangles("tip", [(0, 0, 0), (0.3, 0, 0.3), (0, 0.3, 0.3)], [[0, 1, 2]]),
        ],
        "rays aimed at shared vertices",
    ),
    "two sheets 1e-4 apart": (
        lambda: [
            quad("low", (0, 0, 0), (0.5, 0, 0), (0, 0.5, 0)),
            quad("high", (0, 0, 1e-4), (0, 0.5, 0), (0.5, 0, 0)),
        ],
        "a ray offset larger than the gap",
    ),
    "duplicate coplanar faces": (
        lambda: [triangles("twice", CORNERS, [[0, 1, 2], [0, 1, 2], [2, 1, 0]])],
        "faces that hide behind themselves",
    ),
    "coplanar duplicate objects": (
        lambda: [quad("a", u=(0.5, 0, 0), v=(0, 0.5, 0)), quad("b", u=(0.5, 0, 0), v=(0, 0.5, 0))],
        "the same",
    ),
    "zero-area faces": (
        lambda: [triangles("flat", [*CORNERS, (1, 0, 0)], [[0, 1, 2], [0, 1, 3], [1, 1, 2], [0, 0, 0]])],
        "division by an area",
    ),
    "zero-area faces, shaded smooth": (
        lambda: [
            replace(
                triangles("flat", [*CORNERS, (1, 0, 0)], [[0, 1, 2], [0, 1, 3]]),
                corner_normals=np.tile(np.float32([0, 0, 1]), (2, 3, 1)),
            )
        ],
        "shading normals on faces that have none (found by the fuzzer: NaN)",
    ),
    "needles of 1e6 to 1": (
        lambda: [triangles("needle", [(0, 0, 0), (0.5, 0, 0), (0.5, 5e-7, 0), (0, 0.5, 0)], [[0, 1, 2], [0, 2, 3]])],
        "normals and splits of thin faces",
    ),
    "zero-thickness sheet": (lambda: [quad("sheet", (-0.3, -0.3, 0.1), (0.6, 0, 0), (0, 0.6, 0))], "backs left dark"),
    "flipped winding": (lambda: [flipped(box("box", (-0.2,) * 3, (0.2,) * 3), slice(None))], "backs left dark"),
    "mixed winding": (lambda: [flipped(box("box", (-0.2,) * 3, (0.2,) * 3), slice(0, 5))], "backs left dark"),
    "mirrored": (lambda: [mirrored(box("box", (0.1,) * 3, (0.4,) * 3))], "negative scale"),
    "one single triangle": (lambda: [triangles("one", CORNERS, [[0, 1, 2]])], "too few of anything"),
    "loose vertices": (lambda: [triangles("loose", [*CORNERS, (9, 9, 9)], [[0, 1, 2]])], "bounds of what no face uses"),
    "three faces on an edge": (
        lambda: [triangles("fan", [*CORNERS, (0, 0, 0.5), (0, 0, -0.5)], [[0, 1, 2], [1, 0, 3], [0, 1, 4]])],
        "meshes that are no surface",
    ),
    "T-junction": (
        lambda: [triangles("t", [*CORNERS, (0.25, 0.25, 0), (0.5, 0.5, 0)], [[0, 1, 2], [1, 4, 3], [3, 4, 2]])],
        "cracks",
    ),
    "100 crumbs": (lambda: crowd(100), "cost by object, patches that are dust"),
    "a grain of 1e-5": (
        lambda: [replace(box("grain"), vertices=1e-5 * box("grain").vertices)],
        "sizes under the ray offset of the scene",
    ),
    "smooth ball": (lambda: [sphere("ball", 0.4, 2, smooth=True)], "light about shading normals"),
}
#: The whole furnace, larger and elsewhere.
PLACES = {
    "at home": (1.0, 0.0),
    "a ten-thousandth": (1e-4, 0.0),
    "a thousandth": (1e-3, 0.0),
    "a thousand times": (1e3, 0.0),
    "a hundred thousand times": (1e5, 0.0),
    "at an offset of 1e5": (1.0, 1e5),
}


def tilt(bodies: list[SceneObject]) -> float:
    """The largest share of the rays about a shading normal that start below the surface: they bring nothing, as in
    Cycles. Of a hemisphere tilted by an angle a that is (1 - cos a) / 2."""
    cosines = [1.0]
    for body in bodies:
        if body.corner_normals is not None:
            normals, area = triangle_geometry(body.vertices[body.triangles])
            cosines += list(np.einsum("tck,tk->tc", body.corner_normals, normals)[area > 0].ravel())
    return (1.0 - min(cosines)) / 2.0


def furnace(
    bodies: list[SceneObject], scale: float = 1.0, offset: float = 0.0, material: Surface = GLOWING
) -> KnownLight:
    objects = [*bodies, sphere("room", 2.0, 2, surface=1, inward=True)]
    moved = tuple(replace(o, vertices=o.vertices * scale + offset) for o in objects)
    # Rows that sum to one in double precision, a solve to 1e-5, tables in single precision.
    return KnownLight(
        "",
        Scene(moved, (material, GLOWING)),
        lambda points: np.full(len(points), 2.0),
        5e-5 + tilt(bodies),
        edge=0.7 * scale,
    )


def swallowed(corners: np.ndarray, bodies: Sequence[SceneObject]) -> np.ndarray:
    """Triangles (t, 3, 3) that lie as a whole within what two boxes have in common that cross or touch: where no light
    is."""
    inside = np.zeros(len(corners), dtype=bool)
    bounds = [(o.vertices.min(axis=0), o.vertices.max(axis=0)) for o in bodies if len(o.vertices) == 8]
    for (low, high), (other_low, other_high) in combinations(bounds, 2):
        common = np.maximum(low, other_low), np.minimum(high, other_high)
        nested = any(np.array_equal(common, b) for b in ((low, high), (other_low, other_high)))
        if not nested and (common[0] <= common[1]).all():
            inside |= ((corners > common[0] - 1e-6) & (corners < common[1] + 1e-6)).all(axis=(1, 2))
    return inside


def check(case: str, known: KnownLight, told, estimator="hemisphere", tessellate=True, catches="") -> None:
    settings = Settings(size=known.edge, error=0.1, estimator=estimator, tessellate=tessellate)
    effort = replace(choose_effort(known.scene, settings), patches=200, tolerance=1e-5, threshold=0.0, growth=0.2)
    result = bake(known.scene, settings, effort=effort)
    points, radiance, area = corners_of(result)
    area = np.where(np.repeat(swallowed(points.reshape(-1, 3, 3), known.scene.objects), 3), 0.0, area)
    outcome = compare(case, known, points, radiance, area, result.report.estimated_error["total"])
    told(f"{case} ({estimator})", outcome.exact, outcome.got, outcome.allowed, catches)


@pytest.mark.parametrize("estimator", ["hemisphere", "analytic"])
@pytest.mark.parametrize("case", FURNISHED)
def test_furnished_furnace(case, estimator, told):
    bodies, catches = FURNISHED[case]
    check(f"furnace: {case}", furnace(bodies()), told, estimator, catches=catches)


@pytest.mark.parametrize("case", FURNISHED)
def test_furnace_of_leaves(case, told):
    """Light goes through what stands there, and into what is closed. Seen to fail: what is transmitted left out."""
    bodies, catches = FURNISHED[case]
    check(f"furnace of leaves: {case}", furnace(bodies(), material=LEAF), told, catches=catches)


def test_furnace_with_300_crumbs(told):
    """Too many for each side of each to be met by a ray of the transport."""
    check("furnace: 300 crumbs", furnace(crowd(300)), told, catches="sides that no ray has met taken for black")


def test_furnace_with_thousands_of_specks(told, long_run):
    """Ten thousand in the long run. The mean: backs of specks that no ray of the transport has met are black to the few
    rays that meet them later."""
    count = 10_000 if long_run else 1_000
    speck = 2e-3 * np.array(CORNERS)
    places = np.random.default_rng(0).uniform(-0.5, 0.5, (count, 3))
    specks = [triangles(f"speck {k}", speck + place, [[0, 1, 2]]) for k, place in enumerate(places)]
    check(f"furnace: {count:,} specks", replace(furnace(specks), mean=True), told, catches="cost by object")


@pytest.mark.parametrize("place", PLACES)
def test_furnace_anywhere(place, told):
    bodies, _ = FURNISHED["box standing on a box"]
    check(
        f"furnace {place}",
        furnace(bodies(), *PLACES[place]),
        told,
        tessellate=False,
        catches="metres, and single precision",
    )


def lit_room(scale: float, offset: float) -> np.ndarray:
    """What is baked on the corners of a room with a box and a ball lamp in it, which has the same radiance anywhere."""
    bodies = (box("room", inward=True), box("block", (0.6, 0.6, 0.0), (0.8, 0.8, 0.4)))
    moved = tuple(replace(o, vertices=o.vertices * scale + offset) for o in bodies)
    x, y, z = (np.array([0.3, 0.5, 0.6]) * scale + offset).tolist()
    lamp = PointLamp("lamp", (x, y, z), (scale**2,) * 3, 0.05 * scale)
    settings = Settings(size=0.17 * scale, error=0.1, tessellate=False)
    return corners_of(bake(Scene(moved, (WHITE,), (lamp,)), settings))[1]


@pytest.mark.parametrize("place", [place for place in PLACES if place != "at home"])
def test_a_lit_room_anywhere(place, told):
    """The same at every corner, to a thousandth of the brightest. Seen to fail: a scene that is not centred.

    No edge is just as long as is asked: it would be split or not by the rounding of its place, and all samples that
    follow be others."""
    home, away = lit_room(1.0, 0.0), lit_room(*PLACES[place])
    told(f"lit room {place}: largest change", 0.0, float(np.abs(away - home).max() / home.max()), 1e-3)


# ---- The whole way into the attribute ------------------------------------------------------------------------------


def into_blender(scene: Scene) -> list[bpy.types.Object]:
    """The scene's objects, surfaces and grey sky in the Blender that runs."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    materials = [_material(surface) for surface in scene.surfaces]
    made = []
    for o in scene.objects:
        mesh = bpy.data.meshes.new(o.name)
        mesh.from_pydata(o.vertices.tolist(), [], o.triangles.tolist())
        for material in materials:
            mesh.materials.append(material)
        mesh.polygons.foreach_set("use_smooth", np.full(len(o.triangles), o.corner_normals is not None))
        made.append(bpy.data.objects.new(o.name, mesh))
        bpy.context.scene.collection.objects.link(made[-1])
    bpy.context.view_layer.update()
    return made


def _material(surface: Surface) -> bpy.types.Material:
    material = bpy.data.materials.new(surface.name)
    if material.node_tree is None:
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    output, both, diffuse, glow = (
        tree.nodes.new(f"ShaderNode{kind}") for kind in ("OutputMaterial", "AddShader", "BsdfDiffuse", "Emission")
    )
    diffuse.inputs["Color"].default_value = (*surface.albedo, 1.0)
    glow.inputs["Color"].default_value = (*surface.emission, 1.0)
    tree.links.new(diffuse.outputs[0], both.inputs[0])
    tree.links.new(glow.outputs[0], both.inputs[1])
    tree.links.new(both.outputs[0], output.inputs["Surface"])
    return material


@pytest.mark.parametrize("result_mode", ["keep", "new"])
@pytest.mark.parametrize("case", FURNISHED)
def test_into_the_attribute(case, result_mode, told):
    """What the mesh holds in the end is the exact value too: nothing is lost between Blender's faces and core's."""
    bodies, catches = FURNISHED[case]
    objects = into_blender(furnace(bodies()).scene)
    asked = [o for o in objects if o.name != "room"][:3]
    settings = Settings(triangles=100, error=0.1, tessellate=result_mode != "keep")
    effort = replace(choose_effort(furnace(bodies()).scene, settings), patches=200, tolerance=1e-5)
    _, written = bake_objects(
        bpy.context, asked, settings, result_mode=result_mode, attribute="Radiosity", effort=effort
    )
    light = np.concatenate([_seen_colors(o.data, bodies()) for o in written])
    got = float(light[np.argmax(np.abs(light - 2.0))])
    told(f"attribute ({result_mode}): {case}", 2.0, got, 2e-4 + 2 * tilt(bodies()), catches)


def _seen_colors(mesh: bpy.types.Mesh, bodies: list[SceneObject]) -> np.ndarray:
    """The baked values of the corners of all faces that have an area and can be seen; none may be no number."""
    data = mesh.color_attributes["Radiosity"].data
    colors = np.empty(4 * len(data), np.float32)
    data.foreach_get("color", colors)
    assert np.isfinite(colors).all()
    area, total = np.empty((2, len(mesh.polygons)), np.float32)
    mesh.polygons.foreach_get("area", area)
    mesh.polygons.foreach_get("loop_total", total)
    seen = area > 0
    if (total == 3).all():
        places = np.array([[mesh.vertices[v].co for v in face.vertices] for face in mesh.polygons])
        seen &= ~swallowed(places, bodies)
    return colors.reshape(-1, 4)[np.repeat(seen, total.astype(int)), :3].ravel()


# ---- Shadows whose share is known ----------------------------------------------------------------------------------

DOWN = SunLamp("sun", (0.0, 0.0, -1.0), (np.pi,) * 3)
WHITE, BLACK = Surface("white", (0.5,) * 3), Surface("black", (0.0,) * 3)


def shaded(share: float, *blockers: SceneObject, sun: SunLamp = DOWN) -> KnownLight:
    """A floor of which the sun reaches a share, straight from above unless said; blockers are black, and not baked."""
    black = tuple(replace(b, surface=b.surface + 1, receives=False) for b in blockers)
    return KnownLight(
        "", Scene((FLOOR, *black), (WHITE, BLACK), (sun,)), lambda p: np.full(len(p), 0.5 * share), 0.0, 0.05, True
    )


def test_edges_without_length_are_not_cut():
    """A face that names a vertex twice, beside faces that a solid covers in part (found by the fuzzer: 0 / 0)."""
    faces = [[0, 1, 2], [0, 1, 3], [1, 1, 2], [2, 1, 0]]
    broken = triangles("broken", [(0, 0, 0), (1, 0, 0), (0, 1, 0), (2, 0, 0)], faces)
    scene = Scene((box("box", (0, 0, 0), (0.25, 0.25, 0.25)), broken), (WHITE,), sky=(1.0, 2.0, 3.0))
    light = corners_of(bake(scene, Settings(triangles=30, error=0.3)))[1]
    assert np.isfinite(light).all()
    assert light.min() >= 0


def test_shadows_among_faces_that_share_no_side():
    """Faces that cross and overlap, none of which goes on in another where light breaks (found by the fuzzer: looks
    around from no points)."""
    x, y = (0.13640898, -0.02608042, 0.20787593), (-0.10270972, 0.20787593, 0.09347893)
    z = (0.36520298, 0.27281795, -0.20541944)
    block = box("block").vertices @ np.array([z, y, x]) + (0.0, 0.25, 0.5)
    faces = [[0, 1, 2], [0, 1, 3], [1, 1, 2], [2, 1, 0], [0, 1, 2]]
    broken = triangles("broken", [(0, 0, 0.5), (1, 0, 0.5), (0, 1, 0.5), (2, 0, 0.5), (9, 9, 9.5)], faces)
    scene = Scene((replace(box("block"), vertices=block), broken), (WHITE,))
    settings = Settings(triangles=30, error=None)
    effort = replace(
        choose_effort(scene, settings), patches=30, triangles=30, growth=0.3, transport_rays=16, gather_rays=8
    )
    assert corners_of(bake(scene, settings, effort=effort))[1].max() == 0


def ball_of_rays(count: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(0)
    ways = rng.normal(size=(count, 3)).astype(np.float32)
    return np.tile(np.float32([0.1, 0.05, -0.02]), (count, 1)), ways


def around(width: float, depth: float) -> list[SceneObject]:
    """A roof over the floor and beyond, but for a hole of that size over the floor's middle."""
    x, y = 0.5 + width / 2, 0.5 + depth / 2
    sides = [(-1, -1, 2, 1 - y), (-1, y, 2, 2), (-1, 1 - y, 1 - x, y), (x, 1 - y, 2, y)]
    return [
        quad(f"roof {k}", (a, b, 0.3), (0, d - b, 0), (c - a, 0, 0)) for k, (a, b, c, d) in enumerate(sides) if d > b
    ]


def under_a_glowing_panel(gap: float) -> KnownLight:
    """A floor, all that is not black, under a panel that glows, so far below the ceiling."""
    outline = np.array([(0.2, 0.2, 1.0), (0.8, 0.2, 1.0), (0.8, 0.8, 1.0), (0.2, 0.8, 1.0)])
    x = (np.arange(50) + 0.5) / 50
    points = np.stack([*np.meshgrid(x, x), np.zeros((50, 50))], axis=-1).reshape(-1, 3)
    factor = polygon_irradiance(points, np.tile([0.0, 0.0, 1.0], (len(points), 1)), outline, two_sided=True).mean()
    panel = quad("panel", tuple(outline[0]), (0, 0.6, 0), (0.6, 0, 0), surface=2)
    ceiling = quad("ceiling", (-1, -1, 1 + gap), (0, 3, 0), (3, 0, 0), surface=1)
    objects = (FLOOR, *(replace(o, receives=False) for o in (panel, ceiling)))
    surfaces = (WHITE, BLACK, Surface("lamp", (0.0,) * 3, (2.0,) * 3))
    return KnownLight("", Scene(objects, surfaces), lambda p: np.full(len(p), factor), 0.0, 0.1, True)


SHADED: dict[str, tuple[Callable[[], KnownLight], str]] = {
    "blocker smaller than a patch": (
        lambda: shaded(1 - 0.03**2, quad("dot", (0.31, 0.42, 0.5), (0.03, 0, 0), (0, 0.03, 0))),
        "visibility as yes or no of a patch",
    ),
    "sun grazing at 0.1 degrees": (
        lambda: shaded(
            np.sin(np.radians(0.1)),
            sun=SunLamp("sun", (np.cos(np.radians(0.1)), 0.0, -np.sin(np.radians(0.1))), (np.pi,) * 3),
        ),
        "shadow rays that start behind their own surface",
    ),
    "sun straight along the floor": (
        lambda: shaded(0.0, sun=SunLamp("sun", (1.0, 0.0, 0.0), (np.pi,) * 3)),
        "light from the horizon",
    ),
    "pinhole": (lambda: shaded(0.05**2, *around(0.05, 0.05)), "a spot of sun that no sample has found"),
    "crack of a door": (lambda: shaded(0.01, *around(0.01, 1.0)), "light narrower than a triangle"),
    "light plane in the plane of the ceiling": (lambda: under_a_glowing_panel(0.0), "lamps behind what they lie on"),
    "light plane a hair below the ceiling": (lambda: under_a_glowing_panel(1e-6), "the same"),
    "floor in full shade": (lambda: shaded(0.0, quad("roof", (-5, -5, 0.1), (11, 0, 0), (0, 11, 0))), "leaks"),
}


@pytest.mark.parametrize("case", SHADED)
def test_share_of_sun(case, told):
    """The mean over the floor, within the error that the bake states."""
    known, catches = SHADED[case][0](), SHADED[case][1]
    check(case, known, told, catches=catches)


def shaded_floor(*, inward: bool) -> Scene:
    """A floor in the shadow of a roof, in a nearly black room."""
    room = replace(box("room", (-2, -2, -0.5), (2, 2, 3), inward=inward), receives=False)
    roof = replace(quad("roof", (-0.5, -0.5, 0.5), (0, 1, 0), (1, 0, 0)), receives=False)
    lamp = PointLamp("lamp", (0, 0, 2), (10.0,) * 3)
    return Scene(
        (room, quad("floor", (-1, -1, 0), (2, 0, 0), (0, 2, 0)), roof), (Surface("dark", (0.02,) * 3),), (lamp,)
    )


@pytest.mark.parametrize("tessellate", [True, False], ids=["new", "keep"])
def test_a_room_that_faces_outward_lights_alike(tessellate, told):
    """What lies in it sees nothing but backs, and its shadows are no insides of solids. Seen to fail: whatever is dark
    among backs counts as hidden, 11 % too bright where the floor is kept."""
    settings = Settings(size=0.1, error=0.05, tessellate=tessellate)
    means = []
    for inward in (True, False):
        _, light, area = corners_of(bake(shaded_floor(inward=inward), settings))
        means.append(float(area @ light[:, 0] / area.sum()))
    told(f"shadow in a room that faces outward ({'new' if tessellate else 'keep'})", *means, 1e-3 * means[0])


@pytest.mark.parametrize("shell", [box("shell", (-1,) * 3, (1,) * 3), sphere("shell", 1.0, 4)], ids=["box", "ball"])
def test_watertight_under_a_million_rays(shell, told, long_run):
    """Ten millions in the long run."""
    visibility = Visibility(shell.vertices[shell.triangles])
    lost = 0
    for _ in range(10 if long_run else 1):
        lost += int((visibility.nearest(*ball_of_rays(1_000_000)) < 0).sum())
    told(f"rays that leave a closed shell of {len(shell.triangles)} faces", 0, lost, 0, "cracks between triangles")


def room_with_a_hole(size: float, lamps: tuple[PointLamp, ...]) -> Scene:
    """A closed room of 4 m under a sky, but for a square hole in one of its walls."""
    low, high = 2.0 - size / 2, 2.0 + size / 2
    shell = box("room", (0, 0, 0), (4, 4, 4), inward=True)
    wall = (shell.vertices[shell.triangles][..., 0] == 4).all(axis=1)
    parts = [(0, 0, 4, low), (0, high, 4, 4), (0, low, low, high), (high, low, 4, high)]
    frame = [quad(f"wall {k}", (4, a, b), (0, 0, d - b), (0, c - a, 0)) for k, (a, b, c, d) in enumerate(parts)]
    rest = replace(shell, triangles=shell.triangles[~wall], surface=shell.surface[~wall])
    return Scene((rest, *frame), (WHITE,), lamps, (10.0,) * 3)


@pytest.mark.parametrize("size", [0.0, 0.01])
def test_what_no_ray_has_found_may_be_there(size, told):
    """Through a hole that no ray finds as much light may come as all that is baked: the error is all of it, and a
    warning names the remedy. Beside a lamp it is next to nothing. Seen to fail: an error of 0 where no light is.

    The parts of the wall do not share their corners: now and then a ray of the transport slips through."""
    settings = Settings(error=0.05, triangles=500)
    dark = bake(room_with_a_hole(size, ()), settings).report
    told(f"stated error of a room whose hole of {size} m no ray has found", 1.0, dark.estimated_error["total"], 0.02)
    assert any("Portal" in warning for warning in dark.warnings)
    lit = bake(room_with_a_hole(size, (PointLamp("lamp", (2, 2, 2), (10.0,) * 3),)), settings).report
    assert lit.estimated_error["total"] < 0.06
    assert not any("Portal" in warning for warning in lit.warnings)


def glowing_sheets(channels: int) -> Scene:
    """A small tetrahedron on a sheet whose halves are a needle and a large triangle, all of them glowing and reflecting
    in so many channels: as a random scene was, split."""
    faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
    small = triangles("small", [(0, 0.75, 0.25), (0.25, 0.75, 0.25), (0, 1, 0.25), (0, 0.75, 0.5)], faces)
    corners = [(0, 0.5, 0), (0.92983, 0.77715, -0.24207), (0.92959, 0.77811, -0.24191), (-0.24207, 1.45615, 0.16489)]
    lit = np.arange(3) < channels
    return Scene(
        (small, triangles("sheet", corners, [[0, 1, 2], [0, 2, 3]])),
        (Surface("glowing", tuple(0.2 * lit), tuple(1.0 * lit)),),
    )


def test_stated_error_of_red_light_on_red_surfaces(told):
    """The same rays, the same error in red, and none in green and blue, where nothing is: over the channels the root
    mean square is sqrt(3) times as large as where all three are alike, relative to their mean. Catches errors judged as
    if light and surfaces were white: beside what glows they were stated a third as large. Found by a random scene."""
    stated = []
    for channels in (3, 1):
        settings = Settings(triangles=30, error=None, tessellate=False, effects={"colour": True})
        effort = replace(choose_effort(glowing_sheets(channels), settings), patches=30, gather_rays=8, channels=3)
        stated.append(bake(glowing_sheets(channels), settings, effort=effort).report.estimated_error["total"])
    told("stated error of red light on red surfaces", np.sqrt(3), stated[1] / stated[0], 1e-3 * np.sqrt(3))


LAMPS_NEAR = {
    "on the floor": PointLamp("lamp", (0.5, 0.5, 0.0), (1.0,) * 3),
    "1e-4 over the floor": PointLamp("lamp", (0.5, 0.5, 1e-4), (1.0,) * 3),
    "at a vertex": PointLamp("lamp", (0.0, 0.0, 0.0), (1.0,) * 3),
    "a ball through the floor": PointLamp("lamp", (0.5, 0.5, 0.0), (1.0,) * 3, 0.1, facing_disc=False),
    "a panel in the floor's plane": AreaLamp("lamp", (0.5, 0.5, 0), (0.2, 0, 0), (0, 0.2, 0), (0, 0, 1), (1.0,) * 3),
    "inside a box": PointLamp("lamp", (5.5, 5.5, 5.5), (1.0,) * 3),
}


@pytest.mark.parametrize("case", LAMPS_NEAR)
def test_lamps_in_bad_places_give_finite_light(case, told):
    """Only where the light goes is asked here: nowhere negative, nowhere infinite, nowhere NaN."""
    objects = (FLOOR, box("box", (5,) * 3, (6,) * 3))
    result = bake(Scene(objects, (WHITE,), (LAMPS_NEAR[case],)), Settings(triangles=100, error=0.1))
    light = corners_of(result)[1]
    broken = int(np.count_nonzero(~np.isfinite(light)) + np.count_nonzero(light < 0))
    told(f"broken values: lamp {case}", 0, broken, 0, "poles of the inverse square law")
