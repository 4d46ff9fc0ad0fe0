"""Light handed on from cell to cell (section 4.2): one iteration is one linear operator on the whole grid.

Cell S sends its intensity I = c · y(ω) through the face that it shares with a neighbour D. Every ray that comes
through leaves D by one of the other five faces f, whose solid angles from S's centre add up to the shared face's, so
nothing is lost or counted twice:

    Φ_f = ∫_Ω_f I dω = c · a_f,     a_f = ∫_Ω_f y(ω) dω                    (Eq. 6, with a_f exact)

From D's centre the flux goes on as a cosine lobe around the face's normal, Φ_f/π (ω·n_f)⁺, whose integral is Φ_f. For
the coefficients this is a 4 × 4 matrix for each of the six neighbours.
"""

from functools import cache

import numpy as np

from ...core.sampling.spherical_harmonics import Y0, Y1, sh_cosine_lobe

DIRECTIONS = np.concatenate([np.eye(3), -np.eye(3)]).astype(np.float32)
"""From a cell to its six neighbours."""


def face_moments(corners: np.ndarray) -> np.ndarray:
    """(∫dω, ∫ω dω) over the solid angle of a flat polygon seen from the origin, (4,) float64.

    The solid angle by Oosterom and Strackee's formula, triangle by triangle; the vector by Lambert's, ½ Σ γ n over the
    edges, with γ the angle that an edge is seen under and n the unit normal of its plane through the origin.

    Parameters
    ----------
    corners : (k, 3) float64
        Counterclockwise as seen from the origin.
    """
    unit = corners / np.linalg.norm(corners, axis=1, keepdims=True)
    a, b, c = unit[0], unit[1:-1], unit[2:]
    triple = np.cross(b, c) @ a
    solid_angle = 2 * np.arctan2(triple, 1 + b @ a + c @ a + np.einsum("ij,ij->i", b, c)).sum()
    following = np.roll(unit, -1, axis=0)
    normals = np.cross(unit, following)
    length = np.linalg.norm(normals, axis=1)
    angle = np.arctan2(length, np.einsum("ij,ij->i", unit, following))
    return np.array([solid_angle, *(0.5 * (angle / length) @ normals)])


def _faces(direction: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Normals (5, 3) and corners (5, 4, 3) of the neighbour's faces that light from a unit cell's centre leaves by."""
    normals = DIRECTIONS[DIRECTIONS @ direction >= 0].astype(np.float64)
    corners = []
    for normal in normals:
        s = np.roll(np.abs(normal), 1)
        t = np.cross(normal, s)
        corners.append([direction + (normal + i * s + j * t) / 2 for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
    return normals, np.array(corners)


@cache
def transfer_matrices() -> np.ndarray:
    """T of each direction: what a cell's coefficients become in the neighbour there, (6, 4, 4) float32."""
    matrices = []
    for direction in DIRECTIONS:
        normals, corners = _faces(direction)
        a = np.stack([face_moments(face) for face in corners]) * [Y0, Y1, Y1, Y1]
        matrices.append(sh_cosine_lobe(normals.astype(np.float32)).astype(np.float64).T @ a / np.pi)
    return np.round(np.stack(matrices), 12).astype(np.float32)  # what is 0 by symmetry has to be


def propagate(field: np.ndarray, transmittance: np.ndarray) -> np.ndarray:
    """One iteration: each cell of the new field gathers what its six neighbours send.

    Parameters
    ----------
    field : (4, nx, ny, nz) float32
        Coefficients.
    transmittance : (3, nx, ny, nz) float32
        G, the share of light that passes from each cell to the next along x, y and z.

    Returns
    -------
    (4, nx, ny, nz) float32
        Light that leaves the grid is gone.
    """
    received = np.zeros_like(field)
    for matrix, direction in zip(transfer_matrices(), DIRECTIONS, strict=True):
        sent = _transferred(matrix, field)
        axis = int(np.abs(direction).argmax())
        lower, upper = _neighbours(axis)
        source, target = (lower, upper) if direction[axis] > 0 else (upper, lower)
        passed = sent[source]
        passed *= transmittance[axis][lower[1:]]
        received[target] += passed
    return received


def _transferred(matrix: np.ndarray, field: np.ndarray) -> np.ndarray:
    """The matrix times each cell's coefficients. Half of it is 0, and BLAS would have its threads fight with ours."""
    sent = np.zeros_like(field)
    for i, j in np.argwhere(matrix):
        sent[i] += matrix[i, j] * field[j]
    return sent


def _neighbours(axis: int) -> tuple[tuple[slice, ...], tuple[slice, ...]]:
    """Indices of all cells but the last along an axis, and of all but the first."""
    lower, upper = [slice(None)] * 4, [slice(None)] * 4
    lower[1 + axis], upper[1 + axis] = slice(None, -1), slice(1, None)
    return tuple(lower), tuple(upper)
