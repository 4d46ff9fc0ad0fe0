"""Receivers at vertices and corners: who shares one, and where it lies."""

import numpy as np
import pytest
from photon_bake.addon.receivers import ReceiverMesh, vertex_receivers
from photon_bake.tests.core.scenes import box


def mesh_of(vertices, faces, domain="CORNER", normals=None):
    faces = [np.asarray(face) for face in faces]
    corner_vertex = np.concatenate(faces).astype(np.int32)
    corner_face = np.repeat(np.arange(len(faces)), [len(face) for face in faces]).astype(np.int32)
    vertices = np.asarray(vertices, np.float32)
    if normals is None:
        normal_of_face = [np.cross(*(vertices[face[1:3]] - vertices[face[0]])) for face in faces]
        normals = np.array([n / np.linalg.norm(n) for n in normal_of_face])[corner_face]
    return ReceiverMesh("Object", "Mesh", domain, vertices, np.asarray(normals, np.float32), corner_vertex, corner_face)


def grid(n):
    """n × n quads of a unit square that faces up."""
    x, y = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1))
    vertices = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], 1)
    first = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    return vertices, [(i, i + 1, i + n + 2, i + n + 1) for i in first]


def test_coplanar_faces_share_receivers():
    receivers = vertex_receivers([mesh_of(*grid(4))])
    assert len(receivers) == 25
    (target,) = receivers.targets
    assert target.domain == "CORNER" and len(target.receiver_of_element) == 64


def test_flat_faces_of_a_box_do_not():
    vertices, triangles = box()
    receivers = vertex_receivers([mesh_of(vertices, triangles)])
    assert len(receivers) == 24  # three walls meet in each of eight corners


def test_receivers_of_a_box_lie_inside_on_their_own_wall():
    vertices, triangles = box()
    receivers = vertex_receivers([mesh_of(vertices, triangles)])
    on_wall = np.abs(np.abs((receivers.position * receivers.normal).sum(1)) - 1) < 5e-3
    assert on_wall.all()
    inside = 1 - np.abs(receivers.position)
    inside[np.abs(receivers.normal) > 0.5] = 1
    assert (inside > 5e-3).all() and (np.abs(receivers.position) < 1).all()


def test_inner_vertices_stay_where_they_are():
    vertices, faces = grid(4)
    receivers = vertex_receivers([mesh_of(vertices, faces)])
    sideways = np.linalg.norm(receivers.position[:, :2] - vertices[:, :2], axis=1)
    inner = ((vertices[:, :2] > 0) & (vertices[:, :2] < 1)).all(1)
    # np.unique sorts by vertex, so receivers stand in the vertices' order here
    assert sideways[inner].max() < 1e-6 and sideways[~inner].min() > 1e-3
    assert (receivers.position[:, 2] > 0).all() and (receivers.footprint > 0).all()


def test_smooth_vertices_share_one():
    vertices, triangles = box(inwards=False)
    receivers = vertex_receivers([mesh_of(vertices, triangles, "POINT", vertices / np.sqrt(3))])
    assert len(receivers) == 8
    assert np.array_equal(receivers.targets[0].receiver_of_element, np.arange(8))
    assert (np.abs(receivers.position) > 0.99).all(), "a convex vertex must not be pulled below its faces"


def test_loose_vertices_get_none():
    vertices, faces = grid(1)
    vertices = np.concatenate([[[5, 5, 5]], vertices])
    mesh = mesh_of(vertices, [np.array(face) + 1 for face in faces], "POINT", np.tile([0, 0, 1.0], (5, 1)))
    (target,) = vertex_receivers([mesh]).targets
    assert target.receiver_of_element[0] == -1 and sorted(target.receiver_of_element[1:]) == [0, 1, 2, 3]


def test_several_meshes_are_numbered_on():
    receivers = vertex_receivers([mesh_of(*grid(2)), mesh_of(*grid(3))])
    assert len(receivers) == 9 + 16
    assert receivers.targets[0].receiver_of_element.max() == 8 and receivers.targets[1].receiver_of_element.min() == 9


def test_no_meshes_no_receivers():
    receivers = vertex_receivers([])
    assert len(receivers) == 0 and receivers.targets == ()


@pytest.mark.parametrize("scale", [1e-3, 1, 1e3])
def test_pull_and_lift_scale_with_the_mesh(scale):
    vertices, faces = grid(2)
    small, large = vertex_receivers([mesh_of(vertices, faces)]), vertex_receivers([mesh_of(vertices * scale, faces)])
    assert np.allclose(large.position, small.position * scale, rtol=1e-4, atol=1e-6 * scale)
