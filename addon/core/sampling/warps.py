"""Warps from the unit square to directions and surfaces, with their densities: parts of kernels, and loops over them.

Directions are unit vectors; z is the local axis. Arrays are float32; `u` is (n, 2) in [0, 1).
"""

from typing import Any

import numpy as np

from .. import vec3
from ..compiling import kernel, kernel_array, part
from ..vec3 import ONE, TWO, ZERO, put, row

PI, TWO_PI = np.float32(np.pi), np.float32(2 * np.pi)
_HALF, _QUARTER, _FOUR = np.float32(0.5), np.float32(0.25), np.float32(4)
_SINE = np.float32(-1.6666654611e-1), np.float32(8.3321608736e-3), np.float32(-1.9515295891e-4)
_COSINE = np.float32(4.166664568298827e-2), np.float32(-1.388731625493765e-3), np.float32(2.443315711809948e-5)


@part
def uniform_disk(u, v):
    """A point of the unit disk, uniform by area."""
    return _polar(np.sqrt(u), v)


@part
def uniform_triangle(u, v):
    """Barycentric weights (b1, b2) of a point uniform by area on a triangle."""
    root = np.sqrt(u)
    return ONE - root, v * root


@part
def uniform_sphere(u, v):
    """A direction uniform by solid angle over the sphere: density 1/(4π)."""
    return _around(ONE - TWO * u, v)


@part
def uniform_cone(u, v, cos_max):
    """A direction uniform by solid angle within arccos(`cos_max`, float64) of +z: density 1/(2π(1 − cos_max))."""
    return at_versine(u * (1.0 - cos_max), v)


@part
def versine_octaves(u, v, narrow):
    """A direction around +z, about as many in each octave of the versine v = 1 − cos θ above s = `narrow`.

    Its density is 1/(2π (s + v) ln(1 + 2/s)).
    """
    return at_versine(narrow * np.expm1(u * np.log1p(TWO / narrow)), v)


@part
def cosine_hemisphere(u, v):
    """A direction around +z with density cos θ/π."""
    x, y = uniform_disk(u, v)
    return x, y, np.sqrt(max(ONE - u, ZERO))


@part
def cosine_uniform_mixture(u, v):
    """A direction around +z, halfway between cosine-weighted and uniform: density (cos θ + 1/2)/(2π).

    z = cos θ has the distribution function (z² + z)/2.
    """
    return _around((np.sqrt(ONE + np.float32(8) * u) - ONE) * _HALF, v)


@part
def _polar(r, v):
    """A point of a circle of radius r, at 2πv, to 2e-7 of r; three times as fast as a cosine and a sine.

    Polynomials (those of Moshier's Cephes) on an eighth of the circle to both sides of the nearest quarter.
    """
    quarters = np.rint(v * _FOUR)
    x = (v - quarters * _QUARTER) * TWO_PI
    x2 = x * x
    sine = x + x * x2 * (_SINE[0] + x2 * (_SINE[1] + x2 * _SINE[2]))
    cosine = ONE - _HALF * x2 + x2 * x2 * (_COSINE[0] + x2 * (_COSINE[1] + x2 * _COSINE[2]))
    turns = np.int32(quarters)
    if turns & 1:
        cosine, sine = -sine, cosine
    if turns & 2:
        cosine, sine = -cosine, -sine
    return r * cosine, r * sine


@part
def _around(z, v):
    x, y = _polar(np.sqrt(max(ONE - z * z, ZERO)), v)
    return x, y, z


@part
def at_versine(versine, v):
    """A direction around +z by its azimuth 2πv and by 1 − cos θ, which keeps the precision of narrow cones."""
    x, y = _polar(np.float32(np.sqrt(max(versine * (TWO - versine), ZERO))), v)
    return x, y, np.float32(ONE - versine)


@kernel
def _disks(u, out):
    for i in range(len(u)):
        out[i, 0], out[i, 1] = uniform_disk(u[i, 0], u[i, 1])


def sample_uniform_disk(u: np.ndarray) -> np.ndarray:
    """`uniform_disk` of many, (n, 2)."""
    out = np.empty((len(u), 2), np.float32)
    _disks(kernel_array(u, np.float32), out)
    return out


@kernel
def _triangles(u, b1, b2):
    for i in range(len(u)):
        b1[i], b2[i] = uniform_triangle(u[i, 0], u[i, 1])


def sample_uniform_triangle(u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """`uniform_triangle` of many, (n,) each."""
    b1, b2 = np.empty((2, len(u)), np.float32)
    _triangles(kernel_array(u, np.float32), b1, b2)
    return b1, b2


@kernel
def _cones(u, cos_max, out):
    for i in range(len(u)):
        put(out, i, uniform_cone(u[i, 0], u[i, 1], cos_max[i]))


def sample_uniform_cone(u: np.ndarray, cos_max: np.ndarray | float) -> np.ndarray:
    """`uniform_cone` of many, (n, 3)."""
    return _directions(_cones, u, np.full(len(u), cos_max, np.float64))


@kernel
def _hemispheres(u, out):
    for i in range(len(u)):
        put(out, i, cosine_hemisphere(u[i, 0], u[i, 1]))


def sample_cosine_hemisphere(u: np.ndarray) -> np.ndarray:
    """`cosine_hemisphere` of many, (n, 3)."""
    return _directions(_hemispheres, u)


@kernel
def _frames(normal, tangent, bitangent):
    for i in range(len(normal)):
        t, b = vec3.frame(row(normal, i))
        put(tangent, i, t)
        put(bitangent, i, b)


def frame(normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """`vec3.frame` of unit normals (n, 3): tangents and bitangents, (n, 3) each."""
    tangent, bitangent = np.empty((2, len(normal), 3), np.float32)
    _frames(kernel_array(normal, np.float32), tangent, bitangent)
    return tangent, bitangent


@kernel
def _to_world(local, normal, out):
    for i in range(len(local)):
        put(out, i, vec3.to_world(row(local, i), row(normal, i)))


def to_world(local: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Local directions (n, 3) turned so that +z is the normal (n, 3)."""
    return _directions(_to_world, local, kernel_array(normal, np.float32))


def _directions(loop: Any, first: np.ndarray, *others: np.ndarray) -> np.ndarray:
    """What a kernel writes as directions, (n, 3) float32."""
    out = np.empty((len(first), 3), np.float32)
    loop(kernel_array(first, np.float32), *others, out)
    return out
