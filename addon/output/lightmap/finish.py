"""Light at texels to finished images."""

from dataclasses import dataclass

import numpy as np

from ...parallel import Workers
from ...receivers import Receivers, Seams, Texels
from .borders import with_borders
from .denoise import Denoiser, denoised
from .dilation import dilated
from .texel_images import texel_images

_STAGE = "Finishing lightmaps"


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
        How far around the charts, in texels, the nearest texel's value is taken; −1: over the whole image.
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
    """The images of the receivers' values, (height, width, c) float32 each, row 0 at v = 0.

    Parameters
    ----------
    values : (n, c) float32
        Of each receiver: three channels of light, and after them, if any, directional coefficients of each.
    stderr : (n,) float32
        Standard error of each one's light, in its unit: what has none is not denoised.
    """
    options, workers = options or FinishOptions(), workers or Workers()
    images = texel_images(values, stderr, receivers, texels)
    images = denoised(images, options.denoiser, workers)
    progress = workers.progress
    progress.update(_STAGE, 0)
    seams = texels.seams if options.stitch else Seams.none()
    bordered = with_borders(images, seams)
    progress.update(_STAGE, 0.7)
    return [dilated(image.value, image.known, options.padding) for image in bordered]
