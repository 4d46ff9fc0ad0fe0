"""OpenImageDenoise on a camera's pass."""

from dataclasses import replace

import numpy as np

from ..oidn import filtered
from .passes import CameraPass


def denoised(passes: CameraPass, diffuse: bool) -> CameraPass:
    """The pass with less noise in gloss, and in indirect diffuse light if asked. Caustics stay as they are.

    The filter sees the albedo and the normals, by which it knows edges.

    Parameters
    ----------
    diffuse : bool
        Whether indirect diffuse light is filtered too. Where it is interpolated, its noise is smoother than the filter
        can tell from light.
    """
    guides = {"albedo": np.clip(passes.albedo, 0, 1), "normal": passes.normal}

    def smooth(picture: np.ndarray) -> np.ndarray:
        return filtered("RT", picture, {"hdr": True, "cleanAux": True}, guides) if picture.any() else picture

    light = smooth(passes.indirect_diffuse) if diffuse else passes.indirect_diffuse
    return replace(passes, indirect_diffuse=light, glossy=smooth(passes.glossy))
