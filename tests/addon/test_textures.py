"""Image textures, colour attributes and sampled materials against Cycles' own look-ups."""

import bpy
import numpy as np
import pytest

from radiosity_baker.addon import material_samples
from radiosity_baker.addon.images import LARGEST, read_image, srgb_to_linear
from radiosity_baker.addon.material_samples import Lattice
from radiosity_baker.addon.materials import read_material
from radiosity_baker.addon.scene_reader import read_scene
from radiosity_baker.core.textures import even_points, look_up, point_colours

RANDOM = np.random.default_rng(5)


def make_image(pixels, space="sRGB", alpha=False, is_float=False):
    """An image of pixels (h, w, 3 or 4), the first row at the bottom."""
    height, width = pixels.shape[:2]
    image = bpy.data.images.new("Picture", width, height, alpha=alpha, float_buffer=is_float)
    image.colorspace_settings.name = space
    image.alpha_mode = "PREMUL" if is_float else "STRAIGHT"
    image.pixels.foreach_set(np.dstack([pixels, np.ones((height, width))])[..., :4].astype(np.float32).ravel())
    return image


@pytest.fixture
def pictured(add_material):
    """A diffuse material with an image as its colour; settings of the node, and of a Mapping node before it."""

    def make(image, mapping=None, name="Pictured", **settings):
        material = add_material("ShaderNodeBsdfDiffuse", name=name)
        tree = material.node_tree
        texture = tree.nodes.new("ShaderNodeTexImage")
        texture.image = image
        for key, value in settings.items():
            setattr(texture, key, value)
        tree.links.new(texture.outputs["Color"], shader_of(material).inputs["Color"])
        if mapping is not None:
            moved, uv = tree.nodes.new("ShaderNodeMapping"), tree.nodes.new("ShaderNodeUVMap")
            moved.vector_type, uv.uv_map = mapping, "Map"
            moved.inputs["Location"].default_value = (0.1, 0.2, 0.3)
            moved.inputs["Rotation"].default_value = (0.1, 0.2, 0.35)
            moved.inputs["Scale"].default_value = (0.5, 0.7, 1.2)
            tree.links.new(uv.outputs[0], moved.inputs["Vector"])
            tree.links.new(moved.outputs[0], texture.inputs["Vector"])
        return material

    return make


def shader_of(material):
    return material.node_tree.get_output_node("ALL").inputs["Surface"].links[0].from_node


@pytest.fixture
def scattered(add_mesh):
    """200 triangles anywhere, with a UV map from -1 to 2, a few materials, and light."""

    def make(*materials):
        corners = RANDOM.random((600, 3))
        obj = add_mesh("Confetti", corners.tolist(), np.arange(600).reshape(-1, 3).tolist())
        obj.data.uv_layers.new(name="Map").uv.foreach_set(
            "vector", RANDOM.uniform(-1, 2, (600, 2)).astype(np.float32).ravel()
        )
        for material in materials:
            obj.data.materials.append(material)
        obj.data.polygons.foreach_set("material_index", np.arange(200, dtype=np.int32) % max(len(materials), 1))
        world = bpy.data.worlds.new("Sky")
        world.color = (1, 1, 1)
        bpy.context.scene.world = world
        return obj

    return make


