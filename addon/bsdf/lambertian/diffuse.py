"""Lambertian reflection: the same radiance in every direction of the side that light came to."""

from ...core.compiling import part
from ...core.sampling.warps import cosine_hemisphere


@part
def sample(closure, u, v):
    """A direction, and f |cos| over its density."""
    return cosine_hemisphere(u, v), closure.weight
