"""Triples of numbers inside kernels: points, directions and colours, as tuples of three float32 (or float64)."""

import numpy as np

from .compiling import part

ZERO, ONE, TWO = np.float32(0), np.float32(1), np.float32(2)
BLACK, WHITE = (ZERO, ZERO, ZERO), (ONE, ONE, ONE)


@part
def row(values, k):
    """The k-th row of an (n, 3) array."""
    return values[k, 0], values[k, 1], values[k, 2]


@part
def put(values, k, a):
    """Write a triple into the k-th row of an (n, 3) array."""
    values[k, 0], values[k, 1], values[k, 2] = a


@part
def add(values, k, a):
    """Add a triple to the k-th row of an (n, 3) array."""
    values[k, 0] += a[0]
    values[k, 1] += a[1]
    values[k, 2] += a[2]


@part
def dot(a, b):
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@part
def cross(a, b):
    """Vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@part
def times(a, s):
    """A triple times a scalar."""
    return a[0] * s, a[1] * s, a[2] * s


@part
def mul(a, b):
    """Component by component."""
    return a[0] * b[0], a[1] * b[1], a[2] * b[2]


@part
def plus(a, b):
    """Sum of two triples."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@part
def minus(a, b):
    """Difference of two triples."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@part
def negative(a):
    """A triple turned round."""
    return -a[0], -a[1], -a[2]


@part
def along(origin, distance, direction):
    """The point at a distance along a ray."""
    return plus(origin, times(direction, distance))


@part
def length(a):
    """Euclidean length."""
    return np.sqrt(dot(a, a))


@part
def normalized(a):
    """A triple of length 1; of length 0 it stays 0."""
    return times(a, ONE / max(length(a), np.float32(1e-30)))


@part
def direction_to(origin, target):
    """The unit direction from one point to another, and the distance: at least 1e-6, as nothing is infinitely close."""
    way = minus(target, origin)
    distance = max(length(way), np.float32(1e-6))
    return times(way, ONE / distance), distance


@part
def largest(a):
    """Largest component."""
    return max(a[0], max(a[1], a[2]))


@part
def mean(a):
    """Mean of the three components."""
    return (a[0] + a[1] + a[2]) / np.float32(3)


@part
def wide(a):
    """In float64, where the digits are needed."""
    return np.float64(a[0]), np.float64(a[1]), np.float64(a[2])


@part
def narrow(a):
    """In float32 again."""
    return np.float32(a[0]), np.float32(a[1]), np.float32(a[2])


@part
def frame(n):
    """Tangent and bitangent that make a right-handed orthonormal frame with a unit normal.

    Duff et al., "Building an Orthonormal Basis, Revisited", 2017.
    """
    sign = np.copysign(ONE, n[2])
    a = -ONE / (sign + n[2])
    b = n[0] * n[1] * a
    return (ONE + sign * n[0] * n[0] * a, sign * b, -sign * n[0]), (b, sign + n[1] * n[1] * a, -n[1])


@part
def to_world(local, normal):
    """A local direction turned so that +z is the normal."""
    tangent, bitangent = frame(normal)
    return plus(plus(times(tangent, local[0]), times(bitangent, local[1])), times(normal, local[2]))


@part
def to_local(direction, normal):
    """A direction in the frame in which the normal is +z."""
    tangent, bitangent = frame(normal)
    return dot(direction, tangent), dot(direction, bitangent), dot(direction, normal)