def albedo_by_cycles(obj):
    """(t, 3, 3) what Cycles' Diffuse bake of the colour alone gives at the corners, exactly."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising = 1, False
    target = obj.data.color_attributes.new("Cycles", "FLOAT_COLOR", "CORNER")
    obj.data.color_attributes.active_color = target
    bpy.context.view_layer.objects.active = obj
    obj.select_set(True)
    bpy.ops.object.bake(type="DIFFUSE", pass_filter={"COLOR"}, target="VERTEX_COLORS")
    values = np.empty(len(obj.data.loops) * 4, np.float32)
    obj.data.color_attributes["Cycles"].data.foreach_get("color", values)
    obj.data.color_attributes.remove(obj.data.color_attributes["Cycles"])
    return values.reshape(-1, 3, 4)[..., :3]


def read(*objects):
    scene, _ = read_scene(bpy.context.evaluated_depsgraph_get(), list(objects), tessellate=True)
    return scene


def albedo_at_corners(scene, number=0):
    """(t, 3, 3) of the pixels themselves."""
    own = scene.objects[number]
    every = np.arange(len(own.triangles), dtype=np.int32)
    parts = np.broadcast_to(np.eye(3), (len(every), 3, 3))
    return np.stack([point_colours(scene, own, every, parts, corner, 0.0).albedo for corner in np.eye(3)], axis=1)


def counts():
    """How many of everything this file holds."""
    kinds = ("scenes", "objects", "meshes", "materials", "node_groups", "images", "collections", "worlds")
    return {kind: len(getattr(bpy.data, kind)) for kind in kinds}


@pytest.mark.parametrize("extension", ["REPEAT", "EXTEND", "CLIP", "MIRROR"])
@pytest.mark.parametrize("interpolation", ["Linear", "Closest"])
def test_pixels_lie_where_cycles_has_them(pictured, scattered, extension, interpolation):
    image = make_image(RANDOM.random((4, 6, 3)))
    obj = scattered(pictured(image, extension=extension, interpolation=interpolation))

    off = np.abs(albedo_at_corners(read(obj)) - albedo_by_cycles(obj)).max(axis=2)

    # Bytes hold steps of 1/255, up to 0.009 on the sRGB curve. Points within single precision of a border may fall on
    # either side, and a clipped image fades over half a pixel in Cycles: 17 parts of one show that but coarsely.
    assert np.quantile(off, 0.95) < 0.012
    assert off.mean() < 0.003


@pytest.mark.parametrize("mapping", ["POINT", "TEXTURE"])
def test_the_mapping_node_moves_turns_and_scales(pictured, scattered, mapping):
    obj = scattered(pictured(make_image(RANDOM.random((4, 6, 3))), mapping))
    off = np.abs(albedo_at_corners(read(obj)) - albedo_by_cycles(obj))
    assert np.quantile(off, 0.99) < 0.03
    assert off.mean() < 0.003


@pytest.mark.parametrize(
    ("space", "alpha", "is_float"),
    [
        ("Non-Color", False, False),
        ("Linear Rec.709", False, True),
        ("sRGB", True, False),
        ("Linear Rec.709", True, True),
    ],
)
def test_colour_spaces_and_alpha_mean_what_they_mean_to_cycles(pictured, scattered, space, alpha, is_float):
    obj = scattered(pictured(make_image(RANDOM.uniform(0.05, 0.95, (5, 5, 4)), space, alpha, is_float)))
    off = np.abs(albedo_at_corners(read(obj)) - albedo_by_cycles(obj))
    # Cycles keeps these colours as bytes or half floats and filters them with 8 bits of precision.
    assert off.max() < 0.03
    assert off.mean() < 0.003


def test_a_colour_space_that_only_blender_knows_is_sampled(pictured, scattered):
    image = make_image(RANDOM.uniform(0.2, 0.8, (2, 2, 3)))
    image.colorspace_settings.name = "Linear Rec.2020"
    obj = scattered(pictured(image))
    scene = read(obj)
    assert scene.warnings == ()
    assert scene.surfaces[scene.objects[0].surface[0]].albedo_texture.separate


def test_large_images_are_reduced_and_keep_their_mean():
    pixels = np.tile(RANDOM.random((30, 50, 3)), (50, 50, 1)).astype(np.float32)
    image = make_image(pixels, "Non-Color", is_float=True)
    colour, _ = read_image(image, "repeat", smooth=True, premultiplied=True)
    assert max(colour.shape[:2]) <= LARGEST
    np.testing.assert_allclose(colour.mean(axis=(0, 1)), pixels.mean(axis=(0, 1)), rtol=0.01)


def test_between_black_and_white_srgb_bytes_are_darker_than_half():
    """Cycles mixes the stored bytes and then applies the curve: two thirds of white count as that little."""
    image = make_image(np.tile([[[0.0] * 3, [1.0] * 3]], (1, 200, 1)))
    colour, _ = read_image(image, "repeat", smooth=True, premultiplied=True)
    parts = srgb_to_linear(np.array([0, 1 / 3, 1 / 3, 1, 2 / 3, 2 / 3], np.float32))
    assert colour.shape == (1, 400, 3)
    assert colour.mean() == pytest.approx(parts.mean(), abs=1e-4)
    assert colour.mean() < 0.34


def test_missing_images_are_pink_and_named(pictured):
    lost = bpy.data.images.new("Lost", 4, 4)
    lost.source, lost.filepath = "FILE", "//nowhere.png"
    surface, warnings = read_material(pictured(lost))
    assert surface.albedo == pytest.approx((0.9999, 0.0, 0.9999))
    assert any("'Lost' has no pixels" in warning and "Pictured" in warning for warning in warnings)


@pytest.mark.parametrize("domain", ["CORNER", "POINT"])
@pytest.mark.parametrize("kind", ["BYTE_COLOR", "FLOAT_COLOR"])
@pytest.mark.parametrize("name", ["Paint", ""])
def test_colour_attributes_are_albedo(add_material, scattered, domain, kind, name):
    material = add_material("ShaderNodeBsdfDiffuse")
    node = material.node_tree.nodes.new("ShaderNodeVertexColor")
    node.layer_name = name
    material.node_tree.links.new(node.outputs["Color"], shader_of(material).inputs["Color"])
    obj = scattered(material)
    for other in ("Other", "Paint"):
        paint = obj.data.color_attributes.new(other, kind, domain)
        paint.data.foreach_set("color", RANDOM.random(len(paint.data) * 4).astype(np.float32))
    obj.data.color_attributes.render_color_index = 1

    scene = read(obj)

    assert scene.warnings == ()
    assert scene.objects[0].uv is None
    off = np.abs(albedo_at_corners(scene) - np.minimum(albedo_by_cycles(obj), 0.9999))
    # Cycles finds the corners of a few needles less exactly.
    assert np.quantile(off, 0.99) < 2e-3
    assert off.max() < 0.02


def test_the_colour_of_the_object_is_its_own(add_material, add_mesh):
    material = add_material("ShaderNodeBsdfDiffuse")
    node = material.node_tree.nodes.new("ShaderNodeObjectInfo")
    material.node_tree.links.new(node.outputs["Color"], shader_of(material).inputs["Color"])
    one, two = (add_mesh(name, color=colour) for name, colour in (("A", (0.1, 0.2, 0.3, 1)), ("B", (0.9, 0.5, 0.1, 1))))
    for obj in (one, two):
        obj.data.materials.append(material)
    bpy.context.scene.world = bpy.data.worlds.new("Sky")
    scene = read(one, two)
    found = {o.name: scene.surfaces[o.surface[0]].albedo for o in scene.objects}
    assert found["A"] == pytest.approx((0.1, 0.2, 0.3))
    assert found["B"] == pytest.approx((0.9, 0.5, 0.1))


def test_maps_of_metal_and_mixes_take_their_share_of_the_albedo(add_material, scattered):
    """Principled with an image as its colour and one channel of another as its metal, mixed by that one's green."""
    material = add_material("ShaderNodeBsdfPrincipled", Specular_IOR_Level=0.0)
    tree, principled = material.node_tree, shader_of(material)
    colour, maps = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeTexImage")
    colour.image = make_image(RANDOM.random((3, 3, 3)), "Non-Color")
    maps.image = make_image(RANDOM.random((3, 3, 3)), "Non-Color")
    colour.interpolation = maps.interpolation = "Closest"
    split, mix = tree.nodes.new("ShaderNodeSeparateColor"), tree.nodes.new("ShaderNodeMixShader")
    other = tree.nodes.new("ShaderNodeBsdfDiffuse")
    link = tree.links.new
    link(colour.outputs["Color"], principled.inputs["Base Color"])
    link(maps.outputs["Color"], split.inputs[0])
    link(split.outputs["Blue"], principled.inputs["Metallic"])
    link(split.outputs["Green"], mix.inputs[0])
    link(principled.outputs[0], mix.inputs[1])
    link(other.outputs[0], mix.inputs[2])
    link(mix.outputs[0], tree.get_output_node("ALL").inputs["Surface"])
    obj = scattered(material)

    off = np.abs(albedo_at_corners(read(obj)) - albedo_by_cycles(obj)).max(axis=2)

    assert np.quantile(off, 0.98) < 0.012


