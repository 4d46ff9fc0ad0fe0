"""The light-gathering volume: built of photons and surfaces, read at points."""

from dataclasses import dataclass
from functools import partial

import numpy as np

from ...core.compiling import kernel, kernel_array, part
from ...core.parallel import Workers
from ...core.vec3 import ONE, ZERO, along, dot, minus, put, row
from ...photons import Photons
from ...scene import Scene
from ...tracing import Tracer, TransparencyTracer
from ..rays.gather_rays import GatherRays
from ..screen_volume.sh_fields import N_FIELDS, N_LIGHT, solve_cell
from .grid import Grid, cell_at, centre_at, in_cells
from .injection import OFFSET, Sides, light_of_photons, light_of_rays, lit_sides, response_of
from .occlusion import transmittance
from .propagation import gathered, padded

_HALF = np.float32(0.5)
_POINTS_A_CELL = 32  # on a cell's length of surface squared, where photons fall anywhere


@dataclass(frozen=True)
class LightVolume:
    """Radiance in two bands of spherical harmonics, all over a grid.

    Attributes
    ----------
    grid : Grid
    fields : (cells, N_FIELDS, 4) float32
        Light (W) and the columns of its response (m²), of every cell.
    tracer : Tracer
        Says what a point sees of the cells.
    """

    grid: Grid
    fields: np.ndarray
    tracer: Tracer

    @staticmethod
    def of_photons(
        scene: Scene, tracer: TransparencyTracer, photons: Photons, grid: Grid, n_iterations: int, workers: Workers
    ) -> "LightVolume":
        """A volume filled with photons.

        Parameters
        ----------
        photons : Photons
            Those whose light is wanted.
        n_iterations : int
            How many cells far light is gathered; section 4.2 takes a quarter of the grid's longest side.
        """
        sides = lit_sides(scene, tracer, grid, _POINTS_A_CELL, workers)
        response, cut = response_of(grid, sides)
        light = light_of_photons(scene, tracer, grid, photons, cut, workers)
        return LightVolume._gathered(grid, light, response, tracer.surfaces, n_iterations, workers)

    @staticmethod
    def of_rays(
        scene: Scene,
        tracer: TransparencyTracer,
        rays: GatherRays,
        n_rays: int,
        grid: Grid,
        n_iterations: int,
        workers: Workers,
    ) -> "LightVolume":
        """A volume filled with what `n_rays` rays gather at one point for each cell's length squared of the surfaces.

        Light and response are those of the same points, so that the only noise is that of the rays.
        """
        sides = Sides.join([Sides.none(), *lit_sides(scene, tracer, grid, 1, workers)])
        response, _ = response_of(grid, [sides])
        light = light_of_rays(scene, rays, grid, sides, n_rays, workers)
        return LightVolume._gathered(grid, light, response, tracer.surfaces, n_iterations, workers)

    @staticmethod
    def _gathered(
        grid: Grid, light: np.ndarray, response: np.ndarray, tracer: Tracer, n_iterations: int, workers: Workers
    ) -> "LightVolume":
        """Light and response gathered from cell to cell."""
        passes = padded(transmittance(tracer, grid, response, workers))
        injected = np.concatenate([light, response], axis=1).reshape(*grid.shape, N_FIELDS, 4)
        fields = np.empty((grid.n_cells, N_FIELDS, 4), np.float32)
        gather = partial(gathered, transmittance=passes, n_iterations=n_iterations)
        for i, field in enumerate(workers.map(gather, np.moveaxis(injected, 3, 0))):
            fields[:, i] = field.reshape(-1, 4)
            workers.progress.update("Gathering in the volume", (i + 1) / N_FIELDS)
        return LightVolume(grid, fields, tracer)

    def radiance(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Radiance L in front of surfaces, from R L = c.

        Read half a cell off the surface, where light was injected, from those of the eight cells around whose centres
        the point sees: each counts with its trilinear weight times its height over the surface, so that nothing bleeds
        through a wall.

        Parameters
        ----------
        points : (n, 3) float32, m
            Lifted off their surfaces.
        normals : (n, 3) float32
            Of the sides that are read.

        Returns
        -------
        (n, N_LIGHT, 4) float32, W/(m² sr)
            As `solve_radiance` does; 0 where no surface is near.
        """
        n, grid = len(points), self.grid.arrays
        points, normals = (kernel_array(a, np.float32) for a in (points, normals))
        ends, cells, weights = np.empty(n, np.int32), np.empty(8 * n, np.int32), np.empty(8 * n, np.float32)
        starts, centres = np.empty((2, 8 * n, 3), np.float32)
        n_ways = look_around(grid, points, normals, ends, cells, weights, starts, centres)
        hidden = self.tracer.occluded(starts[:n_ways], centres[:n_ways])
        radiance, room = np.empty((n, N_LIGHT, 4), np.float32), (np.empty((N_FIELDS, 4)), np.empty((4, N_FIELDS)))
        read(self.fields, ends, cells, weights, hidden, room, radiance)
        return radiance


@kernel
def look_around(grid, points, normals, ends, cells, weights, starts, centres):
    """Cells around points (n, 3) that may light them, with their weights, and ways to be looked along; how many.

    Parameters
    ----------
    ends : (n,) int32
        Becomes how many ways there are of each point and those before.
    cells, weights : (8n,) int32 and float32
    starts, centres : (8n, 3) float32, m
        Ends of the ways.
    """
    n = 0
    for p in range(len(points)):
        point, normal = row(points, p), row(normals, p)
        x = in_cells(grid, along(point, OFFSET * grid.length, normal))
        i, f = _between(x[0] - _HALF, grid.shape[0])
        j, g = _between(x[1] - _HALF, grid.shape[1])
        k, h = _between(x[2] - _HALF, grid.shape[2])
        for corner in range(8):
            a, b, c = corner >> 2, corner >> 1 & 1, corner & 1
            centre = centre_at(grid, i + a, j + b, k + c)
            height = dot(minus(centre, point), normal) / grid.length
            weight = _share(f, a) * _share(g, b) * _share(h, c) * min(max(height, ZERO), ONE)
            if weight > ZERO:
                cells[n], weights[n] = cell_at(grid, i + a, j + b, k + c), weight
                put(starts, n, point)
                put(centres, n, centre)
                n += 1
        ends[p] = n
    return n


@part
def _between(x, n):
    """Of n places 0, 1, …, the one below x (the last but one at most), and how far x is above it, 0 to 1."""
    below = min(max(np.int64(np.floor(x)), 0), n - 2)
    return below, min(max(x - np.float32(below), ZERO), ONE)


@part
def _share(f, upper):
    """Weight of linear interpolation of the upper place or the lower."""
    return f if upper else ONE - f


@kernel
def read(fields, ends, cells, weights, hidden, room, radiance):
    """Radiance (n, N_LIGHT, 4) of points from the fields of the cells that nothing hides from them."""
    sums, system = room
    way = 0
    for p in range(len(ends)):
        sums[:] = 0
        while way < ends[p]:
            if not hidden[way]:
                for f in range(N_FIELDS):
                    for a in range(4):
                        sums[f, a] += weights[way] * fields[cells[way], f, a]
            way += 1
        solve_cell(sums, system, radiance[p])
