"""What stands in the way of a good bake: problems named before it, and mended by a click where that is safe."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import bmesh
import bpy
from bpy.app.translations import pgettext_iface as tr

from ..core.lint import Finding
from ..core.plan import Plan
from . import wording
from .scene_reader import check_same_corners, evaluated_mesh

#: What a too white colour becomes: fresh snow.
WHITEST = 0.9
#: Of the memory that is free, the share that a bake may take.
_MEMORY_SHARE = 0.8
#: Of `bmesh.ops`: nearer vertices are one, shorter edges none, in metres.
_MERGE_DISTANCE = 1e-5


#: What is said of each kind of problem.
SAID = {
    "mixed winding": "Neighbouring faces look to different sides ({names}): {triangles}",
    "inside out": "Faces look inward ({names}), and what sees only backs counts as inside and is dark",
    "duplicate faces": "Faces lie exactly on others ({names}): {triangles}",
    "zero area": "Faces have no area ({names}): {triangles}",
    "albedo": "Materials reflect all light or more ({names}), which nothing real does",
    "coarse": "Faces are larger than lamps are far ({names}), and hide the light between their corners: {triangles}",
    "shared mesh": "Shares its mesh with others, and each gets different light: {names}",
    "linked": "Is linked from another file, and cannot be written to: {names}",
    "modifiers": "Has modifiers that change its faces: {names}",
    "no light": "Nothing gives off light: no lamp, no emitting material, and a black world",
    "memory": "Needs about {needed} MB of memory, and {free} MB are free",
}


@dataclass(frozen=True)
class Problem:
    """kind: which of FIXES mends it. text: what is wrong, in words. objects: by name, the ones that it is about."""

    kind: str
    text: str
    objects: tuple[str, ...] = ()


def of_objects(objects: Sequence[bpy.types.Object], result_mode: str, depsgraph: bpy.types.Depsgraph) -> list[Problem]:
    """What Blender's data says before anything is read: sharing, links and modifiers that the asked result refuses."""
    if result_mode == "new":
        return []
    shared = [o.name for o in objects if result_mode == "keep" and o.data.users - o.data.use_fake_user > 1]
    linked = [o.name for o in objects if o.library or o.data.library or o.override_library]
    modified = [o.name for o in objects if o.modifiers and o.name not in linked and _changes_faces(o, depsgraph)]
    return [
        *(_problem("shared mesh", (name,)) for name in shared),
        *(_problem("linked", (name,)) for name in linked),
        *(_problem("modifiers", (name,)) for name in modified),
    ]


def of_findings(found: Iterable[Finding]) -> list[Problem]:
    """What the arrays say (core.lint), with one problem for each kind of finding."""
    by_kind: dict[str, list[Finding]] = {}
    for finding in found:
        by_kind.setdefault(finding.kind, []).append(finding)
    return [
        _problem(kind, tuple(f.name for f in group), sum(f.count for f in group)) for kind, group in by_kind.items()
    ]


def of_plan(planned: Plan) -> list[Problem]:
    """What the predicted cost says."""
    free = free_memory_mb()
    if free is None or planned.memory_mb <= _MEMORY_SHARE * free:
        return []
    text = tr(SAID["memory"]).format(needed=f"{planned.memory_mb:,.0f}", free=f"{free:,.0f}")
    return [Problem("memory", text)]


def free_memory_mb() -> float | None:
    """Memory that a program may still take, in MB; None where the system does not tell."""
    try:
        return os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / 1e6
    except (AttributeError, OSError, ValueError):
        return None


def no_light() -> Problem:
    return _problem("no light", ())


def fix(context: bpy.types.Context, problem: Problem) -> None:
    """Mend a problem. Every mend is an ordinary edit, and undone like one."""
    objects = [context.scene.objects[name] for name in problem.objects if name in context.scene.objects]
    FIXES[problem.kind][1](context, objects, problem)


def _problem(kind: str, names: tuple[str, ...], count: int = 0) -> Problem:
    triangles = wording.count("triangle", count)
    return Problem(kind, tr(SAID[kind]).format(names=", ".join(names), triangles=triangles), names)


