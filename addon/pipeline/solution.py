"""Light in a scene that was solved, and how receivers gather it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..core.inspector import Inspector
from ..core.parallel import Workers
from ..emitters import Source, region_of
from ..gather import (
    LEAST_ESTIMATES,
    OF_SCATTERED,
    Cascade,
    DirectLight,
    Effort,
    Estimate,
    FinalGather,
    GatherRays,
    Irradiance,
    MidAir,
    PhotonDensity,
    Survey,
    build_radiance_cache,
    direct_irradiance,
    direct_slope,
    photon_volume_irradiance,
    search_radius,
    thinned_density,
)
from ..photons import PathKind, Photons
from ..receivers import Receivers
from ..scene import Scene
from ..settings.bake import BakeSettings
from ..tracing import TransparencyTracer

_LEAST_EXTENT = 1e-3  # m, of the receivers: a lone one has none
_OF_VOLUMES = 0.4  # of the stages of photon volumes, that come before them: gloss and caustics
_CAUSTIC_SHARE = 4  # caustics are sharp: their estimate takes as many times fewer photons


@dataclass(frozen=True)
class Solution:
    """Light in a scene, to be gathered.

    Attributes
    ----------
    receivers : Receivers
        That it was solved for.
    bounces_left : (p,) int or None
        How many surfaces further each photon may be seen; None without lamps that limit it.
    noise : float, W/m²
        Standard error of what photons bring to the receivers' mean, where rays gather.
    direct : DirectLight
    survey : Survey or None
        Of the surfaces that gather rays see; None where no rays are sent.
    mid_air : MidAir or None
        The receivers that lie on no surface, and what flies past them; None without any.
    deadline : float, s
        By `time.perf_counter`, of the final gather.
    """

    scene: Scene
    receivers: Receivers
    settings: BakeSettings
    tracer: TransparencyTracer
    photons: Photons
    bounces_left: np.ndarray | None
    noise: float
    sources: list[Source]
    direct: DirectLight
    survey: Survey | None
    mid_air: MidAir | None
    workers: Workers
    inspector: Inspector
    deadline: float

    def at(self, receivers: Receivers) -> "Solution":
        """The same light, to be gathered at the first of the receivers alone, which are given."""
        mid_air = self.mid_air.of_first(len(receivers)) if self.mid_air else None
        return replace(self, receivers=receivers, mid_air=mid_air)

    @property
    def dark(self) -> bool:
        """Whether nothing in the scene gives light."""
        return not self.sources

    def irradiance(self) -> Irradiance:
        """The light at the receivers."""
        return irradiances([self], self.workers)[0]

    def _gathered(self) -> tuple[Estimate, dict[str, int]]:
        """Indirect light by another gather than the final one, and what it counted."""
        if self.settings.gather == "light_volume":
            return self._by_light_volume()
        if self.settings.gather == "photon_volumes":
            return self._by_photon_volumes()
        return self._by_density()

    def _with_direct(self, light: Estimate, counts: dict[str, int]) -> Irradiance:
        """Indirect light, and direct light if it is asked for."""
        passes, slope = {"indirect": light.irradiance}, light.slope
        if self.settings.add_direct:
            at = self.scene, self.direct, self.receivers
            of_slope = 0.0 if slope is None else 0.5  # of the stage
            passes["direct"] = direct_irradiance(*at, self.workers.part(0.0, 1 - of_slope))
            if slope is not None:
                slope = slope + direct_slope(*at, passes["direct"], self.workers.part(1 - of_slope, 1.0))
        value = np.sum(list(passes.values()), axis=0, dtype=np.float32)
        counts = {"receivers": len(value), "stored_photons": len(self.photons), **counts}
        return Irradiance(value, light.stderr, passes, counts, slope, light.gathered, light.caustics, light.own_rays)

    def gather(self, receivers: Receivers) -> Irradiance:
        """The light at other receivers (at least one) on the same surfaces, by the same photons and cache.

        The progress is not told of it, so it is for parts of a stage.

        Raises
        ------
        Cancelled
            If the bake's progress was cancelled.
        """
        rays, quiet = self.rays, replace(self.workers, progress=self.workers.progress.quiet())
        other = replace(self, receivers=receivers, mid_air=None, workers=quiet)
        other.__dict__["rays"] = rays
        return other.irradiance()

    @cached_property
    def rays(self) -> GatherRays | None:
        """Rays that gather from a radiance cache, which is made when they are first asked for; None without survey."""
        if self.survey is None:
            return None
        if self.bounces_left is None:
            return self._rays(self.photons, self.direct, self.workers)
        # What is seen over a surface more may be without some lamps; over more of them it is taken for the same
        rays = None
        for n_surfaces, workers in ((2, self.workers.part(0.0, 0.5)), (1, self.workers.part(0.5, 1.0))):
            lamps = [source for source in self.sources if source.max_bounces >= n_surfaces]
            photons = self.photons.where(self.bounces_left >= n_surfaces)
            rays = self._rays(photons, DirectLight(self.scene, self.tracer, lamps), workers, rays)
        return rays

    def _rays(
        self, photons: Photons, direct: DirectLight, workers: Workers, beyond: GatherRays | None = None
    ) -> GatherRays:
        """Rays that gather what some photons and some lamps bring."""
        assert self.survey is not None
        scene, tracer = self.scene, self.tracer
        n_rays = self.settings.n_cache_rays if beyond or self.bounces_left is None else 0
        cache = build_radiance_cache(scene, tracer, photons, direct, self.survey, n_rays, workers, beyond)
        return GatherRays(scene, tracer, direct, cache, beyond)

    def _by_light_volume(self) -> tuple[Estimate, dict[str, int]]:
        """A coarse but smooth grid takes up photons, or what rays gather; caustics, which are sharp, stay out of it."""
        n_cells, n_rays, at = self.settings.n_grid_cells, self.settings.n_volume_rays, self.receivers.position
        if n_rays:
            volumes = Cascade.of_rays(self.scene, self.tracer, self._must_gather(), n_rays, at, n_cells, self.workers)
        else:
            scattered = self.photons.where(self.photons.kind == PathKind.INDIRECT)
            volumes = Cascade.of_photons(self.scene, self.tracer, scattered, at, n_cells, self.workers)
        self.inspector.see("cells", volumes.cells)
        irradiance, stderr = volumes.irradiance(at, self.receivers.normal, self.workers)
        counts = {"volume_cells": sum(volume.grid.n_cells for volume in volumes.volumes)}
        return _sum(Estimate(irradiance, stderr), counts, self._caustics())

    def _by_photon_volumes(self) -> tuple[Estimate, dict[str, int]]:
        """Photons light the pixels around them; what is seen in mirrors gathers caustics as other receivers do."""
        view = self.receivers.view
        assert view is not None
        scattered, surfaces = self.photons.where(self.photons.kind == PathKind.INDIRECT), self.tracer.surfaces
        n, workers = self.settings.subsample, self.workers.part(_OF_VOLUMES, 1.0)
        light = photon_volume_irradiance(view.camera, view.seen, scattered, workers, n, surfaces, OF_SCATTERED)
        return _sum(Estimate(*light), {}, self._caustics())

    def _by_density(self) -> tuple[Estimate, dict[str, int]]:
        """Receivers gather the photons around them."""
        kind = self.photons.kind
        if self.receivers.takes_caustics is None:
            of_all = self._density(self.photons.where(kind != PathKind.DIRECT), self.settings.n_nearest)
            return self._with_mid_air(of_all.at(self.receivers, self.workers)[0], self.settings.n_nearest), {}
        of_scattered = self._density(self.photons.where(kind == PathKind.INDIRECT), self.settings.n_nearest)
        light = of_scattered.at(self.receivers, self.workers)[0]
        return _sum(self._with_mid_air(light, self.settings.n_nearest, PathKind.INDIRECT), {}, self._caustics())

    def _must_gather(self) -> GatherRays:
        assert self.rays is not None
        return self.rays

    def _caustics(self, gather: FinalGather | None = None) -> tuple[Estimate, int]:
        """What lamps send over mirrors and glass, which photons find far better than rays do; and their number.

        With a gather, most receivers take it from the records.
        """
        focused = self.photons.where(self.photons.kind == PathKind.CAUSTIC)
        n_nearest = self.settings.n_nearest // _CAUSTIC_SHARE
        at, takers = self.receivers, self.receivers.takes_caustics
        caustics = Estimate.dark(len(at), at.directional)
        if takers is not None and not takers.any():
            return caustics, len(focused)
        if len(focused) >= LEAST_ESTIMATES * n_nearest:
            density = self._density(focused, n_nearest)
            if takers is not None:
                caustics.put(takers, density.at(at.where(takers), self.workers)[0])
            elif gather is not None:
                caustics = thinned_density(density, at, gather, self.workers)
            else:
                caustics = density.at(at, self.workers)[0]
        return self._with_mid_air(caustics, n_nearest, PathKind.CAUSTIC), len(focused)

    def _with_mid_air(self, light: Estimate, n_nearest: int, kind: PathKind | None = None) -> Estimate:
        """Light, with that of receivers in mid-air by what flies past them, of one kind or of all."""
        if self.mid_air is None:
            return light
        return self.mid_air.put(light, self.receivers, self.settings.max_radius, n_nearest, kind, self.workers)

    def _density(self, photons: Photons, n_nearest: int) -> PhotonDensity:
        r_max = self.settings.max_radius or search_radius(photons, region_of(self.receivers.position), n_nearest)
        return PhotonDensity(self.tracer, photons, n_nearest, r_max, self.workers)


def irradiances(solutions: Sequence[Solution], workers: Workers) -> list[Irradiance]:
    """The light at the receivers of each of several solutions, which are for the same ones."""
    if solutions[0].settings.gather == "final":
        gathered = _by_final_gather(solutions, workers)
    else:
        gathered = [solution._gathered() for solution in solutions]
    return [solution._with_direct(*of_one) for solution, of_one in zip(solutions, gathered, strict=True)]


def _by_final_gather(solutions: Sequence[Solution], workers: Workers) -> list[tuple[Estimate, dict[str, int]]]:
    """Photons and direct light make a radiance cache; rays from some receivers gather from it, for all.

    The rays are the same for all solutions: they take what each cache has where they end.
    """
    first, noises = solutions[0], tuple(solution.noise for solution in solutions)
    of, at = first.settings, first.receivers
    effort = Effort(of.n_gather_rays, of.noise, first.deadline, of.interpolate, of.gather_share, besides=noises)
    extent = max(2 * region_of(at.position).radius, _LEAST_EXTENT)
    rays = GatherRays.beside([solution._must_gather() for solution in solutions])
    gather = FinalGather(rays, at, effort, extent, first.tracer.surfaces, workers)
    caustics = [solution._caustics(gather) for solution in solutions]
    gathered = gather.finish()
    counts = {"gather_points": gathered.n_records, "gather_rays": gathered.n_rays}
    lights = zip(gathered.lights, noises, caustics, strict=True)
    return [_sum(light.with_noise(noise), counts, caustic) for light, noise, caustic in lights]


def _sum(light: Estimate, counts: dict[str, int], caustics: tuple[Estimate, int]) -> tuple[Estimate, dict[str, int]]:
    """Light and counts, with the caustics'."""
    caustic, n_photons = caustics
    return replace(light.plus(caustic), caustics=caustic.irradiance), {**counts, "caustic_photons": n_photons}
