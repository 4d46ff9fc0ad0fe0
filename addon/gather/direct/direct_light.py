"""Direct light at points, by next-event estimation over lamps, emissive triangles and worlds that are images.

For each point M candidates are drawn from sources: lamps by what they would give around there, meshes and the world by
power. One of them is kept in proportion to the irradiance that it would give unshadowed, and one shadow ray decides
(resampled importance sampling: Talbot et al. 2005). With candidates y drawn with density p, and w(y) = f(y)/p(y), the
kept one gives f(y)/p(y) · (Σw/M) / w(y), whose mean is ∫f.

Close to an emissive mesh f/p has no bound, and where the world is dark f/p is large. There a cosine-weighted ray finds
them instead: each point and each direction is sampled by the way that finds it more often (the maximum heuristic:
Veach 1997, 9.2.4). What is left to such rays is called their own.
"""

from dataclasses import dataclass

import numpy as np

from ...core.sampling.vectors import dot, rows
from ...core.sampling.warps import (
    pdf_cosine_hemisphere,
    sample_cosine_hemisphere,
    sample_uniform_triangle,
    to_world,
)
from ...emitters import Source
from ...emitters.lamp_choice import LampChoice
from ...emitters.light_samples import directions_to, light_samples
from ...emitters.mesh_source import MeshSource
from ...scene import Scene
from ...tracing import Hits, TransparencyTracer

MAX_CANDIDATES = 4


@dataclass(frozen=True)
class Incident:
    """Estimates of the light that comes straight to n points.

    Attributes
    ----------
    irradiance : (n, 3) float32, W/m²
        Its mean is the irradiance; each estimate is of light from one direction.
    direction : (n, 3) float32
        Unit vectors from the points to where the light comes from; undefined where there is none.
    source : (n,) int
        The lamp that it comes from; from the number of lamps on, emissive meshes and worlds.
    """

    irradiance: np.ndarray
    direction: np.ndarray
    source: np.ndarray


