"""Nodes that are evaluated without Cycles, compared with Cycles."""

import bpy
import numpy as np
import pytest
from photon_bake.addon.blender.read.materials import cycles_bake
from photon_bake.tests.host import scenes
from photon_bake.tests.host.test_extract_materials import quads

pytestmark = pytest.mark.usefixtures("empty_cache")
PICTURES = np.random.default_rng(7).uniform(0.02, 0.98, (3, 4, 4, 4))
PICTURES[..., 3] = 1
PICTURES[0, 0, 0, :3] = 0.5  # grey, black and white have rules of their own
PICTURES[1, 0, 1, :3] = 0
PICTURES[0, 0, 2, :3] = 0
PICTURES[1, 0, 3, :3] = 1


@pytest.fixture
def empty_cache():
    cycles_bake._baked.clear()


def emitter():
    material, surface = scenes.add_material("Emitter", "ShaderNodeEmission")
    return material, surface.inputs["Color"]


def picture(material, socket, which=0, alpha=None):
    """An image node of one of the pictures on a socket."""
    pixels = PICTURES[which].copy()
    if alpha is not None:
        pixels[..., 3] = alpha
    node = scenes.add_image_node(material, socket, pixels, byte=False)
    node.image.colorspace_settings.name = "Non-Color"
    return node


def emission_by_cycles(obj):
    """Cycles' bake of emission to an object's corners, (c, 3)."""
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.device, scene.cycles.samples = "CYCLES", "CPU", 1
    obj.data.color_attributes.active_color = obj.data.color_attributes.new("Cycles", "FLOAT_COLOR", "CORNER")
    bpy.context.view_layer.update()
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.bake(type="EMIT", target="VERTEX_COLORS")
    values = np.empty(len(obj.data.loops) * 4, np.float32)
    obj.data.color_attributes["Cycles"].data.foreach_get("color", values)
    return values.reshape(-1, 4)[:, :3]


