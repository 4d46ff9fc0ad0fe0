"""How receivers take light from a solution: a function for each gather, and caustics for all of them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..core.parallel import Workers
from ..emitters import region_of
from ..gather import (
    LEAST_ESTIMATES,
    OF_SCATTERED,
    Cascade,
    Estimate,
    FinalGather,
    GatherRays,
    Irradiance,
    PhotonDensity,
    SampleBudget,
    direct_irradiance,
    direct_slope,
    search_radius,
    splat_irradiance,
    thinned_density,
)
from ..photons import PathKind, Photons
from .solution import Solution

_LEAST_EXTENT = 1e-3  # m, of the receivers: a lone one has none
_OF_SPLATTING = 0.4  # of the stages of photon splatting, that come before them: gloss and caustics
_CAUSTIC_SHARE = 4  # caustics are sharp: their estimate takes as many times fewer photons


def irradiances(solutions: Sequence[Solution], workers: Workers) -> list[Irradiance]:
    """The light at the receivers of each of several solutions, which are for the same ones."""
    if solutions[0].settings.gather == "final":
        gathered = _by_final_gather(solutions, workers)
    else:
        gathered = [_gathered(solution) for solution in solutions]
    return [_with_direct(solution, *of_one) for solution, of_one in zip(solutions, gathered, strict=True)]


def _by_final_gather(solutions: Sequence[Solution], workers: Workers) -> list[tuple[Estimate, dict[str, int]]]:
    """Photons and direct light make a radiance cache; rays from some receivers gather from it, for all.

    The rays are the same for all solutions: they take what each cache has where they end.
    """
    first, noises = solutions[0], tuple(solution.noise for solution in solutions)
    of, at = first.settings, first.receivers
    budget = SampleBudget(
        of.n_gather_rays, of.noise, first.setup.deadline, of.interpolate, of.gather_share, besides=noises
    )
    extent = max(2 * region_of(at.position).radius, _LEAST_EXTENT)
    rays = GatherRays.beside([solution.must_gather() for solution in solutions])
    gather = FinalGather(rays, at, budget, extent, first.tracer.surfaces, workers)
    caustics = [caustics_of(solution, gather) for solution in solutions]
    gathered = gather.finish()
    counts = {"gather_points": gathered.n_records, "gather_rays": gathered.n_rays}
    lights = zip(gathered.lights, noises, caustics, strict=True)
    return [_sum(light.with_noise(noise), counts, caustic) for light, noise, caustic in lights]


def _gathered(solution: Solution) -> tuple[Estimate, dict[str, int]]:
    """Indirect light by another gather than the final one, and what it counted."""
    if solution.settings.gather == "light_volume":
        return _by_light_volume(solution)
    if solution.settings.gather == "photon_volumes":
        return _by_splatting(solution)
    return _by_density(solution)


def _by_light_volume(solution: Solution) -> tuple[Estimate, dict[str, int]]:
    """A coarse but smooth grid takes up photons, or what rays gather; caustics, which are sharp, stay out of it."""
    scene, tracer, settings, workers = solution.scene, solution.tracer, solution.settings, solution.workers
    n_cells, n_rays, at = settings.n_grid_cells, settings.n_volume_rays, solution.receivers.position
    if n_rays:
        volumes = Cascade.of_rays(scene, tracer, solution.must_gather(), n_rays, at, n_cells, workers)
    else:
        scattered = solution.photons.where(solution.photons.kind == PathKind.INDIRECT)
        volumes = Cascade.of_photons(scene, tracer, scattered, at, n_cells, workers)
    solution.setup.inspector.see("cells", volumes.cells)
    irradiance, stderr = volumes.irradiance(at, solution.receivers.normal, workers)
    counts = {"volume_cells": sum(volume.grid.n_cells for volume in volumes.volumes)}
    return _sum(Estimate(irradiance, stderr), counts, caustics_of(solution))


def _by_splatting(solution: Solution) -> tuple[Estimate, dict[str, int]]:
    """Photons light the pixels around them; what is seen in mirrors gathers caustics as other receivers do."""
    view = solution.receivers.view
    assert view is not None
    scattered, surfaces = solution.photons.where(solution.photons.kind == PathKind.INDIRECT), solution.tracer.surfaces
    n, workers = solution.settings.subsample, solution.workers.part(_OF_SPLATTING, 1.0)
    light = splat_irradiance(view.camera, view.seen, scattered, workers, n, surfaces, OF_SCATTERED)
    return _sum(Estimate(*light), {}, caustics_of(solution))


def _by_density(solution: Solution) -> tuple[Estimate, dict[str, int]]:
    """Receivers gather the photons around them."""
    photons, at, n_nearest = solution.photons, solution.receivers, solution.settings.n_nearest
    if at.takes_caustics is None:
        of_all = _density(solution, photons.where(photons.kind != PathKind.DIRECT), n_nearest)
        return _with_mid_air(solution, of_all.at(at, solution.workers)[0], n_nearest), {}
    of_scattered = _density(solution, photons.where(photons.kind == PathKind.INDIRECT), n_nearest)
    light = of_scattered.at(at, solution.workers)[0]
    return _sum(_with_mid_air(solution, light, n_nearest, PathKind.INDIRECT), {}, caustics_of(solution))


def caustics_of(solution: Solution, gather: FinalGather | None = None) -> tuple[Estimate, int]:
    """What lamps send over mirrors and glass, which photons find far better than rays do; and their number.

    With a gather, most receivers take it from the records; those have it already to which it walks through bodies.
    """
    focused = solution.photons.where(solution.photons.kind == PathKind.CAUSTIC)
    n_nearest = solution.settings.n_nearest // _CAUSTIC_SHARE
    at, takers = solution.receivers, solution.receivers.takes_caustics
    caustics = Estimate.dark(len(at), at.directional)
    if takers is not None and not takers.any():
        return caustics, len(focused)
    if len(focused) >= LEAST_ESTIMATES * n_nearest:
        density = _density(solution, focused, n_nearest)
        if takers is not None:
            caustics.put(takers, density.at(at.where(takers), solution.workers)[0])
        elif gather is not None:
            caustics = thinned_density(density, at, gather, solution.workers)
        else:
            caustics = density.at(at, solution.workers)[0]
    if gather is not None:
        brought = gather.takes_caustics_through_bodies
        caustics.put(brought, Estimate.dark(len(brought), at.directional))
    return _with_mid_air(solution, caustics, n_nearest, PathKind.CAUSTIC), len(focused)


def _with_mid_air(solution: Solution, light: Estimate, n_nearest: int, kind: PathKind | None = None) -> Estimate:
    """Light, with that of receivers in mid-air by what flies past them, of one kind or of all."""
    if solution.mid_air is None:
        return light
    r_max = solution.settings.max_radius
    return solution.mid_air.put(light, solution.receivers, r_max, n_nearest, kind, solution.workers)


def _density(solution: Solution, photons: Photons, n_nearest: int) -> PhotonDensity:
    r_max = solution.settings.max_radius or search_radius(photons, region_of(solution.receivers.position), n_nearest)
    return PhotonDensity(solution.tracer, photons, n_nearest, r_max, solution.workers)


def _with_direct(solution: Solution, light: Estimate, counts: dict[str, int]) -> Irradiance:
    """Indirect light, and direct light if it is asked for."""
    passes, slope = {"indirect": light.irradiance}, light.slope
    if solution.settings.add_direct:
        at = solution.scene, solution.direct, solution.receivers
        of_slope = 0.0 if slope is None else 0.5  # of the stage
        passes["direct"] = direct_irradiance(*at, solution.workers.part(0.0, 1 - of_slope))
        if slope is not None:
            slope = slope + direct_slope(*at, passes["direct"], solution.workers.part(1 - of_slope, 1.0))
    value = np.sum(list(passes.values()), axis=0, dtype=np.float32)
    counts = {"receivers": len(value), "stored_photons": len(solution.photons), **counts}
    return Irradiance(value, light.stderr, passes, counts, slope, light.gathered, light.caustics, light.own_rays)


def _sum(light: Estimate, counts: dict[str, int], caustics: tuple[Estimate, int]) -> tuple[Estimate, dict[str, int]]:
    """Light and counts, with the caustics'."""
    caustic, n_photons = caustics
    return replace(light.plus(caustic), caustics=caustic.irradiance), {**counts, "caustic_photons": n_photons}