def test_every_face_has_its_own_material_and_its_uv_map(pictured, add_material, scattered):
    image = make_image(RANDOM.random((4, 4, 3)), "Non-Color")
    materials = [
        pictured(image, interpolation="Closest"),
        add_material("ShaderNodeBsdfDiffuse", name="Plain", Color=(0.3, 0.6, 0.2, 1.0)),
        pictured(image, "POINT", name="Moved", interpolation="Closest"),
    ]
    obj = scattered(*materials)
    off = np.abs(albedo_at_corners(read(obj)) - albedo_by_cycles(obj)).max(axis=2)
    assert np.quantile(off, 0.98) < 0.012


def test_a_mirrored_instance_keeps_its_corners(pictured, add_mesh):
    """The picture goes with the faces, whichever way round the corners are read."""
    ramp = make_image(np.repeat(np.linspace(0, 1, 64)[None, :, None], 3, axis=2), "Non-Color", is_float=True)
    obj = add_mesh(scale=(-1, 1, 1))
    obj.data.uv_layers.new(name="Map").uv.foreach_set("vector", np.array([0, 0, 1, 0, 1, 1, 0, 1], np.float32))
    obj.data.materials.append(pictured(ramp, extension="EXTEND"))
    bpy.context.scene.world = bpy.data.worlds.new("Sky")
    scene = read(obj)
    own = scene.objects[0]
    x = own.vertices[own.triangles][..., 0]
    np.testing.assert_allclose(albedo_at_corners(scene)[..., 0], -x, atol=0.01)