class DirectLight:
    """Estimates of the light that comes straight from lamps, emissive meshes and worlds that are images.

    Constant worlds, which rays find just as well, come in where a method says so.

    Parameters
    ----------
    sources : list of Source
        From `light_sources`; those with `sampled_directly` are sampled.
    """

    def __init__(self, scene: Scene, tracer: TransparencyTracer, sources: list[Source]) -> None:
        self._scene, self._tracer = scene, tracer
        self._emissive, self._emissive_chance = np.zeros(0, np.int32), np.zeros(0)
        for source in sources:
            if isinstance(source, MeshSource):
                self._emissive, self._emissive_chance = source.triangles, source.chance
        self._emissive_cumulative = np.cumsum(self._emissive_chance)
        self._far_away = np.float32(2 * scene.diagonal)
        # After the lamps come all emissive triangles, and the world (whose index is −1)
        power = np.zeros(len(scene.lights) + 2)
        for source in sources:
            if source.sampled_directly:
                power[source.lamp] = source.importance
        lit = power > 0
        # Half by power, half evenly: a weak lamp close by must not be missed.
        chance = power / power.sum() / 2 + lit / lit.sum() / 2 if lit.any() else power
        self._lamps = LampChoice(scene, lit[:-2])
        self._mesh_chance, self._world_chance = np.float32(chance[-2]), np.float32(chance[-1])
        self._lamp_chance = np.float32(chance[:-2].sum())
        # Density by area with which a point of each triangle is drawn, 1/m²
        self._density = np.zeros(scene.n_triangles, np.float32)
        self._density[self._emissive] = self._emissive_chance * chance[-2] / scene.areas[self._emissive]
        self._n_candidates = 1 if lit.sum() == 1 and lit[:-2].any() else MAX_CANDIDATES
        self._any = bool(lit.any())
        self._rays_own_some = bool(lit[-2:].any())
        # Meshes, the world, and what is no object of the scene (−1) are linked to everything
        linked = scene.lights.illuminates
        self._illuminates = None if linked is None else np.pad(linked, ((0, 2), (0, 1)), constant_values=True)

    def irradiance(
        self, positions: np.ndarray, normals: np.ndarray, objects: np.ndarray | None, random: np.random.Generator
    ) -> np.ndarray:
        """One estimate of the direct irradiance at each point, without a constant world, (n, 3) float32, W/m².

        Parameters
        ----------
        positions, normals, objects
            As for `sample`.
        """
        result = self.sample(positions, normals, objects, random).irradiance
        if self._rays_own_some:
            hits, directions = self._rays(positions, normals, random)
            met = self._emission_met(hits, directions, normals) + self._sampled_sky_met(hits, directions, normals)
            result += np.float32(np.pi) * hits.tinted(met)
        return result

    def irradiance_with_sky(
        self, positions: np.ndarray, normals: np.ndarray, objects: np.ndarray | None, random: np.random.Generator
    ) -> np.ndarray:
        """One estimate of all direct irradiance at each point, (n, 3) float32, W/m²; see `irradiance`."""
        hits, directions = self._rays(positions, normals, random)
        own = np.float32(np.pi) * hits.tinted(self.met(hits, directions, normals))
        return self.sample(positions, normals, objects, random).irradiance + own

    def sample(
        self,
        positions: np.ndarray,
        normals: np.ndarray,
        objects: np.ndarray | None,
        random: np.random.Generator,
        rays_own: bool = True,
    ) -> Incident:
        """One estimate of the direct light at each point.

        Parameters
        ----------
        positions, normals : (n, 3) float32
            Points off their surface, and the unit normals of the sides that are lit.
        objects : (n,) int32 or None
            The objects that the points are on, for lamps that do not light all; None: they light all.
        rays_own : bool
            Leave out what a cosine-weighted ray finds more often. The caller sends one from each point, and adds what
            `met` says of it.
        """
        n, m = len(positions), self._n_candidates
        if n == 0 or not self._any:
            nothing = np.zeros((n, 3), np.float32)
            return Incident(nothing, nothing, np.full(n, len(self._scene.lights)))
        source, chance, u = self._draw(positions, random)
        targets, unshadowed = self._incident(
            source, np.repeat(positions, m, axis=0), np.repeat(normals, m, axis=0), u, rays_own
        )
        if objects is not None and self._illuminates is not None:
            unshadowed[~self._illuminates[source, np.repeat(objects, m)]] = 0
        estimates = unshadowed / np.maximum(chance, np.float32(1e-30))[:, None]

        # Keep one in proportion to its brightness
        weights = np.abs(estimates).mean(axis=1, dtype=np.float64).reshape(n, m)  # lamps may take light away
        cumulative = np.cumsum(weights, axis=1)
        total = cumulative[:, -1]
        threshold = random.random(n) * total
        kept = np.minimum((cumulative <= threshold[:, None]).sum(1), m - 1)
        k = np.arange(n) * m + kept

        # Ask whether it is seen
        lit = np.flatnonzero(total > 0)
        scale = (total / m)[lit] / np.take_along_axis(weights, kept[:, None], 1)[lit, 0]
        targets = rows(targets, k)
        passes = self._visibility(rows(positions, lit), rows(targets, lit), source[k[lit]])
        irradiance = np.zeros((n, 3), np.float32)
        irradiance[lit] = rows(estimates, k[lit]) * scale[:, None].astype(np.float32) * passes
        return Incident(irradiance, directions_to(positions, targets)[0], source[k])

    def met(self, hits: Hits, directions: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Radiance that cosine-weighted rays meet and that is their own, (n, 3) float32: of emissive triangles, and of
        the world, a constant one's among it. What see-through surfaces leave of it is for the caller to apply.

        Parameters
        ----------
        directions, normals : (n, 3) float32
            Of the rays, and of the surfaces that they start from.
        """
        radiance = self.unsampled_sky(hits, directions)
        radiance += self._emission_met(hits, directions, normals)
        return radiance + self._sampled_sky_met(hits, directions, normals)

    def unsampled_sky(self, hits: Hits, directions: np.ndarray) -> np.ndarray:
        """Radiance of a constant world where rays meet nothing, (n, 3) float32; none of a world that is an image."""
        world = self._scene.world
        if world.image is not None:
            return np.zeros((len(directions), 3), np.float32)
        return np.where(hits.hit[:, None], np.float32(0), world.radiance(directions))

    def _rays(self, positions: np.ndarray, normals: np.ndarray, random: np.random.Generator) -> tuple[Hits, np.ndarray]:
        """What a cosine-weighted ray from each point meets, and its direction."""
        u = random.random((len(positions), 2), dtype=np.float32)
        directions = to_world(sample_cosine_hemisphere(u), normals)
        return self._tracer.closest_hit(positions, directions), directions

    def _emission_met(self, hits: Hits, directions: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """The part of `met` that comes from emissive triangles."""
        scene = self._scene
        radiance = np.zeros((len(directions), 3), np.float32)
        k = np.flatnonzero(hits.hit & (self._density[hits.triangle] > 0)) if len(self._emissive) else np.zeros(0, int)
        triangle, u, v = hits.triangle[k], hits.u[k], hits.v[k]
        flown = rows(directions, k)
        cosines = dot(flown, rows(normals, k)) * np.abs(dot(flown, rows(hits.normal, k)))
        own = self._rays_find_more(triangle, cosines, hits.distance[k])
        # Rays stop in proportion to the coverage, so that it must not weigh what they meet
        radiance[k] = own[:, None] * scene.look_up(scene.materials.emission, triangle, u, v)
        return radiance

    def _sampled_sky_met(self, hits: Hits, directions: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """The part of `met` that comes from a world that is an image."""
        radiance = np.zeros((len(directions), 3), np.float32)
        if self._scene.world.image is None:
            return radiance
        k = np.flatnonzero(~hits.hit)
        flown = rows(directions, k)
        own = self._rays_see_more(flown, dot(flown, rows(normals, k)))
        radiance[k] = own[:, None] * self._scene.world.radiance(flown)
        return radiance

    def _rays_find_more(self, triangle: np.ndarray, cosines: np.ndarray, distance: np.ndarray) -> np.ndarray:
        """Whether a cosine-weighted ray has the higher density by area, cos θ cos θ'/(πd²), (n,) bool."""
        return cosines > np.float32(np.pi) * distance**2 * self._density[triangle]

    def _rays_see_more(self, directions: np.ndarray, cosine: np.ndarray) -> np.ndarray:
        """Whether a cosine-weighted ray has the higher density by solid angle, cos θ/π, than the world's, (n,) bool."""
        return pdf_cosine_hemisphere(cosine) > self._world_chance * self._scene.world.pdf(directions)

    def _visibility(self, positions: np.ndarray, targets: np.ndarray, source: np.ndarray) -> np.ndarray:
        """Share of the light of sources that reaches positions from targets, (n, 3) or (n, 1) float32."""
        blocked_by = self._scene.lights.blocked_by
        if blocked_by is None:
            return self._tracer.visibility(positions, targets)
        objects = self._scene.objects
        linked = np.append(~(blocked_by | ~objects.casts_shadow).all(axis=1), [False, False])
        passes = np.ones((len(positions), 3), np.float32)
        k = np.flatnonzero(~linked[source])
        passes[k] = self._tracer.visibility(rows(positions, k), rows(targets, k))
        for lamp in np.unique(source[linked[source]]):
            if not (blocked_by[lamp] & objects.casts_shadow).any():
                continue
            k = np.flatnonzero(source == lamp)
            directions, distance = directions_to(positions[k], targets[k])
            near = distance * np.float32(1 - 1e-4)
            passes[k] = self._tracer.transmittance(positions[k], directions, near, blocks=blocked_by[lamp])
        return passes

    def _draw(self, positions: np.ndarray, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Candidates, stratified over the sources: source and its chance, (n · m,), and random numbers, (n · m, 3)."""
        n, m, n_lamps = len(positions), self._n_candidates, len(self._scene.lights)
        steps = ((np.arange(m) + random.random((n, 1))) / m).ravel()
        steps *= self._lamp_chance + self._mesh_chance + self._world_chance
        source = np.where(steps < self._lamp_chance + self._mesh_chance, n_lamps, n_lamps + 1)
        chance = np.where(source == n_lamps, self._mesh_chance, self._world_chance)
        k = np.flatnonzero(steps < self._lamp_chance)
        if len(k):
            source[k], chance[k] = self._lamps.choose(rows(positions, k // m), steps[k] / self._lamp_chance)
            chance[k] *= self._lamp_chance
        return source, chance, random.random((n * m, 3), dtype=np.float32)

    def _incident(
        self, source: np.ndarray, positions: np.ndarray, normals: np.ndarray, u: np.ndarray, rays_own: bool
    ) -> tuple[np.ndarray, np.ndarray]:
        """A point on each source and the irradiance from it over its density: (n, 3) m, (n, 3) W/m²."""
        lights = self._scene.lights
        targets, irradiance = np.zeros_like(positions), np.zeros_like(positions)
        k = np.flatnonzero(source < len(lights))
        if len(k):
            at = rows(positions, k), rows(normals, k), rows(u, k)[:, :2]
            targets[k], irradiance[k] = light_samples(lights, source[k], *at, self._far_away)
        # After the lamps come all emissive triangles, and the world
        for one, sample in ((len(lights), self._from_meshes), (len(lights) + 1, self._from_world)):
            k = np.flatnonzero(source == one)
            if len(k):
                targets[k], irradiance[k] = sample(rows(positions, k), rows(normals, k), rows(u, k), rays_own)
        return targets, irradiance

    def _from_meshes(
        self, positions: np.ndarray, normals: np.ndarray, u: np.ndarray, rays_own: bool
    ) -> tuple[np.ndarray, np.ndarray]:
        """Emissive triangles, by power, then uniform by area; E = L A cos θ |cos θ'| / (d² P(triangle))."""
        scene = self._scene
        k = np.searchsorted(self._emissive_cumulative, u[:, 2], side="right")
        k = np.minimum(k, len(self._emissive) - 1)
        triangle = self._emissive[k]
        place = sample_uniform_triangle(u[:, :2])
        targets = scene.points(triangle, *place)
        directions, distance = directions_to(positions, targets)
        cosines = np.maximum(dot(directions, normals), 0) * np.abs(dot(directions, rows(scene.normals, triangle)))
        weight = scene.areas[triangle] / self._emissive_chance[k] * cosines / distance.astype(np.float64) ** 2
        if rays_own:
            weight = np.where(self._rays_find_more(triangle, cosines, distance), 0, weight)
        radiance = scene.emission(triangle, *place)
        return targets, (radiance * weight[:, None]).astype(np.float32)

    def _from_world(
        self, positions: np.ndarray, normals: np.ndarray, u: np.ndarray, rays_own: bool
    ) -> tuple[np.ndarray, np.ndarray]:
        """A world that is an image: directions by its radiance; E = L cos θ / p."""
        world = self._scene.world
        directions = world.sample(u[:, :2])
        cosine = np.maximum(dot(directions, normals), 0)
        weight = cosine / np.maximum(world.pdf(directions), np.float32(1e-30))
        if rays_own:
            weight[self._rays_see_more(directions, cosine)] = 0
        return positions + self._far_away * directions, world.radiance(directions) * weight[:, None]
