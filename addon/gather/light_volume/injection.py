"""Light put into the volume's cells: that of photons, and the surfaces' response to known light (section 4.1)."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, fields

import numpy as np

from ...core.compiling import kernel, kernel_array
from ...core.parallel import Workers
from ...core.sampling.vectors import dot
from ...core.vec3 import along, put, row
from ...photons import Photons
from ...scene import Scene
from ...scene.surface_points import SurfacePoints, surface_points
from ...tracing import TransparencyTracer
from ..direct.ray_directions import gather_directions
from ..rays.gather_rays import GatherRays
from ..screen_volume.sh_fields import N_LIGHT, N_SIGNS, inject_light, inject_response, random_signs
from .grid import Grid, cell_of, centre_of

OFFSET = np.float32(0.5)
"""Cells off its surface that light is put, along the normal: a wall has its cells on either side."""

_SIGNS, _GATHERING = 61, 64  # streams of random numbers
_CHUNK = 1 << 17  # photons
_RAYS = 1 << 16  # in a chunk


@dataclass(frozen=True)
class Sides:
    """k points of surfaces, each with one of its sides, and the cells that they put light into.

    Attributes
    ----------
    position, normal : (k, 3) float32, m
    triangle : (k,) int32
    area : (k,) float32, m²
        What each stands for, as far as photons are stored there.
    cell : (k,) int32
    unseen : (u,) int32
        Cells of other points, which take no part; −1 outside the grid.
    """

    position: np.ndarray
    normal: np.ndarray
    triangle: np.ndarray
    area: np.ndarray
    cell: np.ndarray
    unseen: np.ndarray

    @staticmethod
    def none() -> "Sides":
        """No points."""
        vectors, numbers = np.zeros((0, 3), np.float32), np.zeros(0, np.int32)
        return Sides(vectors, vectors, numbers, vectors[:, 0], numbers, numbers)

    @staticmethod
    def join(parts: "list[Sides]") -> "Sides":
        """All sides of several `Sides`, in order."""
        names = [field.name for field in fields(Sides)]
        return Sides(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in names})


def lit_sides(
    scene: Scene, tracer: TransparencyTracer, grid: Grid, n_points_a_cell: int, workers: Workers
) -> Iterator[Sides]:
    """Yield both sides of points spread over the surfaces, so many on a cell's length squared.

    They take part if their cell's centre sees them: light of the next room, on the floor just beyond a wall that runs
    through the cell, has no place in it.
    """
    materials = scene.materials
    holds_photons = materials.spreads_light[scene.material_of_triangle]

    def look(points: SurfacePoints) -> Sides:
        points = points.where(np.flatnonzero(holds_photons[points.triangle]))
        area = np.full((2, len(points.triangle)), points.area, np.float32)
        if materials.see_through.any():
            place = scene.barycentrics(points.triangle, points.position)
            for side in (0, 1):
                back = np.full(len(points.triangle), side == 1)
                area[side] *= scene.look_up(materials.coverage, points.triangle, *place, back)[:, 0]
        front = scene.normals[points.triangle]
        position, normal = np.tile(points.position, (2, 1)), np.concatenate([front, -front])
        cell, centres = _cells_in_front(grid, position, normal)
        ways = position - centres
        hits = tracer.surfaces.closest_hit(centres, ways / np.sqrt(dot(ways, ways))[:, None])
        seen = (hits.triangle == np.tile(points.triangle, 2)) & ~tracer.coplanar_occluded(hits.triangle, hits.u, hits.v)
        seen &= cell >= 0
        return Sides(position[seen], normal[seen], hits.triangle[seen], area.ravel()[seen], cell[seen], cell[~seen])

    workers.progress.update("Measuring surfaces", 0.0)
    for sides in workers.map(look, surface_points(scene, grid.box, grid.length / np.sqrt(n_points_a_cell))):
        yield sides
        workers.progress.update("Measuring surfaces", 0.0)


def response_of(grid: Grid, parts: Iterable[Sides]) -> tuple[np.ndarray, np.ndarray]:
    """What surfaces make of light.

    Returns
    -------
    response : (cells, 4, 4) float32, m²
        Of each cell and known radiance, the column.
    cut : (cells,) bool
        Whether there are surfaces in the cell that take no part.
    """
    response, cut = np.zeros((grid.n_cells, 4, 4)), np.zeros(grid.n_cells + 1, bool)
    for sides in parts:
        inject_response(response, sides.cell, sides.normal, sides.area)
        cut[sides.unseen] = True
    return response.astype(np.float32), cut[:-1]


def light_of_photons(
    scene: Scene, tracer: TransparencyTracer, grid: Grid, photons: Photons, cut: np.ndarray, workers: Workers
) -> np.ndarray:
    """The photons' fields, (cells, N_LIGHT, 4) float32, W."""
    fields = np.zeros((grid.n_cells, N_LIGHT, 4))
    signs = random_signs(photons, workers.seed, _SIGNS)
    doubtful = np.append(cut, False)

    def place(chunk: slice, _: np.random.Generator) -> tuple[np.ndarray, ...]:
        part = photons.where(chunk)
        normals = part.normal
        cells, centres = _cells_in_front(grid, part.position, normals)
        k = np.flatnonzero(doubtful[cells])
        lifted = part.position[k] + scene.ray_offset(part.triangle[k], part.position[k]) * normals[k]
        cells[k[tracer.surfaces.occluded(centres[k], lifted)]] = -1
        return cells, part.power, -part.direction, signs[part.path]

    for _, light in workers.chunks("Filling the volume", len(photons), _CHUNK, place, (_SIGNS,)):
        inject_light(fields, *light)
    return fields.astype(np.float32)


