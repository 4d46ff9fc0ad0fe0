"""Volumes one in another: the finer, the more receivers there are (after Kaplanyan and Dachsbacher's cascades)."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...core.parallel import Workers
from ...core.sampling.spherical_harmonics import Y0, sh_cosine_lobe
from ...photons import Photons
from ...scene import Scene
from ...tracing import TransparencyTracer
from ..rays.gather_rays import GatherRays
from ..screen_volume.sh_fields import N_LIGHT
from .grid import Grid
from .injection import OFFSET
from .volume import LightVolume

_LEFT_OUT = (0, 2, 10)  # per cent of the receivers at each end of each axis, from the coarser volumes to the finest
_LEAST_GAIN = 2  # a volume whose cells are not so many times smaller than the one's around it is not built
_LEAST_LENGTH = 2.0**-16  # of a cell, over its coordinates: rays start off surfaces by a quarter of that
_CHUNK = 1 << 13  # receivers

_READING = 63  # the chunks draw no random numbers


@dataclass(frozen=True)
class Cascade:
    """Volumes from the coarsest, which covers the scene, to the finest."""

    volumes: tuple[LightVolume, ...]

    @staticmethod
    def of_photons(
        scene: Scene,
        tracer: TransparencyTracer,
        photons: Photons,
        positions: np.ndarray,
        n_cells: int,
        workers: Workers,
    ) -> "Cascade":
        """A volume over the scene, and finer ones around most of the receivers' positions (n, 3), filled with photons.

        Each has `n_cells` cells along its longest side. A finer one is built where there are photons for it: n_cells²,
        which is one for several cells of surface, and several for all that a reading takes its light from.
        """

        def fill(grid: Grid, part: Workers) -> LightVolume:
            inside = photons.where(grid.reaches(photons.position))
            return LightVolume.of_photons(scene, tracer, inside, grid, n_cells // 4, part)

        def worthwhile(grid: Grid) -> bool:
            return bool(np.count_nonzero(grid.reaches(photons.position)) >= n_cells**2)

        return Cascade._filled(scene, positions, n_cells, worthwhile, fill, workers)

    @staticmethod
    def of_rays(
        scene: Scene,
        tracer: TransparencyTracer,
        rays: GatherRays,
        n_rays: int,
        positions: np.ndarray,
        n_cells: int,
        workers: Workers,
    ) -> "Cascade":
        """The same filled by gather rays. A finer volume has to have as many receivers as cells along its side."""

        def fill(grid: Grid, part: Workers) -> LightVolume:
            return LightVolume.of_rays(scene, tracer, rays, n_rays, grid, n_cells // 4, part)

        def worthwhile(grid: Grid) -> bool:
            large = grid.length > _LEAST_LENGTH * np.abs(grid.box).max()
            return large and bool(np.count_nonzero(grid.reaches(positions)) >= n_cells)

        return Cascade._filled(scene, positions, n_cells, worthwhile, fill, workers)

    @staticmethod
    def _filled(
        scene: Scene,
        positions: np.ndarray,
        n_cells: int,
        worthwhile: Callable[[Grid], bool],
        fill: Callable[[Grid, Workers], LightVolume],
        workers: Workers,
    ) -> "Cascade":
        grids = [Grid.over(scene.bounds, n_cells)]
        for left_out in _LEFT_OUT:
            grid = Grid.over(np.percentile(positions, [left_out, 100 - left_out], axis=0), n_cells)
            if grid.length * _LEAST_GAIN <= grids[-1].length and worthwhile(grid):
                grids.append(grid)
        n = len(grids)
        return Cascade(tuple(fill(grid, workers.part(i / n, (i + 1) / n)) for i, grid in enumerate(grids)))

    def irradiance(self, positions: np.ndarray, normals: np.ndarray, workers: Workers) -> tuple[np.ndarray, np.ndarray]:
        """Irradiance E = ∫ (ω·n)⁺ L dω at points, each read from the finest volume around it (Eq. 7).

        Returns
        -------
        irradiance : (n, 3) float32, W/m²
        stderr : (n,) float32, W/m²
            Of its mean over colours: what photons of random signs add up to.
        """
        irradiance, stderr = np.zeros((len(positions), 3), np.float32), np.zeros(len(positions), np.float32)

        def read(chunk: slice, _: np.random.Generator) -> np.ndarray:
            radiance = self.radiance(positions[chunk], normals[chunk])
            return np.einsum("nfk,nk->nf", radiance, sh_cosine_lobe(normals[chunk]))

        for chunk, light in workers.chunks("Reading the volume", len(positions), _CHUNK, read, (_READING,)):
            irradiance[chunk] = np.maximum(light[:, :3], 0)
            stderr[chunk] = np.sqrt(np.mean(light[:, 3:] ** 2, axis=1))
        return irradiance, stderr

    def cells(self) -> tuple[np.ndarray, np.ndarray]:
        """Centres of the finest volume's lit cells near surfaces, (k, 3) m, and their mean irradiance, (k, 3) W/m².

        As if light came evenly from everywhere, π Y₀ c₀ / R₀₀: what cells one by one tell of directions is all noise.
        """
        volume = self.volumes[-1]
        area = np.trace(volume.fields[:, N_LIGHT:], axis1=1, axis2=2)
        lit = np.flatnonzero(volume.fields[:, :3, 0].any(axis=1) & (area > volume.grid.length**2))
        light, response = volume.fields[lit, :3, 0], volume.fields[lit, N_LIGHT, 0]
        return volume.grid.centres(lit), np.float32(np.pi) * Y0 * light / response[:, None]

    def radiance(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """See `LightVolume.radiance`."""
        finest = np.zeros(len(points), np.int32)
        for i, volume in enumerate(self.volumes[1:], start=1):
            finest[volume.grid.contains(points + OFFSET * np.float32(volume.grid.length) * normals)] = i
        radiance = np.empty((len(points), N_LIGHT, 4), np.float32)
        for i, volume in enumerate(self.volumes):
            k = np.flatnonzero(finest == i)
            radiance[k] = volume.radiance(points[k], normals[k])
        return radiance