def emission_of_faces(scene):
    triangle, third = np.arange(0, scene.n_triangles, 2), np.full(scene.n_triangles // 2, 1 / 3, np.float32)
    return scene.look_up(scene.materials.emission, triangle, third, third)


def assert_as_cycles(material, varied=True, bakes=False):
    """At each texel of a 4 × 4 picture."""
    obj = quads(material)
    scene = scenes.extracted()
    assert bool(cycles_bake._baked) == bakes
    ours = emission_of_faces(scene)
    cycles = emission_by_cycles(obj).reshape(-1, 4, 3).mean(1)
    assert not varied or np.ptp(cycles) > 0.05
    poles = np.abs(cycles) > 1e5  # where rounding decides
    np.testing.assert_allclose(ours[~poles], cycles[~poles], atol=2e-3, rtol=5e-3)


def fill(material, node, sockets=None):
    """Pictures on all colour and number inputs of a node that are shown, small constants on the rest."""
    which = 0
    for one in node.inputs:
        if not one.enabled or one.type not in {"RGBA", "VALUE", "VECTOR"}:
            continue
        if sockets is None or one.identifier in sockets:
            picture(material, one, which % 3)
            which += 1


def operate(kind, socket_out=None, sockets=None, **properties):
    """A material whose emission is what a node makes of the pictures."""
    material, color = emitter()
    node = material.node_tree.nodes.new(kind)
    for name, value in properties.items():
        setattr(node, name, value)
    fill(material, node, sockets)
    outputs = [one for one in node.outputs if one.enabled]
    output = next((one for one in outputs if one.identifier == socket_out), outputs[0])
    material.node_tree.links.new(output, color)
    return material, node


def items(kind, name):
    """What an enumeration of a node type offers."""
    return [item.identifier for item in getattr(bpy.types, kind).bl_rna.properties[name].enum_items]


BLENDS = items("ShaderNodeMixRGB", "blend_type")


@pytest.mark.parametrize("blend", BLENDS)
@pytest.mark.parametrize("kind", ["ShaderNodeMix", "ShaderNodeMixRGB"])
def test_mix(kind, blend):
    new = kind == "ShaderNodeMix"
    options = {"data_type": "RGBA", "blend_type": blend} if new else {"blend_type": blend}
    material, _ = operate(kind, **options)
    assert_as_cycles(material)


@pytest.mark.parametrize("data_type", ["FLOAT", "VECTOR"])
def test_mix_of_numbers(data_type):
    assert_as_cycles(operate("ShaderNodeMix", data_type=data_type)[0])


def test_mix_by_a_vector():
    assert_as_cycles(operate("ShaderNodeMix", data_type="VECTOR", factor_mode="NON_UNIFORM")[0])


@pytest.mark.parametrize("clamp", [True, False])
def test_mix_clamps(clamp):
    material, node = operate("ShaderNodeMix", data_type="RGBA", blend_type="ADD", sockets={"A_Color", "B_Color"})
    node.inputs["Factor"].default_value = 0.9
    node.clamp_result = node.clamp_factor = clamp
    assert_as_cycles(material)


@pytest.mark.parametrize("operation", items("ShaderNodeMath", "operation"))
def test_math(operation):
    material, _ = operate("ShaderNodeMath", operation=operation)
    assert_as_cycles(material, varied=False)


@pytest.mark.parametrize("operation", ["POWER", "MODULO", "FLOORED_MODULO", "LOGARITHM", "WRAP", "PINGPONG", "SQRT"])
def test_math_of_negative_numbers(operation):
    material, node = operate("ShaderNodeMath", operation=operation, sockets={"Value"})
    node.inputs[1].default_value, node.inputs[2].default_value = 0.3, 0.1
    shift = material.node_tree.nodes.new("ShaderNodeMath")
    shift.operation, shift.inputs[1].default_value = "SUBTRACT", 0.3
    material.node_tree.links.new(node.inputs[0].links[0].from_socket, shift.inputs[0])
    material.node_tree.links.new(shift.outputs[0], node.inputs[0])
    assert_as_cycles(material, varied=False)


VECTOR_OPERATIONS = ["ADD", "SUBTRACT", "MULTIPLY", "DIVIDE", "MULTIPLY_ADD", "CROSS_PRODUCT", "DOT_PRODUCT"]
VECTOR_OPERATIONS += ["DISTANCE", "LENGTH", "SCALE", "NORMALIZE", "ABSOLUTE", "MINIMUM", "MAXIMUM", "FRACTION"]


@pytest.mark.parametrize("operation", VECTOR_OPERATIONS)
def test_vector_math(operation):
    assert_as_cycles(operate("ShaderNodeVectorMath", operation=operation)[0])


@pytest.mark.parametrize("kind", ["ShaderNodeInvert", "ShaderNodeGamma", "ShaderNodeBrightContrast"])
def test_colour_nodes(kind):
    assert_as_cycles(operate(kind)[0])


def test_hue_and_saturation():
    material, node = operate("ShaderNodeHueSaturation", sockets={"Color"})
    for name, value in (("Hue", 0.7), ("Saturation", 1.4), ("Value", 0.8), ("Fac", 0.9)):
        next(one for one in node.inputs if one.identifier == name).default_value = value
    assert_as_cycles(material)


@pytest.mark.parametrize("interpolation", ["LINEAR", "EASE", "CONSTANT", "B_SPLINE"])
def test_color_ramp(interpolation):
    material, node = operate("ShaderNodeValToRGB")
    node.color_ramp.interpolation = interpolation
    node.color_ramp.elements[0].color = (0.2, 0.8, 0.1, 1)
    node.color_ramp.elements.new(0.43).color = (0.9, 0.1, 0.3, 0.5)
    assert_as_cycles(material)


def test_rgb_curves():
    material, node = operate("ShaderNodeRGBCurve")
    node.mapping.curves[3].points.new(0.3, 0.7)
    node.mapping.curves[1].points.new(0.5, 0.2)
    node.mapping.update()
    assert_as_cycles(material)


def test_float_curve():
    material, node = operate("ShaderNodeFloatCurve")
    node.mapping.curves[0].points.new(0.3, 0.7)
    node.mapping.update()
    assert_as_cycles(material)


@pytest.mark.parametrize("mode", ["RGB", "HSV", "HSL"])
@pytest.mark.parametrize("channel", ["Red", "Green", "Blue"])
def test_separate_color(mode, channel):
    assert_as_cycles(operate("ShaderNodeSeparateColor", channel, mode=mode)[0])


@pytest.mark.parametrize("mode", ["RGB", "HSV", "HSL"])
def test_combine_color(mode):
    assert_as_cycles(operate("ShaderNodeCombineColor", mode=mode)[0])


@pytest.mark.parametrize("kind", ["ShaderNodeSeparateXYZ", "ShaderNodeCombineXYZ", "ShaderNodeRGBToBW"])
def test_vectors_and_grey(kind):
    assert_as_cycles(operate(kind)[0])


@pytest.mark.parametrize("clamp_type", ["MINMAX", "RANGE"])
def test_clamp(clamp_type):
    material, node = operate("ShaderNodeClamp", sockets={"Value"}, clamp_type=clamp_type)
    node.inputs["Min"].default_value, node.inputs["Max"].default_value = 0.7, 0.3
    assert_as_cycles(material, varied=False)


@pytest.mark.parametrize("interpolation", ["LINEAR", "STEPPED", "SMOOTHSTEP", "SMOOTHERSTEP"])
@pytest.mark.parametrize("clamp", [True, False])
@pytest.mark.parametrize("data_type", ["FLOAT", "FLOAT_VECTOR"])
def test_map_range(interpolation, clamp, data_type):
    options = {"interpolation_type": interpolation, "clamp": clamp, "data_type": data_type}
    material, node = operate("ShaderNodeMapRange", sockets={"Value", "Vector"}, **options)
    values = {"From Min": 0.2, "From Max": 0.8, "To Min": 2.0, "To Max": 0.5, "Steps": 3.0}
    for one in node.inputs:
        if one.name in values:
            value = values[one.name]
            one.default_value = (value,) * 3 if one.type == "VECTOR" else value
    assert_as_cycles(material)


def test_colour_feeds_a_number_and_vector_feeds_a_number():
    material, color = emitter()
    tree = material.node_tree
    math, swap = tree.nodes.new("ShaderNodeMath"), tree.nodes.new("ShaderNodeVectorMath")
    picture(material, math.inputs[0], 0)
    picture(material, swap.inputs[0], 1)
    tree.links.new(swap.outputs[0], math.inputs[1])
    tree.links.new(math.outputs[0], color)
    assert_as_cycles(material)


def test_groups_convert_types():
    group_tree = bpy.data.node_groups.new("Group", "ShaderNodeTree")
    group_tree.interface.new_socket("In", in_out="INPUT", socket_type="NodeSocketFloat")
    group_tree.interface.new_socket("Loose", in_out="INPUT", socket_type="NodeSocketColor")
    group_tree.interface.new_socket("Out", in_out="OUTPUT", socket_type="NodeSocketColor")
    start, end = group_tree.nodes.new("NodeGroupInput"), group_tree.nodes.new("NodeGroupOutput")
    add = group_tree.nodes.new("ShaderNodeVectorMath")
    group_tree.links.new(start.outputs[0], add.inputs[0])
    group_tree.links.new(start.outputs[1], add.inputs[1])
    group_tree.links.new(add.outputs[0], end.inputs[0])
    material, color = emitter()
    groups = [material.node_tree.nodes.new("ShaderNodeGroup") for _ in range(2)]
    for i, node in enumerate(groups):  # one group twice, with values of its own
        node.node_tree = group_tree
        node.inputs[1].default_value = (0.1 * i, 0.2, 0.3, 1)
    picture(material, groups[0].inputs[0])
    material.node_tree.links.new(groups[0].outputs[0], groups[1].inputs[0])
    material.node_tree.links.new(groups[1].outputs[0], color)
    assert_as_cycles(material)


@pytest.mark.parametrize("kind", ["ShaderNodeInvert", "ShaderNodeMixRGB", "ShaderNodeValToRGB", "ShaderNodeGamma"])
def test_muted_nodes(kind):
    material, node = operate(kind)
    node.mute = True
    assert_as_cycles(material, varied=False)


def test_muted_link():
    material, color = emitter()
    picture(material, color)
    color.default_value = (0.1, 0.2, 0.3, 1)
    color.links[0].is_muted = True
    assert_as_cycles(material)


@pytest.mark.parametrize("extension", ["REPEAT", "EXTEND", "CLIP", "MIRROR"])
@pytest.mark.parametrize("vector_type", ["POINT", "TEXTURE", "VECTOR"])
def test_extension_and_mapping(extension, vector_type):
    material, color = emitter()
    tree = material.node_tree
    mix, mapping, uv = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("MixRGB", "Mapping", "UVMap"))
    mix.inputs["Color1"].default_value = (0.1, 0.2, 0.9, 1)
    image = picture(material, mix.inputs["Color2"], alpha=0.75)
    image.extension = extension
    mapping.vector_type = vector_type
    if vector_type != "VECTOR":
        mapping.inputs["Location"].default_value = (-0.37, 0.81, 0)
    mapping.inputs["Rotation"].default_value = (0.3, 0, 0.4)
    mapping.inputs["Scale"].default_value = (2.1, 1.7, 1)
    for start, end in ((uv, mapping.inputs["Vector"]), (mapping, image.inputs["Vector"]), (mix, color)):
        tree.links.new(start.outputs[0], end)
    tree.links.new(image.outputs["Alpha"], mix.inputs[0])
    assert_as_cycles(material)


