"""Direct light at points, by next-event estimation over lamps and emissive triangles.

For each point M candidates are drawn from sources by power, one of them is kept in proportion to the irradiance that it
would give unshadowed, and one shadow ray decides (resampled importance sampling: Talbot et al. 2005). With candidates
y drawn with density p, and w(y) = f(y)/p(y), the kept one gives f(y)/p(y) · (Σw/M) / w(y), whose mean is ∫f.

Close to an emissive mesh f/p has no bound. There a cosine-weighted ray finds the mesh instead: each point of it is
sampled by the way that finds it more often (the maximum heuristic: Veach 1997, 9.2.4).
"""

import numpy as np

from ..parallel import Workers
from ..photons import Source
from ..photons.emission import emissive_triangles, sample_area_lamp
from ..receivers import Receivers
from ..sampling.vectors import dot
from ..sampling.warps import (
    sample_cosine_hemisphere,
    sample_uniform_cone,
    sample_uniform_disk,
    sample_uniform_triangle,
    to_world,
)
from ..scene import LightKind, Scene
from ..tracers import Hits, Tracer

MAX_CANDIDATES = 8
N_SAMPLES = 64
_MESH = -1  # kind of the source that stands for all emissive triangles
_AT_RECEIVERS = 31  # stream of random numbers


