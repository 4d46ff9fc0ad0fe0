"""One bake, stage by stage: photons are traced, receivers gather them."""

from dataclasses import dataclass

import numpy as np

from .gather import (
    Cascade,
    Density,
    DirectLight,
    GatherRays,
    Irradiance,
    build_radiance_cache,
    density_estimate,
    direct_irradiance,
    final_gather,
    worthwhile_elements,
)
from .inspector import LIFT, Inspector
from .parallel import Workers
from .photons import PathKind, Photons, light_sources, region_of, trace_photons
from .progress import Progress
from .receivers import Receivers
from .scene import Scene
from .settings import BakeSettings
from .tracers import LightTracer, Tracer

_CAUSTIC_SHARE = 4  # caustics are sharp: their estimate takes as many times fewer photons


def bake(
    scene: Scene,
    receivers: Receivers,
    settings: BakeSettings,
    tracer: Tracer,
    progress: Progress | None = None,
    inspector: Inspector | None = None,
    photon_tracer: Tracer | None = None,
) -> Irradiance:
    """Trace photons through `scene` and gather them at `receivers`.

    Parameters
    ----------
    inspector : Inspector, optional
        Is shown the photons (W) and the light volume's cells (W/m²).
    photon_tracer : Tracer, optional
        Traces the photons, which forgive it more than those who look for them do; without it `tracer` traces all.

    Raises
    ------
    BakeError
        If nothing in the scene gives light.
    Cancelled
        If `progress` was cancelled.
    """
    progress, inspector = progress or Progress(), inspector or Inspector()
    if len(receivers) == 0:
        nothing = np.zeros((0, 3), np.float32)
        return Irradiance(nothing, nothing[:, 0], {"indirect": nothing}, {"receivers": 0})
    workers = Workers(settings.seed, settings.n_threads, progress)
    region = region_of(receivers.position)
    sources = light_sources(scene, region)
    light_tracer = LightTracer(scene, tracer)
    of_photons = LightTracer(scene, photon_tracer) if photon_tracer else light_tracer
    photons = trace_photons(scene, of_photons, sources, settings.n_photons, settings.max_bounces, workers)
    inspector.see("photons", lambda: (photons.position + LIFT * region.radius * photons.normal, photons.power))
    direct = DirectLight(scene, light_tracer, sources)
    gathering = _Gathering(scene, receivers, settings, light_tracer, photons, direct, workers, inspector)
    if settings.gather == "final":
        indirect, stderr, counts = gathering.by_final_gather()
    elif settings.gather == "light_volume":
        indirect, stderr, counts = gathering.by_light_volume()
    else:
        indirect, stderr, counts = gathering.by_density()
    passes = {"indirect": indirect}
    if settings.add_direct:
        passes["direct"] = direct_irradiance(scene, direct, receivers, workers)
    value = np.sum(list(passes.values()), axis=0, dtype=np.float32)
    return Irradiance(value, stderr, passes, {"receivers": len(value), "stored_photons": len(photons), **counts})


@dataclass(frozen=True)
class _Gathering:
    """What photons become at the receivers: irradiance (n, 3), its standard error (n,), and counts for the report."""

    scene: Scene
    receivers: Receivers
    settings: BakeSettings
    tracer: LightTracer
    photons: Photons
    direct: DirectLight
    workers: Workers
    inspector: Inspector

    def by_final_gather(self) -> tuple[np.ndarray, np.ndarray, dict[str, int]]:
        """Photons and direct light make a radiance cache; rays from the receivers gather from it."""
        n_rays, noise = self.settings.n_gather_rays, self.settings.noise
        rays, n_elements = self._rays(len(self.receivers) * n_rays)
        gathered = final_gather(rays, self.receivers, n_rays, noise, self.workers)
        counts = {"cache_elements": n_elements, "gather_rays": gathered.n_rays}
        return self._with_caustics(gathered.irradiance, gathered.stderr, counts)

    def by_light_volume(self) -> tuple[np.ndarray, np.ndarray, dict[str, int]]:
        """A coarse but smooth grid takes up photons, or what rays gather; caustics, which are sharp, stay out of it."""
        n_cells, n_rays, at = self.settings.n_grid_cells, self.settings.n_volume_rays, self.receivers.position
        if n_rays:
            rays, _ = self._rays(6 * n_cells**2 * n_rays)  # as on the walls of a room
            volumes = Cascade.of_rays(self.scene, self.tracer, rays, n_rays, at, n_cells, self.workers)
        else:
            scattered = self.photons.where(self.photons.kind == PathKind.INDIRECT)
            volumes = Cascade.of_photons(self.scene, self.tracer, scattered, at, n_cells, self.workers)
        self.inspector.see("cells", volumes.cells)
        irradiance, stderr = volumes.irradiance(at, self.receivers.normal, self.workers)
        counts = {"volume_cells": sum(volume.grid.n_cells for volume in volumes.volumes)}
        return self._with_caustics(irradiance, stderr, counts)

    def by_density(self) -> tuple[np.ndarray, np.ndarray, dict[str, int]]:
        """Receivers gather the photons around them."""
        scattered = self.photons.where(self.photons.kind != PathKind.DIRECT)
        density = self._density(scattered, self.settings.n_nearest)
        return density.irradiance, density.stderr, {}

    def _rays(self, n_rays: int) -> tuple[GatherRays, int]:
        """Rays that gather from a radiance cache worth so many of them, and its number of elements."""
        n_cache_rays = self.settings.n_cache_rays
        n_elements = worthwhile_elements(self.settings.n_cache_elements, n_cache_rays, n_rays)
        scene, tracer, direct = self.scene, self.tracer, self.direct
        cache = build_radiance_cache(
            scene, tracer, self.photons, direct, self.receivers, n_elements, n_cache_rays, self.workers
        )
        return GatherRays(scene, tracer, direct, cache), len(cache.elements)

    def _with_caustics(
        self, irradiance: np.ndarray, stderr: np.ndarray, counts: dict[str, int]
    ) -> tuple[np.ndarray, np.ndarray, dict[str, int]]:
        """With what lamps send over mirrors and glass, which photons find far better than rays do."""
        focused = self.photons.where(self.photons.kind == PathKind.CAUSTIC)
        n_nearest = self.settings.n_nearest // _CAUSTIC_SHARE
        if len(focused) < n_nearest:
            focused = Photons.none()  # fewer than an estimate takes say nothing, and cost much time
        caustic = self._density(focused, n_nearest)
        counts = {**counts, "caustic_photons": len(focused)}
        return irradiance + caustic.irradiance, np.hypot(stderr, caustic.stderr), counts

    def _density(self, photons: Photons, n_nearest: int) -> Density:
        surfaces, radius = self.tracer.surfaces, self.settings.max_radius
        return density_estimate(self.scene, surfaces, photons, self.receivers, n_nearest, radius, self.workers)
