"""Directions around normals, stratified for each point, by the density that suits what is asked of them."""

from functools import lru_cache

import numpy as np

from ...core.sampling.streams import below_one, sobol
from ...core.sampling.warps import (
    pdf_cosine_uniform_mixture,
    sample_cosine_hemisphere,
    sample_cosine_uniform_mixture,
    to_world,
)


def gather_directions(normals: np.ndarray, n_rays: int, random: np.random.Generator) -> np.ndarray:
    """Cosine-weighted directions around normals (n, 3), (n, 3) float32; every run of `n_rays` is stratified."""
    return to_world(sample_cosine_hemisphere(_stratified(len(normals) // n_rays, n_rays, random)), normals)


def halfway_directions(normals: np.ndarray, n_rays: int, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Directions between cosine-weighted and uniform, stratified as those, and 1/π over their density, (n,) float32.

    For what light low above the horizon has a say in: weighed by cosine-weighted rays it would have no finite variance.
    """
    local = sample_cosine_uniform_mixture(_stratified(len(normals) // n_rays, n_rays, random))
    return to_world(local, normals), 1 / (np.float32(np.pi) * pdf_cosine_uniform_mixture(local[:, 2]))


def _stratified(n_runs: int, n_rays: int, random: np.random.Generator) -> np.ndarray:
    """Points of the unit square, (n_runs · n_rays, 2): one Sobol set, shifted around the torus anew for each run."""
    shifted = _sobol_set(n_rays) + random.random((n_runs, 1, 2), dtype=np.float32)
    return below_one(shifted - np.floor(shifted)).reshape(-1, 2)


@lru_cache(maxsize=16)
def _sobol_set(n: int) -> np.ndarray:
    """The first n points of the Sobol sequence, (1, n, 2) float32."""
    power_of_two = 1 << max(n - 1, 0).bit_length()
    return sobol(2, 0).random(power_of_two)[None, :n].astype(np.float32)