class DirectLight:
    """Estimates of the irradiance that comes straight from lamps and emissive meshes, and on request from the world.

    Parameters
    ----------
    sources : list of Source
        From `light_sources`; those with `sampled_directly` are sampled.
    """

    def __init__(self, scene: Scene, tracer: Tracer, sources: list[Source]) -> None:
        self._scene, self._tracer = scene, tracer
        self._emissive, self._emissive_chance, _ = emissive_triangles(scene)
        self._emissive_cumulative = np.cumsum(self._emissive_chance)
        # The index after the last lamp stands for all emissive triangles.
        power = np.zeros(len(scene.lights) + 1)
        for source in sources:
            if source.sampled_directly:
                power[source.lamp] = source.power.sum()
        lit = power > 0
        # Half by power, half evenly: a weak lamp close by must not be missed.
        chance = power / power.sum() / 2 + lit / lit.sum() / 2 if lit.any() else power
        self._chance, self._cumulative = chance.astype(np.float32), np.cumsum(chance)
        # Density by area with which a point of each triangle is drawn, 1/m²
        self._density = np.zeros(scene.n_triangles, np.float32)
        of_mesh = self._emissive_chance * chance[-1]
        self._density[self._emissive] = of_mesh / scene.areas[self._emissive]
        single = lit.sum() == 1 and not len(self._emissive)
        self._n_candidates = 1 if single else MAX_CANDIDATES

    def irradiance(
        self, positions: np.ndarray, normals: np.ndarray, random: np.random.Generator, rays_follow: bool = False
    ) -> np.ndarray:
        """One estimate of the direct irradiance at each point, (n, 3) float32, W/m².

        Parameters
        ----------
        positions, normals : (n, 3) float32
            Points off their surface, and the unit normals of the sides that are lit.
        rays_follow : bool
            The caller sends a cosine-weighted ray from each point anyway, and adds what `emission_met` says of it.
        """
        n, m = len(positions), self._n_candidates
        if n == 0 or not (self._chance > 0).any():
            return np.zeros((n, 3), np.float32)
        # Draw candidates, stratified over the sources
        steps = (np.arange(m) + random.random((n, 1))) / m
        chosen = np.searchsorted(self._cumulative, steps.ravel() * self._cumulative[-1], side="right")
        chosen = np.minimum(chosen, len(self._chance) - 1)
        u = random.random((n * m, 3), dtype=np.float32)
        targets, unshadowed = self._incident(chosen, np.repeat(positions, m, 0), np.repeat(normals, m, 0), u)
        estimates = unshadowed / self._chance[chosen, None]

        # Keep one in proportion to its brightness
        weights = (estimates @ np.full(3, 1 / 3, np.float32)).astype(np.float64).reshape(n, m)
        cumulative = np.cumsum(weights, axis=1)
        total = cumulative[:, -1]
        threshold = random.random(n) * total
        kept = np.minimum((cumulative <= threshold[:, None]).sum(1), m - 1)
        k = np.arange(n) * m + kept

        # Ask whether it is seen
        lit = np.flatnonzero(total > 0)
        seen = lit[~self._tracer.occluded(positions[lit], targets[k[lit]])]
        scale = total[seen] / m / np.take_along_axis(weights, kept[:, None], 1)[seen, 0]
        result = np.zeros((n, 3), np.float32)
        result[seen] = estimates[k[seen]] * scale[:, None].astype(np.float32)
        if len(self._emissive) and not rays_follow:
            result += np.float32(np.pi) * self._seen_by_rays(positions, normals, random)[0]
        return result

    def _seen_by_rays(
        self, positions: np.ndarray, normals: np.ndarray, random: np.random.Generator
    ) -> tuple[np.ndarray, np.ndarray]:
        """Radiance that a cosine-weighted ray meets: `emission_met`, and the world's, (n, 3) float32 each."""
        u = random.random((len(positions), 2), dtype=np.float32)
        directions = to_world(sample_cosine_hemisphere(u), normals)
        hits = self._tracer.closest_hit(positions, directions)
        sky = np.where(hits.hit[:, None], np.float32(0), self._scene.world.radiance(directions))
        return self.emission_met(hits, directions, normals), sky

    def irradiance_with_sky(
        self, positions: np.ndarray, normals: np.ndarray, random: np.random.Generator
    ) -> np.ndarray:
        """As `irradiance`, and the world's light."""
        glow, sky = self._seen_by_rays(positions, normals, random)
        return self.irradiance(positions, normals, random, rays_follow=True) + np.float32(np.pi) * (glow + sky)

    def emission_met(self, hits: Hits, directions: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Radiance emitted by what cosine-weighted rays meet, where they find it more often, (n, 3) float32.

        Parameters
        ----------
        directions, normals : (n, 3) float32
            Of the rays, and of the surfaces that they start from.
        """
        scene = self._scene
        radiance = np.zeros((len(directions), 3), np.float32)
        if len(self._emissive) == 0:
            return radiance
        k = np.flatnonzero(hits.hit & (self._density[hits.triangle] > 0))
        cosines = dot(directions[k], normals[k]) * np.abs(dot(directions[k], hits.normal[k]))
        by_ray = self._rays_find_more(hits.triangle[k], cosines, hits.distance[k])
        radiance[k] = by_ray[:, None] * scene.emission(hits.triangle[k], hits.u[k], hits.v[k])
        return radiance

    def _rays_find_more(self, triangle: np.ndarray, cosines: np.ndarray, distance: np.ndarray) -> np.ndarray:
        """Whether a cosine-weighted ray has the higher density by area, cos θ cos θ'/(πd²), (n,) bool."""
        return cosines > np.float32(np.pi) * distance**2 * self._density[triangle]

    def _incident(
        self, source: np.ndarray, positions: np.ndarray, normals: np.ndarray, u: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """A point on each source and the irradiance from it over its density: (n, 3) m, (n, 3) W/m²."""
        lights = self._scene.lights
        kind = np.append(lights.kind, np.int32(_MESH))[source]
        targets, irradiance = np.zeros_like(positions), np.zeros_like(positions)
        for kinds, sample in (
            ((LightKind.POINT, LightKind.SPOT), self._from_points),
            ((LightKind.RECTANGLE, LightKind.ELLIPSE), self._from_areas),
            ((LightKind.SUN,), self._from_suns),
        ):
            k = np.flatnonzero(np.isin(kind, kinds))
            if len(k):
                targets[k], irradiance[k] = sample(source[k], positions[k], normals[k], u[k])
        k = np.flatnonzero(kind == _MESH)
        if len(k):
            targets[k], irradiance[k] = self._from_meshes(positions[k], normals[k], u[k])
        return targets, irradiance

    def _from_points(
        self, lamp: np.ndarray, positions: np.ndarray, normals: np.ndarray, u: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Point and spot lamps: points of the disc of radius r that faces the position, of radiance L = I/(πr²).

        E = L A cos θ cos θ' / d² = I cos θ cos θ' / d², which on the axis adds up to I/(d² + r²), as in Cycles.
        """
        lights = self._scene.lights
        axis, _ = _direction(lights.position[lamp], positions)
        disc = np.concatenate([sample_uniform_disk(u[:, :2]), np.zeros((len(u), 1), np.float32)], axis=1)
        targets = lights.position[lamp] + lights.radius[lamp, None] * to_world(disc, axis)
        directions, distance = _direction(positions, targets)
        cosines = np.maximum(dot(directions, normals), 0) * -dot(directions, axis)
        spot = lights.kind[lamp] == LightKind.SPOT
        falloff = np.where(spot, lights.spot_falloff(lamp, -dot(directions, lights.direction[lamp])), 1)
        return targets, lights.emission[lamp] * (cosines * falloff / distance**2)[:, None]

    def _from_areas(
        self, lamp: np.ndarray, positions: np.ndarray, normals: np.ndarray, u: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Area lamps: points uniform by area; E = L A cos θ cos θ' / d², from the front only."""
        lights = self._scene.lights
        targets = sample_area_lamp(lights, lamp, u[:, :2])
        directions, distance = _direction(positions, targets)
        cosines = np.maximum(dot(directions, normals), 0) * np.maximum(-dot(directions, lights.direction[lamp]), 0)
        return targets, lights.emission[lamp] * (lights.area(lamp) * cosines / distance**2)[:, None]

    def _from_suns(
        self, lamp: np.ndarray, positions: np.ndarray, normals: np.ndarray, u: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Suns: directions uniform over the disc; E = E₀ cos θ · 2/(1 + cos(α/2)), see `SunSource`."""
        lights = self._scene.lights
        cos_max = lights.cos_half_cone(lamp)
        directions = -to_world(sample_uniform_cone(u[:, :2], cos_max), lights.direction[lamp])
        cosine = np.maximum(dot(directions, normals), 0)
        targets = positions + np.float32(2 * self._scene.diagonal) * directions
        return targets, lights.emission[lamp] * (cosine * 2 / (1 + cos_max))[:, None]

    def _from_meshes(self, positions: np.ndarray, normals: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Emissive triangles, by power, then uniform by area; E = L A cos θ |cos θ'| / (d² P(triangle))."""
        scene = self._scene
        k = np.searchsorted(self._emissive_cumulative, u[:, 2], side="right")
        k = np.minimum(k, len(self._emissive) - 1)
        triangle = self._emissive[k]
        place = sample_uniform_triangle(u[:, :2])
        targets = scene.points(triangle, *place)
        directions, distance = _direction(positions, targets)
        cosines = np.maximum(dot(directions, normals), 0) * np.abs(dot(directions, scene.normals[triangle]))
        weight = scene.areas[triangle] / self._emissive_chance[k] * cosines / distance.astype(np.float64) ** 2
        weight = np.where(self._rays_find_more(triangle, cosines, distance), 0, weight)
        radiance = scene.emission(triangle, *place)
        return targets, (radiance * weight[:, None]).astype(np.float32)


def _direction(positions: np.ndarray, targets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit directions from positions to targets, and the distances (at least 1e-6 m: nothing is infinitely close)."""
    way = targets - positions
    distance = np.maximum(np.sqrt(dot(way, way)), np.float32(1e-6))
    return way / distance[:, None], distance


def direct_irradiance(direct: DirectLight, receivers: Receivers, workers: Workers) -> np.ndarray:
    """Direct irradiance of receivers, the world's among it, mean of `N_SAMPLES` estimates, (n, 3) float32, W/m²."""

    def estimate(chunk: slice, random: np.random.Generator) -> np.ndarray:
        positions, normals = (np.repeat(of[chunk], N_SAMPLES, 0) for of in (receivers.position, receivers.normal))
        return direct.irradiance_with_sky(positions, normals, random).reshape(-1, N_SAMPLES, 3).mean(axis=1)

    irradiance = np.zeros((len(receivers), 3), np.float32)
    for chunk, value in workers.chunks("Adding direct light", len(receivers), 1024, estimate, (_AT_RECEIVERS,)):
        irradiance[chunk] = value
    return irradiance
