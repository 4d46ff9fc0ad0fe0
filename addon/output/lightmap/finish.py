"""Light at texels to finished images."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...core.parallel import Workers
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


@dataclass(frozen=True)
class Finished:
    """A finished image; row 0 is at v = 0.

    Attributes
    ----------
    light : (height, width, 3) float32
    slope : (height, width, 3, 3) float32 or None
        How it changes with the normal, for each axis and colour.
    normal : (height, width, 3) float32
        Of the surface.
    """

    light: np.ndarray
    slope: np.ndarray | None
    normal: np.ndarray

    @staticmethod
    def together(parts: "Sequence[Finished]") -> "Finished":
        """An image of all light, from those of its parts."""
        slopes = [one.slope for one in parts if one.slope is not None]
        light = np.sum([one.light for one in parts], axis=0)
        return Finished(light, np.sum(slopes, axis=0) if slopes else None, parts[0].normal)

    @staticmethod
    def of(channels: np.ndarray, normal: np.ndarray) -> "Finished":
        """Of 3 channels, or of 12."""
        slope = channels[..., 3:].reshape(*normal.shape, 3) if channels.shape[2] > 3 else None
        return Finished(channels[..., :3], slope, normal)


def finish_lightmaps(
    values: np.ndarray,
    stderr: np.ndarray,
    receivers: Receivers,
    texels: Texels,
    options: FinishOptions | None = None,
    workers: Workers | None = None,
) -> list[Finished]:
    """The images of the receivers' values.

    Parameters
    ----------
    values : (n, 3 or 12) float32
        Of each receiver: three colours of light and, if it is there, of its slope along x, y and z.
    stderr : (n,) float32
        Standard error of each one's light, in its unit: what has none is not denoised.
    """
    options, workers = options or FinishOptions(), workers or Workers()
    progress = workers.progress
    images = texel_images(values, stderr, receivers, texels, progress)
    images = denoised(images, options.denoiser, workers)
    progress.update(_STAGE, 0)
    seams = texels.seams if options.stitch else Seams.none()
    bordered = with_borders(images, seams, workers)
    finished = []
    for number, (image, texels_of) in enumerate(zip(bordered, images, strict=True)):
        progress.update(_STAGE, 0.7 + 0.3 * number / len(images))
        light = dilated(image.value, image.known, options.padding)
        finished.append(Finished.of(light, dilated(texels_of.normal, texels_of.covered)))
    progress.update(_STAGE, 1)
    return finished
