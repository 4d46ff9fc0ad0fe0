"""Density estimate: the irradiance at receivers from the photons around them.

After the π-engine (Kristensen and Ottosen 2003, part 2): the k nearest photons (section 3.1), those within a thin slice
of the sphere around the receiver's tangent plane (section 3.5), no farther than a radius that the photons' density
gives (Eq. 3.7). Its area πr² is too large where a surface ends within the sphere (boundary bias); here short rays
measure which share of the disc is surface.
"""

import numpy as np
from scipy.spatial import cKDTree

from ...core import vec3
from ...core.compiling import kernel, kernel_array, part
from ...core.parallel import Workers
from ...core.sampling.sobol import fixed_points
from ...core.sampling.vectors import dot, rows
from ...core.sampling.warps import frame, sample_uniform_disk
from ...core.vec3 import mean, minus, plus, put, row, times
from ...emitters import Sphere
from ...photons import Photons
from ...receivers import Receivers
from ...tracing import Tracer, TransparencyTracer
from ..irradiance import Estimate
from ..normal_gradient import slope_of_light

SLICE = np.float32(0.2)
"""Half the slice's thickness over the sphere's radius: thin against walls behind, thick enough for curved surfaces."""

LOW_DENSITY = 0.05
"""α of Eq. 3.5: where photons are less dense than this share of their average, the radius is not grown further."""

SAME_SIDE = np.float32(0.5)
"""Least cosine between normals of one surface."""

_DENSITY = 41  # stream of random numbers
_PAIRS = 1 << 19  # of receivers and photons in a chunk, which bounds the memory
_OVERSEARCH = 2  # in an edge between two faces, half of the nearest photons are the other face's
_N_DISC_RAYS = 16
_LOWEST = np.float32(0.1)  # cosine: few photons come in lower, and each would weigh the more
LEAST_ESTIMATES = 4
"""Photons in all, over those that an estimate takes: fewer say nothing of where the light is, and cost much time."""

LEAST_SHARE = np.float32(1 / 8)  # half of a corner between three walls: with less, the receiver is on no surface


def search_radius(photons: Photons, region: Sphere, k: int) -> float:
    """r_max = √(k rₙ² / (α n)), Eq. 3.7, with n the photons within the sphere of radius rₙ around the receivers, m.

    The π-engine takes the sphere around all photons, which a ground plane blows up; so do we if the first has none.
    0 without photons.
    """
    if len(photons) == 0:
        return 0.0
    away = photons.position - region.centre
    n, r_n = int(np.count_nonzero(dot(away, away) <= region.radius**2)), region.radius
    if n == 0:
        n, r_n = len(photons), float(np.linalg.norm(np.ptp(photons.position, axis=0))) / 2
    return float(np.sqrt(k * r_n**2 / (LOW_DENSITY * n)))


