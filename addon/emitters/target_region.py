"""Light that far emitters send towards the region where it is wanted: of a sky of triangles next to none finds a yard.

Half of the photons that such an emitter sends are aimed. Those of the sun go through nested discs, each twice as wide
as the one before; here the same is done with directions: about as many in each octave of the solid angle around the
region's centre, from the region's own on. So a photon that ends beside the region carries little more than one that
ends in it. The other half leave as they would anyway. Each direction is left to that half which finds it more often
(the maximum heuristic: Veach 1997, 9.2.4), so that guiding the one does not make the other's photons heavy.
"""

import numpy as np

from ..core.sampling.vectors import dot
from ..core.sampling.warps import pdf_versine_octaves, sample_versine_octaves, to_world
from .projection_map import cone_around
from .source import Sphere

_SHARE = 0.5  # of the photons
FAR = 2.0
"""Distance in radii of the region from which photons are aimed: from there a fifteenth of all directions meet it."""


class Homeward:
    """Photons from n places, some of which fly towards a region.

    Parameters
    ----------
    u : (n, 2) float32
        Points of the unit square for directions.
    origins : (n, 3) float32, m

    Attributes
    ----------
    u : (n, 2) float32
        Points of the unit square that are left for directions.
    """

    def __init__(self, region: Sphere, u: np.ndarray, origins: np.ndarray) -> None:
        cos_max, self._axis = cone_around(region.centre, region.radius, origins, 0.0)
        away = origins - region.centre
        self._far = (dot(away, away) > np.float32(FAR * region.radius) ** 2) & (region.radius > 0)
        self._goes = self._far & (u[:, 0] < np.float32(_SHARE))
        share = np.where(self._goes, np.float32(_SHARE), np.float32(1 - _SHARE))
        first = np.where(self._far, (u[:, 0] - ~self._goes * np.float32(_SHARE)) / share, u[:, 0])
        self.u = np.stack([first, u[:, 1]], axis=1).astype(np.float32)
        self._narrow = np.maximum(1 - cos_max, 1e-12)

    def redirect(self, directions: np.ndarray) -> np.ndarray:
        """Directions (n, 3) of all, from those that they would have without aim."""
        k = np.flatnonzero(self._goes)
        directions = directions.copy()
        directions[k] = to_world(sample_versine_octaves(self.u[k], self._narrow[k]), self._axis[k])
        return directions

    def per_density(self, directions: np.ndarray, unaimed: np.ndarray) -> np.ndarray:
        """1 over the density of directions, (n,) float64, sr; 0 of those that the other half of the photons brings.

        Parameters
        ----------
        unaimed : (n,)
            Density by solid angle that the directions have without aim.
        """
        aside = directions - self._axis
        aimed = pdf_versine_octaves(dot(aside, aside) / 2, self._narrow)  # 1 − a·b = |a − b|²/2, with all its digits
        own, other = np.where(self._goes, aimed, unaimed), np.where(self._goes, unaimed, aimed)
        share = np.where(self._goes, _SHARE, 1 - _SHARE)
        return np.where(self._far, (own >= other) / (share * own), 1 / unaimed)
