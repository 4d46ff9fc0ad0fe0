"""Bake targets: elements, positions and normals in the world."""

import bpy
import numpy as np
import pytest
from photon_bake.addon.blender import bake_objects, receiver_meshes
from photon_bake.addon.core.errors import BakeError
from photon_bake.tests.host import scenes


def receiver(obj):
    (mesh,) = scenes.in_graph(lambda graph: receiver_meshes([obj], graph))
    return mesh


def test_flat_cube_takes_corners():
    mesh = receiver(scenes.add_cube())
    assert mesh.domain == "CORNER"
    assert mesh.positions.shape == (8, 3)
    assert mesh.positions.dtype == mesh.normals.dtype == np.float32
    assert mesh.normals.shape == (24, 3)
    np.testing.assert_array_equal(mesh.corner_vertex, np.array(scenes.CUBE_FACES).ravel())
    np.testing.assert_array_equal(mesh.corner_face, np.repeat(np.arange(6), 4))
    # Every corner's normal points straight out of its face.
    centres = mesh.positions[mesh.corner_vertex].reshape(6, 4, 3).mean(1)
    np.testing.assert_allclose(mesh.normals, centres.repeat(4, 0), atol=1e-5)


def test_smooth_cube_takes_vertices():
    mesh = receiver(scenes.add_cube(smooth=True))
    assert mesh.domain == "POINT"
    np.testing.assert_allclose(mesh.normals, mesh.positions / np.sqrt(3), atol=1e-4)


def test_sharp_edge_takes_corners():
    obj = scenes.add_cube(smooth=True)
    obj.data.edges[0].use_edge_sharp = True
    obj.data.update()
    assert receiver(obj).domain == "CORNER"


@pytest.mark.parametrize("scale", [(2, 1, 0.5), (-1, 1, 1), (-1, -2, -3)])
def test_transform(scale):
    obj = scenes.add_cube()
    obj.scale, obj.rotation_euler, obj.location = scale, (0.3, 0.7, 1.1), (5, 6, 7)
    mesh = receiver(obj)
    corners = mesh.positions[mesh.corner_vertex].reshape(6, 4, 3)
    out = corners.mean(1) - mesh.positions.mean(0)
    normals = mesh.normals.reshape(6, 4, 3)
    assert (np.einsum("fj,fcj->fc", out, normals) > 0).all()
    edge = corners[:, 1] - corners[:, 0]
    np.testing.assert_allclose(np.einsum("fj,fcj->fc", edge, normals), 0, atol=1e-5)


def test_shape_key():
    obj = scenes.add_plane()
    obj.shape_key_add(name="Basis")
    key = obj.shape_key_add(name="Up")
    for point in key.data:
        point.co.z = 3
    key.value = 0.5
    np.testing.assert_allclose(receiver(obj).positions[:, 2], 1.5)


def test_several_objects_of_one_mesh():
    one = scenes.add_cube()
    other = bpy.data.objects.new("Other", one.data)
    bpy.context.scene.collection.objects.link(other)
    other.location = (5, 0, 0)
    first, second = scenes.in_graph(lambda graph: receiver_meshes([one, other], graph))
    assert first.mesh_name == second.mesh_name
    assert (first.object_name, second.object_name) == ("Cube", "Other")
    np.testing.assert_allclose(second.positions - first.positions, np.broadcast_to([5, 0, 0], (8, 3)))


def test_objects_by_default():
    scenes.add_cube("Seen")
    scenes.add_cube("Hidden").hide_render = True
    scenes.add_mesh("Empty", [], [])
    scenes.add_cube("Flat").scale = (1, 1, 0)
    scenes.add_lamp("POINT")
    warnings = []
    assert [obj.name for obj in scenes.in_graph(lambda graph: bake_objects(graph, None, warnings))] == ["Seen"]
    assert len(warnings) == 2
    assert all(any(f"'{name}'" in warning for warning in warnings) for name in ("Empty", "Flat"))


def test_objects_by_name():
    for name in "ABC":
        scenes.add_cube(name).hide_render = name == "B"
    # Named twice is baked once.
    assert [obj.name for obj in scenes.in_graph(lambda graph: bake_objects(graph, ["C", "A", "C"]))] == ["C", "A"]
    with pytest.raises(BakeError, match="'B' is hidden in renders"):
        scenes.in_graph(lambda graph: bake_objects(graph, ["B"]))
