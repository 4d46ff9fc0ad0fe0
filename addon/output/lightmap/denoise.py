"""Noise out of lightmaps."""

from dataclasses import replace
from typing import Literal

from ...core.errors import BakeError
from ...core.parallel import Workers
from ..oidn import has_oidn
from .joint_filter import denoised_by_joint_filter
from .oidn import denoised_by_oidn
from .texel_images import TexelImage

Denoiser = Literal["auto", "oidn", "own", "none"]

_STAGE = "Denoising"


def denoised(images: list[TexelImage], denoiser: Denoiser, workers: Workers) -> list[TexelImage]:
    """Images without most of their noise.

    Parameters
    ----------
    denoiser : 'auto', 'oidn', 'own' or 'none'
        OpenImageDenoise, our own filter, or nothing; 'auto' takes OpenImageDenoise where it is there.

    Raises
    ------
    BakeError
        If OpenImageDenoise is asked for and missing, or fails.
    """
    if denoiser == "none":
        return images
    if denoiser == "oidn" and not has_oidn():
        raise BakeError("This Photon Bake came without OpenImageDenoise; choose our own denoiser.")
    by_oidn = denoiser == "oidn" or (denoiser == "auto" and has_oidn())
    denoise = denoised_by_oidn if by_oidn else denoised_by_joint_filter
    results = []
    for number, image in enumerate(images):
        part = workers.part(number / len(images), (number + 1) / len(images))
        try:
            results.append(replace(image, value=denoise(image, part, _STAGE)))
        except RuntimeError as error:
            raise BakeError(f"OpenImageDenoise failed ({error}); choose our own denoiser.") from error
    return results