class PhotonDensity:
    """Tells the irradiance from the photons around receivers: E = Σ Φ / (s π r²).

    s is the share of the disc of radius r that is surface. With k photons found, the sum runs over the k − 1 nearest
    and r is the k-th's distance, which makes the mean exact for evenly spread photons.

    Parameters
    ----------
    n_nearest : int
        k.
    r_max : float, m
        Farthest photon looked for: of `search_radius`.
    """

    def __init__(
        self, light_tracer: TransparencyTracer, photons: Photons, n_nearest: int, r_max: float, workers: Workers
    ) -> None:
        self._tracer, self._photons, self._k, self._r_max = light_tracer, photons, n_nearest, r_max
        workers.progress.update("Sorting photons", 0.0)
        self._tree = cKDTree(photons.position, balanced_tree=False)
        self._normal = photons.normal

    def at(self, receivers: Receivers, workers: Workers) -> tuple[Estimate, np.ndarray]:
        """Estimates at n receivers, and the radius r of each, (n,) float32, m."""
        estimates = Estimate.dark(len(receivers), receivers.directional)
        radius = np.full(len(receivers), self._r_max, np.float32)
        if len(self._photons) == 0:
            return estimates, radius
        flight = self._photons.direction if receivers.directional else None

        def estimate(chunk: slice, _: np.random.Generator) -> tuple[Estimate, np.ndarray]:
            return self._estimate(receivers.position[chunk], receivers.normal[chunk], flight)

        size = max(1, _PAIRS // self._k)
        for chunk, (found, r) in workers.chunks("Gathering photons", len(receivers), size, estimate, (_DENSITY,)):
            estimates.put(chunk, found)
            radius[chunk] = r
        return estimates, radius

    def _estimate(
        self, position: np.ndarray, normals: np.ndarray, flight: np.ndarray | None
    ) -> tuple[Estimate, np.ndarray]:
        photons, tracer = self._photons, self._tracer.surfaces
        x, occluded = _on_surface(self._tracer, position, normals, float(SLICE * self._r_max))
        within, r = _nearest_in_slice(self._tree, photons.position, self._normal, x, normals, self._k, self._r_max)
        # What covers a receiver closer than the slice is thick has other photons on its far side
        above = position + (SLICE * r)[:, None] * normals
        covered = ~self._tracer.visibility(position, above).any(axis=1)
        within[occluded | covered] = -1
        lit = np.flatnonzero((within >= 0).any(axis=1))
        share = np.ones(len(x), np.float32)
        share[lit], blocked = surface_share(tracer, rows(x, lit), rows(normals, lit), r[lit])
        behind = lit[blocked]
        within[behind] = _seen(tracer, photons.position, x[behind], normals[behind], within[behind], r[behind])
        area = np.maximum(np.pi * r**2 * share, np.float32(1e-30))  # where photons lie on the very receiver
        return estimate_of(within, photons.power, flight, normals, area), r


def estimate_of(
    within: np.ndarray, power: np.ndarray, flight: np.ndarray | None, normals: np.ndarray, area: np.ndarray
) -> Estimate:
    """Σ Φ over areas (n,), of the photons (n, k) that are `within`, −1 for none; and with their `flight` its slope."""
    irradiance, stderr = np.empty((len(within), 3), np.float32), np.empty(len(within), np.float32)
    sum_photons(within, power, area, irradiance, stderr)
    if flight is None:
        return Estimate(irradiance, stderr, None)
    power_of, flight_of = np.zeros((2, *within.shape, 3), np.float32)
    some = within >= 0
    power_of[some], flight_of[some] = rows(power, within[some]), rows(flight, within[some])
    return Estimate(irradiance, stderr, slope_of_photons(power_of, flight_of, normals, area))


@kernel
def sum_photons(within, power, area, irradiance, stderr):
    """Σ Φ over areas (n,), of the photons (n, k) that are `within`, −1 for none (Eq. 3.3); and its standard error.

    That is √(Σ Φ²) over the area, of means over colours.
    """
    for r in range(len(within)):
        total, squares = vec3.BLACK, vec3.ZERO
        for j in range(within.shape[1]):
            if within[r, j] >= 0:
                phi = row(power, within[r, j])
                total, squares = plus(total, phi), squares + mean(phi) * mean(phi)
        put(irradiance, r, times(total, vec3.ONE / area[r]))
        stderr[r] = np.sqrt(squares) / area[r]


def slope_of_photons(power: np.ndarray, flight: np.ndarray, normals: np.ndarray, area: np.ndarray) -> np.ndarray:
    """Slope (n, 3, 3) of photons' power (n, k, 3) that flew along unit vectors (n, k, 3) onto areas (n,).

    A photon brings L dω = Φ / (cos θ A), where Φ/A is irradiance; what comes in lower than `_LOWEST` as if from there.
    """
    n, k = power.shape[:2]
    towards, normal = -flight.reshape(-1, 3), np.repeat(normals, k, 0)
    g = slope_of_light(towards, normal) / np.maximum(dot(towards, normal), _LOWEST)[:, None]
    return g.reshape(n, k, 3).transpose(0, 2, 1) @ power / area[:, None, None]


def _on_surface(
    tracer: TransparencyTracer, x: np.ndarray, normals: np.ndarray, farthest: float
) -> tuple[np.ndarray, np.ndarray]:
    """Receivers moved down onto the surface that they hover above, if there is one within a distance, m.

    Where photons are dense, the slice is thinner than what receivers may be lifted off their surface. Also, (n,) bool,
    whether another surface lies there, so that no light gets to them.
    """
    hits = tracer.surfaces.closest_hit(x, -normals, farthest)
    beneath = hits.hit & (np.abs(dot(hits.normal, normals)) > SAME_SIDE)
    occluded = beneath & tracer.coplanar_occluded(hits.triangle, hits.u, hits.v)
    return x - np.where(beneath, hits.distance, 0)[:, None] * normals, occluded


def _nearest_in_slice(
    tree: cKDTree,
    positions: np.ndarray,
    photon_normals: np.ndarray,
    x: np.ndarray,
    normals: np.ndarray,
    k: int,
    r_max: float,
) -> tuple[np.ndarray, np.ndarray]:
    """The k − 1 nearest photons in each receiver's slice, (n, k') int, −1 for none; and the radius (n,) float32."""
    n_asked = min(_OVERSEARCH * k, tree.n)
    distance, index = tree.query(x, k=n_asked, distance_upper_bound=r_max)
    distance, index = distance.reshape(len(x), n_asked), index.reshape(len(x), n_asked)
    radius = np.empty(len(x), np.float32)
    at, normals = kernel_array(x, np.float32), kernel_array(normals, np.float32)
    choose_photons(distance, index, positions, photon_normals, at, normals, k, r_max, radius)
    return index, radius


@kernel
def choose_photons(distance, index, positions, photon_normals, x, normals, k, r_max, radius):
    """Find the radius around each receiver, and put −1 in the place of photons that are not in its slice.

    Parameters
    ----------
    distance, index : (n, m) float64 and int64
        Of the photons nearest to each receiver, rising; an index too large: none more.
    radius : (n,) float32, m
        Becomes the k-th distance on the receiver's side; how far was looked where there are fewer.
    """
    for r in range(len(x)):
        centre, normal = row(x, r), row(normals, r)
        radius[r] = _radius(distance[r], index[r], photon_normals, normal, k, r_max)
        for j in range(index.shape[1]):
            photon = index[r, j]
            if photon >= len(positions) or np.float32(distance[r, j]) >= radius[r]:
                index[r, j] = -1
                continue
            height = abs(vec3.dot(minus(row(positions, photon), centre), normal))
            if height > SLICE * radius[r] or vec3.dot(row(photon_normals, photon), normal) <= SAME_SIDE:
                index[r, j] = -1


@part
def _radius(distance, index, photon_normals, normal, k, r_max):
    """Distance of a receiver's k-th photon on its side, or how far the sphere was looked through."""
    rank = 0
    for j in range(len(index)):
        if index[j] >= len(photon_normals):
            return np.float32(r_max)
        if vec3.dot(row(photon_normals, index[j]), normal) > SAME_SIDE:
            rank += 1
            if rank == k:
                return np.float32(distance[j])
    return np.float32(distance[len(index) - 1])


def points_of_discs(x: np.ndarray, normals: np.ndarray, r: np.ndarray, disc: np.ndarray | None = None) -> np.ndarray:
    """Points of discs of radii (n,) around x (n, 3), at right angles to unit normals, (n, k, 3), m.

    Parameters
    ----------
    disc : (k, 2) float32, optional
        The same points in a disc of radius 1; evenly spread without it.
    """
    if disc is None:
        disc = sample_uniform_disk(fixed_points(_N_DISC_RAYS))
    tangent, bitangent = frame(normals)
    offset = disc[None, :, :1] * tangent[:, None] + disc[None, :, 1:] * bitangent[:, None]
    points: np.ndarray = x[:, None] + r[:, None, None] * offset
    return points


def surface_share(
    tracer: Tracer, x: np.ndarray, normals: np.ndarray, r: np.ndarray, disc: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Share of the disc of radius r around each receiver that is its surface, (n,) float32, at least an eighth.

    Also whether something stands within the disc, (n,) bool.

    From points of the disc raised to the top of the slice, rays go down through it; those that meet a surface facing
    the same way count, unless something stands between the receiver and the point (a wall that the floor runs under).

    Parameters
    ----------
    disc : (k, 2) float32, optional
        The points, in a disc of radius 1; evenly spread without it.
    """
    top = (SLICE * r)[:, None] * normals
    raised = points_of_discs(x, normals, r, disc) + top[:, None]
    n_rays, raised = raised.shape[1], raised.reshape(-1, 3).astype(np.float32)
    down = np.repeat(-normals, n_rays, 0)
    thickness = np.repeat(2 * SLICE * r, n_rays)
    hits = tracer.closest_hit(raised, down)
    cosine = np.abs(dot(hits.normal, down))
    lies_there = hits.hit & (hits.distance <= thickness) & (cosine > SAME_SIDE)
    hidden = tracer.occluded(np.repeat(x + top, n_rays, 0), raised)
    share = (lies_there & ~hidden).reshape(len(x), n_rays).mean(axis=1, dtype=np.float32)
    return np.maximum(share, LEAST_SHARE), hidden.reshape(len(x), n_rays).any(axis=1)


def _seen(
    tracer: Tracer, positions: np.ndarray, x: np.ndarray, normals: np.ndarray, within: np.ndarray, r: np.ndarray
) -> np.ndarray:
    """`within` less the photons that something hides from their receiver, both raised to the top of the slice."""
    receiver, k = np.nonzero(within >= 0)
    top = (SLICE * r[receiver])[:, None] * rows(normals, receiver)
    hidden = tracer.occluded(rows(x, receiver) + top, rows(positions, within[receiver, k]) + top)
    seen = within.copy()
    seen[receiver[hidden], k[hidden]] = -1
    return seen
