"""Vertices that materials move, before anything is read of them."""

import bpy
import numpy as np
import pytest
from photon_bake.addon.blender import displace
from photon_bake.tests.host import scenes


def displaced(material, warnings=None, scale=(1, 1, 1), smooth=True):
    """Where the vertices of a plane are then in its own space, and the normals of its faces; the plane stays flat."""
    obj = scenes.add_plane(material=material)
    obj.scale = scale
    obj.data.polygons.foreach_set("use_smooth", [smooth] * len(obj.data.polygons))
    before = positions(obj)

    def work(depsgraph):
        displace(depsgraph, [] if warnings is None else warnings)
        mesh = obj.evaluated_get(depsgraph).data
        return positions(mesh), np.array([tuple(one.vector) for one in mesh.polygon_normals])

    found = scenes.in_graph(work)
    np.testing.assert_array_equal(positions(obj), before)
    return before, *found


def positions(of):
    mesh = getattr(of, "data", of)
    return np.array([tuple(one.co) for one in mesh.vertices])


def moved(kind, method="DISPLACEMENT", **inputs):
    """A material with a displacement node of constants, or of sockets of others."""
    material, _ = scenes.add_material("Moved")
    tree = material.node_tree
    node = tree.nodes.new(f"ShaderNode{kind}")
    for name, value in inputs.items():
        if name == "space":
            node.space = value
        elif callable(value):
            tree.links.new(value(tree), node.inputs[name])
        else:
            socket = node.inputs[name]
            socket.default_value = value if np.isscalar(value) else (*value, 1)[: len(socket.default_value)]
    tree.links.new(node.outputs[0], tree.get_output_node("CYCLES").inputs["Displacement"])
    material.displacement_method = method
    return material


def along_x(tree):
    split = tree.nodes.new("ShaderNodeSeparateXYZ")
    tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["Object"], split.inputs[0])
    return split.outputs[0]


@pytest.mark.parametrize("smooth", [False, True])
@pytest.mark.parametrize("space, height", [("OBJECT", 0.4), ("WORLD", 0.2)])
def test_displacement_is_along_normals(space, height, smooth):
    """Of (0.7 − 0.5) · 2 in object space, or in the world, twice as large along the normal."""
    material = moved("Displacement", Height=0.7, Midlevel=0.5, Scale=2.0, space=space)
    before, after, _ = displaced(material, scale=(3, 1, 2), smooth=smooth)
    np.testing.assert_allclose(after - before, np.tile([0, 0, height], (len(before), 1)), atol=1e-6)


def test_heights_of_nodes_lean_the_plane():
    """Heights below 0 among them; faces have their new normals."""
    before, after, normals = displaced(moved("Displacement", "BOTH", Height=along_x, Midlevel=0.0, Scale=0.5))
    np.testing.assert_allclose(after[:, 2] - before[:, 2], before[:, 0] / 2, atol=2e-3)
    np.testing.assert_allclose(normals, np.tile([-1, 0, 2] / np.sqrt(5), (len(normals), 1)), atol=2e-3)


def test_vectors_are_of_the_object_or_the_world():
    inputs = {"Vector": (1, 2, 3), "Midlevel": 1.0, "Scale": 0.5}
    for space, scale in (("OBJECT", (1, 1, 1)), ("WORLD", (4, 1, 0.5))):
        before, after, _ = displaced(moved("VectorDisplacement", space=space, **inputs), scale=(4, 1, 0.5))
        expected = np.array([0, 0.5, 1]) / scale
        np.testing.assert_allclose(after - before, np.tile(expected, (len(before), 1)), atol=1e-5)
        bpy.data.objects.remove(bpy.context.scene.objects[0])


def test_bump_only_moves_nothing():
    before, after, _ = displaced(moved("Displacement", "BUMP", Height=along_x))
    np.testing.assert_array_equal(after, before)
