"""Gather rays, and the radiance that they meet.

A ray that ends far away takes what the surface there reflects diffusely from the cache. Two things are found as a path
tracer would find them, by direct light at the point and a further ray for the rest:

- What ends nearer than the cache can resolve (in a corner, under a cupboard), where it would read an element that is
  partly elsewhere (the secondary final gather of the π-engine, section 3.2.2).
- What glossy and glass lobes reflect and transmit, which depends on the direction. Rays follow them in proportion to
  their albedo. Light that lamps send over mirrors, glass and narrow gloss is left out: those are caustics, which
  photons find far better. Where there are none, in what a camera sees in gloss, rays may be told to bring it.
"""

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...bsdf import (
    Lobe,
    Surface,
    base_transmittance,
    evaluate_broad,
    glass_albedo,
    glossy_albedo,
    reflects_highlights,
    surface_at,
)
from ...core.sampling.vectors import dot, largest, rows
from ...emitters.lamp_hits import lamps_along
from ...photons.scattering import ALL_LOBES, NARROW_LOBES, Scattered, facing, local_axes, scatter
from ...scene import Scene
from ...tracing import Hits, TransparencyTracer
from ...tracing.emission import emission_met
from ..direct.direct_light import DirectLight
from ..radiance_cache.radiance_cache import RadianceCache

_MAX_NEAR_HITS = 4
_MAX_HITS = 32
_LATE_SURVIVAL = 0.5  # after the first few hits: a long tail of few paths costs as many calls as many paths
_FOLLOWED = np.float32(2)
"""Rays that follow a narrow lobe, over its albedo: more of them cost time, fewer make noise."""


@dataclass(frozen=True)
class Incoming:
    """What n rays met.

    Attributes
    ----------
    reflected, sky : (n, 3 l) float32, W/(m² sr)
        Radiance from surfaces, and from the world; the sky's is 0 where `DirectLight` samples it.
    hits : Hits
        What they met first.
    """

    reflected: np.ndarray
    sky: np.ndarray
    hits: Hits


@dataclass
class _Paths:
    """Rays on their way, and where they have come to.

    Attributes
    ----------
    ray : (n,) int
        Of the rays that were asked for.
    throughput : (n, 3) float32
        What is left of the light on its way back.
    directions : (n, 3) float32
    positions, normals : (n, 3) float32
        Of the hits, on the side that was met.
    hits : Hits
    near : (n,) bool
        Whether the cache was not asked for the diffuse light there.
    """

    ray: np.ndarray
    throughput: np.ndarray
    directions: np.ndarray
    positions: np.ndarray
    normals: np.ndarray
    hits: Hits
    near: np.ndarray

    @staticmethod
    def at(
        scene: Scene,
        k: np.ndarray,
        ray: np.ndarray,
        throughput: np.ndarray,
        directions: np.ndarray,
        hits: Hits,
        near: np.ndarray,
    ) -> "_Paths":
        """The paths of those rays that `k` chooses."""
        met, flown = hits.where(k), rows(directions, k)
        positions, normals = met.points(scene, flown)
        return _Paths(ray[k], rows(throughput, k), flown, positions, normals, met, near[k])

    def where(self, k: np.ndarray) -> "_Paths":
        return _Paths(
            self.ray[k],
            rows(self.throughput, k),
            rows(self.directions, k),
            rows(self.positions, k),
            rows(self.normals, k),
            self.hits.where(k),
            self.near[k],
        )


