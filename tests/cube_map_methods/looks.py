"""What maps see in any direction, and which map is nearest."""

import numpy as np
from photon_bake.addon.core.sampling.vectors import dot
from photon_bake.addon.tracing.cube_maps.cube_maps import CubeMaps
from scipy.spatial import cKDTree


def seen_towards(maps: CubeMaps, which: np.ndarray, p: np.ndarray, level: int) -> tuple[np.ndarray, np.ndarray]:
    """What maps (n,) see in directions p (n, 3) of any length: texels (n,) and distances (n,), m.

    At coarser levels of the mip chain the distance is that of the nearest depth z in the cell.
    """
    texel, z = maps.texel(which, p)
    if level == 0:
        return texel, maps.distance[texel]
    face_and_row, column = np.divmod(texel, maps.size)
    face, row = np.divmod(face_and_row, maps.size)
    side = maps.size >> level
    cell = maps.level_start[level] + (face * side + (row >> level)) * side + (column >> level)
    return texel, maps.nearest[cell] * np.sqrt(dot(p, p)) / z


def nearest_to(maps: CubeMaps, positions: np.ndarray) -> np.ndarray:
    """Maps whose centres are nearest to positions (n, 3), (n,) int64."""
    return cKDTree(maps.centres).query(positions)[1]
