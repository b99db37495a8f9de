"""Each problem is named, and its button mends it."""

import bpy
import pytest

from radiosity_baker.addon import checklist

pytestmark = pytest.mark.usefixtures("registered")

CUBE = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
CUBE_FACES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


@pytest.fixture
def asked(add_lamp):
    add_lamp("POINT", {"energy": 10.0}, location=(0.0, 0.0, 5.0))
    return bpy.context.scene.radiosity_baker


def flipped(add_mesh, _add_material):
    add_mesh("Cube", CUBE, [CUBE_FACES[0][::-1], *CUBE_FACES[1:]])


def inside_out(add_mesh, _add_material):
    add_mesh("Cube", CUBE, [face[::-1] for face in CUBE_FACES])


def twice(add_mesh, _add_material):
    add_mesh("Cube", [*CUBE, *CUBE[:4]], [*CUBE_FACES, (8, 9, 11, 10)])


def flat(add_mesh, _add_material):
    add_mesh("Plane", [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 0, 0)], [(1, 2, 3, 0), (0, 4, 1)])


def too_white(add_mesh, add_material):
    plane = add_mesh("Plane")
    plane.data.materials.append(add_material("ShaderNodeBsdfDiffuse", Color=(1.0, 1.0, 1.0, 1.0)))


def shared(add_mesh, _add_material):
    one, two = add_mesh("One"), add_mesh("Two", location=(2, 0, 0))
    two.data = one.data
    bpy.context.scene.radiosity_baker.result = "KEEP"


def modified(add_mesh, _add_material):
    add_mesh("Plane").modifiers.new("Subdivision", "SUBSURF")
    bpy.context.scene.radiosity_baker.result = "KEEP"


def coarse(add_mesh, _add_material):
    add_mesh("Plane", [(9 * x, 9 * y, 0) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
    bpy.context.scene.radiosity_baker.result = "KEEP"


def unlit(add_mesh, _add_material):
    add_mesh("Plane")
    for lamp in list(bpy.data.lights):
        bpy.data.lights.remove(lamp)


def much(add_mesh, _add_material):
    add_mesh("Plane")
    bpy.context.scene.radiosity_baker.triangles = 20_000


CASES = {
    "mixed winding": flipped,
    "inside out": inside_out,
    "duplicate faces": twice,
    "zero area": flat,
    "albedo": too_white,
    "shared mesh": shared,
    "modifiers": modified,
    "coarse": coarse,
    "no light": unlit,
    "memory": much,
}


@pytest.mark.parametrize("kind", CASES)
def test_a_problem_is_found_and_mended(asked, add_mesh, add_material, kind, monkeypatch):
    CASES[kind](add_mesh, add_material)
    bpy.ops.object.radiosity_plan()
    if kind == "memory":
        needs = asked.last_plan()["memory_mb"]
        monkeypatch.setattr(checklist, "free_memory_mb", lambda: needs)
        bpy.ops.object.radiosity_plan()
    assert kind in {problem.kind for problem in asked.problems()}

    number = [problem.kind for problem in asked.problems()].index(kind)
    bpy.ops.object.radiosity_fix(number=number)

    if kind == "memory":
        assert asked.triangles == 10_000
    else:
        assert kind not in {problem.kind for problem in asked.problems()}


def test_each_user_of_a_shared_mesh_is_a_problem_of_its_own(asked, add_mesh):
    shared(add_mesh, None)
    bpy.ops.object.radiosity_plan()
    assert [problem.objects for problem in asked.problems()] == [("One",), ("Two",)]
    bpy.ops.object.radiosity_fix(number=0)
    assert asked.problems() == []


def test_a_sound_scene_has_no_problem_and_a_price_for_each_accuracy(asked, add_mesh):
    add_mesh("Cube", CUBE, CUBE_FACES)
    bpy.ops.object.radiosity_plan()
    assert asked.problems() == []
    costs = asked.last_plan()["costs"]
    assert [error for error, _ in costs] == [0.05, 0.02, 0.01, 0.005]
    assert all(seconds > 0 for _, seconds in costs)


def test_every_problem_has_a_mend():
    assert set(CASES) | {"linked"} == set(checklist.FIXES)
