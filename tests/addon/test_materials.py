"""Materials and worlds against Cycles, and the words for what is not read."""

from types import SimpleNamespace

import bpy
import numpy as np
import pytest

from radiosity_baker.addon.materials import read_material, rough_albedo
from radiosity_baker.core.scene import ALBEDO_LIMIT

COLOUR = (0.8, 0.4, 0.1, 1.0)
LIGHT = (1.0, 0.5, 0.25, 1.0)


def white_sky(shader, colour=(1.0, 1.0, 1.0, 1.0), strength=1.0):
    world = bpy.data.worlds.new("Sky")
    bpy.context.scene.world = world
    shader(world, "ShaderNodeBackground", Color=colour, Strength=strength)
    return world


@pytest.fixture
def under_white_sky(add_mesh, cycles_bake, shader):
    """What Cycles' Combined bake gives a single triangle of a material under a sky of radiance 1: albedo + emission."""

    def measure(material):
        white_sky(shader)
        obj = add_mesh(vertices=((0, 0, 0), (1, 0, 0), (0, 1, 0)), faces=((0, 1, 2),))
        obj.data.materials.append(material)
        return cycles_bake(obj, 256)[0].mean(axis=0)

    return measure


@pytest.mark.parametrize(
    ("kind", "inputs"),
    [
        ("ShaderNodeBsdfDiffuse", {"Color": COLOUR}),
        ("ShaderNodeBsdfDiffuse", {"Color": COLOUR, "Roughness": 0.5}),
        ("ShaderNodeBsdfDiffuse", {"Color": COLOUR, "Roughness": 1.0}),
        ("ShaderNodeEmission", {"Color": LIGHT, "Strength": 3.0}),
        ("ShaderNodeBsdfPrincipled", {"Base Color": COLOUR, "Specular IOR Level": 0.0}),
        (
            "ShaderNodeBsdfPrincipled",
            {"Base Color": COLOUR, "Specular IOR Level": 0.0, "Emission Color": LIGHT, "Emission Strength": 2.0},
        ),
    ],
)
def test_a_diffuse_material_is_what_cycles_bakes(add_material, under_white_sky, kind, inputs):
    material = add_material(kind, **{key.replace(" ", "_"): value for key, value in inputs.items()})

    surface, warnings = read_material(material)

    assert warnings == []
    # A convex triangle under an even sky: no noise but that of 256 samples of a constant.
    np.testing.assert_allclose(np.add(surface.albedo, surface.emission), under_white_sky(material), atol=1e-3)


def test_the_default_principled_differs_from_cycles_by_its_thin_reflecting_layer_only(add_material, under_white_sky):
    material = add_material("ShaderNodeBsdfPrincipled", Base_Color=COLOUR)

    surface, _ = read_material(material)

    # The layer sends back 3.7 % and dims what is under it by as much: at most 0.037 where the colour is black.
    np.testing.assert_allclose(surface.albedo, under_white_sky(material), atol=0.037)


def test_metal_and_glass_share_what_the_base_colour_has(add_material):
    """Half is metal; of the rest half is glass. Principled's glass is tinted by the root: light enters and leaves;
    a metal mirrors one part in 21 more than its colour, over all angles."""
    material = add_material(
        "ShaderNodeBsdfPrincipled",
        Base_Color=COLOUR,
        Metallic=0.5,
        Transmission_Weight=0.5,
        Roughness=0.05,
        IOR=1.4,
    )
    base = np.array(COLOUR[:3])

    surface, warnings = read_material(material)

    assert warnings == []
    np.testing.assert_allclose(surface.albedo, base / 4, rtol=1e-6)
    np.testing.assert_allclose(surface.glass, np.sqrt(base) / 4, rtol=1e-6)
    np.testing.assert_allclose(surface.mirror, (base + (1 - base) / 21) / 2, rtol=1e-6)
    assert (surface.ior, surface.roughness) == (pytest.approx(1.4), pytest.approx(0.05))


def test_alpha_is_opacity_and_leaves_the_colour_of_what_is_there(add_material):
    surface, warnings = read_material(add_material("ShaderNodeBsdfPrincipled", Base_Color=COLOUR, Alpha=0.25))

    assert warnings == []
    assert surface.opacity == 0.25
    np.testing.assert_allclose(surface.scattered, np.array(COLOUR[:3]) / 4, rtol=1e-6)


