"""OpenImageDenoise on a camera's pass."""

from dataclasses import replace

import numpy as np

from ..oidn import filtered
from .passes import CameraPass


def denoised(passes: CameraPass) -> CameraPass:
    """The pass with less noise in what rays gathered: indirect diffuse light, and gloss. Caustics stay as they are.

    The filter sees the albedo and the normals, by which it knows edges.
    """
    guides = {"albedo": np.clip(passes.albedo, 0, 1), "normal": passes.normal}
    return replace(
        passes,
        indirect_diffuse=filtered("RT", passes.indirect_diffuse, {"hdr": True, "cleanAux": True}, guides),
        glossy=filtered("RT", passes.glossy, {"hdr": True, "cleanAux": True}, guides)
        if passes.glossy.any()
        else passes.glossy,
    )
