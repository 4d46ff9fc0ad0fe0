"""Final gather: the irradiance at receivers from rays into the radiance cache."""

from dataclasses import dataclass

import numpy as np

from ..parallel import ordered_map, slices
from ..progress import Progress
from ..receivers import Receivers
from ..sampling.streams import stream
from ..scene.z_curve import z_curve
from .gather_rays import GatherRays

_GATHER = 21  # stream of random numbers
_CHUNK = 1 << 16
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
    seed: int,
    n_threads: int = 0,
    progress: Progress | None = None,
) -> Gathered:
    """Irradiance E = π · mean of L over cosine-weighted rays, in batches that are stratified each on its own.

    Parameters
    ----------
    n_rays : int
        Rays of each receiver in a round; a multiple of the batches is used.
    noise : float
        Rounds go on for the receivers whose standard error is above this share of the mean irradiance, as long as
        there are any (at most 64 rounds); 0: one round.
    """
    progress = progress or Progress()
    n = len(receivers)
    rays_a_batch = max(1, n_rays // _N_BATCHES)
    total, total_square = np.zeros((n, 3)), np.zeros(n)
    batches = np.zeros(n, np.int64)
    # Neighbours are gathered together, whose rays meet the same surfaces: that is faster.
    active = in_space = np.argsort(z_curve(receivers.position), kind="stable")
    sent = 0
    for turn in range(_MAX_ROUNDS if noise > 0 else 1):
        size = max(1, _CHUNK // (rays_a_batch * _N_BATCHES))

        def gather(
            item: tuple[int, slice], chosen: np.ndarray = active, turn: int = turn
        ) -> tuple[np.ndarray, np.ndarray]:
            index, chunk = item
            receiver = chosen[chunk]
            return receiver, _batch_means(rays, receivers, receiver, rays_a_batch, stream(seed, _GATHER, turn, index))

        done = 0
        progress.update("Gathering light", _fraction(turn, 0.0, noise > 0))
        for receiver, means in ordered_map(gather, enumerate(slices(len(active), size)), n_threads):
            total[receiver] += means.sum(axis=1)
            total_square[receiver] += (means.mean(axis=2) ** 2).sum(axis=1)
            batches[receiver] += _N_BATCHES
            done += len(receiver)
            progress.update("Gathering light", _fraction(turn, done / len(active), noise > 0))
        sent += len(active) * rays_a_batch * _N_BATCHES
        mean = total / np.maximum(batches, 1)[:, None]
        variance = np.maximum(total_square / np.maximum(batches, 1) - mean.mean(axis=1) ** 2, 0)
        stderr = np.sqrt(variance / np.maximum(batches - 1, 1))
        active = in_space[stderr[in_space] > noise * mean.mean()]
        if len(active) == 0:
            break
    return Gathered((np.pi * mean).astype(np.float32), (np.pi * stderr).astype(np.float32), sent)


def _fraction(turn: int, of_turn: float, more_turns: bool) -> float:
    """How much is done: each turn half of what is left, as nobody knows how many there will be."""
    return 1 - (1 - of_turn / 2) / 2**turn if more_turns else of_turn


def _batch_means(
    rays: GatherRays, receivers: Receivers, receiver: np.ndarray, rays_a_batch: int, random: np.random.Generator
) -> np.ndarray:
    """Mean radiance of each batch of rays of some receivers, (r, batches, 3) float64."""
    n = rays_a_batch * _N_BATCHES
    origins, normals = np.repeat(receivers.position[receiver], n, 0), np.repeat(receivers.normal[receiver], n, 0)
    reflected, _ = rays.radiance(origins, normals, rays_a_batch, random)
    return reflected.reshape(len(receiver), _N_BATCHES, rays_a_batch, 3).mean(axis=2, dtype=np.float64)
