"""The node group that stands behind a shader: shader + what of the baked light the shader scatters diffusely."""

from typing import Any

import bpy

from ..read.materials.nodes import SHOWN
from .tree_builder import TreeBuilder

_NAME = "Photon Bake Shader"

_INPUTS = {
    "Base Color": ("NodeSocketColor", None),
    "Metallic": ("NodeSocketFloat", 0.0),
    "Transmission": ("NodeSocketFloat", 0.0),
    "Alpha": ("NodeSocketFloat", 1.0),
    "Roughness": ("NodeSocketFloat", 0.5),
    "IOR": ("NodeSocketFloat", 1.5),
    "Specular": ("NodeSocketFloat", 0.0),
}
"""Inputs besides the shader, with their types and what they are where a shader has no such input."""


def make_shader_group(light: "bpy.types.NodeTree") -> "bpy.types.NodeTree":
    """A new group with the inputs Shader, Base Color and those of Principled, and the output Shader.

    It emits base color × light × (1 − metallic) × (1 − transmission) × alpha × (1 − what the specular layer reflects).
    Camera rays see it, and those that gloss and glass send on; to diffuse rays it is dark, since the light that they
    would find is in the baked light already.

    Parameters
    ----------
    light : bpy.types.NodeTree
        Of `make_light_group`.
    """
    group = bpy.data.node_groups.new(_NAME, "ShaderNodeTree")
    group[SHOWN] = _NAME
    group.interface.new_socket("Shader", socket_type="NodeSocketShader", in_out="INPUT")
    group.interface.new_socket("Shader", socket_type="NodeSocketShader", in_out="OUTPUT")
    for name, (kind, default) in _INPUTS.items():
        socket = group.interface.new_socket(name, socket_type=kind, in_out="INPUT")
        if default is not None:
            socket.default_value = default
    tree = TreeBuilder(group)
    given = tree.add("NodeGroupInput").outputs
    share = tree.math("MULTIPLY", _seen(tree), given["Alpha"])
    for taken in (given["Metallic"], given["Transmission"], _reflected(tree, given)):
        share = tree.math("MULTIPLY", share, tree.math("SUBTRACT", 1.0, taken))
    baked = tree.add("ShaderNodeGroup", {"node_tree": light}).outputs["Light"]
    color = tree.vector("MULTIPLY", baked, given["Base Color"])
    glow = tree.add("ShaderNodeEmission", Color=color, Strength=share).outputs[0]
    both = tree.add("ShaderNodeAddShader")
    tree.link(given["Shader"], both.inputs[0])
    tree.link(glow, both.inputs[1])
    tree.add("NodeGroupOutput", Shader=both.outputs[0])
    return group


def _seen(tree: TreeBuilder) -> Any:
    """1 for camera rays and for rays that gloss and glass send on, 0 for all others."""
    ray = tree.add("ShaderNodeLightPath").outputs
    onward = tree.math("MAXIMUM", ray["Is Glossy Ray"], ray["Is Transmission Ray"])
    onward = tree.math("MINIMUM", onward, tree.math("SUBTRACT", 1.0, ray["Is Diffuse Ray"]))
    return tree.math("MAXIMUM", ray["Is Camera Ray"], onward)


def _reflected(tree: TreeBuilder, given: Any) -> Any:
    """What Principled's specular layer reflects, and so takes from the diffuse base: its directional albedo.

    f0 A + B min(50 f0, 1) with A and B as Karis fitted them to GGX of a roughness r seen under a cosine μ (Physically
    Based Shading on Mobile, 2014): a = min((1 − r)², 2^(−9.28 μ)) (1 − r) + 0.0425 − 0.0275 r,
    A = −1.04 a + 1.04 − 0.572 r, B = 1.04 a − 0.04 + 0.022 r.
    """
    index = tree.math("DIVIDE", tree.math("SUBTRACT", given["IOR"], 1.0), tree.math("ADD", given["IOR"], 1.0))
    doubled = tree.math("MULTIPLY", given["Specular"], 2.0)
    f0 = tree.math("MINIMUM", tree.math("MULTIPLY", tree.math("MULTIPLY", index, index), doubled), 1.0)
    geometry = tree.add("ShaderNodeNewGeometry").outputs
    cosine = tree.math("ABSOLUTE", tree.vector("DOT_PRODUCT", geometry["Normal"], geometry["Incoming"]))
    rough = given["Roughness"]
    smooth = tree.math("SUBTRACT", 1.0, rough)
    least = tree.math("MINIMUM", tree.math("MULTIPLY", smooth, smooth), _power_of_two(tree, cosine))
    a = tree.math("MULTIPLY_ADD", least, smooth, tree.math("MULTIPLY_ADD", rough, -0.0275, 0.0425))
    scale = tree.math("MULTIPLY_ADD", a, -1.04, tree.math("MULTIPLY_ADD", rough, -0.572, 1.04))
    offset = tree.math("MULTIPLY_ADD", a, 1.04, tree.math("MULTIPLY_ADD", rough, 0.022, -0.04))
    some = tree.math("MINIMUM", tree.math("MULTIPLY", f0, 50.0), 1.0)
    return tree.math("MULTIPLY_ADD", f0, scale, tree.math("MULTIPLY", offset, some))


def _power_of_two(tree: TreeBuilder, cosine: Any) -> Any:
    return tree.math("POWER", 2.0, tree.math("MULTIPLY", cosine, -9.28))