@pytest.mark.parametrize(
    ("kind", "field"), [("Translucent", "transmission"), ("Glass", "glass"), ("Refraction", "glass")]
)
def test_shaders_that_pass_light_on_are_read(add_material, kind, field):
    surface, warnings = read_material(add_material(f"ShaderNodeBsdf{kind}", Color=COLOUR))

    assert warnings == []
    np.testing.assert_allclose(getattr(surface, field), COLOUR[:3], rtol=1e-6)
    assert max(surface.albedo) == 0


def test_frosted_glass_is_named(add_material):
    _, warnings = read_material(add_material("ShaderNodeBsdfGlass", Roughness=0.5))

    assert len(warnings) == 1
    assert "glass of roughness 0.50" in warnings[0]


def test_a_mix_with_a_transparent_shader_is_opaque_by_the_other_share(add_material, shader):
    """The other shader's light is that of the opaque part."""
    material = add_material("ShaderNodeBsdfDiffuse")
    mix = shader(material, "ShaderNodeMixShader")
    mix.inputs[0].default_value = 0.25
    film, solid = chain(material, "ShaderNodeBsdfTransparent", "ShaderNodeBsdfDiffuse")
    film.inputs["Color"].default_value = (1.0, 0.5, 0.25, 1.0)
    solid.inputs["Color"].default_value = COLOUR
    material.node_tree.links.new(film.outputs[0], mix.inputs[1])
    material.node_tree.links.new(solid.outputs[0], mix.inputs[2])

    surface, warnings = read_material(material)

    assert warnings == []
    assert surface.opacity == 0.25
    assert surface.transparent == (1.0, 0.5, 0.25)
    np.testing.assert_allclose(surface.albedo, COLOUR[:3], rtol=1e-6)


def chain(material, *kinds):
    """Put nodes into the material's tree."""
    return [material.node_tree.nodes.new(kind) for kind in kinds]


def test_mix_and_add_weigh_their_shaders(add_material, shader, under_white_sky):
    material = add_material("ShaderNodeBsdfDiffuse")
    mix = shader(material, "ShaderNodeMixShader")
    mix.inputs[0].default_value = 0.25
    diffuse, add, glow, dark = chain(
        material, "ShaderNodeBsdfDiffuse", "ShaderNodeAddShader", "ShaderNodeEmission", "ShaderNodeBsdfDiffuse"
    )
    diffuse.inputs["Color"].default_value = COLOUR
    glow.inputs["Strength"].default_value = 2.0
    dark.inputs["Color"].default_value = (0.1, 0.1, 0.1, 1.0)
    link = material.node_tree.links.new
    link(diffuse.outputs[0], mix.inputs[1])
    link(add.outputs[0], mix.inputs[2])
    link(glow.outputs[0], add.inputs[0])
    link(dark.outputs[0], add.inputs[1])

    surface, warnings = read_material(material)

    assert warnings == []
    np.testing.assert_allclose(surface.albedo, 0.75 * np.array(COLOUR[:3]) + 0.025, rtol=1e-6)
    np.testing.assert_allclose(surface.emission, 0.5, rtol=1e-6)
    np.testing.assert_allclose(np.add(surface.albedo, surface.emission), under_white_sky(material), atol=1e-3)


def test_constants_come_through_reroutes_and_value_nodes(add_material, shader):
    material = add_material("ShaderNodeBsdfDiffuse")
    emission = shader(material, "ShaderNodeEmission")
    rgb, reroute, value = chain(material, "ShaderNodeRGB", "NodeReroute", "ShaderNodeValue")
    rgb.outputs[0].default_value = LIGHT
    value.outputs[0].default_value = 4.0
    link = material.node_tree.links.new
    link(rgb.outputs[0], reroute.inputs[0])
    link(reroute.outputs[0], emission.inputs["Color"])
    link(value.outputs[0], emission.inputs["Strength"])

    surface, warnings = read_material(material)

    assert warnings == []
    np.testing.assert_allclose(surface.emission, 4.0 * np.array(LIGHT[:3]))


def test_a_muted_shader_passes_its_first_input_on(add_material, shader, under_white_sky):
    material = add_material("ShaderNodeBsdfDiffuse")
    add = shader(material, "ShaderNodeAddShader")
    diffuse, glow = chain(material, "ShaderNodeBsdfDiffuse", "ShaderNodeEmission")
    diffuse.inputs["Color"].default_value = COLOUR
    material.node_tree.links.new(diffuse.outputs[0], add.inputs[0])
    material.node_tree.links.new(glow.outputs[0], add.inputs[1])
    add.mute = True

    surface, _ = read_material(material)

    np.testing.assert_allclose(np.add(surface.albedo, surface.emission), under_white_sky(material), atol=1e-3)