def light_of_rays(
    scene: Scene, rays: GatherRays, grid: Grid, sides: Sides, n_rays: int, workers: Workers
) -> np.ndarray:
    """Fields of what rays from the sides gather, as of photons that came the rays' way: (cells, N_LIGHT, 4) float32, W.

    The irradiance of a side is π times the mean of its rays' radiance, so each of n brings π L A/n.
    """
    fields = np.zeros((grid.n_cells, N_LIGHT, 4))
    origin = sides.position + scene.ray_offset(sides.triangle, sides.position) * sides.normal

    def gather(chunk: slice, random: np.random.Generator) -> tuple[np.ndarray, ...]:
        origins, normals, area = (np.repeat(of[chunk], n_rays, axis=0) for of in (origin, sides.normal, sides.area))
        directions = gather_directions(normals, n_rays, random)
        radiance = rays.radiance_along(origins, directions, random).reflected
        power = radiance * (np.float32(np.pi / n_rays) * area)[:, None]
        signs = random.choice(np.array([-1, 1], np.int8), (len(power), N_SIGNS))
        return np.repeat(sides.cell[chunk], n_rays), power, directions, signs

    size = max(1, _RAYS // n_rays)
    for _, light in workers.chunks("Filling the volume", len(origin), size, gather, (_GATHERING,)):
        inject_light(fields, *light)
    return fields.astype(np.float32)


def _cells_in_front(grid: Grid, positions: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The cells half a cell off surfaces, (n,) int32, −1 outside the grid, and their centres, (n, 3) float32."""
    cells, centres = np.empty(len(positions), np.int32), np.empty((len(positions), 3), np.float32)
    positions, normals = (kernel_array(a, np.float32) for a in (positions, normals))
    _find_cells(grid.arrays, positions, normals, cells, centres)
    return cells, centres


@kernel
def _find_cells(grid, positions, normals, cells, centres):
    """See `_cells_in_front`."""
    for k in range(len(cells)):
        cells[k] = cell_of(grid, along(row(positions, k), OFFSET * grid.length, row(normals, k)))
        put(centres, k, centre_of(grid, max(cells[k], 0)))
