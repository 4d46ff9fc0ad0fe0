"""Photons aimed at what makes caustics: a small glass in a large room gets as many as all the rest.

Jensen's projection maps do this for lamps that are points. Here a source's light is parted in two: what flies towards
the balls around caustic makers, and the rest. Half of the photons sample the one part and half the other, by twice the
power; a photon of the rest that flies towards a ball after all carries none, as the others bring that light.
"""

from dataclasses import dataclass

import numpy as np

from ..core.sampling.vectors import dot
from ..core.sampling.warps import sample_uniform_cone, sample_uniform_disk, to_world

_NARROWEST = 1 - 2.0**-40  # cosine: nothing is so far away that its cone has no solid angle


@dataclass(frozen=True)
class Aim:
    """The m balls that photons are aimed at, alike many at each: centre (m, 3) float32 and radius (m,) float32, m."""

    centre: np.ndarray
    radius: np.ndarray

    def redirect(
        self,
        aimed: np.ndarray,
        u: np.ndarray,
        origins: np.ndarray,
        directions: np.ndarray,
        per_density: np.ndarray,
        reach: float = 0.0,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Directions (n, 3), of the aimed ones into the cones around the balls, and 1 over all densities (n,), sr.

        Parameters
        ----------
        aimed : (n,) bool
        u : (n, 2) float32
        origins : (n, 3) or (1, 3) float32
        directions, per_density : (n, 3), (n,) float32
            Of the photons if none was aimed.
        reach : float, m
            How far beside their origins the rays may start.
        """
        k = np.flatnonzero(aimed)
        ball, u_within = self._choose(u[k])
        directions = directions.copy()
        directions[k] = self._towards(ball, u_within, np.broadcast_to(origins, directions.shape)[k], reach)
        density = np.zeros(len(directions))
        for centre, radius in zip(self.centre, self.radius, strict=True):
            cos_max, axis = cone_around(centre, float(radius), origins, reach)
            within = dot(directions, np.broadcast_to(axis, directions.shape)) >= cos_max
            density += within / (len(self.radius) * 2 * np.pi * (1 - cos_max))
        return directions, _parted(aimed, density, per_density)

    def move(
        self, aimed: np.ndarray, u: np.ndarray, places: np.ndarray, directions: np.ndarray, per_density: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Places (n, 3) that parallel rays pass, of the aimed ones within the balls, and 1 over all densities, m².

        Parameters
        ----------
        aimed, u, per_density
            As for `redirect`; the densities are by area across the rays.
        """
        k = np.flatnonzero(aimed)
        ball, u_within = self._choose(u[k])
        disc = self.radius[ball, None] * sample_uniform_disk(u_within)
        places = places.copy()
        places[k] = self.centre[ball] + to_world(np.pad(disc, ((0, 0), (0, 1))), directions[k])
        density = np.zeros(len(places))
        for centre, radius in zip(self.centre, self.radius, strict=True):
            away = places - centre
            beside = dot(away, away) - dot(away, directions) ** 2
            density += (beside <= radius**2) / (len(self.radius) * np.pi * float(radius) ** 2)
        return places, _parted(aimed, density, per_density)

    def _choose(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """A ball for each of numbers (n, 2), and fresh numbers."""
        steps = u[:, 0] * np.float32(len(self.radius))
        ball = np.minimum(steps.astype(np.int64), len(self.radius) - 1)
        return ball, np.stack([np.clip(steps - ball, 0, 1), u[:, 1]], axis=1)

    def _towards(self, ball: np.ndarray, u: np.ndarray, origins: np.ndarray, reach: float) -> np.ndarray:
        """Directions uniform in the cones from origins (n, 3) around a ball each."""
        cos_max, axis = cone_around(self.centre[ball], self.radius[ball].astype(np.float64), origins, reach)
        return to_world(sample_uniform_cone(u, cos_max), axis)


def _parted(aimed: np.ndarray, density: np.ndarray, per_density: np.ndarray) -> np.ndarray:
    """1 over the density of each photon in its part of the light, (n,) float32; 0 of those that strayed."""
    per_aimed = 2 / np.where(density > 0, density, np.inf)
    return np.where(aimed, per_aimed, np.where(density > 0, 0, 2 * per_density)).astype(np.float32)


def cone_around(
    centre: np.ndarray, radius: np.ndarray | float, origins: np.ndarray, reach: float
) -> tuple[np.ndarray, np.ndarray]:
    """Cones that hold all lines to a ball from within `reach` of origins: cos of half the angle (n,), axes (n, 3).

    The cosine (float64, since cones are narrow) is −1 where an origin is too close for a cone.
    """
    way = centre - origins
    distance = np.linalg.norm(way, axis=1).astype(np.float64)
    sine = (radius + reach) / np.maximum(distance, 1e-30)
    cosine = np.where(sine < 1, np.sqrt(np.maximum(1 - sine**2, 0)), -1)
    cosine = np.minimum(cosine, _NARROWEST)
    axes = np.where((distance > 0)[:, None], way / np.maximum(distance, 1e-30)[:, None], [0, 0, 1])
    return cosine, axes.astype(np.float32)
