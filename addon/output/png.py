"""PNG files of 8 bits a channel."""

import struct
import zlib
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from .files import whole_file

_COLOUR_TYPE = {1: 0, 3: 2, 4: 6}  # of grey, RGB, RGBA
_UP = 2  # a byte less the one above it


def write_png(path: Path, pixels: np.ndarray, text: Mapping[str, str] | None = None) -> None:
    """Write pixels (h, w, 1, 3 or 4) uint8 as a PNG, row 0 at the top, whole or not at all.

    The file says nothing of gamma or colour space, so that readers take the bytes as they are.

    Parameters
    ----------
    text : dict of str to str, optional
        Latin-1 texts for the header.

    Raises
    ------
    BakeError
        If the file cannot be written.
    """
    height, width, channels = pixels.shape
    rows = pixels.reshape(height, width * channels)
    lines = np.empty((height, 1 + width * channels), np.uint8)
    lines[:, 0] = _UP
    lines[:, 1:] = np.diff(rows, axis=0, prepend=np.zeros((1, rows.shape[1]), np.uint8))
    header = struct.pack(">IIBBBBB", width, height, 8, _COLOUR_TYPE[channels], 0, 0, 0)
    chunks = [_chunk(b"IHDR", header)]
    chunks += [_chunk(b"tEXt", f"{key}\0{value}".encode("latin-1")) for key, value in (text or {}).items()]
    chunks += [_chunk(b"IDAT", zlib.compress(lines.tobytes(), 6)), _chunk(b"IEND", b"")]
    with whole_file(path) as file:
        file.write(b"\x89PNG\r\n\x1a\n" + b"".join(chunks))


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
