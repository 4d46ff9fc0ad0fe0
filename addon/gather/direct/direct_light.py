"""Direct light at many points, by next-event estimation over lamps, emissive triangles and worlds that are pictures."""

from dataclasses import dataclass

import numpy as np

from ...bsdf.frames import bump_shadowing
from ...core.compiling import kernel, kernel_array
from ...core.vec3 import BLACK, ONE, ZERO, direction_to, dot, mul, plus, put, row, times
from ...emitters import Source
from ...emitters.aiming.regions import Sphere
from ...emitters.row import MESH, WORLD
from ...emitters.source import Surroundings
from ...scene import Scene
from ...tracing import Hits, TransparencyTracer
from ...tracing.embree import new_ray
from .lamp_choice import lamp_grid
from .sampling import DIFFUSE_RAY, MAX_CANDIDATES, DirectArrays, met_radiance, sample_emitters
from .visible import arriving, visible_share


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
    arrays_without_lamps : DirectArrays
        Of emissive meshes and worlds alone.
    tracer : TransparencyTracer
    """

    def __init__(self, scene: Scene, tracer: TransparencyTracer, sources: list[Source]) -> None:
        self.tracer = tracer
        of = sources[0].surroundings if sources else Surroundings.of(scene, Sphere(np.zeros(3, np.float32), 0.0))
        # After the lamps come all emissive triangles, and the world
        power, n_lamps = np.zeros(len(scene.lights) + 2), len(scene.lights)
        for source in sources:
            if source.sampled_directly and (source.kind != WORLD or scene.world.image is not None):
                power[{MESH: n_lamps, WORLD: n_lamps + 1}.get(source.kind, source.lamp)] = source.importance
        lit = power > 0
        # Half by power, half evenly: a weak lamp close by must not be missed.
        chance = power / power.sum() / 2 + lit / lit.sum() / 2 if lit.any() else power
        lamps, mesh, world = (np.float32(c) for c in (chance[:-2].sum(), chance[-2], chance[-1]))
        self.arrays = DirectArrays(
            of.lamps,
            of.mesh,
            of.world,
            lamp_grid(scene, of.lamps.patterns, lit[:-2]),
            lamps,
            mesh,
            world,
            0 if not lit.any() else 1 if lit.sum() == 1 and lit[:-2].any() else MAX_CANDIDATES,
            np.float32(2 * scene.diagonal),
            *_blockers(scene),
        )
        others = mesh + world
        self.arrays_without_lamps = self.arrays._replace(
            lamp_chance=np.float32(0),
            mesh_chance=mesh / others if others > 0 else mesh,
            world_chance=world / others if others > 0 else world,
            n_candidates=MAX_CANDIDATES if others > 0 else 0,
        )

    def irradiance(
        self,
        positions: np.ndarray,
        normals: np.ndarray,
        objects: np.ndarray | None,
        random: np.random.Generator,
        with_sky: bool = False,
    ) -> np.ndarray:
        """One estimate of the direct irradiance at each point, (n, 3) float32, W/m².

        Parameters
        ----------
        positions, normals, objects
            As for `sample`.
        with_sky : bool
            With a constant world.
        """
        return self.mean_irradiance(positions, normals, objects, 1, _key(random), with_sky=with_sky)

    def mean_irradiance(
        self,
        positions: np.ndarray,
        normals: np.ndarray,
        objects: np.ndarray | None,
        n_samples: int,
        key: np.uint64,
        first: int = 0,
        with_sky: bool = True,
        bases: np.ndarray | None = None,
    ) -> np.ndarray:
        """Mean of some estimates of the direct irradiance at each point, (n, 3) float32, W/m².

        Parameters
        ----------
        key, first
            Of the random numbers (`path_key`), and the number of the first point among those that share the key.
        bases : (n, 3) float32, optional
            The points' `base_normal`.
        """
        irradiance = np.empty((len(positions), 3), np.float32)
        bases = np.zeros((0, 3), np.float32) if bases is None else kernel_array(bases, np.float32)
        at, how = (*_points(positions, normals, objects), bases), (n_samples, with_sky, key, first)
        _light_many(self.arrays, self.tracer.arrays, new_ray(), *at, *how, irradiance)
        return irradiance

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
            Leave out what a cosine-weighted ray finds more often. The caller sends one from each point, and adds
            `met_radiance` of it.
        """
        irradiance, towards = np.empty((2, len(positions), 3), np.float32)
        source, at = np.empty(len(positions), np.int64), _points(positions, normals, objects)
        to = irradiance, towards, source
        _sample_many(self.arrays, self.tracer.arrays, new_ray(), *at, rays_own, _key(random), *to)
        return Incident(*to)

    def met(self, hits: Hits, directions: np.ndarray, sides: np.ndarray) -> np.ndarray:
        """`met_radiance` of n rays from surfaces that face sides a (s, 3): Σ_a (ω·a)⁺² L(ω), (n, 3) float32."""
        at, radiance = (hits.triangle, hits.distance, hits.u, hits.v), np.empty((len(directions), 3), np.float32)
        _meet_many(self.arrays, self.tracer.arrays.scene, *at, directions, sides, radiance)
        return hits.tinted(radiance)


