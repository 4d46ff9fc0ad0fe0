"""Receivers that ride on the surfaces they lie on, as these move and bend."""

from dataclasses import dataclass, replace

import numpy as np

from ..core.sampling.vectors import dot, rows
from ..scene import Scene
from ..scene.scene import interpolate
from ..tracing import EmbreeTracer
from .receivers import Receivers

_NEAR = 0.5
"""How far below a receiver its surface is, at most, of the radius that it stands for."""


@dataclass(frozen=True)
class Riding:
    """Receivers, and the r triangles of a scene that some of them ride on; the others stand still.

    With the frames A of a place on its triangle before, and B after, which have the shading normal as their third
    axis, a position p goes from the place o to o' + B Aᵀ (p − o), and a normal n to B Aᵀ n.

    Attributes
    ----------
    receivers : Receivers
    rider : (r,) int64
        Which of the receivers.
    triangle : (r,) int32
    corners : (r, 3) int32
        The triangles' vertices.
    u, v : (r,) float64
        Barycentric weights of the second and third of them.
    place, frame : (r, 3) and (r, 3, 3) float64
        o and A.
    """

    receivers: Receivers
    rider: np.ndarray
    triangle: np.ndarray
    corners: np.ndarray
    u: np.ndarray
    v: np.ndarray
    place: np.ndarray
    frame: np.ndarray

    @staticmethod
    def of(receivers: Receivers, scene: Scene, tracer: EmbreeTracer) -> "Riding":
        """Receivers on a scene's surfaces: a ray down from each finds the nearest, if that is its own object's."""
        hits = tracer.closest_hit(receivers.position, -receivers.normal)
        near = hits.hit & (hits.distance <= _NEAR * receivers.footprint)
        wanted, met = _objects(receivers, scene), np.full(len(near), -1)
        if near.any():
            met[near] = _number_of_object(scene)[scene.object_of_triangle[hits.triangle[near]]]
        k = np.flatnonzero(near & ((wanted < 0) | (wanted == met)))
        triangle, u, v = hits.triangle[k], hits.u[k].astype(np.float64), hits.v[k].astype(np.float64)
        corners = rows(scene.triangles, triangle)
        frame = _frames(scene.vertices[corners], rows(scene.corner_normals, triangle), u, v)
        return Riding(receivers, k, triangle, corners, u, v, *frame)

    def on(self, vertices: np.ndarray, corner_normals: np.ndarray) -> "Ride":
        """The receivers where the scene's vertices (v, 3) are elsewhere, and with them its corner normals (t, 3, 3)."""
        place, frame = _frames(vertices[self.corners], rows(corner_normals, self.triangle), self.u, self.v)
        turn, k = frame @ self.frame.transpose(0, 2, 1), self.rider
        position, normal = self.receivers.position.copy(), self.receivers.normal.copy()
        position[k] = place + np.einsum("nij,nj->ni", turn, position[k] - self.place)
        normal[k] = _unit(np.einsum("nij,nj->ni", turn, normal[k]))
        return Ride(replace(self.receivers, position=position, normal=normal), k, turn)


@dataclass(frozen=True)
class Ride:
    """Receivers at another time, and how r of them have turned.

    Attributes
    ----------
    receivers : Receivers
    rider : (r,) int64
    turn : (r, 3, 3) float64
        B Aᵀ of `Riding`.
    """

    receivers: Receivers
    rider: np.ndarray
    turn: np.ndarray

    def at_rest(self, slope: np.ndarray) -> np.ndarray:
        """Slopes (n, 3, 3) of light over the receivers' normals as slopes over the normals that they have at rest."""
        slope = slope.copy()
        slope[self.rider] = self.turn.transpose(0, 2, 1) @ slope[self.rider]
        return slope


def _frames(corners: np.ndarray, normals: np.ndarray, u: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places (r, 3) on triangles, and the frames (r, 3, 3) there, of columns: along an edge, across, shading normal."""
    corners = corners.astype(np.float64)
    place, normal = interpolate(corners, u, v), _unit(interpolate(normals.astype(np.float64), u, v))
    edge = corners[:, 1] - corners[:, 0]
    along = _unit(edge - dot(edge, normal)[:, None] * normal)
    return place, np.stack([along, np.cross(normal, along), normal], axis=2)


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-30)


def _number_of_object(scene: Scene) -> np.ndarray:
    """The number of each object's name, (o,): where its first bearer is."""
    number: dict[str, int] = {}
    return np.array([number.setdefault(name, i) for i, name in enumerate(scene.objects.names)], np.int64)


def _objects(receivers: Receivers, scene: Scene) -> np.ndarray:
    """The number of the name of the object that each receiver is for, (n,); −1 where the scene has none of it."""
    number = dict(zip(scene.objects.names, _number_of_object(scene).tolist(), strict=True))
    found = np.full(len(receivers), -1)
    for target in receivers.targets:
        elements = target.receiver_of_element
        found[elements[elements >= 0]] = number.get(target.object_name, -1)
    return found
