"""Which modifiers keep the original vertices findable: every claim of `vertex_meshes` is held here."""

import bpy
import numpy as np
import pytest
from photon_bake.addon.blender import receiver_meshes
from photon_bake.addon.blender.read.meshes.modifiers import FIRST_VERTICES, SAME_VERTICES
from photon_bake.tests.host import scenes


def scrambled_grid(flat=True, n=5):
    """A bent grid over x ≥ 0 whose vertices and faces are in random order, so that no order holds by luck.

    Each vertex carries its index in the attribute "ident", which modifiers hand on.
    """
    rng = np.random.default_rng(1)
    x, y = np.meshgrid(np.linspace(0, 2, n), np.linspace(-1, 1, n), indexing="ij")
    vertices = np.column_stack([x.ravel(), y.ravel(), (0.3 * x * y).ravel()])
    faces = [
        (i * n + j, (i + 1) * n + j, (i + 1) * n + j + 1, i * n + j + 1) for i in range(n - 1) for j in range(n - 1)
    ]
    order = rng.permutation(n * n)
    where = np.argsort(order)
    faces = where[rng.permutation(faces)]
    obj = scenes.add_mesh("Grid", vertices[order], faces, smooth=not flat)
    ident = obj.data.attributes.new("ident", "INT", "POINT")
    ident.data.foreach_set("value", np.arange(n * n, dtype=np.int32))
    return obj


def receiver(obj):
    (mesh,) = scenes.in_graph(lambda graph: receiver_meshes([obj], graph))
    return mesh


CASES = [
    ("ARRAY", {}),
    ("ARRAY", {"use_merge_vertices": True}),
    ("ARRAY", {"count": 4, "use_merge_vertices": True, "use_merge_vertices_cap": True}),
    ("EDGE_SPLIT", {"split_angle": 0.0}),
    ("MIRROR", {}),
    ("MIRROR", {"use_mirror_merge": False}),
    ("MIRROR", {"use_axis": (True, True, True)}),
    ("SOLIDIFY", {}),
    ("SOLIDIFY", {"offset": 1.0}),
    ("SOLIDIFY", {"use_rim_only": True}),
    ("SOLIDIFY", {"use_flip_normals": True}),
    ("SUBSURF", {"levels": 1}),
    ("SUBSURF", {"levels": 3}),
    ("SUBSURF", {"levels": 2, "subdivision_type": "SIMPLE"}),
    ("MULTIRES", {}),
    ("WIREFRAME", {"use_replace": False}),
]


def add_modifier(obj, kind, settings):
    modifier = obj.modifiers.new(kind.title(), kind)
    for key, value in settings.items():
        setattr(modifier, key, value)
    if kind == "MULTIRES":
        bpy.context.view_layer.objects.active = obj
        bpy.ops.object.multires_subdivide(modifier=modifier.name, mode="CATMULL_CLARK")
    return modifier


def test_every_claim_has_a_case():
    assert {kind for kind, _ in CASES} == set(FIRST_VERTICES)


@pytest.mark.parametrize("flat", [True, False])
@pytest.mark.parametrize(("kind", "settings"), CASES)
def test_original_vertices_come_first(kind, settings, flat):
    obj = scrambled_grid(flat)
    add_modifier(obj, kind, settings)
    n = len(obj.data.vertices)
    mesh = receiver(obj)
    evaluated = obj.evaluated_get(scenes.depsgraph()).data
    assert len(evaluated.vertices) > n
    ident = np.empty(len(evaluated.vertices), np.int32)
    evaluated.attributes["ident"].data.foreach_get("value", ident)
    np.testing.assert_array_equal(ident[:n], np.arange(n))
    assert mesh.positions.shape == (n, 3)
    assert mesh.domain == ("CORNER" if flat and kind not in {"SUBSURF", "MULTIRES"} else "POINT")
    elements = n if mesh.domain == "POINT" else len(obj.data.loops)
    assert mesh.normals.shape == (elements, 3)
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1, atol=1e-5)


