"""Materials that show the baked light in Material Preview, EEVEE and Cycles, in the place of the person's own.

Each stands in one slot for one material, which it remembers; so what was there can be put back exactly, and a bake
reads the material behind it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import ClassVar

import bpy

from .attribute_writer import OURS_KEY
from .colour_storage import factor_of
from .compat import shader_tree
from .materials import STANDS_FOR_KEY, own_material

#: What stands in for no material: in an empty slot, or in one that was added because there was none.
_EMPTY_SLOT, _NO_SLOT = "empty slot", "no slot"

#: Custom property of a stand-in: it shows whichever layer is active.
_EMITS_KEY = "radiosity_baker_emits"
#: From a material (or none), an attribute's name and the factor of its light to what stands in; None: nothing does.
Make = Callable[["bpy.types.Material | None", str, float], "bpy.types.Material | None"]


def show_light(objects: Iterable[bpy.types.Object]) -> None:
    """Let the surfaces of baked objects give off their active layer, and nothing else."""
    active = [(obj, obj.data.color_attributes.active_color_name) for obj in objects]
    _put_before([(obj, name) for obj, name in active if name in (obj.data.get(OURS_KEY) or {})], _emitting)


def show_lit(objects: Iterable[bpy.types.Object]) -> None:
    """Let the surfaces give off their layer Light times their own colour, with all of its texture's detail, and what
    they emitted before. Materials without a diffuse part stay as they are."""
    _put_before(list(lit_objects(objects)), _lit)


def lit_objects(objects: Iterable[bpy.types.Object]) -> Iterator[tuple[bpy.types.Object, str]]:
    """Those with the layer Light, and the attribute that holds it."""
    for obj in objects:
        for name, layer in (obj.data.get(OURS_KEY) or {}).items():
            if layer == "light" and name in obj.data.color_attributes:
                yield obj, name
                break


def follow_layer(objects: Sequence[bpy.types.Object]) -> None:
    """Another layer has become the active one: let the materials that show the one before show it."""
    showing = [
        obj for obj in objects if any(slot.material and _EMITS_KEY in slot.material for slot in obj.material_slots)
    ]
    if showing:
        show_light(showing)


def shows_light(objects: Iterable[bpy.types.Object]) -> bool:
    """Does any of the objects show baked light by its materials?"""
    return any(_stands_in(slot.material) for obj in objects for slot in obj.material_slots)


def put_back(objects: Iterable[bpy.types.Object]) -> None:
    """Give the objects the materials back that they had, and remove those nobody uses any more."""
    for obj in objects:
        for slot in [slot for slot in obj.material_slots if _stands_in(slot.material)]:
            stand_in = slot.material
            if stand_in[STANDS_FOR_KEY] == _NO_SLOT:
                obj.data.materials.clear()  # `pop` would leave the object its slot.
            else:
                slot.material = own_material(stand_in)
            if stand_in.users == 0:
                bpy.data.materials.remove(stand_in)


def last_baked(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """The objects of the last bake that are still there."""
    report = scene.radiosity_baker.last_report() or {"objects": []}
    found = dict.fromkeys(scene.objects.get(entry["name"]) for entry in report["objects"])
    return [obj for obj in found if obj is not None and obj.type == "MESH"]


def _stands_in(material: bpy.types.Material | None) -> bool:
    return material is not None and STANDS_FOR_KEY in material


def _put_before(chosen: Sequence[tuple[bpy.types.Object, str]], make: Make) -> None:
    """Put what `make` makes of each material of the objects, and of the attribute beside each, in its place."""
    put_back(obj for obj, _ in chosen)
    made: dict[tuple[bpy.types.Material | str, str, float], bpy.types.Material | None] = {}
    for obj, attribute in chosen:
        nothing = _EMPTY_SLOT if obj.material_slots else _NO_SLOT
        if not obj.material_slots:
            obj.data.materials.append(None)
        factor = factor_of(obj.data, attribute)
        for slot in obj.material_slots:
            key = (slot.material or nothing, attribute, factor)
            if key not in made:
                made[key] = make(slot.material, attribute, factor)
                if made[key] is not None:
                    made[key][STANDS_FOR_KEY] = key[0]
            slot.material = made[key] or slot.material


def _emitting(original: bpy.types.Material | None, attribute: str, factor: float) -> bpy.types.Material:
    material = bpy.data.materials.new(f"{original.name if original else 'Material'} shows {attribute}")
    material[_EMITS_KEY] = True
    tree = _tree(material)
    tree.nodes.clear()
    light = _attribute(tree, attribute)
    _emit(tree, tree.nodes.new("ShaderNodeOutputMaterial"), light.outputs["Color"], 1.0 / factor)
    return material


def _lit(original: bpy.types.Material | None, attribute: str, factor: float) -> bpy.types.Material | None:
    material = original.copy() if original else bpy.data.materials.new("Material")
    material.name = f"{original.name if original else 'Material'} lit by {attribute}"
    tree = _tree(material)
    output = tree.get_output_node("ALL")
    diffuse = _diffuse_node(output) if output else None
    if diffuse is None:
        bpy.data.materials.remove(material)
        return None
    colour = _colour(diffuse)
    reflected = _vector_math(tree, "MULTIPLY", colour, _attribute(tree, attribute).outputs["Color"])
    if "Emission Color" not in diffuse.inputs:
        _emit(tree, output, reflected, 1.0 / factor)
        return material
    light = _vector_math(tree, "SCALE", reflected)
    light.node.inputs["Scale"].default_value = 1.0 / factor
    glow = _vector_math(tree, "SCALE", diffuse.inputs["Emission Color"])
    _feed(tree, diffuse.inputs["Emission Strength"], glow.node.inputs["Scale"])
    _emit(tree, output, _vector_math(tree, "ADD", light, glow), 1.0)
    return material


def _tree(material: bpy.types.Material) -> bpy.types.NodeTree:
    """The node tree of a material; one that shades without nodes gets those that do the same."""
    if shader_tree(material) is None:
        material.use_nodes = True
        tree = material.node_tree
        tree.nodes.clear()
        diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
        diffuse.inputs["Color"].default_value = material.diffuse_color
        tree.links.new(diffuse.outputs["BSDF"], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return material.node_tree


def _attribute(tree: bpy.types.NodeTree, name: str) -> bpy.types.Node:
    node = tree.nodes.new("ShaderNodeVertexColor")
    node.layer_name = name
    return node


def _emit(tree: bpy.types.NodeTree, output: bpy.types.Node, colour: bpy.types.NodeSocket, strength: float) -> None:
    emission = tree.nodes.new("ShaderNodeEmission")
    emission.inputs["Strength"].default_value = strength
    tree.links.new(colour, emission.inputs["Color"])
    tree.links.new(emission.outputs["Emission"], output.inputs["Surface"])


def _vector_math(tree: bpy.types.NodeTree, operation: str, *operands: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
    """The result of an operation on what comes out of sockets, or goes into them."""
    node = tree.nodes.new("ShaderNodeVectorMath")
    node.operation = operation
    for operand, socket in zip(operands, node.inputs, strict=False):
        _feed(tree, operand, socket)
    return node.outputs["Vector"]


def _feed(tree: bpy.types.NodeTree, source: bpy.types.NodeSocket, socket: bpy.types.NodeSocket) -> None:
    """Let a socket have what an output gives, or what another input is given."""
    if source.is_output:
        tree.links.new(source, socket)
    elif source.is_linked:
        tree.links.new(source.links[0].from_socket, socket)
    elif source.type == "RGBA":
        socket.default_value = source.default_value[:3]
    else:
        socket.default_value = source.default_value


def _diffuse_node(output: bpy.types.Node) -> bpy.types.Node | None:
    """The nearest node behind the surface of an output that has a colour which diffuse light is multiplied with."""
    waiting = [output.inputs["Surface"]]
    while waiting:
        links = waiting.pop(0).links
        for link in links:
            if _colour(link.from_node) is not None:
                return link.from_node
            waiting += [socket for socket in link.from_node.inputs if socket.type == "SHADER"]
    return None


def _colour(node: bpy.types.Node) -> bpy.types.NodeSocket | None:
    if node.bl_idname == "ShaderNodeBsdfPrincipled":
        return node.inputs["Base Color"]
    return node.inputs["Color"] if node.bl_idname == "ShaderNodeBsdfDiffuse" else None


class OBJECT_OT_radiosity_show_light(bpy.types.Operator):
    bl_idname = "object.radiosity_show_light"
    bl_label = "Show in Materials"
    bl_description = "Let the baked objects give off their active layer in Material Preview and renders, without lamps"
    bl_options: ClassVar[set[str]] = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return bool(last_baked(context.scene))

    def execute(self, context: bpy.types.Context) -> set[str]:
        show_light(last_baked(context.scene))
        return {"FINISHED"}


class OBJECT_OT_radiosity_show_lit(bpy.types.Operator):
    bl_idname = "object.radiosity_show_lit"
    bl_label = "Multiply with Colors"
    bl_description = (
        "Let the baked objects give off the layer Light times the colours of their materials, textures included, in "
        "Material Preview and renders"
    )
    bl_options: ClassVar[set[str]] = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if any(lit_objects(last_baked(context.scene))):
            return True
        cls.poll_message_set("Bake the layer Light first (Advanced)")
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        show_lit(last_baked(context.scene))
        return {"FINISHED"}


class OBJECT_OT_radiosity_put_back(bpy.types.Operator):
    bl_idname = "object.radiosity_put_back"
    bl_label = "Restore Materials"
    bl_description = "Give the baked objects the materials back that they had before they showed the light"
    bl_options: ClassVar[set[str]] = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return shows_light(last_baked(context.scene))

    def execute(self, context: bpy.types.Context) -> set[str]:
        put_back(last_baked(context.scene))
        return {"FINISHED"}


OPERATORS = (OBJECT_OT_radiosity_show_light, OBJECT_OT_radiosity_show_lit, OBJECT_OT_radiosity_put_back)


def register() -> None:
    for operator in OPERATORS:
        bpy.utils.register_class(operator)


def unregister() -> None:
    for operator in reversed(OPERATORS):
        bpy.utils.unregister_class(operator)