class GatherRays:
    """Rays that gather radiance from a scene's cache.

    Parameters
    ----------
    direct : DirectLight
        For where the cache is not asked.
    beyond : GatherRays, optional
        For what lies behind the first surfaces that rays meet, where light is cut off after some bounces.
    """

    def __init__(
        self,
        scene: Scene,
        tracer: TransparencyTracer,
        direct: DirectLight,
        cache: RadianceCache,
        beyond: "GatherRays | None" = None,
    ) -> None:
        self._beyond: GatherRays = beyond or self
        self._scene, self._tracer, self._directs, self._cache = scene, tracer, [direct], cache
        # One more entry for triangle −1
        self._narrow = np.append(scene.materials.glossy_or_glass[scene.material_of_triangle], False)
        self._any_narrow = bool(self._narrow.any())
        self._diffuse = np.append(scene.materials.has(Lobe.DIFFUSE)[scene.material_of_triangle], False)
        self._translucent = np.append(scene.materials.has(Lobe.TRANSLUCENT)[scene.material_of_triangle], False)

    @staticmethod
    def beside(rays: "Sequence[GatherRays]") -> "GatherRays":
        """The same rays for several lights that differ in all but surfaces: `Incoming` has three columns of each.

        What costs most, to find what rays meet and where they go on, is done once for all of them.
        """
        if len(rays) == 1:
            return rays[0]
        joined = copy(rays[0])
        joined._directs = [one._directs[0] for one in rays]
        joined._cache = RadianceCache.beside([one._cache for one in rays])
        own = all(one._beyond is one for one in rays)
        joined._beyond = joined if own else GatherRays.beside([one._beyond for one in rays])
        return joined

    @property
    def n_lights(self) -> int:
        """How many lights lie side by side."""
        return len(self._directs)

    def _wide(self, values: np.ndarray) -> np.ndarray:
        """Values (n, 3) that hold for each of the lights, (n, 3 l)."""
        return values if self.n_lights == 1 else np.tile(values, self.n_lights)

    def _of_lights(self, of_one: Callable[..., np.ndarray], *at: Any) -> np.ndarray:
        """What `of_one` says of each `DirectLight` and of what follows, (n, 3) each, side by side, (n, 3 l)."""
        return np.concatenate([of_one(direct, *at) for direct in self._directs], axis=1)

    def radiance_along(
        self,
        origins: np.ndarray,
        directions: np.ndarray,
        random: np.random.Generator,
        facets: np.ndarray | None = None,
        focused: bool = False,
    ) -> Incoming:
        """What rays meet; the mean over cosine-weighted directions is E/π.

        Parameters
        ----------
        origins, directions : (n, 3) float32
            Points off their surface and unit directions.
        facets : (n, 3) float32, optional
            Geometric normals: no light comes from behind them.
        focused : bool
            Bring also what mirrors, glass and narrow gloss show of lamps, emission and worlds, as `reflected`; not for
            several lights side by side.
        """
        hits = self._tracer.closest_hit(origins, directions)
        throughput = hits.tinted(np.ones((len(origins), 3), np.float32))
        sky = self._wide(throughput) * self._of_lights(DirectLight.unsampled_sky, hits, directions)
        reflected = np.zeros_like(sky)
        paths = self._look_up(reflected, np.arange(len(origins)), throughput, directions, hits, True, random)
        for step in range(_MAX_HITS):
            if len(paths.ray) == 0:
                break
            rays = self._beyond if step else self
            paths = rays._follow(reflected, paths, step, random, focused)
        if facets is not None:
            above = (dot(directions, facets) > 0)[:, None]
            reflected, sky = reflected * above, sky * above
        return Incoming(reflected, sky, hits)

    def _look_up(
        self,
        radiance: np.ndarray,
        ray: np.ndarray,
        throughput: np.ndarray,
        directions: np.ndarray,
        hits: Hits,
        near_allowed: bool,
        random: np.random.Generator,
    ) -> _Paths:
        """Add what the cache says to the rays' `radiance`; return the paths that have to be followed."""
        reflected, near = self._cache.look_up(hits, directions)
        # What shines through a leaf is lit from its other side: only the cache knows both
        near &= near_allowed & self._diffuse[hits.triangle] & ~self._translucent[hits.triangle]
        reflected = np.where(near[:, None], np.float32(0), reflected * self._wide(throughput))
        followed, scale = near.copy(), np.ones(len(ray), np.float32)
        if self._any_narrow:
            # Light the narrow lobes, and follow them in proportion to what they reflect
            k = np.flatnonzero(self._narrow[hits.triangle])
            paths = _Paths.at(self._scene, k, ray, throughput, directions, hits, near)
            surface, cosine = self._surface(paths.hits, paths.directions)
            reflected[k] *= self._wide(base_transmittance(surface, cosine))
            glossy = largest(glossy_albedo(surface, cosine))
            self._add_glossy(radiance, paths, surface, random)
            albedo = glossy + largest(glass_albedo(surface))
            chance = np.minimum(_FOLLOWED * albedo * np.minimum(largest(paths.throughput), 1), 1)
            followed[k] |= random.random(len(k), dtype=np.float32) < chance
            scale[k] = np.where(near[k], 1, 1 / np.maximum(chance, np.float32(1e-6)))
        radiance[ray] += reflected
        k = np.flatnonzero(followed)
        return _Paths.at(self._scene, k, ray, throughput * scale[:, None], directions, hits, near)

    def _surface(self, hits: Hits, directions: np.ndarray) -> tuple[Surface, np.ndarray]:
        """Scattering where rays met surfaces, and the cosines at which they did."""
        surface = surface_at(self._scene, hits.triangle, hits.u, hits.v, hits.back(directions))
        return surface, np.abs(dot(hits.normal, directions))

    def _follow(
        self, radiance: np.ndarray, paths: _Paths, step: int, random: np.random.Generator, focused: bool
    ) -> _Paths:
        """Add direct light where paths have come to in `step` steps, and send them on."""
        scene = self._scene
        near_allowed = step < _MAX_NEAR_HITS - 1
        most = np.float32(1 if step < _MAX_NEAR_HITS else _LATE_SURVIVAL)
        if paths.near.any():
            self._add_diffuse(radiance, paths.where(np.flatnonzero(paths.near)), random)

        # Send rays on: from near hits by any lobe, from far ones by those that the cache does not hold
        parts = []
        for near, lobes in ((True, ALL_LOBES), (False, NARROW_LOBES)):
            k = np.flatnonzero(paths.near == near)
            if len(k) == 0:
                continue
            part = paths.where(k)
            on = scatter(scene, part.hits, part.positions, part.directions, part.normals, random, lobes)
            throughput = part.throughput * on.weight
            survival = np.minimum(largest(throughput), most)
            alive = np.flatnonzero(random.random(len(k), dtype=np.float32) < survival)
            throughput = rows(throughput, alive) / survival[alive, None]
            ray, origins, onward = part.ray[alive], rows(on.origins, alive), rows(on.directions, alive)
            hits = self._tracer.closest_hit(origins, onward, on.kind[alive])
            throughput = hits.tinted(throughput)
            light = self._of_lights(DirectLight.unsampled_sky, hits, onward)
            wide = np.flatnonzero(on.lobe[alive] < Lobe.GLOSSY)
            k = alive[wide]
            left = part.hits.where(k)
            side = np.where(on.lobe[k] == Lobe.TRANSLUCENT, np.float32(-1), np.float32(1))[:, None]
            shading = side * scene.shading_normals(left.triangle, left.u, left.v, rows(part.normals, k))
            light[wide] = self._of_lights(DirectLight.met, hits.where(wide), rows(onward, wide), shading)
            if focused:
                k = np.flatnonzero(on.lobe[alive] >= Lobe.GLOSSY)
                light[k] = self._focused_light(part.where(alive[k]), on.where(alive[k]), hits.where(k), light[k])
            radiance[ray] += self._wide(throughput) * light
            parts.append(self._beyond._look_up(radiance, ray, throughput, onward, hits, near_allowed, random))
        return _join(parts)

    def _focused_light(self, paths: _Paths, on: Scattered, hits: Hits, light: np.ndarray) -> np.ndarray:
        """All that shines along rays that narrow lobes send on, where no shadow ray asks for it; elsewhere `light`."""
        scene, left = self._scene, paths.hits
        k = np.flatnonzero(on.focused)
        on, to = on.where(k), hits.where(k)
        objects = scene.object_of_triangle[left.triangle[k]]
        light[k] = emission_met(scene, to, on.directions)
        light[k] += lamps_along(scene.lights, on.origins, on.directions, to.distance, on.kind, objects)
        return light

    def _add_diffuse(self, radiance: np.ndarray, paths: _Paths, random: np.random.Generator) -> None:
        """Direct light that the diffuse lobe reflects, and caustics; what rays own of it comes with the next ray."""
        scene, hits = self._scene, paths.hits
        origins = paths.positions + scene.ray_offset(paths.hits.triangle, paths.positions) * paths.normals
        objects = scene.object_of_triangle[hits.triangle]
        normals = scene.shading_normals(hits.triangle, hits.u, hits.v, paths.normals)
        light = self._of_lights(lambda direct: direct.sample(origins, normals, objects, random).irradiance)
        reflected = self._wide(scene.albedo(hits.triangle, hits.u, hits.v)) * light / np.float32(np.pi)
        reflected += self._cache.caustic_at(hits, paths.directions)
        if self._any_narrow:
            surface, cosine = self._surface(hits, paths.directions)
            reflected *= self._wide(base_transmittance(surface, cosine))
        radiance[paths.ray] += self._wide(paths.throughput) * reflected

    def _add_glossy(self, radiance: np.ndarray, paths: _Paths, surface: Surface, random: np.random.Generator) -> None:
        """Direct light that rough glossy lobes reflect: highlights are bright, however little it is on average."""
        k = np.flatnonzero(reflects_highlights(surface))
        if len(k) == 0:
            return
        scene, paths, surface = self._scene, paths.where(k), surface.where(k)
        hits = paths.hits
        normals = scene.shading_normals(hits.triangle, hits.u, hits.v, paths.normals)
        normals = facing(normals, paths.normals, paths.directions)
        origins = paths.positions + scene.ray_offset(paths.hits.triangle, paths.positions) * paths.normals
        axes, objects = local_axes(normals), scene.object_of_triangle[hits.triangle]

        def of_one(direct: DirectLight) -> np.ndarray:
            light = direct.sample(origins, normals, objects, random, rays_own=False)
            wo, wi = (np.einsum("nij,nj->ni", axes, d) for d in (-paths.directions, light.direction))
            return evaluate_broad(surface, wo, wi) * light.irradiance

        radiance[paths.ray] += self._wide(paths.throughput) * self._of_lights(of_one)


def _join(parts: list[_Paths]) -> _Paths:
    """Paths of several parts, in order."""
    if len(parts) == 1:
        return parts[0]
    names = ("ray", "throughput", "directions", "positions", "normals", "near")
    arrays = {name: np.concatenate([getattr(part, name) for part in parts]) for name in names}
    return _Paths(hits=Hits.join([part.hits for part in parts]), **arrays)