def test_a_muted_link_is_no_link(add_material):
    material = add_material("ShaderNodeEmission", Strength=2.0)
    (value,) = chain(material, "ShaderNodeValue")
    emission = next(node for node in material.node_tree.nodes if node.bl_idname == "ShaderNodeEmission")
    value.outputs[0].default_value = 5.0
    material.node_tree.links.new(value.outputs[0], emission.inputs["Strength"]).is_muted = True

    assert read_material(material)[0].emission == (2.0, 2.0, 2.0)


def test_a_texture_is_named_and_the_plain_value_taken(add_material):
    material = add_material("ShaderNodeBsdfDiffuse", name="Bricks", Color=COLOUR)
    (texture,) = chain(material, "ShaderNodeTexChecker")
    diffuse = next(node for node in material.node_tree.nodes if node.bl_idname == "ShaderNodeBsdfDiffuse")
    material.node_tree.links.new(texture.outputs["Color"], diffuse.inputs["Color"])

    surface, warnings = read_material(material)

    np.testing.assert_allclose(surface.albedo, COLOUR[:3])
    assert len(warnings) == 1
    assert "Material 'Bricks' takes its Color from the node Checker Texture" in warnings[0]


def test_a_shader_that_is_not_read_is_black_and_named(add_material):
    surface, warnings = read_material(add_material("ShaderNodeBsdfToon", name="Cartoon"))

    assert surface.albedo == (0.0, 0.0, 0.0)
    assert "Material 'Cartoon' uses the node Toon BSDF" in warnings[0]


def test_no_shader_at_the_output_is_black_and_named(add_material):
    material = add_material("ShaderNodeBsdfDiffuse", name="Loose")
    material.node_tree.links.clear()

    surface, warnings = read_material(material)

    assert surface.albedo == (0.0, 0.0, 0.0)
    assert "Material 'Loose' has no shader" in warnings[0]


def test_white_is_limited_and_named(add_material):
    surface, warnings = read_material(add_material("ShaderNodeBsdfDiffuse", Color=(1.0, 2.0, 0.5, 1.0)))

    assert surface.albedo == (ALBEDO_LIMIT, ALBEDO_LIMIT, 0.5)
    assert "reflects more than it receives" in warnings[0]


def test_without_nodes_the_viewport_colour_counts():
    """Blenders before 5.0 let a material do without nodes."""
    rna = SimpleNamespace(properties={"use_nodes": SimpleNamespace()})
    plain = SimpleNamespace(name="Plain", bl_rna=rna, use_nodes=False, node_tree=None, diffuse_color=COLOUR)

    surface, warnings = read_material(plain)

    assert surface.albedo == COLOUR[:3]
    assert warnings == []


def test_rough_albedo_keeps_its_ends():
    colour = np.array([0.0, 0.3, 1.0])
    np.testing.assert_array_equal(rough_albedo(colour, 0.0), colour)
    # Energy is preserved: a white surface stays white however rough.
    np.testing.assert_allclose(rough_albedo(colour, 1.0)[[0, 2]], [0.0, 1.0], atol=1e-12)


def turned_by_side(add_material, behind="ShaderNodeBsdfDiffuse", **inputs):
    """A lamp's front, and another shader behind."""
    material = add_material("ShaderNodeEmission", name="Panel", Color=LIGHT, Strength=3.0)
    tree = material.node_tree
    mix, geometry, back = (tree.nodes.new(kind) for kind in ("ShaderNodeMixShader", "ShaderNodeNewGeometry", behind))
    for name, value in inputs.items():
        back.inputs[name].default_value = value
    front = next(node for node in tree.nodes if node.bl_idname == "ShaderNodeEmission")
    tree.links.new(geometry.outputs["Backfacing"], mix.inputs[0])
    tree.links.new(front.outputs[0], mix.inputs[1])
    tree.links.new(back.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], tree.get_output_node("ALL").inputs["Surface"])
    return material


def test_what_emits_in_front_only_is_one_sided(add_material):
    surface, warnings = read_material(turned_by_side(add_material, Color=(0.0, 0.0, 0.0, 1.0)))
    np.testing.assert_allclose(surface.emission, 3.0 * np.array(LIGHT[:3]))
    assert (surface.one_sided, surface.unread, warnings) == (True, (), [])


def test_a_back_of_another_colour_is_warned_of(add_material):
    surface, warnings = read_material(turned_by_side(add_material, Color=COLOUR))
    assert surface.one_sided
    assert warnings == ["Material 'Panel' is not the same from behind: its front is used for both sides."]
    both, warnings = read_material(turned_by_side(add_material, "ShaderNodeEmission", Strength=1.0))
    assert not both.one_sided
    assert len(warnings) == 1
