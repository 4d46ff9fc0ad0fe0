"""Texture coordinates that give every face of a mesh a place of its own in a square image.

Faces get square cells whose sides are powers of two of texels, larger ones to larger faces; laid along the Z-curve from
the largest to the smallest they leave no gaps. A face fills its cell: look-ups take the nearest texel, so no margin is
needed between cells beyond what rounding asks for.
"""

from dataclasses import dataclass
from math import ceil, log2

import bpy
import numpy as np

from ...core.ranges import repeat_ranges
from ..read.meshes.meshes import attribute, face_sizes

TEXEL = 0.02
"""Side that a texel should have in the world, m: light that has bounced is blurred far more."""

MIN_SIDE, MAX_SIDE, MAX_SIDE_OF_DENSE = 128, 1024, 2048
"""Sides of the image in texels; the last is for meshes that would not have two by two texels a face otherwise."""

INSET = 0.05
"""How far a face stays off the border of its cell, texels."""


@dataclass(frozen=True)
class Atlas:
    """Places of a mesh's faces.

    Attributes
    ----------
    uvs : (c, 2) float32
        Texture coordinates of the mesh's corners; −1 at faces that have no place.
    side : int
        Of the image, texels.
    """

    uvs: np.ndarray
    side: int


def make_atlas(mesh: "bpy.types.Mesh", chosen: np.ndarray, matrix: np.ndarray) -> Atlas | None:
    """An atlas of some faces of a mesh.

    Parameters
    ----------
    mesh : bpy.types.Mesh
    chosen : (f,) bool
        Which of its faces get a place.
    matrix : (4, 4) float64
        Local to world.

    Returns
    -------
    Atlas or None
        None if there are more faces than texels, or none.
    """
    start, n_corners = np.empty(len(mesh.polygons), np.int32), face_sizes(mesh)
    mesh.polygons.foreach_get("loop_start", start)
    start, n_corners = start[chosen], n_corners[chosen]
    if not len(start):
        return None
    areas = _areas(mesh, start, n_corners, matrix)
    side = _side(len(start), float(areas.sum()))
    levels = _levels(areas, int(log2(side)))
    if levels is None:
        return None
    face, corner = repeat_ranges(n_corners)
    texels = 2.0 ** levels[face, None]
    place = _cells(levels)[face] + INSET + _shape(corner, n_corners[face]) * (texels - 2 * INSET)
    uvs = np.full((len(mesh.loops), 2), -1, np.float32)
    uvs[start[face] + corner] = place / side
    return Atlas(uvs, side)


def _areas(mesh: "bpy.types.Mesh", start: np.ndarray, n_corners: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """Areas of faces in the world, by the triangles around their first corner, (f,) m²."""
    vertex = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", vertex)
    positions = attribute(mesh, "position", "vector", (len(mesh.vertices), 3), np.float32) @ matrix[:3, :3].T
    face, triangle = repeat_ranges(n_corners - 2)
    first, second = start[face], start[face] + triangle + 1
    a, b, c = (positions[vertex[corner]] for corner in (first, second, second + 1))
    doubled = np.bincount(face, np.linalg.norm(np.cross(b - a, c - a), axis=1), len(start))
    return np.nan_to_num(doubled / 2, posinf=0.0)


def _side(n_faces: int, area: float) -> int:
    """Side of the image, a power of two of texels."""
    wanted = max(area**0.5 / TEXEL, 2 * n_faces**0.5, 1.0)
    side = 2 ** ceil(log2(min(wanted, MAX_SIDE_OF_DENSE)))
    return int(np.clip(side, MIN_SIDE, MAX_SIDE_OF_DENSE if 4 * n_faces > MAX_SIDE**2 else MAX_SIDE))


def _levels(areas: np.ndarray, top: int) -> np.ndarray | None:
    """Logarithm to base 2 of the side of each face's cell in an image of 2^top texels, or None where none fit."""
    lowest = 1 if 4 * len(areas) <= 4**top else 0
    if len(areas) > 4**top:
        return None
    share = areas / areas.sum() if areas.sum() > 0 else np.full(len(areas), 1 / len(areas))
    wanted = np.log2(np.maximum(share, 1e-30)) / 2 + top
    for bonus in np.arange(1, -2 * top - 2, -0.25):  # from too large for all to fit
        levels = np.clip(np.floor(wanted + bonus), lowest, top).astype(np.int64)
        if (4**levels).sum() <= 4**top:
            return levels
    return np.full(len(areas), lowest)


def _cells(levels: np.ndarray) -> np.ndarray:
    """Lowest corners of the faces' cells, (f, 2) texels."""
    order = np.argsort(-levels, kind="stable")
    code = np.empty(len(levels), np.int64)
    code[order] = np.cumsum(4 ** levels[order]) - 4 ** levels[order]
    place = np.zeros((len(levels), 2))
    for bit in range(16):
        place[:, 0] += ((code >> (2 * bit)) & 1) << bit
        place[:, 1] += ((code >> (2 * bit + 1)) & 1) << bit
    return place


def _shape(corner: np.ndarray, n_corners: np.ndarray) -> np.ndarray:
    """Corners of faces in the unit square, (c, 2): a square, a triangle, or others on a circle."""
    angle = (corner + 0.5) / n_corners * 2 * np.pi
    radius = np.where(n_corners == 4, 0.5**0.5, 0.5)
    round_ = 0.5 + radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    triangle = np.array([(0, 0), (1, 0), (0.5, 1)])[np.minimum(corner, 2)]
    return np.where(n_corners[:, None] == 3, triangle, round_)
