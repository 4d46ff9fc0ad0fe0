"""The light-gathering volume: built of photons and surfaces, read at points."""

from dataclasses import dataclass
from functools import partial

import numpy as np

from ...core.parallel import Workers
from ...photons import Photons
from ...scene import Scene
from ...tracing import Tracer, TransparencyTracer
from ..rays.gather_rays import GatherRays
from ..screen_volume.sh_fields import N_FIELDS, solve_radiance
from .grid import Grid
from .injection import Sides, inject_gathered, inject_photons, inject_response, lit_sides
from .occlusion import transmittance
from .propagation import propagate

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
        response, cut = inject_response(grid, sides)
        light = inject_photons(scene, tracer, grid, photons, cut, workers)
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
        response, _ = inject_response(grid, [sides])
        light = inject_gathered(scene, rays, grid, sides, n_rays, workers)
        return LightVolume._gathered(grid, light, response, tracer.surfaces, n_iterations, workers)

    @staticmethod
    def _gathered(
        grid: Grid, light: np.ndarray, response: np.ndarray, tracer: Tracer, n_iterations: int, workers: Workers
    ) -> "LightVolume":
        """Light and response gathered from cell to cell."""
        passes = transmittance(tracer, grid, response, workers)
        injected = np.concatenate([light, response]).reshape(N_FIELDS, 4, *grid.shape)
        fields = np.empty((grid.n_cells, N_FIELDS, 4), np.float32)
        gather = partial(_gather, transmittance=passes, n_iterations=n_iterations)
        for i, field in enumerate(workers.map(gather, injected)):
            fields[:, i] = field.reshape(4, -1).T
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
        cells, weights = self.grid.around(points + np.float32(self.grid.length / 2) * normals)
        ways = self.grid.centres(cells) - points[:, None]
        height = np.einsum("nki,ni->nk", ways, normals) / np.float32(self.grid.length)
        weights = (weights * np.clip(height, 0, 1)).reshape(-1)
        counts = np.flatnonzero(weights)
        point = counts // 8
        hidden = self.tracer.occluded(points[point], points[point] + ways.reshape(-1, 3)[counts])
        weights[counts[hidden]] = 0

        fields = np.zeros((len(points), N_FIELDS, 4), np.float32)
        for cell, weight in zip(cells.T, weights.reshape(-1, 8).T, strict=True):
            fields += weight[:, None, None] * self.fields[cell]
        return solve_radiance(fields)


def _gather(field: np.ndarray, transmittance: np.ndarray, n_iterations: int) -> np.ndarray:
    """A field and what its cells gather in all iterations, (4, nx, ny, nz) float32."""
    gathered = field.copy()
    for _ in range(n_iterations):
        field = propagate(field, transmittance)
        gathered += field
    return gathered
