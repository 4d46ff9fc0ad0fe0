"""Directional lightmaps: the light of normals that a normal map turns, in four images.

Light is a linear function of the normal n', with four coefficients for each colour, in world space:

    E(n')/π = L0 + L1·n'

It is exact at the texel's own normal n, and the best of its kind over the hemisphere around it (`normal_gradient`):
with the irradiance's slope B, L1 = B/π and L0 = E(n)/π − L1·n. Images hold L0, and for each axis a share from 0 to 1:

    L1 = 2 L0 (2 share − 1)

which is the format that engines call SH, or L1. It can hold |L1| ≤ 2 L0. Light from a narrow cone around n needs more:
there L1's part along n gives way, so that the light of n itself stays as it is.
"""

import numpy as np

KINDS = ("L0", "L1x", "L1y", "L1z")
"""What the four images are called."""


def directional_light(light: np.ndarray, slope: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """L0 (…, 3) and L1 (…, 3, 3), for each axis and colour, float32.

    With L1 = t + s n, t across n and s = E(n)/π − L0, |L1| ≤ 2 L0 is 3 L0² + 2 L0 E(n)/π ≥ t² + (E(n)/π)².

    Parameters
    ----------
    light : (…, 3)
        E(n)/π.
    slope : (…, 3, 3)
        B/π, for each axis and colour.
    normals : (…, 3)
        Unit vectors.
    """
    light, normals = np.maximum(light, 0), normals[..., None]
    along = (normals * slope).sum(axis=-2)
    across = slope - normals * along[..., None, :]
    least = (np.sqrt(4 * light**2 + 3 * (across**2).sum(axis=-2)) - light) / 3
    constant = np.maximum(light - along, least)
    linear = across + normals * (light - constant)[..., None, :]
    return constant.astype(np.float32), linear.astype(np.float32)


def shares_of(constant: np.ndarray, linear: np.ndarray) -> np.ndarray:
    """L1/(2 L0), (…, 3, 3) from −1 to 1."""
    return np.clip(linear / np.maximum(2 * constant, np.float32(1e-20))[..., None, :], -1, 1)


def encode_directional(constant: np.ndarray, linear: np.ndarray) -> dict[str, np.ndarray]:
    """The four images (h, w, 3) of L0 (h, w, 3) and L1 (h, w, 3, 3), by their `KINDS`."""
    shares = np.moveaxis(shares_of(constant, linear) * np.float32(0.5) + np.float32(0.5), 2, 0)
    return dict(zip(KINDS, (constant, *shares), strict=True))


def decode_directional(images: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """L0 and L1 of four images."""
    constant = images["L0"]
    return constant, np.stack([2 * constant * (2 * images[kind] - 1) for kind in KINDS[1:]], axis=2)


def light_for_normals(constant: np.ndarray, linear: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """E(n')/π (…, 3) for unit normals (…, 3); not below 0."""
    return np.maximum(constant + (normals[..., None] * linear).sum(axis=-2), 0)
