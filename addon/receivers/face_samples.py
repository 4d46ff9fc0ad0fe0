"""Points of the faces between vertices, where light is gathered that vertices are fitted to.

Faces wider than light's finest detail get points even by area; the narrow ones of dense meshes get few or none, since
their vertices say it all. Faces that other geometry covers in part get more.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..core.parallel import Workers
from ..core.sampling.sequences import R2_STEPS
from ..core.sampling.vectors import dot, largest, rows
from ..core.sampling.warps import frame, sample_uniform_triangle
from ..tracing import Tracer
from .lightmap.texel_points import LEAST_LIFT, LIFT
from .receivers import AttributeTarget, Receivers
from .vertices import ReceiverMesh

STAGE = "Placing samples of faces"

SPACING = 1 / 192
"""Of samples, as a share of the receivers' extent: half of the cells in which a final gather begins to look closely."""

MOST_OF_FACE = 48
"""Samples of a triangle at the most: an average of as many is known to a seventh of what light varies within it."""

OF_COVERED = 16
"""Samples of a triangle that is covered in part, at the most: one for each square of a quarter of the spacing."""

MOST = 100_000
"""Samples at the most, and one more for each vertex; besides those of triangles that are covered in part."""

_MOST_BACKS = 3  # of four rays along the surface see backs, inside of a solid
_CLOSE = np.float32(0.1)  # of a sample's radius: what hangs as low above it hides it
_CHUNK = 1 << 15


@dataclass(frozen=True)
class ShownFaces:
    """t triangles that show the values of vertex receivers, linear in between.

    Attributes
    ----------
    receiver : (t, 3) int32
        Of each corner.
    position : (t, 3, 3) float32, m
    normal : (t, 3, 3) float32
        Unit shading normals of the corners.
    area : (t,) float64, m²
    target : (t,) int32
        Which of the receivers' targets the triangle is of.
    """

    receiver: np.ndarray
    position: np.ndarray
    normal: np.ndarray
    area: np.ndarray
    target: np.ndarray

    def __len__(self) -> int:
        return len(self.receiver)

    @staticmethod
    def of(meshes: Sequence[ReceiverMesh], targets: Sequence[AttributeTarget]) -> "ShownFaces":
        """Those of meshes whose faces are the shown ones, with the targets that `vertex_receivers` made of them."""
        empty = np.zeros((0, 3), np.int32), *2 * (np.zeros((0, 3, 3), np.float32),), np.zeros(0), np.zeros(0, np.int32)
        parts = [empty]
        for i, (mesh, target) in enumerate(zip(meshes, targets, strict=True)):
            if mesh.triangles is None:
                continue
            of_corner = target.receiver_of_element
            if mesh.map is None and mesh.domain == "POINT":
                of_corner = of_corner[mesh.corner_vertex]
            receiver = of_corner[mesh.triangles]
            position = rows(mesh.positions, mesh.corner_vertex[mesh.triangles])
            ways = (position[:, 1:] - position[:, :1]).astype(np.float64)
            area = np.linalg.norm(np.cross(ways[:, 0], ways[:, 1]), axis=1) / 2
            k = np.flatnonzero((receiver >= 0).all(axis=1) & (area > 0))
            normal = rows(mesh.corner_normals, mesh.triangles[k])
            parts.append((receiver[k], position[k], normal, area[k], np.full(len(k), i, np.int32)))
        return ShownFaces(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))


@dataclass(frozen=True)
class FaceSamples:
    """s points of shown faces.

    Attributes
    ----------
    face : (s,) int32
        Ascending.
    weight : (s, 3) float32
        Barycentric weights of the face's corners.
    position : (s, 3) float32, m
        Lifted off the surface.
    normal : (s, 3) float32
        Unit shading normal.
    footprint : (s,) float32, m
        Radius of a disc as large as what the sample stands for.
    hidden : (s,) bool
        Nobody sees it, if it is dark: it is inside of something solid, or close under something.
    """

    face: np.ndarray
    weight: np.ndarray
    position: np.ndarray
    normal: np.ndarray
    footprint: np.ndarray
    hidden: np.ndarray

    def __len__(self) -> int:
        return len(self.face)

    def where(self, chosen: slice, first_face: int = 0) -> "FaceSamples":
        """Some of the samples, of faces that are numbered from `first_face` on."""
        some = (getattr(self, name)[chosen] for name in self.__dataclass_fields__ if name != "face")
        return FaceSamples(self.face[chosen] - np.int32(first_face), *some)

    def receivers(self, faces: ShownFaces, targets: Sequence[AttributeTarget]) -> Receivers:
        """Where they want light, for as many targets, which are to tell what object each is on and no more."""
        target = faces.target[self.face]
        of = tuple(
            AttributeTarget(one.object_name, one.mesh_name, "POINT", np.flatnonzero(target == i).astype(np.int32))
            for i, one in enumerate(targets)
        )
        return Receivers(self.position, self.normal, self.footprint, of)


