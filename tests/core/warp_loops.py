"""Warps of many points of the unit square that only tests ask for: loops over the parts in `warps`."""

import numpy as np
from photon_bake.addon.core.compiling import kernel, kernel_array
from photon_bake.addon.core.sampling.warps import cosine_uniform_mixture, uniform_sphere
from photon_bake.addon.core.vec3 import put


@kernel
def _spheres(u, out):
    for i in range(len(u)):
        put(out, i, uniform_sphere(u[i, 0], u[i, 1]))


def sample_uniform_sphere(u: np.ndarray) -> np.ndarray:
    """`uniform_sphere` of many, (n, 3)."""
    out = np.empty((len(u), 3), np.float32)
    _spheres(kernel_array(u, np.float32), out)
    return out


@kernel
def _mixtures(u, out):
    for i in range(len(u)):
        put(out, i, cosine_uniform_mixture(u[i, 0], u[i, 1]))


def sample_cosine_uniform_mixture(u: np.ndarray) -> np.ndarray:
    """`cosine_uniform_mixture` of many, (n, 3)."""
    out = np.empty((len(u), 3), np.float32)
    _mixtures(kernel_array(u, np.float32), out)
    return out
