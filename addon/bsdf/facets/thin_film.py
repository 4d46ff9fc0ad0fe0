"""Interference in a thin film on facets, as Cycles has it.

Belcour and Barla, "A Practical Extension to Microfacet Theory for the Modeling of Varying Iridescence", 2017.
Light that goes through the film m times more than other light is out of step with it by m times the optical path
difference D = 2 η d cos θ and a phase. What eyes see of that is the Fourier transform of their colour matching
functions, tabulated over D.

RESPONSE : (2, 3, 2, N_NODES)
    Real and imaginary part for each colour of Rec.709 at D = 0, STEP, 2 STEP … nm; that at 0 is 1. The first table is
    a fit that Blender 4.5 has, the second that of the curves themselves. `tools/thin_film.py` makes the file.
"""

from pathlib import Path

import numpy as np

from ...core.compiling import part, routine
from ...core.vec3 import ONE, TWO, ZERO
from ...scene.closures import FresnelCurve
from . import metal

FILE = Path(__file__).with_suffix(".npz")
FILE_DIGEST = "08e5ca6d63cd5669bc7cd237cc7ab3520b6205551f95c9a7fdcaa6b70aad21be"
"""SHA-256 of the file. Kernels contain the table, and are kept under a digest of this text."""

N_NODES, STEP = 512, 60_000 / (1022 * np.pi)

with np.load(FILE) as tables:
    RESPONSE = tables["response"]

_DIELECTRIC, _CONDUCTOR = int(FresnelCurve.DIELECTRIC), int(FresnelCurve.CONDUCTOR)
_N_ORDERS = 3
_TINY, _HALF, _ALMOST_ONE, _LEAST_F0 = np.float32(1e-20), np.float32(0.5), np.float32(0.999), np.float32(1e-5)
_PER_STEP, _LAST = np.float32(1 / STEP), np.float32(N_NODES - 1)


@routine
def reflectances(film, curve, cos, f0, edge, ior):
    """What filmed facets reflect that are seen at `cos`, of three colours.

    Parameters
    ----------
    film : triple
        Thickness in nm, index of refraction, and which table.
    curve, f0, edge, ior
        As those of `Closure`: what is under the film.
    """
    return (
        _reflectance(film, 0, curve, cos, f0[0], edge[0], ior),
        _reflectance(film, 1, curve, cos, f0[1], edge[1], ior),
        _reflectance(film, 2, curve, cos, f0[2], edge[2], ior),
    )


@routine
def _reflectance(film, channel, curve, cos, f0, edge, ior):
    """That of one colour."""
    if curve == _DIELECTRIC:
        return _tinted(_of_dielectric(film, channel, cos, ior), f0, ior)
    if curve == _CONDUCTOR:
        return _of_metal(film, channel, cos, edge, metal.extinction(f0, edge), -ONE)
    at_82 = metal.f82(metal.COS_82, f0, metal.schlick(metal.COS_82, f0) * edge)
    f0 = min(f0, _ALMOST_ONE)
    n = metal.index_of(f0, at_82)
    return _of_metal(film, channel, cos, n, metal.extinction(f0, n), at_82)


@part
def _tinted(reflected, f0, ior):
    """A reflectance scaled towards f0, the more the closer it is to that of the bare dielectric."""
    ratio = (ior - ONE) / (ior + ONE)
    bare = ratio * ratio
    if bare <= _LEAST_F0:
        return reflected
    share = min(max((ONE - reflected) / (ONE - bare), ZERO), ONE)
    return reflected * (ONE + (f0 / bare - ONE) * share)


@part
def _of_dielectric(film, channel, cos, ior):
    """Reflectance of a film on a dielectric; 1 in total internal reflection at either side of it."""
    r12, sign12, cos2 = _interface(cos, film[1])
    r23, sign23, cos3 = _interface(cos2, ior / film[1])
    if cos2 <= ZERO or cos3 <= ZERO:
        return ONE
    path = TWO * film[1] * film[0] * cos2
    s = _summed(film, channel, path, r12[0], r23[0], -sign12[0] * sign23[0], ZERO)
    p = _summed(film, channel, path, r12[1], r23[1], -sign12[1] * sign23[1], ZERO)
    return min(max((s + p) * _HALF, ZERO), ONE)


@part
def _of_metal(film, channel, cos, n, k, at_82):
    """Reflectance of a film on a metal n + ik, which reflects by the F82 curve where `at_82` ≥ 0."""
    r12, sign12, cos2 = _interface(cos, film[1])
    if cos2 <= ZERO:
        return ONE
    n, k = n / film[1], k / film[1]
    if at_82 >= ZERO:
        f0 = ((n - ONE) * (n - ONE) + k * k) / ((n + ONE) * (n + ONE) + k * k)
        rs = rp = metal.f82(cos2, f0, at_82)
    else:
        rs, rp = metal.conductor_polarised(cos2, n, k)
    (real_s, imaginary_s), (real_p, imaginary_p) = _phases(cos2, n, k)
    path = TWO * film[1] * film[0] * cos2
    s = _summed(film, channel, path, r12[0], rs, -sign12[0] * real_s, -sign12[0] * imaginary_s)
    p = _summed(film, channel, path, r12[1], rp, -sign12[1] * real_p, -sign12[1] * imaginary_p)
    return min(max((s + p) * _HALF, ZERO), ONE)


@part
def _interface(cos, ior):
    """Between dielectrics: reflectances (Rs, Rp), signs of the amplitudes, and the cosine beyond or 0."""
    cos = abs(cos)
    below = ior * ior - (ONE - cos * cos)
    if below <= ZERO:
        return (ONE, ONE), (ONE, ONE), ZERO
    cos_t = np.sqrt(below) / ior
    s = (cos - ior * cos_t) / (cos + ior * cos_t)
    p = (ior * cos - cos_t) / (ior * cos + cos_t)
    return (s * s, p * p), (ONE if s >= ZERO else -ONE, ONE if p >= ZERO else -ONE), cos_t


@part
def _phases(cos, n, k):
    """exp(iφ) of light that is reflected by a conductor, of both polarisations; at grazing angles they are alike."""
    u, v = metal.refracted(cos, n, k)
    size = u * u + v * v
    s = _unit(cos * cos - size, -TWO * cos * v)
    whole = (n * n + k * k) * cos
    p = _unit(whole * whole - size, TWO * cos * (TWO * n * k * u - (n * n - k * k) * v))
    return s, p


@part
def _unit(real, imaginary):
    size = np.sqrt(real * real + imaginary * imaginary)
    return (real / size, imaginary / size) if size > ZERO else (ONE, ZERO)


@part
def _summed(film, channel, path, r12, r23, real, imaginary):
    """Airy's sum over the orders of interference, equation 10 of the paper; `real` and `imaginary` are exp(iφ)."""
    through, both = ONE - r12, r12 * r23
    between = through * through * r23 / max(ONE - both, _TINY)
    total, term, root = between + r12, between - through, np.sqrt(both)
    re, im = real, imaginary
    for m in range(1, _N_ORDERS + 1):
        term *= root
        x = min(np.float32(m) * path * _PER_STEP, _LAST)
        i = min(np.int32(x), np.int32(N_NODES - 2))
        f, table = x - np.float32(i), np.int32(film[2])
        seen = _between(table, channel, 0, i, f) * re + _between(table, channel, 1, i, f) * im
        total += TWO * term * seen
        re, im = re * real - im * imaginary, re * imaginary + im * real
    return total


@part
def _between(table, channel, part_, i, f):
    a = RESPONSE[table, channel, part_, i]
    return a + (RESPONSE[table, channel, part_, i + 1] - a) * f
