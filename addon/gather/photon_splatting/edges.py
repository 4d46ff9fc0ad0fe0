"""Where surfaces end: photons that would be beyond an edge or behind a wall are missing there."""

import numpy as np
from scipy.ndimage import distance_transform_edt

from ...core.parallel import Workers
from ...core.sampling.sobol import fixed_points
from ...core.sampling.vectors import dot
from ...core.sampling.warps import sample_uniform_disk
from ...receivers import Camera, SeenSurface
from ...tracing import Tracer
from ..density.density import SAME_SIDE, surface_share

_REACH = np.float32(3)  # sides of a pixel that neighbours on one surface may be off each other's plane
_N_RAYS = 32
_CHUNK = 1 << 13  # points

_EDGES = 83  # stream of random numbers


def share_of_splats(
    tracer: Tracer, seen: SeenSurface, to_edge: np.ndarray, radius: np.ndarray, workers: Workers
) -> np.ndarray:
    """Share s = ∫κ dA over the surface around each point, (p,) float32, at least an eighth.

    Divided by s, even light is even to the edge. Short rays find it for points closer to an edge in the picture than
    splats are large.

    Parameters
    ----------
    to_edge : (p,) float32, m
        From `distance_to_edge`.
    radius : (p,) float32, m
        Of the splats that light each point; 0: none.
    """
    near = np.flatnonzero(to_edge <= radius * (radius > 0))
    u = fixed_points(_N_RAYS)
    # ∫κ dA within ρr is 2ρ² − ρ⁴
    disc = sample_uniform_disk(np.stack([1 - np.sqrt(1 - u[:, 0]), u[:, 1]], axis=1))
    share = np.ones(len(seen), np.float32)

    def measure(chunk: slice, _: np.random.Generator) -> np.ndarray:
        k = near[chunk]
        return surface_share(tracer, seen.position[k], seen.normal[k], radius[k], disc)[0]

    for chunk, found in workers.chunks("Looking for edges", len(near), _CHUNK, measure, (_EDGES,)):
        share[near[chunk]] = found
    return share


def distance_to_edge(camera: Camera, seen: SeenSurface) -> np.ndarray:
    """How far each point is at the least from another surface, or from the picture's edge, (p,) float32, m.

    It is the distance in the picture, times the side of the point's pixel across the view.
    """
    grid = np.full((camera.height + 2, camera.width + 2), -1)
    row, column = np.divmod(seen.pixel, camera.width)
    grid[row + 1, column + 1] = np.arange(len(seen))
    inner = np.ones(grid.shape, bool)
    for points, of_axis in ((grid, inner), (grid.T, inner.T)):
        a, b = points[:-1], points[1:]
        joined = _on_one_surface(seen, a.ravel(), b.ravel()).reshape(a.shape)
        of_axis[:-1] &= joined
        of_axis[1:] &= joined
    side = np.sqrt(seen.area * np.abs(dot(seen.normal, seen.direction)))
    return distance_transform_edt(inner)[row + 1, column + 1].astype(np.float32) * side


def _on_one_surface(seen: SeenSurface, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Whether points a and b (n,), −1 for none, lie on one surface, (n,) bool."""
    off_plane = np.abs(dot(seen.position[b] - seen.position[a], seen.normal[a]))
    alike = (dot(seen.normal[a], seen.normal[b]) > SAME_SIDE) & (off_plane < _REACH * np.sqrt(seen.area[a]))
    return (a >= 0) & (b >= 0) & alike