def noisy(material):
    """Make a gradient along the object's x, by a node that only Cycles can read, its colour and its emission."""
    tree, shader = material.node_tree, shader_of(material)
    gradient, place = tree.nodes.new("ShaderNodeTexGradient"), tree.nodes.new("ShaderNodeTexCoord")
    tree.links.new(place.outputs["Generated"], gradient.inputs[0])
    tree.links.new(gradient.outputs["Color"], shader.inputs["Base Color"])
    tree.links.new(gradient.outputs["Color"], shader.inputs["Emission Color"])
    shader.inputs["Emission Strength"].default_value = 2.0
    return material


def test_what_only_cycles_can_read_is_sampled_exactly_where_it_is_linear(add_material, add_mesh):
    obj = add_mesh("Wedge", [(0, 0, 0), (3, 0, 0), (3, 1, 0.5), (0, 1, 0), (1, 2, 2)], [(0, 1, 2, 3), (3, 2, 4)])
    obj.location, obj.scale = (5, 0, 0), (1, -2, 1)
    obj.data.materials.append(noisy(add_material("ShaderNodeBsdfPrincipled", Metallic=0.25)))
    bpy.context.view_layer.update()
    before = counts()

    scene = read(obj)

    assert counts() == before
    assert [w for w in scene.warnings if "metallic" not in w] == []
    own = scene.objects[0]
    surface = scene.surfaces[own.surface[0]]
    for point in even_points(9):
        x = np.einsum("k,tkc->tc", point, own.vertices[own.triangles])[:, 0]
        uv = np.einsum("k,tkc->tc", point, own.uv).astype(float)
        np.testing.assert_allclose(look_up(surface.albedo_texture, uv)[:, 0], 0.75 * (x - 5) / 3, atol=1e-4)
        np.testing.assert_allclose(look_up(surface.emission_texture, uv)[:, 0], 2 * (x - 5) / 3, atol=1e-4)


