"""The charts of objects' meshes, ready to be packed."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import sqrt

import bpy
import numpy as np

from ...errors import BakeError
from ...progress import Progress
from .charts import Faces, chart_of_triangles, laid_flat
from .checks import overlapping
from .packing import Packed, Piece, PiecesAt, pack

ANGLES = (66.0, 45.0, 20.0)
"""Angles between a chart's faces and its plane, degrees: the next is taken for charts that would lie over themselves.
"""

_TEXELS_TO_LOOK = 1 << 16  # in which a mesh's charts are looked at for overlaps
_STAGE = "Unwrapping"


@dataclass
class Pieces:
    """What objects bring into images: the charts of a mesh, or where objects share one, its image as a whole.

    Attributes
    ----------
    objects : list of (object name, mesh name)
    of_mesh : dict of str to Piece
        Charts of each mesh, as large as on its largest object.
    """

    objects: list[tuple[str, str]]
    of_mesh: dict[str, Piece]
    _alone: dict[tuple[str, float], Packed] = field(default_factory=dict)

    @staticmethod
    def of(objects: "list[bpy.types.Object]", depsgraph: "bpy.types.Depsgraph", progress: Progress) -> "Pieces":
        """The pieces of objects."""
        owners: dict[str, list[np.ndarray]] = {}
        meshes = {obj.data.name: obj.data for obj in objects}
        for obj in objects:
            linear = np.array(obj.evaluated_get(depsgraph).matrix_world, np.float64)[:3, :3]
            owners.setdefault(obj.data.name, []).append(linear)
        of_mesh = {}
        for i, (name, matrices) in enumerate(owners.items()):
            progress.update(_STAGE, i / len(owners))
            largest = max(matrices, key=lambda matrix: abs(np.linalg.det(matrix)))
            of_mesh[name] = _unwrapped(Faces.of(meshes[name], largest), name)
        progress.update(_STAGE, 1)
        return Pieces([(obj.name, obj.data.name) for obj in objects], of_mesh)

    def is_shared(self, mesh: str) -> bool:
        """Whether several objects have the mesh."""
        return sum(of == mesh for _, of in self.objects) > 1

    def alone(self, mesh: str, density: float, ring: int) -> Packed:
        """The image of a mesh by itself."""
        key = (mesh, density)
        if key not in self._alone:
            packed = pack([self.of_mesh[mesh]], density, ring)
            if packed is None:
                raise BakeError(f"The charts of mesh '{mesh}' cannot be packed: choose a UV map of it.")
            self._alone[key] = packed
        return self._alone[key]

    def any_shared(self, chosen: Sequence[int]) -> bool:
        """Whether one of some objects has a mesh that others have too."""
        return any(self.is_shared(self.objects[i][1]) for i in chosen)

    def charts_of(self, mesh: str) -> PiecesAt:
        """The charts of one mesh."""
        return lambda _: [self.of_mesh[mesh]]

    def at(self, chosen: Sequence[int], ring: int, inner_density: float) -> PiecesAt:
        """Pieces of some objects; meshes that objects share are packed at `inner_density`, or the image's own if 0."""

        def pieces(density: float) -> list[Piece]:
            return [self._of_mesh(self.objects[i][1], ring, inner_density or density) for i in chosen]

        return pieces

    def _of_mesh(self, mesh: str, ring: int, density: float) -> Piece:
        if not self.is_shared(mesh) or not density:
            return self.of_mesh[mesh]
        alone = self.alone(mesh, density, ring)
        return Piece.rectangle(alone.width / density, alone.height / density)

    def split(self, chosen: Sequence[int]) -> list[list[int]]:
        """Two halves of some objects with about as much surface each."""
        areas = {i: self.of_mesh[self.objects[i][1]].area for i in chosen}
        halves: list[list[int]] = [[], []]
        for i in sorted(chosen, key=lambda i: (-areas[i], i)):
            min(halves, key=lambda half: sum(areas[j] for j in half)).append(i)
        return [sorted(half) for half in halves]


def _unwrapped(faces: Faces, name: str) -> Piece:
    """The charts of a mesh, of which none lies over itself: those that would are cut into smaller ones."""
    if not faces.area > 0:
        raise BakeError(f"The faces of mesh '{name}' have no area: give it some, or leave its objects out.")
    face_of_corner = faces.face_of_corner()
    face_of_triangle = face_of_corner[faces.triangles[:, 0]]
    uv = np.zeros((len(face_of_corner), 2), np.float32)
    chart = np.zeros(len(faces.triangles), np.int32)
    folded = np.ones(len(faces.n_corners), bool)
    for angle in ANGLES:
        part = faces.where(folded)
        flat = laid_flat(part, angle)
        of_part = chart_of_triangles(part, flat)
        uv[folded[face_of_corner]] = flat
        triangles = folded[face_of_triangle]
        chart[triangles] = of_part + chart.max() + 1
        folded[face_of_triangle[triangles]] = _overlaps_itself(part, flat, of_part)
        if not folded.any():
            break
    else:
        apart = folded[face_of_triangle]  # each face by itself
        chart[apart] = face_of_triangle[apart] + chart.max() + 1
    return Piece.of(uv, faces.triangles, chart)


def _overlaps_itself(faces: Faces, uv: np.ndarray, chart: np.ndarray) -> np.ndarray:
    """Whether the chart of each triangle (t,) lies over itself."""
    area = faces.area
    packed = pack([Piece.of(uv, faces.triangles, chart)], sqrt(_TEXELS_TO_LOOK / area), 1) if area > 0 else None
    if packed is None:
        return np.zeros(len(chart), bool)
    over = overlapping(packed.uv[0][faces.triangles], (packed.height, packed.width))
    return np.isin(chart, chart[over])
