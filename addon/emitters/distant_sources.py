"""How the sun and the world emit photons: from outside, through discs around the receivers."""

import numpy as np

from ..core.sampling.vectors import dot
from ..core.sampling.warps import frame, sample_uniform_cone, sample_uniform_disk, to_world
from ..scene import Lights, Scene
from .source import Rays, Source, Sphere, bounding_sphere


class _DistantSource(Source):
    """Parallel light from outside: rays through discs that face the direction they come from.

    The discs lie around the region of the receivers, each twice as wide as the one before, and the last around the
    whole scene. Each gets the same share of the rays: many go where receivers are, and none carries much more than its
    neighbours.
    With K discs of areas A_k a ray at x has density p(x) = Σ_k [x in disc k] / (K A_k).
    """

    def __init__(self, scene: Scene, region: Sphere) -> None:
        self._whole = bounding_sphere(scene)
        smallest = max(region.radius, 1e-6 * self._whole.radius)  # a lone receiver's region may have no size
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
        aimed, u_disc = self._halved(u_choose)
        n_discs = len(self._radii) + 1
        chosen = np.minimum((u_disc * n_discs).astype(np.int32), n_discs - 1)
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

        centres = np.stack([self._whole.centre, self._centre])[of_region.astype(np.int8)]
        places, per_density = centres + offset, 1 / density
        if self.aim:
            places, per_density = self.aim.move(aimed, u_place, places, directions, per_density)
        # Start behind the whole scene
        back = dot(places - self._whole.centre, directions) + np.float32(self._whole.radius)
        return places - back[:, None] * directions, per_density[:, None]


class SunSource(_DistantSource):
    """A sun lamp of irradiance E from a disc of angle α.

    Attributes
    ----------
    direction : (3,) float32
        In which its light flies, about.
    cos_max : float
        Cosine of half the angle.
    beam : (3,) float32, W/m²
        All of its light across each ray's own direction.
    """

    def __init__(self, lights: Lights, lamp: int, scene: Scene, region: Sphere) -> None:
        super().__init__(scene, region)
        self._be_lamp(lights, lamp)
        self.n_cells = (1, 1, 64, 64, len(self._radii) + 1)
        self.direction = lights.direction[lamp]
        self.cos_max = float(np.cos(lights.angle[lamp] / 2))
        # E = ∫L cos θ dω = πL sin²(α/2) over the disc, while beams add up to ∫L dω = 2πL(1 − cos(α/2)).
        self.beam = lights.emission[lamp] * np.float32(2 / (1 + self.cos_max))
        self.power = self.beam.astype(np.float64) * self._area_of_region

    def emit(self, u: np.ndarray) -> Rays:
        """Directions uniform over the sun's disc, places by the nested discs."""
        local = sample_uniform_cone(u[:, :2], self.cos_max)
        directions = to_world(local, np.broadcast_to(self.direction, (len(u), 3)))
        origins, area = self._through_discs(directions, u[:, 2:4], u[:, 4])
        return Rays(origins, directions, self.beam * area)


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
