"""Receivers at the vertices or corners of meshes."""

from dataclasses import dataclass

import numpy as np

from .attribute_map import AttributeMap
from .receivers import AttributeTarget, Domain, Receivers

CORNER_PULL = 0.02
"""How far a receiver is pulled from its vertex towards the middle of its own faces, as a share of the way there.

A vertex lies on the edge of its faces, where other surfaces often touch it: at the very edge a gather ray would start
inside the neighbour (black) or beyond it (leak). At 2 % of the way in, the receiver is clearly on its own face, and
the light there differs little from the light at the vertex.
"""

NUDGE = 1e-4
"""Least pull, as a share of the vertex's largest coordinate: Cycles' own, for the same reason.

On faces of a few millimetres it matters, as they may lie that close to other surfaces.
"""

LIFT = 1e-3
"""How far a receiver is lifted off its face, as a share of the distance to the middle of its faces."""

IN_PLACE = 0.4
"""Light that modifiers show less far than this from where it belongs (`AttributeMap.misplaced`) is where it should be.

A bevel's is 0.2; copies of faces, which show the light of one place in several, have more.
"""


@dataclass(frozen=True)
class ReceiverMesh:
    """A mesh whose vertices or corners want light: v vertices, c corners, f faces of any size.

    Attributes
    ----------
    object_name, mesh_name : str
        For messages, and for where the light goes.
    domain : 'POINT' or 'CORNER'
        What the normals are of; without a map, the values are stored on it.
    positions : (v, 3) float32, m
        World space.
    normals : (v, 3) or (c, 3) float32
        Unit shading normals of the domain's elements, world space.
    corner_vertex : (c,) int32
    corner_face : (c,) int32
        Face of each corner, ascending.
    map : AttributeMap or None
        Where modifiers change the elements: this is the evaluated mesh then, and the map leads back to the stored one.
    triangles : (t, 3) int32 or None
        Corners of the triangles that renders cut the faces into; None: what renders show is not these faces, but others
        between vertices that lie here.
    """

    object_name: str
    mesh_name: str
    domain: Domain
    positions: np.ndarray
    normals: np.ndarray
    corner_vertex: np.ndarray
    corner_face: np.ndarray
    map: AttributeMap | None = None
    triangles: np.ndarray | None = None

    @property
    def corner_normals(self) -> np.ndarray:
        """Normals of the corners, (c, 3)."""
        return self.normals if self.domain == "CORNER" else self.normals[self.corner_vertex]


def joined(parts: list[ReceiverMesh]) -> ReceiverMesh:
    """One mesh of several with maps to the same stored mesh, such as the faces that one object cuts into others."""
    if len(parts) == 1:
        return parts[0]
    maps = [part.map for part in parts if part.map is not None]
    corner, vertex, face = (
        np.cumsum([0, *counts])[:-1]
        for counts in (
            [len(part.corner_vertex) for part in parts],
            [len(part.positions) for part in parts],
            [part.corner_face[-1] + 1 for part in parts],
        )
    )
    element = np.concatenate([one.element for one in maps])
    stand_in = maps[0].stand_in.copy()
    stand_in[element] = element
    together = AttributeMap(
        domain=maps[0].domain,
        area=np.concatenate([one.area for one in maps]),
        stand_in=stand_in,
        corner=np.concatenate([one.corner + first for one, first in zip(maps, corner, strict=True)]),
        element=element,
        weight=np.concatenate([one.weight for one in maps]),
        misplaced=max(one.misplaced for one in maps),
    )
    return ReceiverMesh(
        object_name=parts[0].object_name,
        mesh_name=parts[0].mesh_name,
        domain="CORNER",
        positions=np.concatenate([part.positions for part in parts]),
        normals=np.concatenate([part.corner_normals for part in parts]),
        corner_vertex=np.concatenate([part.corner_vertex + first for part, first in zip(parts, vertex, strict=True)]),
        corner_face=np.concatenate([part.corner_face + first for part, first in zip(parts, face, strict=True)]),
        map=together,
        triangles=_joined_triangles([part.triangles for part in parts], corner),
    )


def _joined_triangles(parts: list[np.ndarray | None], first: np.ndarray) -> np.ndarray | None:
    """Triangles of all parts, whose corners are numbered on from `first`; None if a part has none."""
    there = [part + np.int32(start) for part, start in zip(parts, first, strict=True) if part is not None]
    return np.concatenate(there) if len(there) == len(parts) else None


