"""OpenEXR files."""

from collections.abc import Collection, Mapping
from pathlib import Path

import numpy as np

from ..settings.camera import Compression
from .files import whole_file
from .hush import hushed

_LARGEST_HALF = 65504.0


def write_exr(
    path: Path,
    channels: Mapping[str, np.ndarray],
    metadata: Mapping[str, str | int | float] | None = None,
    half: bool = True,
    compression: Compression = "zip",
    exact: Collection[str] = (),
) -> None:
    """Write an OpenEXR file of scan lines, whole or not at all.

    Parameters
    ----------
    channels : dict of str to (h, w) float32
        By name, as in ``R`` or, in a layer, ``Indirect.R``; row 0 is the top.
    metadata : dict of str to str, int or float, optional
        Attributes of the header.
    half : bool
        Whether values become 16-bit floats, of which the largest is 65504; unsigned integers stay as they are.
    compression : str
        ``dwaa`` and ``dwab`` lose a little, all others nothing.
    exact : collection of str
        Channels that stay as they are where the others become 16-bit.

    Raises
    ------
    BakeError
        If the file cannot be written.
    """
    import OpenEXR

    def pixels(name: str, values: np.ndarray) -> np.ndarray:
        if half and name not in exact and values.dtype != np.uint32:
            values = np.clip(values, -_LARGEST_HALF, _LARGEST_HALF).astype(np.float16)
        return np.ascontiguousarray(values)

    header = {
        **(metadata or {}),
        "compression": getattr(OpenEXR, f"{'no' if compression == 'none' else compression}_COMPRESSION".upper()),
        "type": OpenEXR.scanlineimage,
    }
    with (
        whole_file(path) as file,
        OpenEXR.File(header, {name: pixels(name, v) for name, v in channels.items()}) as exr,
        hushed(2, _is_of_an_older_library),
    ):
        exr.write(file)


def _is_of_an_older_library(line: bytes) -> bool:
    """Whether OpenEXR printed a line because two of its versions meet.

    On Linux a Blender that is linked to OpenEXR has its symbols before those of the wheel, which therefore calls the
    C functions of Blender's version. Versions before 3.5 refuse compression levels for the wheel's temporary context
    and print that; the levels keep their defaults, which are what the wheel asks for, so the pixels are the same.
    """
    return line.startswith(b"<compression>: (EXR_ERR_ARGUMENT_OUT_OF_RANGE)")
