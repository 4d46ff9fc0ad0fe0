"""Light put into the volume's cells: that of photons, and the surfaces' response to known light (section 4.1)."""

import numpy as np

from ...parallel import Workers
from ...photons import Photons
from ...sampling.vectors import dot
from ...scene import Scene
from ...scene.surface_points import SurfacePoints, surface_points
from ...tracers import LightTracer
from ..sh_fields import ISOTROPIC, N_LIGHT, SCALE, photon_fields, random_signs
from .grid import Grid

OFFSET = np.float32(0.5)
"""Cells off its surface that light is put, along the normal: a wall has its cells on either side."""

_SIGNS = 61  # stream of random numbers
_CHUNK = 1 << 17  # photons
_POINTS_A_CELL = 32  # on a cell's length of surface squared


def inject_response(scene: Scene, tracer: LightTracer, grid: Grid, workers: Workers) -> tuple[np.ndarray, np.ndarray]:
    """What surfaces make of light.

    Surfaces take part as far as photons are stored on them, and if their cell's centre sees them: light of the next
    room, on the floor just beyond a wall that runs through the cell, has no place in it.

    Returns
    -------
    response : (4, 4, cells) float32, m²
        The first index is the column, the known radiance.
    cut : (cells,) bool
        Whether there are surfaces in the cell that take no part.
    """
    materials = scene.materials
    holds_photons = materials.spreads_light[scene.material_of_triangle]
    a, b = np.triu_indices(4)
    products = np.zeros((len(a), grid.n_cells + 1))  # ν_a ν_b dA
    cut = np.zeros(grid.n_cells + 1, bool)

    def inject(points: SurfacePoints) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
        points = points.where(np.flatnonzero(holds_photons[points.triangle]))
        area = np.full(len(points.triangle), points.area, np.float32)
        if materials.see_through.any():
            place = scene.barycentrics(points.triangle, points.position)
            area *= scene.look_up(materials.coverage, points.triangle, *place)[:, 0]
        sides = []
        for normals in (scene.normals[points.triangle], -scene.normals[points.triangle]):
            cells, centres = _cells_in_front(grid, points.position, normals)
            ways = points.position - centres
            hits = tracer.surfaces.closest_hit(centres, ways / np.sqrt(dot(ways, ways))[:, None])
            seen = (hits.triangle == points.triangle) & ~tracer.smothered(hits.triangle, hits.u, hits.v)
            nu = np.concatenate([np.ones((1, int(seen.sum())), np.float32), normals[seen].T])
            sides.append((cells[seen], area[seen] * nu[a] * nu[b], cells[~seen]))
        return sides

    workers.progress.update("Measuring surfaces", 0.0)
    for sides in workers.map(inject, surface_points(scene, grid.box, grid.length / np.sqrt(_POINTS_A_CELL))):
        for cells, values, unseen in sides:
            _add(products, cells, values)
            cut[unseen] = True
        workers.progress.update("Measuring surfaces", 0.0)
    response = np.empty((4, 4, grid.n_cells), np.float32)
    response[a, b] = response[b, a] = SCALE[a, b, None] * products[:, :-1]
    response += ISOTROPIC[:, :, None] * products[0, :-1].astype(np.float32)
    return response, cut[:-1]


def inject_photons(
    scene: Scene, tracer: LightTracer, grid: Grid, photons: Photons, cut: np.ndarray, workers: Workers
) -> np.ndarray:
    """The photons' fields: (N_LIGHT, 4, cells) float32, W; the signed ones of their power's mean over colours."""
    fields = np.zeros((N_LIGHT * 4, grid.n_cells + 1))
    signs = random_signs(photons, workers.seed, _SIGNS)
    doubtful = np.append(cut, False)

    def inject(chunk: slice, _: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        part = photons.where(chunk)
        normals = part.normal
        cells, centres = _cells_in_front(grid, part.position, normals)
        k = np.flatnonzero(doubtful[cells])
        lifted = part.position[k] + scene.ray_offset(part.position[k]) * normals[k]
        cells[k[tracer.surfaces.occluded(centres[k], lifted)]] = grid.n_cells
        return cells, photon_fields(part, signs)

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