@pytest.mark.parametrize("vector_type", ["POINT", "TEXTURE", "VECTOR", "NORMAL"])
def test_texture_mapping_of_the_node(vector_type):
    material, color = emitter()
    image = picture(material, color)
    mapping = image.texture_mapping
    mapping.vector_type = vector_type
    mapping.translation, mapping.rotation, mapping.scale = (-0.37, 0.81, 0), (0.3, 0, 0.4), (2.1, 1.7, 1)
    mapping.mapping_x, mapping.mapping_y = "Y", "X"
    uv = material.node_tree.nodes.new("ShaderNodeMapping")
    uv.inputs["Rotation"].default_value = (0, 0, 0.5)
    material.node_tree.links.new(material.node_tree.nodes.new("ShaderNodeUVMap").outputs[0], uv.inputs["Vector"])
    material.node_tree.links.new(uv.outputs[0], image.inputs["Vector"])
    assert_as_cycles(material, bakes=vector_type == "NORMAL")


@pytest.mark.parametrize("domain", ["POINT", "CORNER", "FACE", "EDGE"])
@pytest.mark.parametrize("data_type", ["FLOAT2", "FLOAT_VECTOR", "FLOAT_COLOR", "FLOAT", "INT"])
def test_attributes_as_uv_maps(data_type, domain):
    if data_type == "FLOAT2" and domain == "CORNER":
        pytest.skip("that is a UV map")
    material, color = emitter()
    image = picture(material, color)
    uv = material.node_tree.nodes.new("ShaderNodeUVMap")
    uv.uv_map = "Place"
    material.node_tree.links.new(uv.outputs[0], image.inputs["Vector"])
    obj = quads(material)
    place = obj.data.attributes.new("Place", data_type, domain)
    prop, width = {"FLOAT2": ("vector", 2), "FLOAT_VECTOR": ("vector", 3), "FLOAT_COLOR": ("color", 4)}.get(
        data_type, ("value", 1)
    )
    kind = np.int32 if data_type == "INT" else np.float32
    # The same for all elements of a quad, in the middles of texels
    corners = np.random.default_rng(3).integers(0, 4, (16, width)) * 0.25 + 0.125
    of_quad = {"POINT": 4, "CORNER": 4, "FACE": 1, "EDGE": 4}[domain]
    place.data.foreach_set(prop, np.repeat(corners, of_quad, axis=0).astype(kind).ravel())
    ours = emission_of_faces(scenes.extracted())
    assert not cycles_bake._baked
    np.testing.assert_allclose(ours, emission_by_cycles(obj).reshape(-1, 4, 3).mean(1), atol=2e-3)