def face_samples(
    faces: ShownFaces, vertices: Receivers, extent: float, tracer: Tracer, workers: Workers
) -> tuple[FaceSamples, np.ndarray]:
    """Samples of faces, and which of the vertices are hidden, (n,) bool, as samples may be.

    Parameters
    ----------
    vertices : Receivers
        That the faces are between.
    extent : float, m
        Of most receivers.
    """
    workers.progress.update(STAGE, 0)
    hidden = _hidden(vertices.position, vertices.normal, vertices.footprint, tracer, workers.part(0, 0.4))
    spacing = SPACING * extent
    number = samples_of_faces(faces.area, spacing, MOST + len(vertices))
    samples = _samples(faces, number, tracer, workers.part(0.4, 0.8))
    n_hidden = np.bincount(samples.face, samples.hidden, len(faces)) + hidden[faces.receiver].sum(axis=1)
    wanted = np.minimum(16 * faces.area / spacing**2, OF_COVERED).astype(np.int64)
    covered = (n_hidden > 0) & (n_hidden < number + 3) & (number < wanted)
    if covered.any():
        more = _samples(faces, np.where(covered, wanted, 0), tracer, workers.part(0.8, 1.0))
        samples = _merged(samples, more, ~covered[samples.face])
    workers.progress.update(STAGE, 1)
    return samples, hidden


def samples_of_faces(area: np.ndarray, spacing: float, most: int) -> np.ndarray:
    """How many samples each triangle gets, (t,) int64: one for each square of a spacing, on the average.

    Of narrow ones some get one and others none, evenly.
    """
    wanted = np.minimum(area / max(spacing, 1e-30) ** 2, MOST_OF_FACE)
    wanted *= min(1.0, most / max(float(wanted.sum()), 1e-30))
    return np.diff(np.floor(np.cumsum(wanted) + 0.5), prepend=0.0).astype(np.int64)


def _samples(faces: ShownFaces, number: np.ndarray, tracer: Tracer, workers: Workers) -> FaceSamples:
    """So many samples of each face."""
    face = np.repeat(np.arange(len(faces), dtype=np.int32), number)
    index = np.arange(len(face)) - np.repeat(np.cumsum(number) - number, number)
    weight = _even_points(index, face, number[face])
    corners, bent = rows(faces.position, face).astype(np.float64), rows(faces.normal, face).astype(np.float64)
    position, normal = (np.einsum("sk,ski->si", weight, values) for values in (corners, bent))
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    flat /= np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-30)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = np.where(length > 1e-3, normal / np.maximum(length, 1e-30), flat)
    radius = np.sqrt(faces.area[face] / np.maximum(number[face], 1) / np.pi)
    lift = np.maximum(LIFT * radius, LEAST_LIFT * largest(np.abs(position)))[:, None]
    position += np.where(dot(flat, normal)[:, None] < 0, -lift, lift) * flat
    at = position.astype(np.float32), normal.astype(np.float32), radius.astype(np.float32)
    return FaceSamples(face, weight.astype(np.float32), *at, _hidden(*at, tracer, workers))


def _even_points(index: np.ndarray, face: np.ndarray, number: np.ndarray) -> np.ndarray:
    """Barycentric weights (s, 3) of points that are even in their triangles; the only one of a triangle is its middle.

    Parameters
    ----------
    index, number : (s,) int
        Of the point within its triangle, and of points there.
    """
    start = face[:, None] * R2_STEPS[::-1] % 1  # of the R₂ sequence, another one for each triangle
    a, c = sample_uniform_triangle((start + (index[:, None] + 1) * R2_STEPS) % 1)
    weight = np.stack([a, 1 - a - c, c], axis=1)
    weight[number == 1] = 1 / 3
    return weight


def _merged(some: FaceSamples, others: FaceSamples, kept: np.ndarray) -> FaceSamples:
    """Those of `some` that are kept, and others, by faces."""
    order = np.argsort(np.concatenate([some.face[kept], others.face]), kind="stable")
    names = FaceSamples.__dataclass_fields__
    both = (np.concatenate([getattr(some, name)[kept], getattr(others, name)])[order] for name in names)
    return FaceSamples(*both)


def _hidden(
    position: np.ndarray, normal: np.ndarray, radius: np.ndarray, tracer: Tracer, workers: Workers
) -> np.ndarray:
    """Which points are inside of something solid or close under something, (n,) bool.

    Their normals meet the back of a surface, and so do three of four ways along the surface; or any surface lies close
    above.
    """
    hidden = np.zeros(len(position), bool)

    def look(chunk: slice, _: np.random.Generator) -> np.ndarray:
        at, up = position[chunk], normal[chunk]
        above = tracer.closest_hit(at, up)
        found = above.distance < _CLOSE * radius[chunk]
        k = np.flatnonzero(above.hit & above.back(up) & ~found)
        tangent, bitangent = (rows(axis, np.arange(len(k))) for axis in frame(rows(up, k)))
        n_backs = np.zeros(len(k), np.int8)
        for way in (tangent, -tangent, bitangent, -bitangent):
            beside = tracer.closest_hit(rows(at, k), way)
            n_backs += beside.hit & beside.back(way)
        found[k] = n_backs >= _MOST_BACKS
        return found

    for chunk, found in workers.chunks(STAGE, len(position), _CHUNK, look, ()):
        hidden[chunk] = found
    return hidden
