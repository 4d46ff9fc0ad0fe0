"""Finished lightmaps as files."""

from pathlib import Path
from typing import Literal

import numpy as np

from ...core.errors import BakeError
from ..exr import write_exr
from ..files import file_name
from ..png import write_png
from ..radiance_hdr import write_radiance_hdr
from .shared_scale import to_rgbd, to_rgbm

FileFormat = Literal["exr_half", "exr_float", "hdr", "rgbm", "rgbd"]

SUFFIX: dict[FileFormat, str] = {
    "exr_half": ".exr",
    "exr_float": ".exr",
    "hdr": ".hdr",
    "rgbm": ".png",
    "rgbd": ".png",
}

PATTERN = "{scene}_{image}_{kind}"
"""How files are called, less their suffix; ``kind`` is what is in them, as in ``indirect`` or ``L0``."""


def image_path(
    folder: Path, scene: str, image: str, kind: str, file_format: FileFormat, frame: str = "", pattern: str = PATTERN
) -> Path:
    """The path of an image's file, which of several frames ends in its own; what no file name may hold becomes an
    underscore.

    Raises
    ------
    BakeError
        If the pattern names anything but ``{scene}``, ``{image}`` and ``{kind}``.
    """
    try:
        name = pattern.format(scene=scene, image=image, kind=kind)
    except (KeyError, IndexError, ValueError) as error:
        raise BakeError(f"The file name {pattern!r} may hold {{scene}}, {{image}} and {{kind}} alone.") from error
    return folder / (file_name(name) + (f".{frame}" if frame else "") + SUFFIX[file_format])


def write_lightmap(
    path: Path,
    image: np.ndarray,
    file_format: FileFormat,
    value_range: float = 8.0,
    dither: bool = False,
    unit: bool = False,
) -> None:
    """Write an image (h, w, 3) float32 with row 0 at v = 0, which becomes the file's lowest row; all is linear.

    Parameters
    ----------
    value_range : float
        The largest light that RGBM and RGBD can hold.
    dither : bool
        For these two, see `to_rgbm`.
    unit : bool
        Values lie between 0 and 1, as those of directional images: PNGs hold them as they are.

    Raises
    ------
    BakeError
        If the file cannot be written; an older one stays as it was.
    """
    image = image[::-1]
    if file_format in ("exr_half", "exr_float"):
        channels = {name: image[..., i] for i, name in enumerate("RGB")}
        write_exr(path, channels, half=file_format == "exr_half")
    elif file_format == "hdr":
        write_radiance_hdr(path, image)
    elif unit:
        write_png(path, np.rint(np.clip(image, 0, 1) * 255).astype(np.uint8))
    else:
        encode = to_rgbm if file_format == "rgbm" else to_rgbd
        text = {"Encoding": file_format.upper(), "Range": f"{value_range:g}"}
        write_png(path, encode(image, value_range, dither), text)
