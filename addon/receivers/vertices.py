"""Receivers at the vertices or corners of meshes."""

from dataclasses import dataclass

import numpy as np

from .receivers import AttributeTarget, Domain, Receivers

CORNER_PULL = 0.02
"""How far a receiver is pulled from its vertex towards the middle of its own faces, as a share of the way there.

A vertex lies on the edge of its faces, where other surfaces often touch it: at the very edge a gather ray would start
inside the neighbour (black) or beyond it (leak). At 2 % of the way in, the receiver is clearly on its own face, and
the light there differs little from the light at the vertex.
"""


@dataclass(frozen=True)
class ReceiverMesh:
    """A mesh whose vertices or corners want light: v vertices, c corners, f faces of any size.

    Attributes
    ----------
    object_name, mesh_name : str
        For messages, and for where the light goes.
    domain : 'POINT' or 'CORNER'
        What the values are stored on.
    positions : (v, 3) float32, m
        World space.
    normals : (v, 3) or (c, 3) float32
        Unit shading normals of the domain's elements, world space.
    corner_vertex : (c,) int32
    corner_face : (c,) int32
        Face of each corner, ascending.
    """

    object_name: str
    mesh_name: str
    domain: Domain
    positions: np.ndarray
    normals: np.ndarray
    corner_vertex: np.ndarray
    corner_face: np.ndarray


def vertex_receivers(meshes: list[ReceiverMesh]) -> Receivers:
    """One receiver for each vertex, or for each set of a vertex's corners with the same normal."""
    raise NotImplementedError
