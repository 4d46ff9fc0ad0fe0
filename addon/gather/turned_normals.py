"""How irradiance changes with the normal: what directional lightmaps hold.

A normal map turns a surface's normal n to n', all over the hemisphere around n. The irradiance that it then has is told
by a slope B, the linear function that is exact at n and best over that hemisphere:

    E(n') ≈ E(n) + B·(n' − n),        ∫ (E(n') − E(n) − B·(n' − n))² dn' is least

The three components of n' − n, two across n and one along it, are orthogonal over the hemisphere, and the square of
each has the integral 2π/3. So each component of B is a projection of its own,

    B = 3/(2π) ∫ (E(n') − E(n)) (n' − n) dn'

For light from ω, at the angle θ to n, E(n') is L max(ω·n', 0) dω, and the integral over the lune of normals that see n
and ω is elementary:

    B = ∫ L g dω,        g = (1 − θ/π) ω + (sin θ/π − 3/4 (1 − cos θ)) n

Light from straight above has g = n, which is exact for all normals, and so is light that is the same from everywhere
above, B = E n/2. The bands 0 and 1 of the radiance's spherical harmonics, E(n') ≈ ∫ L (1 + 2 ω·n')/4 dω, are off at n
itself instead: by a quarter for light from above.
"""

import numpy as np

from ..sampling.vectors import dot


def slope_of_light(directions: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """G of unit directions (n, 3) that light comes from, around unit normals (n, 3): (n, 3); 0 below the horizon."""
    cosine = np.clip(dot(directions, normals), -1, 1)
    theta = np.arccos(cosine)
    across = np.where(cosine > 0, 1 - theta / np.float32(np.pi), np.float32(0))
    along = np.sin(theta) / np.float32(np.pi) - np.float32(0.75) * (1 - cosine)
    along = np.where(cosine > 0, along, np.float32(0))
    return across[:, None] * directions + along[:, None] * normals
