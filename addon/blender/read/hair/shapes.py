"""Hair and points as sources of triangles, which are made when they are placed."""

from dataclasses import dataclass
from functools import cached_property
from hashlib import blake2b

import bpy
import numpy as np

from ....scene.fibres.balls import MOST_POINTS, SMOOTH, Balls
from ....scene.fibres.strands import MOST_STRANDS, ROUND, Strands, Tubes, thinned
from ...warn import Warnings
from ..materials.pictures.strands import ON_STRANDS
from ..meshes.meshes import LocalMesh
from ..meshes.object_values import Reading, Values
from .curves import read_curves
from .particles import read_particles

POINT_RADIUS = 0.01
"""Cycles' radius of points that have no attribute of that name, m."""


class VertexUVs:
    """Texture coordinates of strands or points, in the place of a mesh's `UVMaps`; corners are vertices here."""

    def __init__(self, shape: Tubes | Balls, owner_of_vertex: np.ndarray) -> None:
        self._shape, self._owner = shape, owner_of_vertex
        self._maps = shape.rings.uvs if isinstance(shape, Tubes) else {}

    def corners(self, name: str) -> np.ndarray:
        """Texture coordinates of the vertices, (v, 2) float32; zero where there is no such map."""
        if name == ON_STRANDS and isinstance(self._shape, Tubes):
            along = np.repeat(self._shape.along, self._shape.sides)
            return np.stack([self._shape.rings.random[self._owner], along], axis=1)
        if name not in self._maps:
            return np.zeros((len(self._owner), 2), np.float32)
        return self._maps[name][self._owner]


@dataclass(frozen=True, eq=False)
class Fibres:
    """What stands for hair or points.

    Attributes
    ----------
    shape : Tubes or Balls
    """

    shape: Tubes | Balls

    @property
    def n_vertices(self) -> int:
        return self.shape.n_vertices

    @property
    def n_triangles(self) -> int:
        return self.shape.n_triangles

    def digest(self) -> bytes:
        """Of which vertices the triangles have."""
        digest = blake2b(str(self.n_vertices).encode(), digest_size=16)
        if isinstance(self.shape, Tubes):
            digest.update(f"{self.shape.sides} {self.shape.closed}".encode() + self.shape.rings.start.tobytes())
        return digest.digest()

    @property
    def is_smooth(self) -> bool:
        """Whether normals are those of round things, and not of the triangles."""
        return self.shape.sides >= ROUND if isinstance(self.shape, Tubes) else self.shape.cuts >= SMOOTH

    @cached_property
    def _owner_of_vertex(self) -> np.ndarray:
        if isinstance(self.shape, Tubes):
            return self.shape.strand_of_vertex
        return np.zeros(self.n_vertices, np.int64)

    def values(self, of_object: Values) -> Values:
        """What nodes read of the object, and of its strands, which are taken for alike."""
        known = {}
        if isinstance(self.shape, Tubes):
            length, thickness = self.shape.rings.mean_size()
            known = {"Is Strand": 1.0, "Length": length, "Thickness": thickness}

        def value(reading: Reading) -> np.ndarray | None:
            if reading.of != "HAIR":
                return of_object(reading)
            return np.full(4, known.get(reading.name, 0.0), np.float32)

        return value

    def directions(self) -> np.ndarray:
        """Unit vectors along the strands at the triangles' corners, (t, 3, 3) float32; upward on points."""
        if isinstance(self.shape, Balls):
            return np.broadcast_to(np.array([0, 0, 1], np.float32), (self.n_triangles, 3, 3))
        return self.shape.directions().take(self.shape.triangles(), 0)

    def read(self) -> LocalMesh:
        """Their triangles."""
        outward, triangles = self.shape.outward(), self.shape.triangles()
        # The last has no direction: there the triangles' own are taken
        normals, of_corner = np.append(outward, np.zeros((1, 3), np.float32), axis=0), triangles.copy()
        n_smooth = 0 if not self.is_smooth else self.shape.n_around if isinstance(self.shape, Tubes) else len(triangles)
        of_corner[n_smooth:] = len(outward)
        uvs = VertexUVs(self.shape, self._owner_of_vertex)
        slots = np.zeros(len(triangles), np.int32)
        return LocalMesh(self.shape.vertices(outward), triangles, normals, of_corner, triangles, slots, uvs)


def fibres_of_curves(curves: "bpy.types.Curves", name: str, warn: Warnings, drawn: str) -> Fibres | None:
    """Hair curves; None where there are none. `drawn` is the shape that Cycles gives them."""
    return _fibres(*read_curves(curves), name, drawn, warn)


def fibres_of_particles(
    obj: "bpy.types.Object",
    modifier: "bpy.types.ParticleSystemModifier",
    for_render: bool,
    drawn: str,
    warn: Warnings,
) -> Fibres | None:
    """Hair of a particle system; None where there is none."""
    return _fibres(*read_particles(obj, modifier, for_render), obj.name, drawn, warn)


def _fibres(strands: Strands, n: int, name: str, drawn: str, warn: Warnings) -> Fibres | None:
    if not (np.isfinite(strands.positions).all() and np.isfinite(strands.radii).all()):
        warn.add(f"Object '{name}' has hair that is not finite: those strands are left out.")
    strands = strands.whole()
    if not len(strands):
        return None
    if n > MOST_STRANDS:
        warn.add(
            f"Object '{name}' has {n:,} strands, of which {MOST_STRANDS:,} are baked, as much thicker as stand for "
            "the others."
        )
    return Fibres(Tubes.of(strands, straight=drawn == "THICK_LINEAR", closed=drawn != "RIBBONS"))


def fibres_of_points(points: "bpy.types.PointCloud", name: str, warn: Warnings) -> Fibres | None:
    """A point cloud; None where there is nothing of a size."""
    at, size = points.attributes.get("position"), points.attributes.get("radius")
    n = len(at.data) if at is not None else 0
    if at is None or not n:
        return None
    positions, radii = np.empty((n, 3), np.float32), np.full(n, POINT_RADIUS, np.float32)
    at.data.foreach_get("vector", positions.ravel())
    if size is not None and size.data_type == "FLOAT":
        size.data.foreach_get("value", radii)
    if not (np.isfinite(positions).all() and np.isfinite(radii).all()):
        warn.add(f"Object '{name}' has points that are not finite: those are left out.")
    chosen = thinned(n, MOST_POINTS)
    if len(chosen) < n:
        warn.add(
            f"Object '{name}' has {n:,} points, of which {len(chosen):,} are baked, as much larger as stand for the "
            "others."
        )
    balls = Balls.of(positions[chosen], radii[chosen] * np.float32((n / len(chosen)) ** 0.5))
    return Fibres(balls) if len(balls) else None