def test_shader_groups_are_sampled(add_material, add_mesh):
    group = bpy.data.node_groups.new("Paint", "ShaderNodeTree")
    group.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    principled, output = group.nodes.new("ShaderNodeBsdfPrincipled"), group.nodes.new("NodeGroupOutput")
    principled.inputs["Base Color"].default_value = (0.7, 0.5, 0.3, 1.0)
    group.links.new(principled.outputs[0], output.inputs[0])
    material = add_material("ShaderNodeBsdfDiffuse")
    node = material.node_tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    material.node_tree.links.new(node.outputs[0], material.node_tree.get_output_node("ALL").inputs["Surface"])
    obj = add_mesh()
    obj.data.materials.append(material)
    bpy.context.scene.world = bpy.data.worlds.new("Sky")
    before = counts()

    scene = read(obj)

    # Without the thin reflecting layer, which would dim it: the same as outside of a group.
    np.testing.assert_allclose(albedo_at_corners(scene)[0, 0], (0.7, 0.5, 0.3), atol=1e-4)
    assert counts() == before
    assert principled.inputs["Specular IOR Level"].default_value > 0


@pytest.mark.parametrize("way", ["picture", "gradient", "mix", "veil"])
def test_what_is_sampled_keeps_its_holes(add_material, add_mesh, way):
    """Of one colour, made by a node that only Cycles can read: colour and opacity are told apart exactly."""
    material = add_material("ShaderNodeBsdfPrincipled", Alpha=0.4 if way == "veil" else 1.0)
    tree, principled = material.node_tree, shader_of(material)
    hue, gradient = tree.nodes.new("ShaderNodeHueSaturation"), tree.nodes.new("ShaderNodeTexGradient")
    hue.inputs["Color"].default_value = (0.8, 0.4, 0.2, 1.0)
    tree.links.new(hue.outputs[0], principled.inputs["Base Color"])
    place = tree.nodes.new("ShaderNodeTexCoord")
    tree.links.new(place.outputs["Generated"], gradient.inputs[0])
    if way == "picture":
        image, bars = tree.nodes.new("ShaderNodeTexImage"), np.ones((1, 2, 4))
        bars[:, 0, 3] = 0.0
        image.image, image.interpolation = make_image(bars, alpha=True), "Closest"
        tree.links.new(image.outputs["Alpha"], principled.inputs["Alpha"])
    elif way == "gradient":
        tree.links.new(gradient.outputs["Fac"], principled.inputs["Alpha"])
    elif way == "mix":
        mix, clear = tree.nodes.new("ShaderNodeMixShader"), tree.nodes.new("ShaderNodeBsdfTransparent")
        added, glow = tree.nodes.new("ShaderNodeAddShader"), tree.nodes.new("ShaderNodeEmission")
        tree.links.new(principled.outputs[0], added.inputs[0])
        tree.links.new(glow.outputs[0], added.inputs[1])
        for output, socket in zip(
            (gradient.outputs["Fac"], clear.outputs[0], added.outputs[0]), mix.inputs, strict=True
        ):
            tree.links.new(output, socket)
        tree.links.new(mix.outputs[0], tree.get_output_node("ALL").inputs["Surface"])
    obj = add_mesh()
    obj.data.uv_layers.new(name="Map").uv.foreach_set("vector", np.array([0, 0, 1, 0, 1, 1, 0, 1], np.float32))
    obj.data.materials.append(material)
    bpy.context.scene.world = bpy.data.worlds.new("Sky")
    before = counts()

    scene = read(obj)

    assert counts() == before
    own = scene.objects[0]
    surface = scene.surfaces[own.surface[0]]
    assert (surface.opacity_texture is None) == (way == "veil")
    true = {
        "picture": lambda x: x > 0.5,
        "gradient": lambda x: x,
        "mix": lambda x: x,
        "veil": lambda x: np.full_like(x, 0.4),
    }[way]
    for point in even_points(9):
        x = np.einsum("k,tkc->tc", point, own.vertices[own.triangles])[:, 0]
        uv = np.einsum("k,tkc->tc", point, own.uv).astype(float)
        holes = 1.0 if surface.opacity_texture is None else look_up(surface.opacity_texture, uv)[:, 0]
        sure = np.abs(x - 0.5) > 0.05
        np.testing.assert_allclose((surface.opacity * holes * np.ones_like(x))[sure], true(x)[sure], atol=1e-3)
        seen = true(x) > 0.02
        colour = look_up(surface.albedo_texture, uv)[seen & sure]
        np.testing.assert_allclose(colour, np.tile((0.8, 0.4, 0.2), (len(colour), 1)), atol=2e-3)


