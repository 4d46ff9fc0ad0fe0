"""How large splats are: as the density of photons says, which makes them shrink as photons get more."""

import numpy as np
from scipy.spatial import cKDTree

from ...core.parallel import Workers
from ...core.sampling.path_numbers import PathNumbers
from ...photons import Photons
from ..density.density import LOW_DENSITY

_LEAST_PATH_DENSITY = 0.01
_NEIGHBOURS = 16  # by which the density is measured: of fewer it would be noisy
OF_CAUSTICS, OF_SCATTERED = 0.011, 0.04
"""ℓ/√A, the width of what is to be resolved best, over that of what photons light: by caustics, by scattered light."""

_CHUNK = 1 << 14  # photons
_RADIUS = 81  # stream of random numbers


def n_in_splat(n: int, fineness: float = OF_CAUSTICS) -> float:
    """How many photons of n to have in a splat, so that noise and blur make the least error: k = (96π²)^⅓ (nℓ²/A)^⅔.

    With λ photons a square metre and Epanechnikov's kernel of radius r, an estimate of an irradiance E has the relative
    variance 4/(3πλr²), and the mean is off by r²∇²E/12. Let ∇²E be E/ℓ². Then r⁴/(144 ℓ⁴) + 4/(3πλr²) is least at r⁶ =
    96 ℓ⁴/(πλ), and k = πλr² photons are within. Both noise and blur go to 0 as n grows, the error as n^(−⅓).

    Parameters
    ----------
    fineness : float
        ℓ/√A: `OF_CAUSTICS` or `OF_SCATTERED`.
    """
    return max((96 * np.pi**2) ** (1 / 3) * (n * fineness**2) ** (2 / 3), _NEIGHBOURS)


def path_density_radius(photons: Photons, area: float, n: int, fineness: float = OF_CAUSTICS) -> np.ndarray:
    """Radii √(k A / (π α p N)), (p,) float32, m: larger the less probable a photon's path was (section 4.3).

    Parameters
    ----------
    area : float, m²
        A, of the surfaces that are lit.
    n : int
        N, the photons there.
    """
    density = np.clip(photons.path_density, _LEAST_PATH_DENSITY, 1)
    return np.sqrt(np.float32(n_in_splat(n, fineness) * area / (np.pi * LOW_DENSITY * max(n, 1))) / density)


def neighbour_radius(
    photons: Photons, largest: np.ndarray, workers: Workers, fineness: float = OF_CAUSTICS
) -> np.ndarray:
    """Distance to about the k-th nearest photon around each, at most `largest` (p,), (p,) float32, m.

    So splats are small in a bright caustic, and large beside it (the variable kernels of Breiman, Meisel and Purcell
    1977). Of a random m-th of the photons, the (k/m)-th nearest is as far away, and found sooner; a photon takes what
    the one of the sample that is nearest to it has found.
    """
    n = len(photons)
    chances = PathNumbers(workers.seed, _RADIUS).of(photons.path).random(n)  # alike from frame to frame
    sample = photons.position[chances < np.float32(_NEIGHBOURS / n_in_splat(n, fineness))]
    if len(sample) <= _NEIGHBOURS:
        return largest.astype(np.float32)
    tree, farthest = cKDTree(sample, balanced_tree=False), float(largest.max())

    def query(points: np.ndarray, k: int, part: tuple[float, float]) -> np.ndarray:
        """The k-th nearest of the sample to each point: distance and index, (n, 2)."""

        def of_chunk(chunk: slice, _: np.random.Generator) -> np.ndarray:
            return np.stack(tree.query(points[chunk], [k], distance_upper_bound=farthest), axis=1)[..., 0]

        parts = workers.chunks("Measuring photons", len(points), _CHUNK, of_chunk, (_RADIUS,), part)
        return np.concatenate([found for _, found in parts])

    spread = query(sample, _NEIGHBOURS + 1, (0, 0.5))[:, 0]  # itself is the first
    nearest = query(photons.position, 1, (0.5, 1))[:, 1].astype(np.int64)
    return np.minimum(np.append(spread, np.inf)[nearest], largest).astype(np.float32)