def test_bytes_of_other_spaces_are_read_by_cycles():
    material, color = emitter()
    node = scenes.add_image_node(material, color, PICTURES[0])
    node.image.colorspace_settings.name = "Filmic sRGB"
    assert_as_cycles(material, bakes=True)


@pytest.mark.parametrize("stored", ["8 bits", "16 bits in a file", "floats"])
def test_srgb_between_texels(stored, tmp_path):
    """Bytes and files of 16 bits are interpolated with sRGB's curve, floats without."""
    material, color = emitter()
    pixels = PICTURES[0][:1, 1:3].copy()
    pixels[0, :, :3] = [[0, 0.1, 0.2], [1, 0.9, 0.3]]
    node = scenes.add_image_node(material, color, pixels, byte=stored == "8 bits")
    node.interpolation = "Linear"
    if stored == "16 bits in a file":
        scene, path = bpy.context.scene, str(tmp_path / "deep.png")
        settings = scene.render.image_settings
        settings.file_format, settings.color_depth = "PNG", "16"
        scene.view_settings.view_transform = "Standard"
        node.image.save_render(path, scene=scene)
        node.image = bpy.data.images.load(path)
        assert node.image.is_float
    obj = quads(material, 16)
    ours = emission_of_faces(scenes.extracted())
    cycles = emission_by_cycles(obj).reshape(-1, 4, 3).mean(1)
    np.testing.assert_allclose(ours, cycles, atol=0.02)  # the other way round they are 0.2 apart


