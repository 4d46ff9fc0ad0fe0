"""The paper's method: an initial testing point by angle partition (3.1, 3.2), then the secant method."""

from dataclasses import dataclass

import numpy as np
from photon_bake.addon.core.sampling.vectors import dot
from photon_bake.addon.tracing.cube_maps.cube_maps import CubeMaps
from photon_bake.addon.tracing.cube_maps.search.map_hit import MapHits
from photon_bake.tests.cube_map_methods.looks import nearest_to, seen_towards
from photon_bake.tests.cube_map_methods.secant import CLOSE, refine

_Q = 8
_LEVELS = (2, 1, 0, 0)  # of the mip chain, in each loop
_SETTLED = np.float32(0.01)  # of its distance: a testing point that moves less from loop to loop is final
_OWN = np.float32(2)  # texels: nearer than this is the photon's own surface
_ALONG = np.float32(1 - 1e-3)  # cosine: an unrefined testing point has to lie this close to the ray


@dataclass(frozen=True)
class Fan:
    """Divides the fan between the photon and its direction, as the map nearest to the photon sees it.

    The energy f(p) = d² a (Eq. 2, 3) is taken with d relative to |p − t|, and for points that are clear of the photon.
    As the paper has it, in metres and everywhere, it prefers the photon's own surface, where |p − t| is small.

    `MapHits.loops` are the partitions.
    """

    maps: CubeMaps

    def find(self, origins: np.ndarray, directions: np.ndarray, t_max: np.ndarray) -> MapHits:
        """See `Method.find`."""
        found = MapHits.none(len(origins))
        testing_point, texel = self._testing_points(origins, directions, found)
        s = dot(testing_point - origins, directions)  # dp, from the photon instead of V' (Eq. 1)
        which = nearest_to(self.maps, testing_point)
        refined, ratio, refined_texel = refine(self.maps, which, origins, directions, s, found)
        close = np.isfinite(self.maps.distance[refined_texel]) & (np.abs(ratio - 1) < CLOSE)
        way = testing_point - origins
        meets = (texel >= 0) & (close | (s > _ALONG * np.sqrt(dot(way, way))))
        s, texel = np.where(close, refined, s), np.where(close, refined_texel, texel)
        meets &= s < t_max
        found.distance[meets], found.texel[meets] = s[meets], texel[meets]
        return found

    def _testing_points(
        self, origins: np.ndarray, directions: np.ndarray, found: MapHits
    ) -> tuple[np.ndarray, np.ndarray]:
        """Initial testing points I (n, 3) in world space, and their texels (n,), −1 where there is none."""
        which = nearest_to(self.maps, origins)
        t, r = origins - self.maps.centres[which], directions
        to_photon = t / np.maximum(np.sqrt(dot(t, t)), np.float32(1e-30))[:, None]
        across = r - dot(to_photon, r)[:, None] * to_photon
        across /= np.maximum(np.sqrt(dot(across, across)), np.float32(1e-30))[:, None]
        low, high = np.zeros(len(t), np.float32), np.arccos(np.clip(dot(to_photon, r), -1, 1))
        point, texel = np.zeros_like(t), np.full(len(t), -1)
        live = np.arange(len(t))
        for level in _LEVELS:
            turn = _Turn(to_photon[live], across[live])
            angles = np.linspace(low[live], high[live], _Q + 1)
            f = np.stack([self._energy(which[live], t[live], r[live], turn.by(angle), level) for angle in angles])
            g = f[:-1] + f[1:]
            best = np.where(np.isfinite(g.min(axis=0)), g.argmin(axis=0), np.minimum(f.argmin(axis=0), _Q - 1))
            found.loops[live] += 1
            found.n_look_ups += (_Q + 2) * len(live)
            some, row = np.isfinite(f.min(axis=0)), np.arange(len(live))
            low[live], high[live] = (np.where(some, angles[best + i, row], angles[i * _Q]) for i in (0, 1))

            # The middle of the best section is the new testing point, if the map sees something there
            q = turn.by((low[live] + high[live]) / 2)
            seen_in, distance = seen_towards(self.maps, which[live], q, 0)
            new = some & np.isfinite(distance)
            moved = np.where(new, distance, 0)[:, None] * q - point[live]
            point[live[new]] += moved[new]
            texel[live[new]] = seen_in[new]
            live = live[~(new & (np.sqrt(dot(moved, moved)) < _SETTLED * distance))]
        return point + self.maps.centres[which], texel

    def _energy(self, which: np.ndarray, t: np.ndarray, r: np.ndarray, q: np.ndarray, level: int) -> np.ndarray:
        """The energy f of what maps see in directions q (n, 3), (n,); infinite where that cannot be a hit."""
        _, distance = seen_towards(self.maps, which, q, level)
        sees = np.isfinite(distance)
        p = np.where(sees, distance, 0)[:, None] * q - t
        length, along = np.sqrt(dot(p, p)), dot(p, r)
        d = (length - along) / np.maximum(length, np.float32(1e-30))
        clear = length > _OWN * (2 / self.maps.size) * distance
        return np.where(sees & clear & (along > 0), d * d * (length + along), np.inf)


@dataclass(frozen=True)
class _Turn:
    """Directions `start` (n, 3), to be turned towards the perpendicular ones `across` (n, 3)."""

    start: np.ndarray
    across: np.ndarray

    def by(self, angle: np.ndarray) -> np.ndarray:
        return np.cos(angle)[:, None] * self.start + np.sin(angle)[:, None] * self.across
