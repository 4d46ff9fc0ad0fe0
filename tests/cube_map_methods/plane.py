"""The multi-image method of Yao et al., as section 3 tells it: every map is tried, and one of their answers taken."""

from dataclasses import dataclass

import numpy as np
from photon_bake.addon.core.sampling.vectors import dot
from photon_bake.addon.tracing.cube_maps.cube_maps import CubeMaps
from photon_bake.addon.tracing.cube_maps.search.map_hit import MapHits
from photon_bake.tests.cube_map_methods.looks import seen_towards
from photon_bake.tests.cube_map_methods.secant import refine


@dataclass(frozen=True)
class Plane:
    """Takes the surface to be a plane perpendicular to VA, where A is what a map sees along the ray's direction.

    Where the ray meets that plane, the secant method starts, in each map. Of the points that the maps come to, the one
    nearest to the photon is taken among those that it sees within half a texel of the ray's direction.

    `MapHits.loops` are the maps tried.
    """

    maps: CubeMaps

    def find(self, origins: np.ndarray, directions: np.ndarray, t_max: np.ndarray) -> MapHits:
        """See `Method.find`."""
        found = MapHits.none(len(origins))
        least_cosine = np.float32(np.cos(1 / self.maps.size))
        for number, centre in enumerate(self.maps.centres):
            which, t = np.full(len(origins), number), origins - centre
            _, distance = seen_towards(self.maps, which, directions, 0)
            found.n_look_ups += len(origins)
            dp = np.where(np.isfinite(distance), distance, 0) - dot(t, directions)
            s, _, texel = refine(self.maps, which, origins, directions, dp, found)

            # The point that the map sees in the end, from the photon
            x = t + s[:, None] * directions
            p = x * (self.maps.distance[texel] / np.maximum(np.sqrt(dot(x, x)), np.float32(1e-30)))[:, None] - t
            on_ray = dot(p, directions) > least_cosine * np.sqrt(dot(p, p))
            nearer = on_ray & (s > 0) & (s < np.minimum(t_max, found.distance))
            found.distance[nearer], found.texel[nearer] = s[nearer], texel[nearer]
        found.loops += len(self.maps)
        return found
