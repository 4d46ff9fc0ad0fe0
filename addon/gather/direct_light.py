"""Direct light at points, by next-event estimation over lamps and emissive triangles.

For each point M candidates are drawn from sources by power, one of them is kept in proportion to the irradiance that it
would give unshadowed, and one shadow ray decides (resampled importance sampling: Talbot et al. 2005). With candidates
y drawn with density p, and w(y) = f(y)/p(y), the kept one gives f(y)/p(y) · (Σw/M) / w(y), whose mean is ∫f.
"""

import numpy as np

from ..parallel import ordered_map, slices
from ..photons import Source
from ..photons.emission import emissive_triangles, sample_area_lamp
from ..progress import Progress
from ..receivers import Receivers
from ..sampling.streams import stream
from ..sampling.warps import sample_uniform_cone, sample_uniform_triangle, to_world
from ..scene import LightKind, Scene
from ..tracers import Tracer

MAX_CANDIDATES = 8
N_SAMPLES = 64
_AT_RECEIVERS = 31  # stream of random numbers


class DirectLight:
    """Estimates of the irradiance that comes straight from lamps and emissive meshes; the world is not among them.

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
        single = lit.sum() == 1 and not len(self._emissive)
        self._n_candidates = 1 if single else MAX_CANDIDATES

    @property
    def dark(self) -> bool:
        """There is nothing to sample."""
        return not (self._chance > 0).any()

    def irradiance(self, positions: np.ndarray, normals: np.ndarray, random: np.random.Generator) -> np.ndarray:
        """One estimate of the direct irradiance at each point, (n, 3) float32, W/m².

        Parameters
        ----------
        positions, normals : (n, 3) float32
            Points off their surface, and the unit normals of the sides that are lit.
        """
        n, m = len(positions), self._n_candidates
        if n == 0 or self.dark:
            return np.zeros((n, 3), np.float32)
        # Draw candidates, stratified over the sources
        steps = (np.arange(m) + random.random((n, 1))) / m
        chosen = np.searchsorted(self._cumulative, steps.ravel() * self._cumulative[-1], side="right")
        chosen = np.minimum(chosen, len(self._chance) - 1)
        u = random.random((n * m, 3), dtype=np.float32)
        targets, unshadowed = self._incident(chosen, np.repeat(positions, m, 0), np.repeat(normals, m, 0), u)
        estimates = unshadowed / self._chance[chosen, None]

        # Keep one in proportion to its brightness
        weights = estimates.mean(axis=1, dtype=np.float64).reshape(n, m)
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
        return result

    def _incident(
        self, source: np.ndarray, positions: np.ndarray, normals: np.ndarray, u: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """A point on each source and the irradiance from it over its density: (n, 3) m, (n, 3) W/m²."""
        lights = self._scene.lights
        kind = np.append(lights.kind, np.int32(-1))[source]
        targets, irradiance = np.zeros_like(positions), np.zeros_like(positions)
        for kinds, sample in (
            ((LightKind.POINT, LightKind.SPOT), self._from_spheres),
            ((LightKind.RECTANGLE, LightKind.ELLIPSE), self._from_areas),
            ((LightKind.SUN,), self._from_suns),
            ((-1,), self._from_meshes),
        ):
            k = np.flatnonzero(np.isin(kind, kinds))
            if len(k):
                targets[k], irradiance[k] = sample(source[k], positions[k], normals[k], u[k])
        return targets, irradiance

    def _from_spheres(self, lamp, positions, normals, u):
        """Point and spot lamps: uniform directions in the cone that the lamp's sphere fills.

        L = I/(πr²) over the solid angle Ω = 2π(1 − cos α) with sin α = r/d; L Ω → I/d² as r → 0.
        """
        lights = self._scene.lights
        way, distance = _direction(positions, lights.position[lamp])
        ratio = np.minimum(lights.radius[lamp] / distance, 1)
        cos_max = np.sqrt(1 - ratio**2)
        local = sample_uniform_cone(u[:, :2], cos_max)
        directions = to_world(local, way)
        # 2(1 − cos α)/sin²α = 2/(1 + cos α), which needs no special case for a point
        normal_irradiance = lights.emission[lamp] * (2 / (1 + cos_max) / distance**2)[:, None]
        spot = lights.kind[lamp] == LightKind.SPOT
        falloff = lights.spot_falloff(lamp, -_dot(directions, lights.direction[lamp]))
        cosine = np.maximum(_dot(directions, normals), 0) * np.where(spot, falloff, 1)
        # The near side of the sphere, or its centre's distance for a point
        along = distance * local[:, 2]
        to_sphere = along - np.sqrt(np.maximum(lights.radius[lamp] ** 2 - distance**2 + along**2, 0))
        return positions + np.maximum(to_sphere, 0)[:, None] * directions, normal_irradiance * cosine[:, None]

    def _from_areas(self, lamp, positions, normals, u):
        """Area lamps: points uniform by area; E = L A cos θ cos θ' / d², from the front only."""
        lights = self._scene.lights
        targets = sample_area_lamp(lights, lamp, u[:, :2])
        directions, distance = _direction(positions, targets)
        cosines = np.maximum(_dot(directions, normals), 0) * np.maximum(-_dot(directions, lights.direction[lamp]), 0)
        return targets, lights.emission[lamp] * (lights.area(lamp) * cosines / distance**2)[:, None]

    def _from_suns(self, lamp, positions, normals, u):
        """Suns: directions uniform over the disc; E = E₀ cos θ · 2/(1 + cos(α/2)), see `SunSource`."""
        lights = self._scene.lights
        cos_max = lights.cos_half_cone(lamp)
        directions = -to_world(sample_uniform_cone(u[:, :2], cos_max), lights.direction[lamp])
        cosine = np.maximum(_dot(directions, normals), 0)
        targets = positions + np.float32(2 * self._scene.diagonal) * directions
        return targets, lights.emission[lamp] * (cosine * 2 / (1 + cos_max))[:, None]

    def _from_meshes(self, _, positions, normals, u):
        """Emissive triangles, by power, then uniform by area; E = L A cos θ |cos θ'| / (d² P(triangle))."""
        scene = self._scene
        k = np.searchsorted(self._emissive_cumulative, u[:, 2], side="right")
        k = np.minimum(k, len(self._emissive) - 1)
        triangle = self._emissive[k]
        targets = scene.points(triangle, *sample_uniform_triangle(u[:, :2]))
        directions, distance = _direction(positions, targets)
        cosines = np.maximum(_dot(directions, normals), 0) * np.abs(_dot(directions, scene.normals[triangle]))
        weight = scene.areas[triangle] / self._emissive_chance[k] * cosines / distance.astype(np.float64) ** 2
        radiance = scene.materials.emission[scene.material_of_triangle[triangle]]
        return targets, (radiance * weight[:, None]).astype(np.float32)


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum("ij,ij->i", a, b)