def _changes_faces(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> bool:
    with evaluated_mesh(obj.evaluated_get(depsgraph)) as mesh:
        try:
            check_same_corners(obj, mesh)
        except ValueError:
            return True
    return False


def _edit(obj: bpy.types.Object, change: Callable[[bmesh.types.BMesh], object]) -> None:
    mesh = bmesh.new()
    try:
        mesh.from_mesh(obj.data)
        change(mesh)
        mesh.to_mesh(obj.data)
    finally:
        mesh.free()
    obj.data.update()


Fix = Callable[[bpy.types.Context, Sequence[bpy.types.Object], Problem], None]


def _edit_all(change: Callable[[bmesh.types.BMesh], object]) -> Fix:
    def fix_all(_context: bpy.types.Context, objects: Sequence[bpy.types.Object], _problem: Problem) -> None:
        for mesh, obj in {obj.data: obj for obj in objects}.items():
            if mesh.library is None:
                _edit(obj, change)

    return fix_all


def _drop_duplicates(mesh: bmesh.types.BMesh) -> None:
    bmesh.ops.remove_doubles(mesh, verts=mesh.verts, dist=_MERGE_DISTANCE)
    seen: set[frozenset[bmesh.types.BMVert]] = set()
    again = []
    for face in mesh.faces:
        corners = frozenset(face.verts)
        if corners in seen:
            again.append(face)
        seen.add(corners)
    bmesh.ops.delete(mesh, geom=again, context="FACES_ONLY")


def _make_single_user(_context: bpy.types.Context, objects: Sequence[bpy.types.Object], _problem: Problem) -> None:
    for obj in objects:
        obj.data = obj.data.copy()


def _choose_new_object(context: bpy.types.Context, *_: object) -> None:
    context.scene.radiosity_baker.result = "NEW"


def _darken(_context: bpy.types.Context, _objects: Sequence[bpy.types.Object], problem: Problem) -> None:
    for name in problem.objects:
        material = bpy.data.materials.get(name)
        tree = material.node_tree if material is not None else None
        for node in tree.nodes if tree is not None else ():
            for plug in node.inputs:
                if plug.type == "RGBA" and not plug.is_linked:
                    red, green, blue, alpha = plug.default_value
                    plug.default_value = (min(red, WHITEST), min(green, WHITEST), min(blue, WHITEST), alpha)


def _add_sun(context: bpy.types.Context, *_: object) -> None:
    lamp = bpy.data.lights.new("Sun", "SUN")
    lamp.energy, lamp.angle = 3.0, 0.01
    sun = bpy.data.objects.new("Sun", lamp)
    sun.location, sun.rotation_euler = (4.0, -4.0, 6.0), (0.6, 0.3, 0.6)
    context.scene.collection.objects.link(sun)


def _use_fewer_triangles(context: bpy.types.Context, *_: object) -> None:
    asked = context.scene.radiosity_baker
    asked.density, asked.triangles = "TRIANGLES", max(asked.triangles // 2, 1_000)


#: What the button says, and what it does.
FIXES: dict[str, tuple[str, Fix]] = {
    "mixed winding": (
        "Recalculate Normals",
        _edit_all(lambda mesh: bmesh.ops.recalc_face_normals(mesh, faces=mesh.faces)),
    ),
    "inside out": ("Flip Normals", _edit_all(lambda mesh: bmesh.ops.reverse_faces(mesh, faces=mesh.faces))),
    "duplicate faces": ("Remove Duplicates", _edit_all(_drop_duplicates)),
    "zero area": (
        "Dissolve",
        _edit_all(lambda mesh: bmesh.ops.dissolve_degenerate(mesh, dist=_MERGE_DISTANCE, edges=mesh.edges)),
    ),
    "albedo": ("Darken to 90 %", _darken),
    "coarse": ("Bake a New Object", _choose_new_object),
    "shared mesh": ("Make Single User", _make_single_user),
    "linked": ("Bake a New Object", _choose_new_object),
    "modifiers": ("Bake a New Object", _choose_new_object),
    "no light": ("Add a Sun", _add_sun),
    "memory": ("Use Half the Triangles", _use_fewer_triangles),
}
