"""Points and normals moved by Blender's matrices into the world."""

import numpy as np

from ...core.errors import BakeError

FARTHEST = 1e15
"""Surfaces this far out are no part of a scene, m: products of them would overflow float32."""

_ONE = np.zeros(1, np.int64)
"""The copy that all rows belong to where there is but one."""


def to_world(vertices: np.ndarray, matrix: np.ndarray, name: str) -> np.ndarray:
    """(v, 3) float32 positions moved by a (4, 4) matrix.

    Raises
    ------
    BakeError
        If one is not finite, or too far out.
    """
    positions = moved(vertices, matrix[None], _ONE)
    if not within_reach(positions).all():
        raise BakeError(
            f"Object '{name}' has vertices or a transform that are not finite (or beyond {FARTHEST:g} m): repair "
            "them, or hide it from renders."
        )
    return positions


def place_normals(normals: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """(n, 3) normals moved by a (4, 4) matrix, of unit length, float32; +z where one has no direction."""
    placed = unit(turned(normals, normal_matrices(matrix[None]), _ONE))
    return np.where(np.isnan(placed[:, :1]), np.array([0, 0, 1], np.float32), placed)


def normal_matrices(matrices: np.ndarray) -> np.ndarray:
    """The inverse transposes of (k, 4, 4) matrices' linear parts up to a positive factor, (k, 3, 3) float64.

    They are the matrices of cofactors, which exist even where an inverse does not, with 1 as the largest entry.
    """
    after, before = [1, 2, 0], [2, 0, 1]
    linear = matrices[:, :3, :3]
    a, b = linear[:, after], linear[:, before]
    with np.errstate(over="ignore", invalid="ignore"):
        cofactors = a[:, :, after] * b[:, :, before] - a[:, :, before] * b[:, :, after]
        determinant = np.einsum("ki,ki->k", linear[:, 0], cofactors[:, 0])
    largest = np.abs(cofactors).max(axis=(1, 2))
    scale = np.where(determinant < 0, -1.0, 1.0) / np.where(largest > 0, largest, 1.0)
    return cofactors * scale[:, None, None]


def turned(points: np.ndarray, matrices: np.ndarray, copy: np.ndarray) -> np.ndarray:
    """(n, 3) float32 points, each multiplied by the linear part of its copy's matrix, (3, n) float64."""
    x, y, z = np.ascontiguousarray(points.T, np.float64)
    rows = np.ascontiguousarray(matrices[:, :3, :3].transpose(1, 2, 0))
    with np.errstate(over="ignore", invalid="ignore"):
        return np.stack([x * a.take(copy) + y * b.take(copy) + z * c.take(copy) for a, b, c in rows])


def moved(points: np.ndarray, matrices: np.ndarray, copy: np.ndarray) -> np.ndarray:
    """(n, 3) float32 points, each moved by its copy's (4, 4) matrix, (n, 3) float32."""
    with np.errstate(over="ignore", invalid="ignore"):
        positions = turned(points, matrices, copy) + np.ascontiguousarray(matrices[:, :3, 3].T).take(copy, axis=1)
        return positions.T.astype(np.float32)


def unit(vectors: np.ndarray) -> np.ndarray:
    """(3, n) vectors at length 1, (n, 3) float32; NaN where one has no direction."""
    with np.errstate(over="ignore", invalid="ignore"):
        length = np.sqrt(np.einsum("in,in->n", vectors, vectors))
        length[~(length > 1e-12)] = np.nan
        return (vectors / length).T.astype(np.float32)


def within_reach(positions: np.ndarray) -> np.ndarray:
    """Which of (n, 3) positions are finite and not too far out, (n,) bool."""
    return (np.abs(positions) < FARTHEST).all(axis=1)  # not of NaN
