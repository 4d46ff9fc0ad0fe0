"""One bake, stage by stage: photons are traced, receivers gather them."""

import numpy as np

from .gather import (
    Cascade,
    Density,
    DirectLight,
    GatherRays,
    Irradiance,
    RadianceCache,
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
    given = (scene, receivers, settings, light_tracer, photons, workers)
    if settings.gather == "final":
        indirect, stderr, counts = _by_final_gather(*given, direct)
    elif settings.gather == "light_volume":
        indirect, stderr, counts = _by_light_volume(*given, direct, inspector)
    else:
        indirect, stderr, counts = _by_density(*given)
    passes = {"indirect": indirect}
    if settings.add_direct:
        passes["direct"] = direct_irradiance(scene, direct, receivers, workers)
    value = np.sum(list(passes.values()), axis=0, dtype=np.float32)
    return Irradiance(value, stderr, passes, {"receivers": len(value), "stored_photons": len(photons), **counts})


def _by_final_gather(
    scene: Scene,
    receivers: Receivers,
    settings: BakeSettings,
    tracer: LightTracer,
    photons: Photons,
    workers: Workers,
    direct: DirectLight,
) -> tuple[np.ndarray, np.ndarray, dict[str, int]]:
    """Photons and direct light make a radiance cache; rays from the receivers gather from it."""
    n_rays = settings.n_gather_rays
    cache = _cache(scene, receivers, settings, tracer, photons, workers, direct, len(receivers) * n_rays)
    rays = GatherRays(scene, tracer, direct, cache)
    gathered = final_gather(rays, receivers, n_rays, settings.noise, workers)
    counts = {"cache_elements": len(cache.elements), "gather_rays": gathered.n_rays}

    # What lamps send over mirrors and glass, photons find far better than rays do
    focused, caustic = _caustics(scene, receivers, settings, tracer, photons, workers)
    stderr = np.hypot(gathered.stderr, caustic.stderr)
    return gathered.irradiance + caustic.irradiance, stderr, {**counts, "caustic_photons": focused}


def _cache(
    scene: Scene,
    receivers: Receivers,
    settings: BakeSettings,
    tracer: LightTracer,
    photons: Photons,
    workers: Workers,
    direct: DirectLight,
    n_gathered: int,
) -> RadianceCache:
    """The radiance cache for so many gather rays."""
    n_rays = settings.n_cache_rays
    n_elements = worthwhile_elements(settings.n_cache_elements, n_rays, n_gathered)
    return build_radiance_cache(scene, tracer, photons, direct, receivers, n_elements, n_rays, workers)


def _caustics(
    scene: Scene,
    receivers: Receivers,
    settings: BakeSettings,
    tracer: LightTracer,
    photons: Photons,
    workers: Workers,
) -> tuple[int, Density]:
    """How many photons are focused, and their light; fewer than an estimate takes say nothing, and cost much time."""
    focused = photons.where(photons.kind == PathKind.CAUSTIC)
    n_nearest = settings.n_nearest // _CAUSTIC_SHARE
    if len(focused) < n_nearest:
        focused = Photons.none()
    surfaces, radius = tracer.surfaces, settings.max_radius
    return len(focused), density_estimate(scene, surfaces, focused, receivers, n_nearest, radius, workers)


def _by_light_volume(
    scene: Scene,
    receivers: Receivers,
    settings: BakeSettings,
    tracer: LightTracer,
    photons: Photons,
    workers: Workers,
    direct: DirectLight,
    inspector: Inspector,
) -> tuple[np.ndarray, np.ndarray, dict[str, int]]:
    """A coarse but smooth grid takes up photons, or what rays gather; caustics, which are sharp, stay out of it."""
    n_cells, n_rays, at = settings.n_grid_cells, settings.n_volume_rays, receivers.position
    if n_rays:
        n_gathered = 6 * n_cells**2 * n_rays  # as on the walls of a room
        cache = _cache(scene, receivers, settings, tracer, photons, workers, direct, n_gathered)
        rays = GatherRays(scene, tracer, direct, cache)
        volumes = Cascade.of_rays(scene, tracer, rays, n_rays, at, n_cells, workers)
    else:
        scattered = photons.where(photons.kind == PathKind.INDIRECT)
        volumes = Cascade.of_photons(scene, tracer, scattered, at, n_cells, workers)
    inspector.see("cells", volumes.cells)
    irradiance, stderr = volumes.irradiance(at, receivers.normal, workers)
    focused, caustic = _caustics(scene, receivers, settings, tracer, photons, workers)
    counts = {"volume_cells": sum(volume.grid.n_cells for volume in volumes.volumes), "caustic_photons": focused}
    return irradiance + caustic.irradiance, np.hypot(stderr, caustic.stderr), counts


def _by_density(
    scene: Scene,
    receivers: Receivers,
    settings: BakeSettings,
    tracer: LightTracer,
    photons: Photons,
    workers: Workers,
) -> tuple[np.ndarray, np.ndarray, dict[str, int]]:
    """Receivers gather the photons around them."""
    scattered = photons.where(photons.kind != PathKind.DIRECT)
    n_nearest, max_radius = settings.n_nearest, settings.max_radius
    density = density_estimate(scene, tracer.surfaces, scattered, receivers, n_nearest, max_radius, workers)
    return density.irradiance, density.stderr, {}
