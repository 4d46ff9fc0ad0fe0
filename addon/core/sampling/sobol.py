"""Sobol points in five dimensions by their numbers, every sequence scrambled on its own.

Direction numbers are Joe and Kuo's (2008). Owen's nested uniform scrambling is a hash of the reversed bits in which
every bit depends on those before it alone (Laine and Karras 2011; Burley 2020, "Practical Hash-based Owen Scrambling";
the constants are Vegdahl's of 2021). So any point of any sequence can be had without those before.
"""

import numpy as np

from ..compiling import kernel, part

N_DIMENSIONS = 5

# Of dimensions 2 to 5: the primitive polynomial's coefficients between its first and its last, and the first mₖ
_POLYNOMIALS = ((), (1,), (0, 1), (1, 0))
_FIRST = ((1,), (1, 3), (1, 3, 1), (1, 1, 1))

_1, _2, _4, _8, _16, _32_BITS = (np.uint64(n) for n in (1, 2, 4, 8, 16, 0xFFFFFFFF))
_MIX_1, _MIX_2, _MIX_3 = (np.uint64(n) for n in (0x3D20ADEA, 0x05526C56, 0x53A22864))
_PAIRS, _FOURS, _EIGHTS, _BYTES = (np.uint64(n) for n in (0x55555555, 0x33333333, 0x0F0F0F0F, 0x00FF00FF))
_STEP = np.float32(2**-24)


def _direction_numbers() -> np.ndarray:
    """Direction numbers of each dimension and bit, (5, 32) of 32 bits: mₖ / 2ᵏ in binary, for k = 1 to 32."""
    m = [[1] * 32]
    for first, coefficients in zip(_FIRST, _POLYNOMIALS, strict=True):
        s, column = len(first), list(first)
        for k in range(s, 32):
            value = column[k - s] ^ (column[k - s] << s)
            for j, a in enumerate(coefficients, 1):
                value ^= a * column[k - j] << j
            column.append(value)
        m.append(column)
    return np.array([[value << (31 - k) for k, value in enumerate(column)] for column in m], np.uint64)


def _sums_of_bytes() -> np.ndarray:
    """What each byte of a number adds to its point, bits reversed, (4, 256, 5) uint64."""
    numbers = _direction_numbers()
    turned = np.zeros_like(numbers)
    for bit in range(32):
        turned |= ((numbers >> np.uint64(bit)) & _1) << np.uint64(31 - bit)
    sums = np.zeros((4, 256, N_DIMENSIONS), np.uint64)
    for at, value, bit in np.ndindex(4, 256, 8):
        if value >> bit & 1:
            sums[at, value] ^= turned[:, 8 * at + bit]
    return sums


_SUMS = _sums_of_bytes()


def sobol_seeds(n_sequences: int, seed: int, *key: int) -> np.ndarray:
    """What scrambles each dimension of several sequences of a stage (`key`) of a seed, (n_sequences, 5) uint64."""
    state = np.random.SeedSequence([seed, *key]).generate_state(n_sequences * N_DIMENSIONS)
    return state.reshape(n_sequences, N_DIMENSIONS).astype(np.uint64)


@part
def sobol_point(seeds, sequence, i):
    """The i-th point of a sequence, five float32 in [0, 1); i below 2³²."""
    a, b, c, d = i & 255, (i >> 8) & 255, (i >> 16) & 255, (i >> 24) & 255
    return (
        _scrambled(_SUMS[0, a, 0] ^ _SUMS[1, b, 0] ^ _SUMS[2, c, 0] ^ _SUMS[3, d, 0], seeds[sequence, 0]),
        _scrambled(_SUMS[0, a, 1] ^ _SUMS[1, b, 1] ^ _SUMS[2, c, 1] ^ _SUMS[3, d, 1], seeds[sequence, 1]),
        _scrambled(_SUMS[0, a, 2] ^ _SUMS[1, b, 2] ^ _SUMS[2, c, 2] ^ _SUMS[3, d, 2], seeds[sequence, 2]),
        _scrambled(_SUMS[0, a, 3] ^ _SUMS[1, b, 3] ^ _SUMS[2, c, 3] ^ _SUMS[3, d, 3], seeds[sequence, 3]),
        _scrambled(_SUMS[0, a, 4] ^ _SUMS[1, b, 4] ^ _SUMS[2, c, 4] ^ _SUMS[3, d, 4], seeds[sequence, 4]),
    )


@part
def _scrambled(bits, seed):
    """Reversed bits scrambled by a seed, as a number in [0, 1)."""
    bits ^= bits * _MIX_1 & _32_BITS
    bits = (bits + seed) * ((seed >> _16) | _1) & _32_BITS
    bits ^= bits * _MIX_2 & _32_BITS
    bits ^= bits * _MIX_3 & _32_BITS
    bits = ((bits >> _1) & _PAIRS) | ((bits & _PAIRS) << _1)
    bits = ((bits >> _2) & _FOURS) | ((bits & _FOURS) << _2)
    bits = ((bits >> _4) & _EIGHTS) | ((bits & _EIGHTS) << _4)
    bits = ((bits >> _8) & _BYTES) | ((bits & _BYTES) << _8)
    bits = ((bits >> _16) | (bits << _16)) & _32_BITS
    return np.float32(bits >> _8) * _STEP


@kernel
def _fill(seeds, sequence, first, points):
    for k in range(len(points)):
        points[k, 0], points[k, 1], points[k, 2], points[k, 3], points[k, 4] = sobol_point(seeds, sequence, first + k)


def sobol_points(seeds: np.ndarray, sequence: int, first: int, n: int) -> np.ndarray:
    """Points `first` to `first + n` of a sequence, (n, 5) float32 in [0, 1)."""
    points = np.empty((n, N_DIMENSIONS), np.float32)
    _fill(seeds, sequence, first, points)
    return points


def fixed_points(n: int, n_dimensions: int = 2) -> np.ndarray:
    """The first n points of one sequence, (n, n_dimensions) float32 in [0, 1): the same in every bake."""
    return np.ascontiguousarray(sobol_points(sobol_seeds(1, 0), 0, 0, n)[:, :n_dimensions])
