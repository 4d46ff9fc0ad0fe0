"""How lights emit photons.

Every source turns points of the unit hypercube into rays that carry flux. The mean of the flux over the hypercube is
the source's power, so n points make n photons of flux/n watts each.
"""

from dataclasses import dataclass

import numpy as np

from ..errors import BakeError
from ..sampling.warps import (
    frame,
    sample_cosine_hemisphere,
    sample_uniform_cone,
    sample_uniform_disk,
    sample_uniform_sphere,
    sample_uniform_triangle,
    to_world,
)
from ..scene import LightKind, Lights, Scene

N_DIMENSIONS = 5
"""Dimensions of the hypercube that sources sample: two for a direction, two for a place, one to choose."""


@dataclass(frozen=True)
class Sphere:
    """A ball in world space, m."""

    centre: np.ndarray
    radius: float


def region_of(positions: np.ndarray) -> Sphere:
    """The ball around most receivers: the middle 96 % of their positions along each axis.

    The sun and the world aim at it. A lone receiver far away (the corner of a ground plane) does not blow it up, and
    still gets light: a share of the photons goes to the whole scene.
    """
    low, high = np.percentile(positions, [2, 98], axis=0)
    return Sphere(((low + high) / 2).astype(np.float32), float(np.linalg.norm(high - low)) / 2)


def bounding_sphere(scene: Scene) -> Sphere:
    """A ball around the whole scene."""
    low, high = scene.bounds
    return Sphere((low + high) / 2, max(scene.diagonal / 2 * 1.001, 1e-6))


@dataclass(frozen=True)
class Rays:
    """Emitted light: origins (n, 3) m, unit directions (n, 3), flux (n, 3) W whose mean is the source's power."""

    origins: np.ndarray
    directions: np.ndarray
    flux: np.ndarray


class Source:
    """Something that emits photons.

    Attributes
    ----------
    name : str
    lamp : int
        Index in the scene's `Lights`; the number of lamps for emissive meshes, −1 for the world.
    power : (3,) float64, W
        What photons are shared out by; for the sun and the world, the power that enters the region of the receivers.
    sampled_directly : bool
        Its direct light is found by next-event estimation, so that its photons need not be stored where they first hit.
    """

    name: str
    lamp: int
    power: np.ndarray
    sampled_directly = True

    def emit(self, u: np.ndarray) -> Rays:
        """Rays for points `u` (n, 5) of the unit hypercube."""
        raise NotImplementedError


class PointSource(Source):
    """A point or spot lamp: an intensity I(ω) that leaves, in each direction, a disc of radius r that faces it.

    That is how Cycles' lamps with soft falloff look from afar. So: a direction by intensity, then a place on its disc.
    """

    def __init__(self, lights: Lights, lamp: int) -> None:
        self._lights, self.lamp = lights, lamp
        self.name = lights.names[lamp]
        self._is_spot = lights.kind[lamp] == LightKind.SPOT
        self._cos_max = float(lights.cos_half_cone(lamp)) if self._is_spot else -1.0
        # ∫ falloff dω = 2π(1 − c)(1 − b/2): the smoothstep's mean over the blend is one half.
        mean_falloff = 1 - float(lights.blend[lamp]) / 2 if self._is_spot else 1.0
        self._solid_angle = 2 * np.pi * (1 - self._cos_max)
        self.power = lights.emission[lamp].astype(np.float64) * self._solid_angle * mean_falloff

    def emit(self, u: np.ndarray) -> Rays:
        """Uniform directions in the cone, weighted by the falloff."""
        lights, lamp = self._lights, self.lamp
        axis = np.broadcast_to(lights.direction[lamp], (len(u), 3))
        local = sample_uniform_cone(u[:, :2], self._cos_max)
        directions = to_world(local, axis)
        flux = np.broadcast_to(lights.emission[lamp] * np.float32(self._solid_angle), (len(u), 3))
        if self._is_spot:
            flux = flux * lights.spot_falloff(lamp, local[:, 2])[:, None]
        disc = np.concatenate([sample_uniform_disk(u[:, 2:4]), np.zeros((len(u), 1), np.float32)], axis=1)
        origins = lights.position[lamp] + lights.radius[lamp] * to_world(disc, directions)
        return Rays(origins, directions, flux)


