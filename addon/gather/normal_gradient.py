"""How irradiance changes with the normal: what directional lightmaps hold.

A normal map turns a surface's normal n to n', all over the hemisphere around n. The irradiance that it then has is told
by a slope B, the linear function that is exact at n and best for the normals of a map of half balls. Their density is
n·n'/π, as each texel covers as much of the surface:

    E(n') ≈ E(n) + B·(n' − n),        ∫ (E(n') − E(n) − B·(n' − n))² n·n' dn' is least

The three components of n' − n, two across n and one along it, are orthogonal under this weight. The integrals of their
squares are π/4, π/4 and π/6, so each component of B is a projection of its own: with d = n' − n and the mean over
normals of that density,

    B = mean of (E(n') − E(n)) (4 d + 2 (d·n) n)

For light from ω, at the angle θ to n, E(n') is L max(ω·n', 0) dω, and the integrals over the lune of normals that see n
and ω are elementary:

    B = ∫ L g dω,        g = (1 + cos θ)/2 ω + ((1 − cos θ)(3 − cos θ)/4 − 4/π (sin θ − θ cos θ)) n

Light from straight above has g = n, which is exact for all normals, and so is light that is the same from everywhere
above, B = E n/2. The bands 0 and 1 of the radiance's spherical harmonics, E(n') ≈ ∫ L (1 + 2 ω·n')/4 dω, are off at n
itself instead (by a quarter for light from above) and have half of this slope or little more.
"""

import numpy as np

from ..core.compiling import kernel, kernel_array, part
from ..core.vec3 import BLACK, ONE, TWO, ZERO, dot, plus, put, row, times

_THREE, _FOUR, _FOUR_PER_PI = np.float32(3), np.float32(4), np.float32(4 / np.pi)


@part
def gradient_of_light(direction, normal):
    """The g of a unit direction that light comes from, around a unit normal; 0 below the horizon."""
    cosine = min(dot(direction, normal), ONE)
    if cosine <= ZERO:
        return BLACK
    theta = np.arccos(cosine)
    bend = np.sin(theta) - theta * cosine
    along = (ONE - cosine) * (_THREE - cosine) / _FOUR - _FOUR_PER_PI * bend
    return plus(times(direction, (ONE + cosine) / TWO), times(normal, along))


def slope_of_light(directions: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """`gradient_of_light` of directions and normals (n, 3), (n, 3) float32."""
    g = np.empty((len(directions), 3), np.float32)
    _gradients(kernel_array(directions, np.float32), kernel_array(normals, np.float32), g)
    return g


@kernel
def _gradients(directions, normals, g):
    for k in range(len(directions)):
        put(g, k, gradient_of_light(row(directions, k), row(normals, k)))


def slope_of_samples(change: np.ndarray, turned: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """B (m, 3, 3), for each axis and colour, by its definition.

    Parameters
    ----------
    change : (m, k, 3)
        E(n') − E(n).
    turned : (m, k, 3)
        Normals n', cosine-weighted around n.
    normals : (m, 3)
        n.
    """
    away = turned - normals[:, None]
    along = np.einsum("mka,ma->mk", away, normals)
    weight = 4 * away + 2 * along[..., None] * normals[:, None]
    return weight.transpose(0, 2, 1) @ change / turned.shape[1]
