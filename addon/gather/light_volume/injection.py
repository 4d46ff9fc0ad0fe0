"""Light put into the volume's cells: that of photons, and that of known light on the same surfaces (section 4.1).

A photon adds its power Φ, from the direction −Θ that it came from, to the cell in front of the surface that it hit:

    c = Σ Φ y(−Θ)                                                          (Eq. 5)

Equation 4's factor A C₀²/(4N) stands for the area that a photon lights, and drops n's cosine into its power. Here
nothing is estimated: if the radiance in front of the cell's surfaces is L · y(ω), the photons' sum is expected to be

    c = ∫ dA ∫ (ω·n)⁺ (L · y(ω)) y(ω) dω = R L,        R = ∫ r(n) dA,     r(n) = ∫ (ω·n)⁺ y(ω) y(ω)ᵀ dω,

with R, the *response*, known from the surfaces alone. R is injected beside c as four fields (its columns are what four
known radiances would give). What is linear is done to both, and L = R⁻¹ c has its absolute level whatever that was.
"""

import numpy as np

from ...parallel import Workers
from ...photons import Photons
from ...sampling.spherical_harmonics import sh_basis
from ...sampling.streams import stream
from ...sampling.vectors import dot
from ...scene import Scene
from ...scene.surface_points import SurfacePoints, surface_points
from ...tracers import LightTracer
from .grid import Grid

N_SIGNS = 2
"""Fields whose photons have random signs: what they read is noise, and as large as that of the light."""

N_LIGHT = 3 + N_SIGNS
N_FIELDS = N_LIGHT + 4
"""Red, green, blue; the signed fields; the response's columns."""

OFFSET = np.float32(0.5)
"""Cells off its surface that light is put, along the normal: a wall has its cells on either side."""

_SIGNS = 61  # stream of random numbers
_CHUNK = 1 << 17  # photons
_POINTS_A_CELL = 32  # a cell's length of surface squared

# r(n) of ν = (1, n): r_ab = SCALE_ab ν_a ν_b, and 3/16 more on the diagonal of the linear band
SCALE = np.full((4, 4), 3 / 16, np.float32)
SCALE[0, :] = SCALE[:, 0] = 1 / (2 * np.sqrt(3))
SCALE[0, 0] = 1 / 4
_ISOTROPIC = np.diag(np.array([0, 3 / 16, 3 / 16, 3 / 16], np.float32))


def sh_response(normals: np.ndarray) -> np.ndarray:
    """r(n) = ∫ (ω·n)⁺ y(ω) y(ω)ᵀ dω of unit normals (n, 3): (n, 4, 4) float32."""
    nu = np.concatenate([np.ones((len(normals), 1), np.float32), normals], axis=1)
    return SCALE * nu[:, :, None] * nu[:, None, :] + _ISOTROPIC


def inject_response(scene: Scene, tracer: LightTracer, grid: Grid, workers: Workers) -> tuple[np.ndarray, np.ndarray]:
    """What surfaces make of light.

    Surfaces take part if their cell's centre sees them: light of the next room, on the floor just beyond a wall that
    runs through the cell, has no place in it.

    Returns
    -------
    response : (4, 4, cells) float32, m²
        The first index is the column, the known radiance.
    cut : (cells,) bool
        Whether there are surfaces in the cell that take no part.
    """
    a, b = np.triu_indices(4)
    products = np.zeros((len(a), grid.n_cells + 1))  # ν_a ν_b dA
    cut = np.zeros(grid.n_cells + 1, bool)

    def inject(points: SurfacePoints) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
        sides = []
        for normals in (scene.normals[points.triangle], -scene.normals[points.triangle]):
            cells, centres = _cells_in_front(grid, points.position, normals)
            ways = points.position - centres
            hits = tracer.surfaces.closest_hit(centres, ways / np.sqrt(dot(ways, ways))[:, None])
            seen = (hits.triangle == points.triangle) & ~tracer.smothered(hits.triangle, hits.u, hits.v)
            nu = np.concatenate([np.ones((1, int(seen.sum())), np.float32), normals[seen].T])
            sides.append((cells[seen], points.area * nu[a] * nu[b], cells[~seen]))
        return sides

    for sides in workers.map(inject, surface_points(scene, grid.box, grid.length / np.sqrt(_POINTS_A_CELL))):
        for cells, values, unseen in sides:
            _add(products, cells, values)
            cut[unseen] = True
        workers.progress.update("Measuring surfaces", 0.0)
    response = np.empty((4, 4, grid.n_cells), np.float32)
    response[a, b] = response[b, a] = SCALE[a, b, None] * products[:, :-1]
    response += _ISOTROPIC[:, :, None] * products[0, :-1].astype(np.float32)
    return response, cut[:-1]


def inject_photons(
    scene: Scene, tracer: LightTracer, grid: Grid, photons: Photons, cut: np.ndarray, workers: Workers
) -> np.ndarray:
    """The photons' fields: (N_LIGHT, 4, cells) float32, W; the signed ones of their power's mean over colours."""
    fields = np.zeros((N_LIGHT * 4, grid.n_cells + 1))
    n_paths = int(photons.path.max(initial=-1)) + 1
    signs = stream(workers.seed, _SIGNS).choice(np.array([-1, 1], np.int8), (n_paths, N_SIGNS))
    doubtful = np.append(cut, False)

    def inject(chunk: slice, _: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        part = photons.where(chunk)
        normals = part.normal
        cells, centres = _cells_in_front(grid, part.position, normals)
        k = np.flatnonzero(doubtful[cells])
        lifted = part.position[k] + scene.ray_offset(part.position[k]) * normals[k]
        cells[k[tracer.surfaces.occluded(centres[k], lifted)]] = grid.n_cells
        y = sh_basis(-part.direction)
        power = np.concatenate([part.power, part.power.mean(axis=1, keepdims=True) * signs[part.path]], axis=1)
        return cells, power.T[:, None] * y.T

    for _, (cells, values) in workers.chunks("Filling the volume", len(photons), _CHUNK, inject, (_SIGNS,)):
        _add(fields, cells, values)
    return fields[:, :-1].reshape(N_LIGHT, 4, -1).astype(np.float32)


def _cells_in_front(grid: Grid, positions: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The cells half a cell off surfaces, (n,), and their centres (n, 3); `n_cells` outside the grid."""
    cells = grid.cells(positions + OFFSET * np.float32(grid.length) * normals)
    return cells, grid.centres(np.minimum(cells, grid.n_cells - 1))


def _add(fields: np.ndarray, cells: np.ndarray, values: np.ndarray) -> None:
    """Add values (…, n) to the cells of fields (f, cells)."""
    for field, value in zip(fields, values.reshape(len(fields), -1), strict=True):
        field += np.bincount(cells, value, minlength=len(field))
