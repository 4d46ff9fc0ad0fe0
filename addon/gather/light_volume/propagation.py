"""Light handed on from cell to cell (section 4.2): one iteration is one linear operator on the whole grid.

Cell S sends its intensity I = c · y(ω) through the face that it shares with a neighbour D. Every ray that comes
through leaves D by one of the other five faces f, whose solid angles from S's centre add up to the shared face's, so
nothing is lost or counted twice:

    Φ_f = ∫_Ω_f I dω = c · a_f,     a_f = ∫_Ω_f y(ω) dω                    (Eq. 6, with a_f exact)

From D's centre the flux goes on as a cosine lobe around the face's normal, Φ_f/π (ω·n_f)⁺, whose integral is Φ_f. For
the coefficients this is a 4 × 4 matrix for each of the six neighbours. By symmetry five numbers tell all of them: light
along the way and across it do not mix.

Grids have a layer of empty cells around them, which take light from nobody and send none.
"""

from functools import cache
from typing import NamedTuple

import numpy as np

from ...core.compiling import kernel, part
from ...core.sampling.spherical_harmonics import Y0, Y1, sh_cosine_lobe
from ...core.vec3 import ONE

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


class Transfer(NamedTuple):
    """What a cell's coefficients become in a neighbour: T₀₀; T₀ₐ, Tₐ₀ and Tₐₐ, a being the axis there; Tₜₜ across."""

    constant: np.float32
    constant_of_along: np.float32
    along_of_constant: np.float32
    along: np.float32
    across: np.float32


@cache
def transfer() -> Transfer:
    """Those of `transfer_matrices`."""
    towards_x = transfer_matrices()[0]
    return Transfer(towards_x[0, 0], towards_x[0, 1], towards_x[1, 0], towards_x[1, 1], towards_x[2, 2])


@part
def _cell(f, i, j, k):
    """A cell's coefficients."""
    return f[i, j, k, 0], f[i, j, k, 1], f[i, j, k, 2], f[i, j, k, 3]


@part
def _sent(t, towards, passes, constant, along, s, r):
    """What a cell sends to a neighbour, towards +1 or −1 along an axis, of its light along this axis and across it."""
    return (
        passes * (t.constant * constant + towards * t.constant_of_along * along),
        passes * (towards * t.along_of_constant * constant + t.along * along),
        passes * t.across * s,
        passes * t.across * r,
    )


@part
def gather_cell(t, f, g, i, j, k):
    """The coefficients that a cell gathers from its six neighbours (Eq. 6), of fields f and transmittance g (…, 3)."""
    c0, cx, cy, cz = _cell(f, i - 1, j, k)
    a0, ax, ay, az = _sent(t, ONE, g[i - 1, j, k, 0], c0, cx, cy, cz)
    c0, cx, cy, cz = _cell(f, i + 1, j, k)
    b0, bx, by, bz = _sent(t, -ONE, g[i, j, k, 0], c0, cx, cy, cz)
    c0, cx, cy, cz = _cell(f, i, j - 1, k)
    d0, dy, dz, dx = _sent(t, ONE, g[i, j - 1, k, 1], c0, cy, cz, cx)
    c0, cx, cy, cz = _cell(f, i, j + 1, k)
    e0, ey, ez, ex = _sent(t, -ONE, g[i, j, k, 1], c0, cy, cz, cx)
    c0, cx, cy, cz = _cell(f, i, j, k - 1)
    h0, hz, hx, hy = _sent(t, ONE, g[i, j, k - 1, 2], c0, cz, cx, cy)
    c0, cx, cy, cz = _cell(f, i, j, k + 1)
    l0, lz, lx, ly = _sent(t, -ONE, g[i, j, k, 2], c0, cz, cx, cy)
    return (
        a0 + b0 + d0 + e0 + h0 + l0,
        ax + bx + dx + ex + hx + lx,
        ay + by + dy + ey + hy + ly,
        az + bz + dz + ez + hz + lz,
    )


@kernel
def propagate(t, field, transmittance, received):
    """One iteration: each cell of the new field gathers what its six neighbours send.

    Parameters
    ----------
    t : Transfer
    field, received : (nx + 2, ny + 2, nz + 2, 4) float32
        Coefficients. Light that leaves the grid is gone.
    transmittance : (nx + 2, ny + 2, nz + 2, 3) float32
        G, the share of light that passes from each cell to the next along x, y and z.
    """
    nx, ny, nz, _ = field.shape
    for i in range(1, nx - 1):
        for j in range(1, ny - 1):
            for k in range(1, nz - 1):
                received[i, j, k, 0], received[i, j, k, 1], received[i, j, k, 2], received[i, j, k, 3] = gather_cell(
                    t, field, transmittance, i, j, k
                )


def padded(grid: np.ndarray) -> np.ndarray:
    """A grid (nx, ny, nz, c) with a layer of zeros around it."""
    return np.pad(grid, ((1, 1), (1, 1), (1, 1), (0, 0)))


def gathered(field: np.ndarray, transmittance: np.ndarray, n_iterations: int) -> np.ndarray:
    """A field (nx, ny, nz, 4) float32 and what its cells gather in all iterations.

    Parameters
    ----------
    transmittance : (nx + 2, ny + 2, nz + 2, 3) float32
        See `propagate`.
    """
    sent = padded(field)
    total, received = sent.copy(), np.zeros_like(sent)
    for _ in range(n_iterations):
        propagate(transfer(), sent, transmittance, received)
        total += received
        sent, received = received, sent
    return total[1:-1, 1:-1, 1:-1]