def test_instances_share_their_samples_unless_the_material_depends_on_them(add_material, add_mesh):
    material = noisy(add_material("ShaderNodeBsdfPrincipled"))
    one = add_mesh("One")
    one.data.materials.append(material)
    two = bpy.data.objects.new("Two", one.data)
    bpy.context.scene.collection.objects.link(two)
    bpy.context.view_layer.update()
    same = read(one, two)
    assert same.objects[0].surface[0] == same.objects[1].surface[0]
    gradient = next(n for n in material.node_tree.nodes if n.bl_idname == "ShaderNodeTexGradient")
    place = material.node_tree.nodes.new("ShaderNodeNewGeometry")
    material.node_tree.links.new(place.outputs["Position"], gradient.inputs[0])
    apart = read(one, two)
    assert apart.objects[0].surface[0] != apart.objects[1].surface[0]


def test_when_cycles_fails_plain_values_stay_and_nothing_is_left_behind(add_material, add_mesh, monkeypatch):
    def refuse(*_):
        raise RuntimeError("no luck")

    obj = add_mesh()
    obj.data.materials.append(noisy(add_material("ShaderNodeBsdfPrincipled", Base_Color=(0.3, 0.2, 0.1, 1.0))))
    bpy.context.view_layer.update()
    before = counts()
    monkeypatch.setattr(material_samples, "bake_corners", refuse)

    scene = read(obj)

    assert counts() == before
    assert scene.surfaces[scene.objects[0].surface[0]].albedo == pytest.approx((0.3, 0.2, 0.1))
    assert any("no luck" in warning for warning in scene.warnings)
    assert any("Base Color from the node Gradient Texture" in warning for warning in scene.warnings)


@pytest.mark.parametrize("cuts", [[1], [2, 3], [5, 5, 5, 1], [96, 7]])
def test_no_two_triangles_share_a_pixel_and_linear_values_stay_linear(cuts):
    lattice = Lattice(np.array(cuts, np.int32))
    slope = np.arange(1, len(cuts) + 1)[lattice.parent, None]
    corners = lattice.barycentric[..., 1] * slope + lattice.barycentric[..., 2] * 3
    texture = lattice.texture(np.repeat(corners.reshape(-1, 1), 3, axis=1).astype(np.float32))
    for point in (*even_points(25), *np.eye(3), (0, 0.5, 0.5), (0.5, 0.5, 0)):
        found = look_up(texture, np.einsum("k,tkc->tc", point, lattice.uv).astype(float))[:, 0]
        np.testing.assert_allclose(found, point[1] * np.arange(1, len(cuts) + 1) + point[2] * 3, atol=2e-3)


def packed_image(folder):
    """One whose file is gone."""
    saved = make_image(RANDOM.random((4, 6, 3)))
    saved.filepath_raw, saved.file_format = str(folder / "picture.png"), "PNG"
    saved.save()
    packed = bpy.data.images.load(saved.filepath_raw)
    packed.pack()
    (folder / "picture.png").unlink()
    return packed


def generated_image(_):
    """A test card that Blender draws by itself."""
    generated = bpy.data.images.new("Grid", 64, 64)
    generated.source, generated.generated_type = "GENERATED", "COLOR_GRID"
    return generated


@pytest.mark.parametrize("image", [packed_image, generated_image])
def test_images_without_a_file_are_what_cycles_has(pictured, scattered, tmp_path, image):
    obj = scattered(pictured(image(tmp_path), interpolation="Closest"))

    scene = read(obj)

    assert not scene.warnings
    off = np.abs(albedo_at_corners(scene) - albedo_by_cycles(obj)).max(axis=2)
    # On the border of two pixels either may be meant.
    assert np.quantile(off, 0.95) < 0.012
    assert np.ptp(albedo_at_corners(scene)) > 0.5