def _blockers(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """`has_blockers` and `blockers` of `DirectArrays`."""
    of_lamps, links, casts_shadow = scene.lights.blocked_by, scene.objects.links, scene.objects.casts_shadow
    if of_lamps is None and links is None:
        return np.zeros(0, np.bool_), np.zeros((0, 0), np.bool_)
    n_lamps, n_objects = len(scene.lights), len(casts_shadow)
    all_do = np.ones((n_lamps if of_lamps is None else 0, n_objects), bool)
    rest = np.ones((2, n_objects), bool)
    of_groups = [] if links is None else [links.blocked_by]
    blocked_by = np.concatenate([all_do if of_lamps is None else of_lamps, rest, *of_groups])
    return (casts_shadow & ~blocked_by).any(axis=1), kernel_array(blocked_by, np.bool_)


def _points(
    positions: np.ndarray, normals: np.ndarray, objects: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points as kernels take them."""
    objects = np.full(len(positions), -1, np.int32) if objects is None else kernel_array(objects, np.int32)
    return kernel_array(positions, np.float32), kernel_array(normals, np.float32), objects


def _key(random: np.random.Generator) -> np.uint64:
    """The key of paths that have numbers of their own."""
    return np.uint64(random.integers(1 << 64, dtype=np.uint64, endpoint=False))


@kernel
def _light_many(direct, tracing, room, positions, normals, objects, bases, n_samples, with_sky, key, first, irradiance):
    for k in range(len(positions)):
        position, normal, total = row(positions, k), row(normals, k), BLACK
        for path in range((first + k) * n_samples, (first + k + 1) * n_samples):
            way, light, other, met = arriving(
                direct, tracing, room, position, normal, objects[k], key, path, 0, with_sky
            )
            if len(bases) > 0:
                light = times(light, bump_shadowing(row(bases, k), normal, way))
                met = times(met, bump_shadowing(row(bases, k), normal, other))
            total = plus(total, plus(light, met))
        put(irradiance, k, times(total, ONE / np.float32(n_samples)))


@kernel
def _sample_many(direct, tracing, room, positions, normals, objects, rays_own, key, irradiance, towards, sources):
    for k in range(len(positions)):
        position, normal = row(positions, k), row(normals, k)
        at = position, normal, objects[k]
        target, light, lamp, lit = sample_emitters(direct, tracing.scene, *at, DIFFUSE_RAY, rays_own, key, k, 0)
        if lit:
            light = mul(light, visible_share(direct, tracing, room, lamp, position, target))
        way, _ = direction_to(position, target)
        put(irradiance, k, light)
        put(towards, k, way)
        sources[k] = lamp


@kernel
def _meet_many(direct, scene, triangle, distance, u, v, directions, sides, radiance):
    for k in range(len(triangle)):
        direction, total = row(directions, k), BLACK
        for side in range(len(sides)):
            cosine = dot(direction, row(sides, side))
            if cosine > ZERO:
                at = triangle[k], distance[k], u[k], v[k], direction, row(sides, side), np.int32(-1)
                total = plus(total, times(met_radiance(direct, scene, *at), cosine * cosine))
        put(radiance, k, total)
