"""How lights emit photons.

Every source turns points of the unit hypercube into rays that carry flux. The mean of the flux over the hypercube is
the source's power, so n points make n photons of flux/n watts each.
"""

from dataclasses import dataclass

import numpy as np

from ..errors import BakeError
from ..sampling.streams import sobol
from ..sampling.warps import (
    frame,
    sample_cosine_hemisphere,
    sample_uniform_cone,
    sample_uniform_disk,
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
    """Emitted light: origins (n, 3) m, unit directions (n, 3), flux (n, 3) W whose mean is the source's power.

    Also the objects that emitted it, (n,) int32, unless it was none of the scene's.
    """

    origins: np.ndarray
    directions: np.ndarray
    flux: np.ndarray
    objects: np.ndarray | None = None


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
    illuminates, blocked_by : (o,) bool or None
        Objects that its light falls on, and that keep it away; None: all.
    n_cells : tuple of 5 int
        Into how many cells each dimension of the hypercube is cut where photons are guided.
    """

    name: str
    lamp: int
    power: np.ndarray
    n_cells: tuple[int, ...] = (8, 8, 8, 8, 1)
    sampled_directly = True
    illuminates: np.ndarray | None = None
    blocked_by: np.ndarray | None = None

    def _be_lamp(self, lights: Lights, lamp: int) -> None:
        """Take over what all lamps have."""
        self._lights, self.lamp, self.name = lights, lamp, lights.names[lamp]
        self.illuminates = None if lights.illuminates is None else lights.illuminates[lamp]
        self.blocked_by = None if lights.blocked_by is None else lights.blocked_by[lamp]

    def emit(self, u: np.ndarray) -> Rays:
        """Rays for points `u` (n, 5) of the unit hypercube."""
        raise NotImplementedError


class PointSource(Source):
    """A point or spot lamp: an intensity I(ω) that leaves, in each direction, a disc of radius r that faces it.

    That is exact for lamps that are spheres, and how Cycles' lamps with soft falloff look from afar. So: a direction by
    intensity, then a place on its disc. Directions are drawn from the cone of a spot, or from the cone around the scene
    if that is narrower; the power is what goes there.
    """

    n_cells = (64, 64, 1, 1, 1)

    def __init__(self, lights: Lights, lamp: int, whole: Sphere) -> None:
        self._be_lamp(lights, lamp)
        self._is_spot = lights.kind[lamp] == LightKind.SPOT
        self._cos_max = float(lights.cos_half_cone(lamp)) if self._is_spot else -1.0
        position = lights.position[lamp][None]
        (cos_to_scene,), (self._to_scene,) = _cone_around(whole, position, float(lights.radius[lamp]))
        self._aims = cos_to_scene > self._cos_max
        self._cos_max = max(self._cos_max, float(cos_to_scene))
        self._solid_angle = 2 * np.pi * (1 - self._cos_max)
        share = self._directions(sobol(2, 0).random(_N_FOR_POWER).astype(np.float32))[1].mean(dtype=np.float64)
        self.power = lights.emission[lamp].astype(np.float64) * self._solid_angle * share

    def emit(self, u: np.ndarray) -> Rays:
        """Uniform directions in the cone, weighted by the falloff."""
        lights, lamp = self._lights, self.lamp
        directions, share = self._directions(u[:, :2])
        flux = lights.emission[lamp] * (np.float32(self._solid_angle) * share)[:, None]
        place = sample_uniform_disk(u[:, 2:4])
        bulge = np.sqrt(1 - u[:, 2:3]) if lights.sphere[lamp] else np.zeros((len(u), 1), np.float32)
        origins = lights.position[lamp] + lights.radius[lamp] * to_world(np.hstack([place, bulge]), directions)
        return Rays(origins, directions, flux)

    def _directions(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Directions (n, 3), and each one's share of the intensity over its density times the cone's size (n,).

        A stretched cone's directions are (ax, by, z) / |(ax, by, z)| of a round one's, whose solid angles grow by
        ab / |(ax, by, z)|³.
        """
        lights, lamp = self._lights, self.lamp
        local = sample_uniform_cone(u, self._cos_max)
        if self._aims or not self._is_spot:
            directions = to_world(local, np.broadcast_to(self._to_scene, (len(u), 3)))
            if not self._is_spot:
                return directions, np.ones(len(u), np.float32)
            every = np.full(len(u), lamp)
            return directions, lights.spot_falloff(every, lights.in_cone(every, directions))
        share = lights.spot_falloff(lamp, local[:, 2])
        a, b = lights.stretch[lamp]
        local = local * np.array([a, b, 1], np.float32)
        length = np.linalg.norm(local, axis=1)
        axes = np.stack([lights.axis_x[lamp], lights.axis_y[lamp], lights.direction[lamp]])
        return (local / length[:, None]) @ axes, share * a * b / length**3


class AreaSource(Source):
    """An area lamp: a rectangle or ellipse of radiance L on its front, power πLA whatever its spread.

    From far away it sends photons only to the scene; the power is what goes there then.
    """

    def __init__(self, lights: Lights, lamp: int, whole: Sphere) -> None:
        self._be_lamp(lights, lamp)
        self._whole = whole
        self._sin2 = np.float32(lights.sin2_half_spread(lamp))
        self._full_power = lights.emission[lamp].astype(np.float64) * np.pi * float(lights.area(np.array([lamp]))[0])
        reach = float(np.linalg.norm(lights.size[lamp])) / 2
        (cos_to_scene,), _ = _cone_around(whole, lights.position[lamp][None], reach)
        self._aims = 2 * (1 - cos_to_scene) < self._sin2
        share = self._leaving(sobol(4, 0).random(_N_FOR_POWER).astype(np.float32))[2] if self._aims else np.ones(1)
        self.power = self._full_power * share.mean(dtype=np.float64)

    def emit(self, u: np.ndarray) -> Rays:
        """Uniform places, directions within the spread or the cone around the scene, weighted by cosine and falloff."""
        origins, directions, share = self._leaving(u[:, :4])
        return Rays(origins, directions, self._full_power.astype(np.float32) * share[:, None])

    def _leaving(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Origins (n, 3), directions (n, 3), and the radiance and cosine over density and full power of each, (n,)."""
        lights, lamp = self._lights, np.full(len(u), self.lamp)
        axis = lights.direction[lamp]
        origins = sample_area_lamp(lights, lamp, u[:, 2:4])
        if self._aims:
            cos_max, to_scene = _cone_around(self._whole, origins, 0.0)
            directions = to_world(sample_uniform_cone(u[:, :2], cos_max), to_scene)
            cosine = np.maximum(np.einsum("ij,ij->i", directions, axis), 0)
            share = (cosine * 2 * (1 - cos_max)).astype(np.float32)
        else:
            local = sample_cosine_hemisphere(u[:, :2] * np.stack([self._sin2, np.float32(1)]))
            directions, cosine = to_world(local, axis), local[:, 2]
            share = np.full(len(u), self._sin2)
        aside = np.linalg.norm(directions - cosine[:, None] * axis, axis=1)
        return origins, directions, share * lights.spread_falloff(lamp, aside / np.maximum(cosine, np.float32(1e-6)))


_N_FOR_POWER = 1 << 14
"""Photons by which the power is told that lamps send to the scene."""


def _cone_around(sphere: Sphere, positions: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
    """Cones that hold all lines to a ball from within `reach` of positions: cos of half the angle (n,), axes (n, 3).

    The cosine (float64, since cones are narrow) is −1 where a position is too close for a cone.
    """
    way = sphere.centre - positions
    distance = np.linalg.norm(way, axis=1).astype(np.float64)
    sine = (sphere.radius + reach) / np.maximum(distance, 1e-30)
    cosine = np.where(sine < 1, np.sqrt(np.maximum(1 - sine**2, 0)), -1)
    axes = np.where((distance > 0)[:, None], way / np.maximum(distance, 1e-30)[:, None], [0, 0, 1])
    return cosine, axes.astype(np.float32)


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
        self.n_cells = (8, 8, 8, 8, n_inner + 1)

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
        self._be_lamp(lights, lamp)
        self.n_cells = (1, 1, 64, 64, len(self._radii) + 1)
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
    """The world's radiance L from all directions, more photons from where it is brighter."""

    name, lamp = "World", -1

    def __init__(self, scene: Scene, region: Sphere) -> None:
        super().__init__(scene, region)
        self._world = scene.world
        self.sampled_directly = scene.world.image is not None
        self.power = scene.world.integral * self._area_of_region

    def emit(self, u: np.ndarray) -> Rays:
        """Directions by radiance, places by the nested discs."""
        towards = self._world.sample(u[:, :2])
        origins, area = self._through_discs(-towards, u[:, 2:4], u[:, 4])
        density = np.maximum(self._world.pdf(towards), np.float32(1e-30))
        return Rays(origins, -towards, self._world.radiance(towards) * (area[:, 0] / density)[:, None])


class MeshSource(Source):
    """All emissive triangles together, each chosen by its power 2πLA; both sides emit."""

    name, n_cells = "Emissive meshes", (4, 4, 1, 1, 1024)

    def __init__(self, scene: Scene) -> None:
        self._scene, self.lamp = scene, len(scene.lights)
        self._triangles, self._chance, power = emissive_triangles(scene)
        self.power = power.sum(0)
        self._cumulative = np.cumsum(self._chance)

    def emit(self, u: np.ndarray) -> Rays:
        """A triangle by power, a place on it, a side, a cosine-weighted direction."""
        scene = self._scene
        # One dimension chooses both triangle and side, so that it stays stratified.
        chosen = u[:, 4].astype(np.float64) * 2
        front, chosen = chosen < 1, chosen % 1
        k = np.minimum(np.searchsorted(self._cumulative, chosen, side="right"), len(self._cumulative) - 1)
        triangle, place = self._triangles[k], sample_uniform_triangle(u[:, 2:4])
        origins = scene.points(triangle, *place)
        normals = np.where(front[:, None], scene.normals[triangle], -scene.normals[triangle])
        directions = to_world(sample_cosine_hemisphere(u[:, :2]), normals)
        area = 2 * np.pi * scene.areas[triangle] / np.maximum(self._chance[k], 1e-300)
        flux = (scene.emission(triangle, *place) * area[:, None]).astype(np.float32)
        origins = origins + scene.ray_offset(origins) * normals
        return Rays(origins, directions, flux, scene.object_of_triangle[triangle])


def emissive_triangles(scene: Scene) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The triangles that emit: index (e,) int32, chance to be chosen by power (e,), power 2πLA (e, 3) W.

    Objects that diffuse rays do not see do not shine on diffuse surfaces. The power of textured triangles is a mean
    over some of their points; a tenth of the chance goes by the brightest that they could be, lest none were missed.
    """
    materials, objects = scene.materials, scene.objects
    shines = objects.scatters & objects.emits
    glows = materials.emission.nonzero[scene.material_of_triangle] & shines[scene.object_of_triangle]
    triangles = np.flatnonzero(glows).astype(np.int32)
    area = 2 * np.pi * scene.areas[triangles, None]
    power = area * _mean_emission(scene, triangles)
    chance = power.sum(axis=1) / max(power.sum(), 1e-300)
    if (materials.emission.textured or materials.coverage.textured) and power.any():
        bound = (area * _brightest(scene)[scene.material_of_triangle[triangles]]).sum(axis=1)
        chance = 0.9 * chance + 0.1 * bound / bound.sum()
    return triangles, chance, power


def _mean_emission(scene: Scene, triangles: np.ndarray) -> np.ndarray:
    """Mean emitted radiance of triangles, (e, 3) float64, over at least 16 points where they are textured."""
    middle = np.full(len(triangles), 1 / 3, np.float32)
    mean = scene.emission(triangles, middle, middle).astype(np.float64)
    materials = scene.materials
    textured = (materials.emission.texture >= 0) | (materials.coverage.texture >= 0)
    varying = np.flatnonzero(textured[scene.material_of_triangle[triangles]])
    n_points = 1 << int(np.clip(np.log2(_N_POINTS / max(len(varying), 1)), 4, 12))
    u, v = sample_uniform_triangle(sobol(2, 0).random(n_points).astype(np.float32))
    size = _N_POINTS // n_points
    for chunk in (varying[start : start + size] for start in range(0, len(varying), size)):
        triangle = np.repeat(triangles[chunk], n_points)
        radiance = scene.emission(triangle, np.tile(u, len(chunk)), np.tile(v, len(chunk)))
        mean[chunk] = radiance.reshape(len(chunk), n_points, 3).mean(axis=1, dtype=np.float64)
    return mean


_N_POINTS = 1 << 20
"""Points at which textured emission is looked at, at a time."""


def _brightest(scene: Scene) -> np.ndarray:
    """The highest radiance that each material may emit, (m, 3) float32."""
    emission, textures = scene.materials.emission, scene.materials.textures
    brightest = emission.value.copy()
    if emission.textured:
        textured = emission.texture >= 0
        brightest[textured] *= np.maximum.reduceat(textures.pixels, textures.offset)[emission.texture[textured]]
    return brightest


def light_sources(scene: Scene, region: Sphere) -> list[Source]:
    """All sources of a scene that emit anything, the receivers being in `region`.

    Raises
    ------
    BakeError
        If nothing emits light.
    """
    lights, whole = scene.lights, bounding_sphere(scene)
    sources: list[Source] = []
    for lamp, kind in enumerate(lights.kind):
        if kind in (LightKind.POINT, LightKind.SPOT):
            sources.append(PointSource(lights, lamp, whole))
        elif kind == LightKind.SUN:
            sources.append(SunSource(lights, lamp, scene, region))
        else:
            sources.append(AreaSource(lights, lamp, whole))
    sources.append(MeshSource(scene))
    sources.append(WorldSource(scene, region))
    sources = [source for source in sources if source.power.sum() > 0]
    if not sources:
        raise BakeError("There is no light in the scene: add a lamp, an emissive material or a world colour.")
    return sources
