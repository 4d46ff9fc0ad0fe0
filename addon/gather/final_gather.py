"""Final gather: the irradiance at receivers from rays into the radiance cache."""

from dataclasses import dataclass

import numpy as np

from ..parallel import Workers
from ..receivers import Receivers
from ..scene.z_curve import z_curve
from .gather_rays import GatherRays

_GATHER = 21  # stream of random numbers
_CHUNK = 1 << 17
_N_BATCHES = 4
_MAX_ROUNDS = 64


@dataclass(frozen=True)
class Gathered:
    """What n receivers gathered.

    Attributes
    ----------
    irradiance : (n, 3) float32, W/m²
        From surfaces.
    stderr : (n,) float32, W/m²
        Standard error of the irradiance, mean over colours, from independent batches of rays.
    n_rays : int
        Rays sent out in all.
    """

    irradiance: np.ndarray
    stderr: np.ndarray
    n_rays: int


def final_gather(
    rays: GatherRays,
    receivers: Receivers,
    n_rays: int,
    noise: float,
    workers: Workers,
) -> Gathered:
    """Irradiance E = π · mean of L over cosine-weighted rays, in batches that are stratified each on its own.

    Parameters
    ----------
    n_rays : int
        Rays of each receiver in a round; a multiple of the batches is used.
    noise : float
        Rounds go on for the receivers whose standard error is above this share of their own irradiance and of the mean
        irradiance, as long as there are any (at most 64 rounds); 0: one round.
    """
    n = len(receivers)
    rays_a_batch = max(1, n_rays // _N_BATCHES)
    size = max(1, _CHUNK // (rays_a_batch * _N_BATCHES))
    total, total_square = np.zeros((n, 3)), np.zeros(n)
    batches = np.zeros(n, np.int64)
    # Neighbours are gathered together, whose rays meet the same surfaces: that is faster.
    active = in_space = np.argsort(z_curve(receivers.position), kind="stable")
    sent = 0
    for turn in range(_MAX_ROUNDS if noise > 0 else 1):

        def gather(chunk: slice, random: np.random.Generator, active: np.ndarray = active) -> np.ndarray:
            return _batch_means(rays, receivers, active[chunk], rays_a_batch, random)

        # Nobody knows how many turns there will be: each is half of what is left
        part = (1 - 0.5**turn, 1 - 0.5 ** (turn + 1)) if noise > 0 else (0.0, 1.0)
        for chunk, means in workers.chunks("Gathering light", len(active), size, gather, (_GATHER, turn), part):
            total[active[chunk]] += means.sum(axis=1)
            total_square[active[chunk]] += (means.mean(axis=2) ** 2).sum(axis=1)
        batches[active] += _N_BATCHES
        sent += len(active) * rays_a_batch * _N_BATCHES
        mean = total / np.maximum(batches, 1)[:, None]
        variance = np.maximum(total_square / np.maximum(batches, 1) - mean.mean(axis=1) ** 2, 0)
        stderr = np.sqrt(variance / np.maximum(batches - 1, 1))
        too_noisy = stderr > noise * np.maximum(mean.mean(axis=1), mean.mean())
        active = in_space[too_noisy[in_space]]
        if len(active) == 0:
            break
    return Gathered((np.pi * mean).astype(np.float32), (np.pi * stderr).astype(np.float32), sent)


def _batch_means(
    rays: GatherRays, receivers: Receivers, receiver: np.ndarray, rays_a_batch: int, random: np.random.Generator
) -> np.ndarray:
    """Mean radiance of each batch of rays of some receivers, (r, batches, 3) float64."""
    n = rays_a_batch * _N_BATCHES
    origins, normals = np.repeat(receivers.position[receiver], n, 0), np.repeat(receivers.normal[receiver], n, 0)
    reflected, _ = rays.radiance(origins, normals, rays_a_batch, random)
    return reflected.reshape(len(receiver), _N_BATCHES, rays_a_batch, 3).mean(axis=2, dtype=np.float64)
