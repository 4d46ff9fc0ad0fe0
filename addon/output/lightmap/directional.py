"""Directional lightmaps: light from all around in four images, by spherical harmonics of the bands 0 and 1.

For incident radiance L(ω) at a texel, with ω in world space and L = 0 below the surface,

    M = (1/4π) ∫ L dω        V = (1/4π) ∫ L ω dω

a shader that has a normal n, from a normal map say, finds the light as

    E(n)/π = M + 2 V·n

(Ramamoorthi and Hanrahan 2001: the cosine lobe has A₀ = π and A₁ = 2π/3). No component of V is larger than M, so that
three images of V/M in [0, 1] go with one of M:

    M  = L0            V_x = L0 · (2 L1x − 1), and y and z alike

which is what engines call the SH format of directional lightmaps.
"""

import numpy as np

KINDS = ("L0", "L1x", "L1y", "L1z")
"""What the four images are called."""


def encode_directional(mean: np.ndarray, vector: np.ndarray) -> dict[str, np.ndarray]:
    """The four images of M and V, by their `KINDS`.

    Parameters
    ----------
    mean : (h, w, 3) float32
        M of each colour.
    vector : (h, w, 3, 3) float32
        V: for each axis x, y, z, each colour.
    """
    share = vector / np.maximum(mean, np.float32(1e-20))[:, :, None]
    images = np.moveaxis(np.clip(share, -1, 1) * np.float32(0.5) + np.float32(0.5), 2, 0)
    return dict(zip(KINDS, (mean, *images), strict=True))


def decode_directional(images: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """M and V of the four images."""
    mean = images["L0"]
    vector = [mean * (2 * images[kind] - 1) for kind in KINDS[1:]]
    return mean, np.stack(vector, axis=2)


def light_for_normals(mean: np.ndarray, vector: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """E(n)/π for unit normals (h, w, 3), (h, w, 3); not below 0."""
    return np.maximum(mean + 2 * np.einsum("hwac,hwa->hwc", vector, normals), 0)