def _direction(positions: np.ndarray, targets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit directions from positions to targets, and the distances (at least 1e-6 m: nothing is infinitely close)."""
    way = targets - positions
    distance = np.maximum(np.sqrt(_dot(way, way)), np.float32(1e-6))
    return way / distance[:, None], distance


def direct_irradiance(
    direct: DirectLight, receivers: Receivers, seed: int, n_threads: int = 0, progress: Progress | None = None
) -> np.ndarray:
    """Direct irradiance of receivers, the mean of `N_SAMPLES` estimates, (n, 3) float32, W/m²."""
    progress = progress or Progress()

    def estimate(item: tuple[int, slice]) -> tuple[slice, np.ndarray]:
        index, chunk = item
        positions, normals = (np.repeat(of[chunk], N_SAMPLES, 0) for of in (receivers.position, receivers.normal))
        samples = direct.irradiance(positions, normals, stream(seed, _AT_RECEIVERS, index))
        return chunk, samples.reshape(-1, N_SAMPLES, 3).mean(axis=1)

    irradiance = np.zeros((len(receivers), 3), np.float32)
    for chunk, value in ordered_map(estimate, enumerate(slices(len(receivers), 1024)), n_threads):
        irradiance[chunk] = value
        progress.update("Adding direct light", chunk.stop / len(receivers))
    return irradiance
