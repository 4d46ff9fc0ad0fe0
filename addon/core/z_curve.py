"""Order in space: points that are close on the Z-curve are close in the scene."""

import numpy as np

CURVE_BITS = 21
"""Of each axis in a code: cells of an edge of 2⁻ⁿ of the cube have the first 3 n bits of the 63 in common."""

# Puts two zeros between the bits of a number.
_SPREAD = [
    (np.uint64(shift), np.uint64(mask))
    for shift, mask in (
        (32, 0x1F00000000FFFF),
        (16, 0x1F0000FF0000FF),
        (8, 0x100F00F00F00F00F),
        (4, 0x10C30C30C30C30C3),
        (2, 0x1249249249249249),
    )
]


def z_curve(positions: np.ndarray) -> np.ndarray:
    """Morton code of positions (n, 3) in the cube around them, (n,) uint64."""
    if len(positions) == 0:
        return np.zeros(0, np.uint64)
    low, high = positions.min(axis=0), positions.max(axis=0)
    cells = ((positions - low) / max(float((high - low).max()), 1e-30) * (2**CURVE_BITS - 1)).astype(np.uint64)
    code = np.zeros(len(positions), np.uint64)
    for axis in range(3):
        bits = cells[:, axis]
        for shift, mask in _SPREAD:
            bits = (bits | (bits << shift)) & mask
        code |= bits << np.uint64(axis)
    return code
