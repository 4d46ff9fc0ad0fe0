"""A grid of probes as three OpenEXR files, one a colour: 3D textures that a shader reads irradiance from.

A texel (R, G, B, A) of a colour's texture is what n = (1, x, y, z) of a unit normal is multiplied with:

    E(n)/π = R + G n_x + B n_y + A n_z,        R = Y₀ c₀,    (G, B, A) = 2/3 Y₁ (c_x, c_y, c_z)

with the radiance's coefficients c, and A_l/π = 1, 2/3, 1/4 of the cosine lobe (Ramamoorthi and Hanrahan 2001). Files of
three bands have five channels more, which the polynomials of the normal that they are called after are multiplied with.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ...core.sampling.spherical_harmonics import COSINE_LOBE, Y0, Y1, Y2
from ...settings.probes import Harmonics
from ..exr import write_exr

VOLUME_COLORS = "RGB"
"""Of the three files."""

CHANNELS = ("R", "G", "B", "A", "L2.xy", "L2.yz", "L2.3zz-1", "L2.xz", "L2.xx-yy")

TO_TEXEL = COSINE_LOBE / np.float32(np.pi) * np.concatenate([[Y0], *3 * [[Y1]], Y2])
"""What coefficients of the radiance are multiplied with."""


def volume_channels(sh: np.ndarray, counts: tuple[int, int, int], harmonics: Harmonics) -> dict[str, np.ndarray]:
    """The channels of one colour's file, (z · y, x) float32 each: slices of one z below each other, row 0 at the top.

    Parameters
    ----------
    sh : (n, 9) float32
        Of a grid's radiance in one colour, x fastest.
    """
    n_x, n_y, n_z = counts
    n_channels = 4 if harmonics == "l1" else 9
    texels = (sh * TO_TEXEL).astype(np.float32)
    return {name: texels[:, i].reshape(n_z * n_y, n_x) for i, name in enumerate(CHANNELS[:n_channels])}


def write_volume(path: Path, channels: Mapping[str, np.ndarray], about: Mapping[str, str]) -> None:
    """Write one colour's file in half floats, whole or not at all.

    Raises
    ------
    BakeError
        If the file cannot be written.
    """
    write_exr(path, channels, about)
