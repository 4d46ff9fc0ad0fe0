"""How point, spot and area lamps emit photons."""

import numpy as np

from ..core.sampling.streams import sobol
from ..core.sampling.vectors import dot
from ..core.sampling.warps import sample_cosine_hemisphere, sample_uniform_cone, sample_uniform_disk, to_world
from ..scene import LightKind, Lights
from .projection_map import cone_around
from .source import Rays, Source, Sphere


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
        (cos_to_scene,), (self._to_scene,) = cone_around(
            whole.centre, whole.radius, position, float(lights.radius[lamp])
        )
        self._aims = cos_to_scene > self._cos_max
        self._cos_max = max(self._cos_max, float(cos_to_scene))
        self._solid_angle = 2 * np.pi * (1 - self._cos_max)
        share = self._directions(sobol(2, 0).random(_N_FOR_POWER).astype(np.float32))[1].mean(dtype=np.float64)
        self.power = lights.emission[lamp].astype(np.float64) * self._solid_angle * share

    def emit(self, u: np.ndarray) -> Rays:
        """Uniform directions in the cone, weighted by the falloff."""
        lights, lamp = self._lights, self.lamp
        directions, share = self._directions(u[:, :2])
        per_density = np.float32(self._solid_angle) * share
        if self.aim:
            (k, _), at = self._halved(u[:, 4]), lights.position[lamp][None]
            reach = float(lights.radius[lamp])
            directions, per_density = self.aim.redirect(k, u[:, :2], at, directions, per_density, reach)
            per_density[k] *= self._falloff(directions[k])
        return self._leaving(directions, per_density, u[:, 2:4])

    def rays_along(self, directions: np.ndarray, per_density: np.ndarray, u: np.ndarray) -> Rays:
        """Rays in directions (n, 3) that were drawn otherwise, with 1 over their densities (n,), sr."""
        return self._leaving(directions, per_density * self._falloff(directions), u)

    @property
    def axes(self) -> np.ndarray:
        """Rows: unit vectors to the right, up and forward, (3, 3) float32."""
        lights, lamp = self._lights, self.lamp
        return np.stack([lights.axis_x[lamp], lights.axis_y[lamp], lights.direction[lamp]])

    def frustum(self, widest: float) -> float | None:
        """Half the side, at distance 1, of the square around a spot's cone; None if its cosine is below `widest`."""
        cosine = float(self._lights.cos_half_cone(self.lamp)) if self._is_spot else -1.0
        return float(self._lights.stretch[self.lamp].max()) * np.sqrt(1 / cosine**2 - 1) if cosine > widest else None

    def _leaving(self, directions: np.ndarray, intensity: np.ndarray, u: np.ndarray) -> Rays:
        """Rays from the discs that face directions; flux is the emission times `intensity` (n,)."""
        lights, lamp = self._lights, self.lamp
        bulge = np.sqrt(1 - u[:, :1]) if lights.sphere[lamp] else np.zeros((len(u), 1), np.float32)
        place = np.hstack([sample_uniform_disk(u), bulge])
        origins = lights.position[lamp] + lights.radius[lamp] * to_world(place, directions)
        return Rays(origins, directions, lights.emission[lamp] * intensity[:, None])

    def _directions(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Directions (n, 3), and each one's share of the intensity over its density times the cone's size (n,).

        A stretched cone's directions are (ax, by, z) / |(ax, by, z)| of a round one's, whose solid angles grow by
        ab / |(ax, by, z)|³.
        """
        lights, lamp = self._lights, self.lamp
        local = sample_uniform_cone(u, self._cos_max)
        if self._aims or not self._is_spot:
            directions = to_world(local, np.broadcast_to(self._to_scene, (len(u), 3)))
            return directions, self._falloff(directions)
        share = lights.spot_falloff(lamp, local[:, 2])
        a, b = lights.stretch[lamp]
        local = local * np.array([a, b, 1], np.float32)
        length = np.linalg.norm(local, axis=1)
        return (local / length[:, None]) @ self.axes, share * a * b / length**3

    def _falloff(self, directions: np.ndarray) -> np.ndarray:
        """Share of the intensity that goes in each direction (n, 3), (n,) float32."""
        if not self._is_spot:
            return np.ones(len(directions), np.float32)
        every = np.full(len(directions), self.lamp)
        return self._lights.spot_falloff(every, self._lights.in_cone(every, directions))


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
        (cos_to_scene,), _ = cone_around(whole.centre, whole.radius, lights.position[lamp][None], reach)
        self._aims = 2 * (1 - cos_to_scene) < self._sin2
        share = self._leaving(sobol(4, 0).random(_N_FOR_POWER).astype(np.float32))[2] if self._aims else np.ones(1)
        self.power = self._full_power * share.mean(dtype=np.float64)

    def emit(self, u: np.ndarray) -> Rays:
        """Uniform places, directions within the spread or the cone around the scene, weighted by cosine and falloff."""
        origins, directions, share = self._leaving(u)
        return Rays(origins, directions, self._full_power.astype(np.float32) * share[:, None])

    def _leaving(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Origins (n, 3), directions (n, 3), and the radiance and cosine over density and full power of each, (n,)."""
        lights, lamp = self._lights, np.full(len(u), self.lamp)
        origins = sample_area_lamp(lights, lamp, u[:, 2:4])
        directions, per_density = self._directions(u[:, :2], origins)
        if self.aim:
            directions, per_density = self.aim.redirect(
                self._halved(u[:, 4])[0], u[:, :2], origins, directions, per_density
            )
        axis = lights.direction[lamp]
        cosine = np.maximum(dot(directions, axis), 0)
        aside = np.linalg.norm(directions - cosine[:, None] * axis, axis=1)
        falloff = lights.spread_falloff(lamp, aside / np.maximum(cosine, np.float32(1e-6)))
        return origins, directions, cosine * per_density / np.float32(np.pi) * falloff

    def _directions(self, u: np.ndarray, origins: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Directions (n, 3), and 1 over their densities by solid angle (n,), sr."""
        if self._aims:
            cos_max, to_scene = cone_around(self._whole.centre, self._whole.radius, origins, 0.0)
            directions = to_world(sample_uniform_cone(u, cos_max), to_scene)
            return directions, (2 * np.pi * (1 - cos_max)).astype(np.float32)
        local = sample_cosine_hemisphere(u * np.stack([self._sin2, np.float32(1)]))
        axis = np.broadcast_to(self._lights.direction[self.lamp], origins.shape)
        return to_world(local, axis), self._sin2 * np.float32(np.pi) / np.maximum(local[:, 2], np.float32(1e-6))


_N_FOR_POWER = 1 << 14
"""Photons by which the power is told that lamps send to the scene."""


def sample_area_lamp(lights: Lights, lamp: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Points uniform by area on area lamps `lamp` (n,), world space (n, 3)."""
    disc = sample_uniform_disk(u) / 2
    place = np.where((lights.kind[lamp] == LightKind.ELLIPSE)[:, None], disc, u - np.float32(0.5)) * lights.size[lamp]
    return lights.position[lamp] + place[:, :1] * lights.axis_x[lamp] + place[:, 1:] * lights.axis_y[lamp]
