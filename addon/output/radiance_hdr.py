"""Radiance pictures (.hdr): three 8-bit mantissas and a common exponent, run by run (Ward 1991)."""

from pathlib import Path

import numpy as np

from ..core.ranges import repeat_ranges
from .files import whole_file

_SHORTEST_RUN, _LONGEST_RUN, _LONGEST_LITERAL = 4, 127, 128


def write_radiance_hdr(path: Path, image: np.ndarray) -> None:
    """Write linear light (h, w, 3) float32 as a Radiance picture, row 0 at the top, whole or not at all.

    A channel is off by at most 1/256 of the pixel's largest channel; negative light becomes 0.

    Raises
    ------
    BakeError
        If the file cannot be written.
    """
    height, width = image.shape[:2]
    pixels = to_rgbe(image)
    header = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n"
    # The format knows runs only in lines of such lengths
    body = _runs(pixels) if 8 <= width < 1 << 15 else pixels.tobytes()
    with whole_file(path) as file:
        file.write(header.encode("ascii") + body)


def to_rgbe(image: np.ndarray) -> np.ndarray:
    """Pixels (h, w, 3) as mantissas m and exponent e, (h, w, 4) uint8: the value of a channel is m · 2^(e − 136)."""
    image = np.maximum(np.nan_to_num(image), 0)
    _, exponent = np.frexp(image.max(axis=2))
    exponent = np.clip(exponent, -127, 127)
    mantissa = np.minimum(np.rint(np.ldexp(image, 8 - exponent[..., None])), 255)
    dark = mantissa.max(axis=2, keepdims=True) == 0
    return np.where(dark, 0, np.concatenate([mantissa, exponent[..., None] + 128], axis=2)).astype(np.uint8)


def _runs(pixels: np.ndarray) -> bytes:
    """RGBE pixels (h, w, 4) run by run: each line's four channels after each other."""
    height, width, _ = pixels.shape
    data = pixels.transpose(0, 2, 1).reshape(-1)
    start, length, is_run = _blocks(data, width)
    size = np.where(is_run, 2, 1 + length)
    first_of_line = start % (4 * width) == 0
    place = np.cumsum(size + 4 * first_of_line) - size  # of each block in the file
    code = np.empty(int(size.sum()) + 4 * height, np.uint8)
    code[place[first_of_line, None] + np.arange(-4, 0)] = (2, 2, width >> 8, width & 255)
    code[place] = np.where(is_run, 128 + length, length)
    code[place[is_run] + 1] = data[start[is_run]]
    literal = np.flatnonzero(~is_run)
    nth, within = repeat_ranges(length[literal])
    block = literal[nth]
    code[place[block] + 1 + within] = data[start[block] + within]
    return code.tobytes()


def _blocks(data: np.ndarray, width: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Start, length and kind (whether a run of one value) of the blocks that lines of `width` bytes are cut into."""
    at_line = np.arange(len(data)) % width == 0
    changes = np.append(True, data[1:] != data[:-1]) | at_line
    start = np.flatnonzero(changes)
    is_run = np.diff(start, append=len(data)) >= _SHORTEST_RUN
    # What lies between two runs of a line is one block
    opens = is_run | np.append(True, is_run[:-1]) | at_line[start]
    start, is_run = start[opens], is_run[opens]
    length = np.diff(start, append=len(data))
    longest = np.where(is_run, _LONGEST_RUN, _LONGEST_LITERAL)
    block, piece = repeat_ranges(-(-length // longest))
    before = piece * longest[block]
    return start[block] + before, np.minimum(length[block] - before, longest[block]), is_run[block]