@pytest.mark.parametrize("interpolation", ["Linear", "Cubic", "Smart"])
@pytest.mark.parametrize("extension", ["REPEAT", "EXTEND", "CLIP", "MIRROR"])
def test_interpolation_of_small_pictures(interpolation, extension):
    material, color = emitter()
    tree = material.node_tree
    image = picture(material, color)
    image.interpolation, image.extension = interpolation, extension
    mapping, uv = tree.nodes.new("ShaderNodeMapping"), tree.nodes.new("ShaderNodeUVMap")
    mapping.inputs["Location"].default_value = (-0.37, 0.21, 0)
    mapping.inputs["Scale"].default_value = (1.5, 0.7, 1)
    tree.links.new(uv.outputs[0], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs[0], image.inputs["Vector"])
    obj = quads(material)
    ours = emission_of_faces(scenes.extracted())
    cycles = emission_by_cycles(obj).reshape(-1, 4, 3).mean(1)
    np.testing.assert_allclose(ours, cycles, atol=0.02)
    assert bool(cycles_bake._baked) == (extension == "CLIP")  # which fades out a little outside


def test_pictures_of_different_sizes():
    material, color = emitter()
    node = material.node_tree.nodes.new("ShaderNodeMixRGB")
    picture(material, node.inputs[1])
    small = scenes.add_image_node(material, node.inputs[2], PICTURES[1][:2, :2], byte=False)
    small.image.colorspace_settings.name = "Non-Color"
    material.node_tree.links.new(node.outputs[0], color)
    assert_as_cycles(material)


@pytest.mark.parametrize("difference", ["uv_map", "extension", "mapping"])
def test_pictures_that_share_no_grid_are_baked(difference):
    material, color = emitter()
    tree = material.node_tree
    mix = tree.nodes.new("ShaderNodeMixRGB")
    _, other = (picture(material, mix.inputs[1 + i], i) for i in range(2))
    tree.links.new(mix.outputs[0], color)
    uv = tree.nodes.new("ShaderNodeUVMap")
    tree.links.new(uv.outputs[0], other.inputs["Vector"])
    if difference == "uv_map":
        uv.uv_map = "Missing"
    elif difference == "extension":
        other.extension = "CLIP"
    else:
        mapping = tree.nodes.new("ShaderNodeMapping")
        mapping.inputs["Scale"].default_value = (3, 3, 3)
        tree.links.new(uv.outputs[0], mapping.inputs[0])
        tree.links.new(mapping.outputs[0], other.inputs["Vector"])
    obj = quads(material)
    warnings = []
    ours = emission_of_faces(scenes.extracted(warnings))
    np.testing.assert_allclose(ours, emission_by_cycles(obj).reshape(-1, 4, 3).mean(1), atol=5e-3)
    assert not warnings
