"""Light at texels to finished images."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ...parallel import Workers
from ...receivers import Receivers, Texels
from .dilation import dilated
from .texel_images import texel_images

Denoiser = Literal["auto", "oidn", "own", "none"]


@dataclass(frozen=True)
class FinishOptions:
    """What is done to a lightmap after the bake.

    Attributes
    ----------
    denoiser : 'auto', 'oidn', 'own' or 'none'
        OpenImageDenoise (where its wheel is), our own filter, or nothing; 'auto' takes the first where there is one.
    stitch : bool
        Whether charts that meet are made to agree along their seams.
    padding : int
        How many texels around the charts take their nearest texel's value; −1: all texels.
    """

    denoiser: Denoiser = "auto"
    stitch: bool = True
    padding: int = -1


def finish_lightmaps(
    values: np.ndarray,
    stderr: np.ndarray,
    receivers: Receivers,
    texels: Texels,
    options: FinishOptions | None = None,
    workers: Workers | None = None,
) -> list[np.ndarray]:
    """The images of the receivers' values, (height, width, 3) float32 each, row 0 at v = 0.

    Parameters
    ----------
    values : (n, 3) float32
        Of each receiver.
    stderr : (n,) float32
        Standard error of each, in the values' unit.
    """
    options, workers = options or FinishOptions(), workers or Workers()
    images = texel_images(values, stderr, receivers, texels)
    return [dilated(image.value, image.covered, options.padding) for image in images]
