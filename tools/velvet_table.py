"""Compute the albedo of velvet and write it to addon/bsdf/broad/velvet.npz: `python tools/velvet_table.py`.

Print its digest, which addon/bsdf/broad/velvet.py has to say.
"""

import hashlib

import numba
import numpy as np
from photon_bake.addon.bsdf.broad import velvet
from photon_bake.addon.core.vec3 import ZERO

_N, _N_ANGLES, _LEAST = 32, 256, 1e-3  # nodes along each axis, and points along each angle; the least of a node

compiled = numba.njit(error_model="numpy")


@compiled
def tabulate(sigmas, cosines, middles, albedo):
    """∫ f cos θ dω by the midpoint rule in the root of cos θ and in the azimuth."""
    for r, sigma in enumerate(sigmas):
        for c, cos in enumerate(cosines):
            total, view = 0.0, (np.sqrt(1 - cos * cos), ZERO, cos)
            for root in middles:
                z = root * root
                sin = np.sqrt(1 - z * z)
                for turn in middles:
                    light = (sin * np.cos(np.pi * turn), sin * np.sin(np.pi * turn), z)
                    total += velvet.shape(sigma, view, light) * z * 2 * root
            albedo[r, c] = 2 * np.pi * total / len(middles) ** 2


def table(n_angles: int = _N_ANGLES) -> np.ndarray:
    """The albedo at nodes of the roughness and the cosine, (32, 32) float32."""
    nodes = np.clip(np.linspace(0, 1, _N), _LEAST, 1).astype(np.float32)
    albedo = np.empty((_N, _N), np.float32)
    tabulate(np.maximum(nodes, 0.01).astype(np.float32), nodes, (np.arange(n_angles) + 0.5) / n_angles, albedo)
    return albedo


if __name__ == "__main__":
    np.savez(velvet.FILE, albedo=table())
    print(hashlib.sha256(velvet.FILE.read_bytes()).hexdigest())
