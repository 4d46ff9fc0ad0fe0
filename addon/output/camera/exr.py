"""A camera's pass as one OpenEXR file of many layers."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...settings.camera import Compression
from ..exr import write_exr
from .passes import CameraPass

LAYER = "PhotonBake"
"""Prefix of all channels, as a view layer's name is of those that Blender writes."""

GROUP_LAYER = "Indirect"
"""Before the name of a light group: the layer with the part of Indirect that its light is."""

DEPTH = f"{LAYER}.Depth.Z"


FILE, SCENE = "PhotonBakeFile", "Scene"
"""Attributes of the header: the .blend file's name, and the scene's."""


def origin_of(path: Path) -> tuple[str, str] | None:
    """The file and the scene that an image file says it is of; None where it says nothing of it."""
    import OpenEXR

    try:
        with OpenEXR.File(str(path), header_only=True) as file:
            header = dict(file.header())  # the file empties its own
    except Exception:  # what it raises for other files is its library's affair
        return None
    return (str(header[FILE]), str(header[SCENE])) if FILE in header and SCENE in header else None


@dataclass(frozen=True)
class PictureFrame:
    """The picture that a render writes.

    Attributes
    ----------
    width, height : int
        Pixels.
    column, row : int
        Of the upper left pixel of the part that is rendered, from the upper left.
    """

    width: int
    height: int
    column: int = 0
    row: int = 0

    def around(self, picture: np.ndarray) -> np.ndarray:
        """The whole picture, (height, width, …), 0 around the part that is rendered."""
        height, width = picture.shape[:2]
        if (height, width) == (self.height, self.width):
            return picture
        whole = np.zeros((self.height, self.width, *picture.shape[2:]), picture.dtype)
        whole[self.row : self.row + height, self.column : self.column + width] = picture
        return whole


def frame_path(folder: Path, pattern: str, frame: int) -> Path:
    """The file of a frame: the last run of ``#`` in the pattern becomes its number; without one, it is appended."""
    runs = list(re.finditer("#+", pattern))
    if not runs:
        return folder / f"{pattern}{frame:04d}.exr"
    start, end = runs[-1].span()
    return folder / f"{pattern[:start]}{frame:0{end - start}d}{pattern[end:]}.exr"


def channels(passes: CameraPass, frame: PictureFrame) -> dict[str, np.ndarray]:
    """Channels (height, width) float32 by name."""
    coloured = {
        "Indirect": passes.indirect,
        "IndirectDiffuse": passes.indirect_diffuse,
        "Caustics": passes.caustics,
        "Glossy": passes.glossy,
        "Albedo": passes.albedo,
        **({"Volume": passes.volume} if passes.volume is not None else {}),
        **({"Transmittance": passes.transmittance} if passes.transmittance is not None else {}),
        **{f"{GROUP_LAYER}_{name}": light for name, light in passes.apart.items()},
    }
    found = {f"{LAYER}.{name}.{c}": values[..., i] for name, values in coloured.items() for i, c in enumerate("RGB")}
    found |= {f"{LAYER}.Normal.{axis}": passes.normal[..., i] for i, axis in enumerate("XYZ")}
    found |= {DEPTH: passes.depth, f"{LAYER}.Error.V": passes.error}
    return {name: frame.around(values) for name, values in found.items()}


def write_camera_pass(
    path: Path,
    passes: CameraPass,
    frame: PictureFrame,
    metadata: Mapping[str, str | int | float],
    half: bool = True,
    compression: Compression = "zip",
) -> None:
    """Write a camera's pass, whole or not at all; see `write_exr`. Depth always has 32 bits."""
    write_exr(path, channels(passes, frame), metadata, half, compression, exact=(DEPTH,))
