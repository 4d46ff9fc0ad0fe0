"""OpenImageDenoise on a camera's pass."""

from dataclasses import replace

import numpy as np

from ..oidn import MOST_MEMORY, filtered
from .passes import CameraPass


def denoised(passes: CameraPass, diffuse: bool, memory: int = MOST_MEMORY) -> CameraPass:
    """The pass with less noise in gloss and media, and in indirect diffuse light if asked. Caustics stay as they are.

    The filter sees the albedo and the normals, by which it knows edges.

    Parameters
    ----------
    diffuse : bool
        Whether indirect diffuse light is filtered too. Where it is interpolated, its noise is smoother than the filter
        can tell from light.
    memory : int
        Megabytes that the filter may take for itself.
    """
    guides = {"albedo": np.clip(passes.albedo, 0, 1), "normal": passes.normal}

    def smooth(picture: np.ndarray) -> np.ndarray:
        if not picture.any():
            return picture
        return filtered("RT", picture, {"hdr": True, "cleanAux": True}, guides, memory)

    light = smooth(passes.indirect_diffuse) if diffuse else passes.indirect_diffuse
    volume = None if passes.volume is None else smooth(passes.volume)
    return replace(passes, indirect_diffuse=light, glossy=smooth(passes.glossy), volume=volume)
