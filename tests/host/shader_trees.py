"""Materials made of shader nodes, and what is read of them."""

import bpy
import numpy as np
from photon_bake.addon.scene import Lobe
from photon_bake.tests.host import scenes

F0 = 0.04  # of glass at 1.5


def read(material, warnings=None):
    scenes.add_plane(material=material)
    return scenes.extracted([] if warnings is None else warnings).materials


def expect(materials, **values):
    """Of the first material's channels and of the sums of its closures; other values, by their names, of a closure."""
    of_sums = {
        "diffuse": lambda: scenes.weight_of(materials, Lobe.DIFFUSE),
        "translucent": lambda: scenes.weight_of(materials, Lobe.TRANSLUCENT),
        "f0": lambda: scenes.weight_of(materials, Lobe.GLOSSY, "f0"),
        "f90": lambda: scenes.weight_of(materials, Lobe.GLOSSY, "f90"),
        "glass_reflection": lambda: scenes.weight_of(materials, Lobe.GLASS, "f0"),
        "glass_transmission": lambda: scenes.weight_of(materials, Lobe.GLASS, "f90"),
    }
    closures = materials.closures
    rough = np.flatnonzero((closures.kind >= Lobe.GLOSSY) & (closures.material == 0))
    for name, value in values.items():
        if name in of_sums:
            found = of_sums[name]()[0]
        elif name in ("emission", "coverage", "tint"):
            found = getattr(materials, name).value[0]
        elif name == "layer_f0":
            layer = closures.layer[(closures.kind == Lobe.DIFFUSE) & (closures.layer >= 0)]
            found = closures.f0.value[layer].max(initial=0)
        else:
            column = getattr(closures, name)
            found = getattr(column, "value", column)[rough[0]]
        np.testing.assert_allclose(found, value, atol=2e-4, err_msg=name)


def shader(tree, kind, **values):
    """A shader node with values on its inputs."""
    node = tree.nodes.new(f"ShaderNode{kind}")
    for name, value in values.items():
        name = name.replace("_", " ")
        node.inputs[name].default_value = (*value, 1) if isinstance(value, tuple) else value
    return node


def tree_of():
    """A material without a surface; its tree, and how to give it one."""
    material, surface = scenes.add_material()
    tree = material.node_tree
    tree.nodes.remove(surface)
    output = tree.get_output_node("CYCLES")
    return material, tree, lambda node: tree.links.new(node.outputs[0], output.inputs["Surface"])


def mixed(tree, first, second, factor=0.5, kind="MixShader"):
    node = tree.nodes.new(f"ShaderNode{kind}")
    shaders = [one for one in node.inputs if one.type == "SHADER"]
    for one, socket in zip((first, second), shaders, strict=True):
        tree.links.new(one.outputs[0], socket)
    if isinstance(factor, bpy.types.NodeSocket):
        tree.links.new(factor, node.inputs[0])
    elif kind == "MixShader":
        node.inputs[0].default_value = factor
    return node


def principled(**values):
    material, tree, show = tree_of()
    show(shader(tree, "BsdfPrincipled", **values))
    return material