@pytest.mark.parametrize("kind", ["ARRAY", "MIRROR", "EDGE_SPLIT", "TRIANGULATE"])
def test_corner_normals_stay_those_of_the_faces(kind):
    """Where a modifier moves nothing, receivers are as without it."""
    obj = scrambled_grid()
    before = receiver(obj)
    modifier = add_modifier(obj, kind, {})
    if kind == "EDGE_SPLIT":
        modifier.split_angle = 0
    after = receiver(obj)
    np.testing.assert_allclose(after.positions, before.positions, atol=1e-6)
    np.testing.assert_allclose(after.normals, before.normals, atol=1e-5)


def test_triangulated_and_deformed():
    obj = scrambled_grid()
    obj.data.transform(np.diag([1, 1, 0, 1]).tolist())
    add_modifier(obj, "CAST", {"cast_type": "SPHERE", "factor": 0.5})
    deformed = receiver(obj)
    add_modifier(obj, "TRIANGULATE", {})
    both = receiver(obj)
    np.testing.assert_allclose(both.positions, deformed.positions, atol=1e-6)
    np.testing.assert_allclose(both.normals, deformed.normals, atol=1e-4)


def test_modifiers_in_a_row():
    obj = scrambled_grid(flat=False)
    for kind in ("MIRROR", "SUBSURF", "SOLIDIFY", "ARRAY"):
        add_modifier(obj, kind, {})
    assert receiver(obj).positions.shape == (25, 3)


def test_deforming_modifiers_exist():
    known = {item.identifier for item in bpy.types.Modifier.bl_rna.properties["type"].enum_items}
    assert known >= SAME_VERTICES
    assert known >= set(FIRST_VERTICES)


def geometry_nodes(obj, node_type):
    tree = bpy.data.node_groups.new("Nodes", "GeometryNodeTree")
    for in_out in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=in_out, socket_type="NodeSocketGeometry")
    first, last = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    node = tree.nodes.new(node_type)
    tree.links.new(first.outputs[0], node.inputs[0])
    tree.links.new(node.outputs[0], last.inputs[0])
    obj.modifiers.new("Nodes", "NODES").node_group = tree


def test_geometry_nodes_that_keep_the_vertices():
    obj = scrambled_grid(flat=False)
    geometry_nodes(obj, "GeometryNodeSetShadeSmooth")
    add_modifier(obj, "SUBSURF", {})
    assert receiver(obj).domain == "POINT"


def test_geometry_nodes_that_do_not():
    obj = scrambled_grid(flat=False)
    geometry_nodes(obj, "GeometryNodeSubdivideMesh")
    mesh = receiver(obj)
    assert mesh.map.domain == "CORNER"
    assert len(mesh.map.stand_in) == len(obj.data.loops)
    assert mesh.positions.shape == (81, 3)


def test_sorted_vertices_are_found_again():
    """As many vertices in another order are not the same vertices."""
    obj = scrambled_grid(flat=False)
    geometry_nodes(obj, "GeometryNodeSortElements")
    nodes = obj.modifiers["Nodes"].node_group.nodes
    sort = next(node for node in nodes if node.bl_idname == "GeometryNodeSortElements")
    index = nodes.new("GeometryNodeInputIndex")
    minus = nodes.new("ShaderNodeMath")
    minus.operation = "MULTIPLY"
    minus.inputs[1].default_value = -1.0
    links = obj.modifiers["Nodes"].node_group.links
    links.new(index.outputs[0], minus.inputs[0])
    links.new(minus.outputs[0], sort.inputs["Sort Weight"])
    mesh = receiver(obj)
    vertex = np.empty(len(obj.data.loops), np.int32)
    obj.data.loops.foreach_get("vertex_index", vertex)
    np.testing.assert_array_equal(vertex[mesh.map.element], 24 - mesh.corner_vertex[mesh.map.corner])
