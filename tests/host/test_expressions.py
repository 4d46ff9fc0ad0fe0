"""Nodes that are evaluated without Cycles, compared with Cycles."""

import bpy
import pytest
from photon_bake.tests.host.node_pictures import assert_as_cycles, emitter, picture

pytestmark = pytest.mark.usefixtures("empty_cache")


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
