"""Gather rays: cosine-weighted directions over hemispheres, stratified for each point, and what they see."""

from collections.abc import Callable
from functools import lru_cache

import numpy as np

from ..sampling.streams import below_one, sobol
from ..sampling.warps import sample_cosine_hemisphere, to_world
from ..scene import Scene
from ..tracers import Hits, Tracer

LookUp = Callable[[Hits, np.ndarray], np.ndarray]
"""Radiance that rays meet, from their hits and directions."""


def gather_radiance(
    scene: Scene,
    tracer: Tracer,
    look_up: LookUp,
    origins: np.ndarray,
    normals: np.ndarray,
    n_rays: int,
    random: np.random.Generator,
) -> tuple[np.ndarray, np.ndarray]:
    """Radiance that one cosine-weighted ray from each origin meets: from surfaces, and from the world.

    Every run of `n_rays` rays is stratified over the hemisphere; the mean of a run is E/π.

    Parameters
    ----------
    origins, normals : (n, 3) float32
        n is a multiple of `n_rays`.

    Returns
    -------
    reflected, sky : (n, 3) float32, W/(m² sr)
    """
    directions = to_world(sample_cosine_hemisphere(_stratified(len(origins) // n_rays, n_rays, random)), normals)
    hits = tracer.closest_hit(origins, directions)
    sky = np.where(hits.hit[:, None], np.float32(0), scene.world_radiance)
    return look_up(hits, directions), sky


def _stratified(n_runs: int, n_rays: int, random: np.random.Generator) -> np.ndarray:
    """Points of the unit square, (n_runs · n_rays, 2): one Sobol set, shifted around the torus anew for each run."""
    shifted = _sobol_set(n_rays) + random.random((n_runs, 1, 2), dtype=np.float32)
    return below_one(shifted - np.floor(shifted)).reshape(-1, 2)


@lru_cache(maxsize=16)
def _sobol_set(n: int) -> np.ndarray:
    """The first n points of the Sobol sequence, (1, n, 2) float32."""
    power_of_two = 1 << max(n - 1, 0).bit_length()
    return sobol(2, 0).random(power_of_two)[None, :n].astype(np.float32)
