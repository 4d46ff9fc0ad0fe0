"""Lambertian transmission: the same radiance in every direction of the other side."""

from ...core.compiling import part
from ...core.sampling.warps import cosine_hemisphere
from ...core.vec3 import negative


@part
def sample(closure, u, v):
    """A direction, and f |cos| over its density."""
    return negative(cosine_hemisphere(u, v)), closure.weight
