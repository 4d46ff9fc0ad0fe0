"""From the light at texels to finished lightmaps: images, their borders and seams, noise, and files."""

from .contact_sheet import contact_sheet
from .denoise import Denoiser
from .directional import (
    KINDS,
    decode_directional,
    directional_light,
    encode_directional,
    light_for_normals,
)
from .finish import Finished, FinishOptions, finish_lightmaps
from .image_files import PATTERN, SUFFIX, FileFormat, image_path, write_lightmap

__all__ = [
    "KINDS",
    "PATTERN",
    "SUFFIX",
    "Denoiser",
    "FileFormat",
    "FinishOptions",
    "Finished",
    "contact_sheet",
    "decode_directional",
    "directional_light",
    "encode_directional",
    "finish_lightmaps",
    "image_path",
    "light_for_normals",
    "write_lightmap",
]
