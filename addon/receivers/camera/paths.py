"""Samples followed from the camera over mirrors and clear glass, and the light that they meet there."""

import numpy as np

from ...bsdf import Lobe, is_mirror, surface_at
from ...core.sampling.vectors import dot
from ...emitters.lamp_hits import lamps_along
from ...photons.scattering import NARROW_LOBES, Scattered, scatter, scatter_both_ways
from ...scene import RayKind, Scene
from ...tracing import Hits, TransparencyTracer
from ...tracing.emission import emission_met

_MOST_FOLLOWED = 8
"""Mirrors and surfaces of glass that a sample is followed over: through four bodies of glass."""

_MOST_SPLIT = 2
"""Surfaces of glass, the first ones, at which a sample goes both ways: through one body, and what it mirrors inside."""

_COLUMNS = ("directions", "throughput", "distance", "sample", "share", "n_followed", "lamplight")


class FollowedPaths:
    """Samples on their way, and what glass splits off them: n rays and where they end, all that there is of each.

    Attributes
    ----------
    sample : (n,) int64
    share, throughput, n_followed
        As in `CameraSamples`.
    distance : (n,) float32, m
        Of all the way.
    lamplight : (n, 3) float32, W/(m² sr)
        Of the lamps met over more than one mirror or surface of glass.
    """

    def __init__(self, hits: Hits, directions: np.ndarray, throughput: np.ndarray, distance: np.ndarray) -> None:
        self.hits, self.directions = hits, directions
        self.throughput, self.distance = throughput, distance
        n = len(directions)
        self.sample, self.share = np.arange(n), np.ones(n, np.float32)
        self.n_followed, self.lamplight = np.zeros(n, np.uint8), np.zeros_like(throughput)

    def follow(self, scene: Scene, tracer: TransparencyTracer, random: np.random.Generator) -> None:
        """Send those on that met a mirror or clear glass, until they meet something else; a few are dropped."""
        k = self._at_mirrors(scene, np.flatnonzero(self.hits.hit))
        if len(k) == 0:
            return
        self.hits, self.distance = self.hits.with_tint(), self.distance.copy()
        self.directions = self.directions.copy()
        for step in range(_MOST_FOLLOWED):
            if len(k) == 0:
                return
            k, on, normals, objects = self._scattered(scene, k, step < _MOST_SPLIT, random)
            kind = np.where(dot(on.directions, normals) > 0, RayKind.GLOSSY, RayKind.TRANSMITTED)
            onward = tracer.closest_hit(on.origins, on.directions, kind)
            self.hits.put(k, onward)
            self.directions[k] = on.directions
            self.throughput[k] *= onward.tinted(on.weight)
            if step > 0:
                met = lamps_along(scene.lights, on.origins, on.directions, onward.distance, kind, objects)
                self.lamplight[k] += self.throughput[k] * met
            self.distance[k] += np.where(onward.hit, onward.distance, 0)
            self.n_followed[k] += 1
            k = self._at_mirrors(scene, k[onward.hit])
        self.hits.put(k, Hits.none(len(k)))
        self.throughput[k] = 0

    def _scattered(
        self, scene: Scene, k: np.ndarray, split: bool, random: np.random.Generator
    ) -> tuple[np.ndarray, Scattered, np.ndarray, np.ndarray]:
        """Which paths go on and where, from what normals (m, 3) and objects (m,); what goes nowhere ends here.

        With `split`, those at surfaces of glass alone go both ways, one of them as a new path.
        """
        hits, directions = self.hits.where(k), self.directions[k]
        positions, normals = hits.points(scene, directions)
        materials, material = scene.materials, scene.material_of_triangle[hits.triangle]
        both = split & ~materials.has(Lobe.GLOSSY)[material]
        one, two = np.flatnonzero(~both), np.flatnonzero(both)
        at = [(hits.where(i), positions[i], directions[i], normals[i], random) for i in (one, two)]
        parts = [scatter(scene, *at[0], NARROW_LOBES), *scatter_both_ways(scene, *at[1])]
        reflected, refracted = (part.weight.mean(axis=1) for part in parts[1:])
        total = np.maximum(reflected + refracted, np.float32(1e-20))
        rows = np.concatenate([k[one], self._copied(k[two]), k[two]])
        self.share[rows] *= np.concatenate([np.ones(len(one), np.float32), reflected / total, refracted / total])

        on, of = Scattered.join(parts), np.concatenate([one, two, two])
        alive = on.weight.any(axis=1)
        self.hits.put(rows[~alive], Hits.none(int((~alive).sum())))
        self.throughput[rows[~alive]] = 0
        i = np.flatnonzero(alive)
        return rows[i], on.where(i), normals[of[i]], scene.object_of_triangle[hits.triangle[of[i]]]

    def _copied(self, k: np.ndarray) -> np.ndarray:
        """Indices of copies of the paths k, which come after all others."""
        n = len(self.sample)
        self.hits = Hits.join([self.hits, self.hits.where(k)])
        for name in _COLUMNS:
            values = getattr(self, name)
            setattr(self, name, np.concatenate([values, values[k]]))
        self.lamplight[n:] = 0
        return np.arange(n, n + len(k))

    def _at_mirrors(self, scene: Scene, k: np.ndarray) -> np.ndarray:
        """Those of the paths k that met something that scatters light in smooth lobes alone."""
        materials = scene.materials
        material = scene.material_of_triangle[self.hits.triangle[k]]
        k = k[(materials.glossy_or_glass & ~materials.spreads_light)[material]]
        met = self.hits.where(k)
        return k[is_mirror(surface_at(scene, met.triangle, met.u, met.v, met.back(self.directions[k])))]

    def light_beyond(self, scene: Scene) -> np.ndarray:
        """What is emitted and met over more than one mirror or surface of glass, (samples, 3), W/(m² sr)."""
        light, k = self.lamplight.copy(), np.flatnonzero(self.n_followed > 1)
        light[k] += self.throughput[k] * emission_met(scene, self.hits.where(k), self.directions[k])
        return np.stack([np.bincount(self.sample, column) for column in light.T], axis=1)