def vertex_receivers(meshes: list[ReceiverMesh], all_shown: bool = False) -> Receivers:
    """Receivers of several meshes: one a vertex, or one for each set of a vertex's corners that share a normal.

    Corners of coplanar or smoothly joined faces share a receiver. Each is pulled towards the middle of its faces by
    `CORNER_PULL` or `NUDGE`, but never below its tangent plane, and lifted along its normal by `LIFT`.

    Parameters
    ----------
    all_shown : bool
        Whether all corners that show stored values get one, even if fewer decide on them.
    """
    parts, targets, start = [], [], 0
    for mesh in meshes:
        receiver_of_element, *arrays = _of_mesh(mesh)
        if mesh.map is not None:
            receiver_of_element, used = _reached(receiver_of_element, mesh, all_shown)
            arrays = [values[used] for values in arrays]
        position, normal, footprint = arrays
        moved = np.where(receiver_of_element >= 0, receiver_of_element + start, -1).astype(np.int32)
        domain = mesh.domain if mesh.map is None else mesh.map.domain
        targets.append(AttributeTarget(mesh.object_name, mesh.mesh_name, domain, moved, mesh.map))
        parts.append((position, normal, footprint))
        start += len(position)
    empty = np.zeros((0, 3), np.float32), np.zeros((0, 3), np.float32), np.zeros(0, np.float32)
    position, normal, footprint = (np.concatenate(arrays) for arrays in zip(*(parts or [empty]), strict=True))
    return Receivers(position, normal, footprint, tuple(targets))


def _of_mesh(mesh: ReceiverMesh) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Receiver of each element, and the receivers' positions, normals and footprints."""
    group_of_corner, normal, receiver_of_element = _groups(mesh)
    n = len(normal)
    corner_position = mesh.positions[mesh.corner_vertex]
    n_corners = np.maximum(np.bincount(group_of_corner, minlength=n), 1)[:, None]
    vertex = np.zeros((n, 3))
    vertex[group_of_corner] = corner_position  # a group's corners are all of one vertex
    way = _face_middles(mesh)[mesh.corner_face] - corner_position
    to_middle = _mean_by(group_of_corner, way, n_corners)
    reach = _mean_by(group_of_corner, np.linalg.norm(way, axis=1), n_corners[:, 0])
    # Down into the surface is left out, up is not: the middle of a hollow's faces lies above its tangent plane.
    down = np.minimum((to_middle * normal).sum(1, keepdims=True), 0) * normal
    nudge = NUDGE * np.abs(vertex).max(axis=1, initial=0)
    pull = np.minimum(np.maximum(CORNER_PULL, nudge / np.maximum(reach, 1e-30)), 1)[:, None]
    position = vertex + pull * (to_middle - down) + LIFT * reach[:, None] * normal
    return receiver_of_element, position.astype(np.float32), normal.astype(np.float32), reach.astype(np.float32)


def _reached(receiver_of_element: np.ndarray, mesh: ReceiverMesh, all_shown: bool) -> tuple[np.ndarray, np.ndarray]:
    """The receiver of each corner that decides on stored values (−1: none), and which of the receivers these are.

    All that show stored values do, unless there are more of them than of these, and each shows its own light; or, if
    that is asked for, all.
    """
    assert mesh.map is not None
    of_corner = receiver_of_element if mesh.domain == "CORNER" else receiver_of_element[mesh.corner_vertex]
    decides = mesh.map.reached
    if not all_shown and mesh.map.misplaced < IN_PLACE and len(np.unique(of_corner[decides])) > len(mesh.map.stand_in):
        decides &= np.isin(of_corner, of_corner[mesh.map.decisive()])
    used, of_deciding = np.unique(of_corner[decides], return_inverse=True)
    receiver = np.full(len(of_corner), -1, np.int32)
    receiver[decides] = of_deciding.reshape(-1)
    return receiver, used


def _groups(mesh: ReceiverMesh) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Sets of corners that share a receiver: set of each corner, normal of each set, set of each element (−1: none)."""
    if mesh.domain == "POINT":
        used, group = np.unique(mesh.corner_vertex, return_inverse=True)
        receiver_of_vertex = np.full(len(mesh.positions), -1, np.int32)
        receiver_of_vertex[used] = np.arange(len(used))
        return group.reshape(-1), mesh.normals[used], receiver_of_vertex
    # Normals within about half a degree are the same.
    key = mesh.corner_vertex.astype(np.int64)
    for axis in range(3):  # one number a corner: sorting rows would hold Python's lock, and Blender's window with it
        key = key * 256 + np.rint(mesh.normals[:, axis] * 100).astype(np.int64) + 128
    _, first, group = np.unique(key, return_index=True, return_inverse=True)
    return group, mesh.normals[first], group.astype(np.int32)


def _face_middles(mesh: ReceiverMesh) -> np.ndarray:
    """Mean corner position of each face, (f, 3) float64, m."""
    n_corners = np.maximum(np.bincount(mesh.corner_face), 1)
    return _mean_by(mesh.corner_face, mesh.positions[mesh.corner_vertex], n_corners[:, None])


def _mean_by(group: np.ndarray, values: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Sum of the values of each group over its count; values (n,) or (n, d)."""
    columns = values.reshape(len(values), -1).T
    sums = np.stack([np.bincount(group, column, minlength=len(counts)) for column in columns], axis=1)
    return sums.reshape(-1, *values.shape[1:]) / counts