class AreaSource(Source):
    """An area lamp: a rectangle or ellipse of uniform radiance L on its front, power πLA."""

    def __init__(self, lights: Lights, lamp: int) -> None:
        self._lights, self.lamp = lights, lamp
        self.name = lights.names[lamp]
        self.power = lights.emission[lamp].astype(np.float64) * np.pi * float(lights.area(np.array([lamp]))[0])

    def emit(self, u: np.ndarray) -> Rays:
        """Uniform places, cosine-weighted directions: all rays carry the same flux."""
        lights, lamp = self._lights, np.full(len(u), self.lamp)
        origins = sample_area_lamp(lights, lamp, u[:, 2:4])
        directions = to_world(sample_cosine_hemisphere(u[:, :2]), lights.direction[lamp])
        return Rays(origins, directions, np.broadcast_to(self.power.astype(np.float32), (len(u), 3)))


def sample_area_lamp(lights: Lights, lamp: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Points uniform by area on area lamps `lamp` (n,), world space (n, 3)."""
    disc = sample_uniform_disk(u) / 2
    place = np.where((lights.kind[lamp] == LightKind.ELLIPSE)[:, None], disc, u - np.float32(0.5)) * lights.size[lamp]
    return lights.position[lamp] + place[:, :1] * lights.axis_x[lamp] + place[:, 1:] * lights.axis_y[lamp]


class _DistantSource(Source):
    """Parallel light from outside: rays through discs that face the direction they come from.

    The discs lie around the region of the receivers, each twice as wide as the one before, and the last around the
    whole scene. Each gets the same share of the rays: many go where receivers are, and none carries much more than its
    neighbours.
    With K discs of areas A_k a ray at x has density p(x) = Σ_k [x in disc k] / (K A_k).
    """

    def __init__(self, scene: Scene, region: Sphere) -> None:
        self._whole = bounding_sphere(scene)
        smallest = max(region.radius, 1e-3 * self._whole.radius)  # a lone receiver's region has no size
        n_inner = max(0, int(np.ceil(np.log2(self._whole.radius / smallest))))
        self._centre, self._radii = region.centre, (smallest * 2.0 ** np.arange(n_inner)).astype(np.float32)
        # Σ 1/(K A_k) over the discs around the region that are wider than a distance, by their number
        shares = 1 / ((n_inner + 1) * np.pi * self._radii.astype(np.float64) ** 2)
        self._density = np.append(np.cumsum(shares[::-1])[::-1], 0).astype(np.float32)
        self._density_of_whole = np.float32(1 / ((n_inner + 1) * np.pi * self._whole.radius**2))
        self._area_of_region = np.pi * smallest**2

    def _through_discs(
        self, directions: np.ndarray, u_place: np.ndarray, u_choose: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Origins (n, 3) outside the scene, and 1/p of each (n, 1), m²."""
        n_discs = len(self._radii) + 1
        chosen = (u_choose * n_discs).astype(np.int32)
        of_region = chosen < n_discs - 1
        radii = np.append(self._radii, np.float32(self._whole.radius))[chosen]
        tangent, bitangent = frame(directions)
        disc = sample_uniform_disk(u_place) * radii[:, None]
        offset = disc[:, :1] * tangent + disc[:, 1:] * bitangent

        # Squared distance of the line from the centre of its own disc, and from the other centre, at Δ from the first
        own = u_place[:, 0] * radii**2
        delta = self._centre - self._whole.centre
        along = directions @ delta
        other = own + np.where(of_region, 2, -2) * (offset @ delta) + (delta @ delta - along**2)
        n_narrower = np.searchsorted(self._radii**2, np.where(of_region, own * np.float32(1 - 1e-6), other))
        in_whole = ~of_region | (other <= self._whole.radius**2)
        density = self._density[n_narrower] + in_whole * self._density_of_whole

        # Start behind the whole scene
        centres = np.stack([self._whole.centre, self._centre])[of_region.astype(np.int8)]
        back = np.where(of_region, along, 0) + np.float32(self._whole.radius)
        return centres + offset - back[:, None] * directions, 1 / density[:, None]


class SunSource(_DistantSource):
    """A sun lamp of irradiance E from a disc of angle α."""

    def __init__(self, lights: Lights, lamp: int, scene: Scene, region: Sphere) -> None:
        super().__init__(scene, region)
        self.name, self.lamp = lights.names[lamp], lamp
        self._direction = lights.direction[lamp]
        self._cos_max = float(np.cos(lights.angle[lamp] / 2))
        # E = ∫L cos θ dω = πL sin²(α/2) over the disc, while beams add up to ∫L dω = 2πL(1 − cos(α/2)).
        self._beam = lights.emission[lamp] * np.float32(2 / (1 + self._cos_max))
        self.power = self._beam.astype(np.float64) * self._area_of_region

    def emit(self, u: np.ndarray) -> Rays:
        """Directions uniform over the sun's disc, places by the nested discs."""
        local = sample_uniform_cone(u[:, :2], self._cos_max)
        directions = to_world(local, np.broadcast_to(self._direction, (len(u), 3)))
        origins, area = self._through_discs(directions, u[:, 2:4], u[:, 4])
        return Rays(origins, directions, self._beam * area)


class WorldSource(_DistantSource):
    """The world's constant radiance L from all directions."""

    name, lamp = "World", -1
    sampled_directly = False

    def __init__(self, scene: Scene, region: Sphere) -> None:
        super().__init__(scene, region)
        self._radiance = scene.world.color
        self.power = self._radiance.astype(np.float64) * 4 * np.pi * self._area_of_region

    def emit(self, u: np.ndarray) -> Rays:
        """Uniform directions, places by the nested discs."""
        directions = sample_uniform_sphere(u[:, :2])
        origins, area = self._through_discs(directions, u[:, 2:4], u[:, 4])
        return Rays(origins, directions, np.float32(4 * np.pi) * self._radiance * area)


class MeshSource(Source):
    """All emissive triangles together, each chosen by its power 2πLA; both sides emit."""

    name = "Emissive meshes"

    def __init__(self, scene: Scene) -> None:
        self._scene, self.lamp = scene, len(scene.lights)
        self._triangles, self._chance, power = emissive_triangles(scene)
        self.power = power.sum(0)
        self._cumulative = np.cumsum(self._chance)
        self._flux = (power / np.maximum(self._chance[:, None], 1e-300)).astype(np.float32)

    def emit(self, u: np.ndarray) -> Rays:
        """A triangle by power, a place on it, a side, a cosine-weighted direction."""
        scene = self._scene
        # One dimension chooses both triangle and side, so that it stays stratified.
        chosen = u[:, 4].astype(np.float64) * 2
        front, chosen = chosen < 1, chosen % 1
        k = np.minimum(np.searchsorted(self._cumulative, chosen, side="right"), len(self._cumulative) - 1)
        triangle = self._triangles[k]
        origins = scene.points(triangle, *sample_uniform_triangle(u[:, 2:4]))
        normals = np.where(front[:, None], scene.normals[triangle], -scene.normals[triangle])
        directions = to_world(sample_cosine_hemisphere(u[:, :2]), normals)
        return Rays(origins + scene.ray_offset(origins) * normals, directions, self._flux[k])


def emissive_triangles(scene: Scene) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The triangles that emit: index (e,) int32, chance to be chosen by power (e,), power 2πLA (e, 3) W.

    Objects that diffuse rays do not see do not shine on diffuse surfaces.
    """
    glows = scene.materials.emission.nonzero
    emits = glows[scene.material_of_triangle] & scene.objects.scatters[scene.object_of_triangle]
    triangles = np.flatnonzero(emits).astype(np.int32)
    radiance = scene.materials.emission.value[scene.material_of_triangle[triangles]].astype(np.float64)
    power = 2 * np.pi * radiance * scene.areas[triangles, None]
    return triangles, power.sum(axis=1) / max(power.sum(), 1e-300), power


def light_sources(scene: Scene, region: Sphere) -> list[Source]:
    """All sources of a scene that emit anything, the receivers being in `region`.

    Raises
    ------
    BakeError
        If nothing emits light.
    """
    lights = scene.lights
    sources: list[Source] = []
    for lamp, kind in enumerate(lights.kind):
        if kind in (LightKind.POINT, LightKind.SPOT):
            sources.append(PointSource(lights, lamp))
        elif kind == LightKind.SUN:
            sources.append(SunSource(lights, lamp, scene, region))
        else:
            sources.append(AreaSource(lights, lamp))
    sources.append(MeshSource(scene))
    sources.append(WorldSource(scene, region))
    sources = [source for source in sources if source.power.sum() > 0]
    if not sources:
        raise BakeError("There is no light in the scene: add a lamp, an emissive material or a world colour.")
    return sources
