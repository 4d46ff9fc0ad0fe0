"""Direct light at many points, by next-event estimation over lamps, emissive triangles and worlds that are pictures."""

from dataclasses import dataclass

import numpy as np

from ...core.compiling import kernel, kernel_array
from ...core.sampling.vectors import rows
from ...core.sampling.warps import sample_cosine_hemisphere, to_world
from ...core.vec3 import BLACK, direction_to, put, row
from ...emitters import Source
from ...emitters.aiming.regions import Sphere
from ...emitters.row import MESH, WORLD
from ...emitters.source import Surroundings
from ...scene import Scene
from ...tracing import Hits, TransparencyTracer
from .lamp_choice import lamp_grid
from .sampling import MAX_CANDIDATES, DirectArrays, met_radiance, sample_emitters, unsampled_sky


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
    """Estimates of the light that comes straight from lamps, emissive meshes and worlds that are pictures.

    Constant worlds, which rays find just as well, come in where a method says so.

    Parameters
    ----------
    sources : list of Source
        From `light_sources`; those with `sampled_directly` are sampled.

    Attributes
    ----------
    arrays : DirectArrays
        What kernels take.
    """

    def __init__(self, scene: Scene, tracer: TransparencyTracer, sources: list[Source]) -> None:
        self._scene, self._tracer = scene, tracer
        of = sources[0].surroundings if sources else Surroundings.of(scene, Sphere(np.zeros(3, np.float32), 0.0))
        # After the lamps come all emissive triangles, and the world
        power, n_lamps = np.zeros(len(scene.lights) + 2), len(scene.lights)
        for source in sources:
            if source.sampled_directly:
                power[{MESH: n_lamps, WORLD: n_lamps + 1}.get(source.kind, source.lamp)] = source.importance
        lit = power > 0
        # Half by power, half evenly: a weak lamp close by must not be missed.
        chance = power / power.sum() / 2 + lit / lit.sum() / 2 if lit.any() else power
        n_candidates = 0 if not lit.any() else 1 if lit.sum() == 1 and lit[:-2].any() else MAX_CANDIDATES
        lamps, mesh, world = (np.float32(c) for c in (chance[:-2].sum(), chance[-2], chance[-1]))
        grid, far = lamp_grid(scene, lit[:-2]), np.float32(2 * scene.diagonal)
        self.arrays = DirectArrays(
            scene.arrays, of.lamps, of.mesh, of.world, grid, lamps, mesh, world, n_candidates, far
        )
        self._rays_own_some = bool(lit[-2:].any())

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
            met = self.met(hits, directions, normals) - self.unsampled_sky(hits, directions)
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
        n, key = len(positions), random.integers(1 << 64, dtype=np.uint64, endpoint=False)
        targets, irradiance, towards = np.empty((3, n, 3), np.float32)
        found, objects = (
            Incident(irradiance, towards, np.empty(n, np.int64)),
            np.full(n, -1) if objects is None else objects,
        )
        at = kernel_array(positions, np.float32), kernel_array(normals, np.float32), kernel_array(objects, np.int64)
        _sample_many(self.arrays, *at, rays_own, key, targets, irradiance, towards, found.source)
        lit = np.flatnonzero(irradiance.any(axis=1))
        passes = self._visibility(rows(positions, lit), rows(targets, lit), towards[lit], found.source[lit])
        irradiance[lit] *= passes
        return found

    def met(self, hits: Hits, directions: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Radiance that cosine-weighted rays meet and that is their own, (n, 3) float32: of emissive triangles, and of
        the world, a constant one's among it. What see-through surfaces leave of it is for the caller to apply.

        Parameters
        ----------
        directions, normals : (n, 3) float32
            Of the rays, and of the surfaces that they start from.
        """
        radiance = np.empty((len(directions), 3), np.float32)
        ways = kernel_array(directions, np.float32), kernel_array(normals, np.float32)
        distance, u, v = (kernel_array(of, np.float32) for of in (hits.distance, hits.u, hits.v))
        _meet_many(self.arrays, kernel_array(hits.triangle, np.int32), distance, u, v, *ways, radiance)
        return radiance

    def unsampled_sky(self, hits: Hits, directions: np.ndarray) -> np.ndarray:
        """Radiance of a constant world where rays meet nothing, (n, 3) float32; none of a world that is a picture."""
        radiance = np.empty((len(directions), 3), np.float32)
        _look_at_sky(self.arrays, kernel_array(hits.triangle, np.int32), radiance)
        return radiance

    def _rays(self, positions: np.ndarray, normals: np.ndarray, random: np.random.Generator) -> tuple[Hits, np.ndarray]:
        """What a cosine-weighted ray from each point meets, and its direction."""
        u = random.random((len(positions), 2), dtype=np.float32)
        directions = to_world(sample_cosine_hemisphere(u), normals)
        return self._tracer.closest_hit(positions, directions), directions

    def _visibility(
        self, positions: np.ndarray, targets: np.ndarray, directions: np.ndarray, source: np.ndarray
    ) -> np.ndarray:
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
            near = np.linalg.norm(targets[k] - positions[k], axis=1) * np.float32(1 - 1e-4)
            passes[k] = self._tracer.transmittance(positions[k], directions[k], near, blocks=blocked_by[lamp])
        return passes


@kernel
def _sample_many(direct, positions, normals, objects, rays_own, key, targets, irradiance, directions, sources):
    for k in range(len(positions)):
        position = row(positions, k)
        target, light, sources[k], _ = sample_emitters(
            direct, position, row(normals, k), objects[k], rays_own, key, k, 0
        )
        way, _ = direction_to(position, target)
        put(targets, k, target)
        put(irradiance, k, light)
        put(directions, k, way)


@kernel
def _meet_many(direct, triangle, distance, u, v, directions, normals, radiance):
    for k in range(len(triangle)):
        light = met_radiance(direct, triangle[k], distance[k], u[k], v[k], row(directions, k), row(normals, k))
        put(radiance, k, light)


@kernel
def _look_at_sky(direct, triangle, radiance):
    for k in range(len(triangle)):
        put(radiance, k, unsampled_sky(direct) if triangle[k] < 0 else BLACK)
