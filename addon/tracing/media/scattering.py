"""How the volumes of a scene scatter light: each by its own phase function."""

from ...bsdf.phase import sampling as phase
from ...core.compiling import part


@part
def phase_density(media, k, cos):
    """The density of the k-th volume's phase function, of the cosine between the directions before and after, 1/sr."""
    if media.table[k] >= 0:
        return phase.density_of_rings(cos, media.rings, media.table[k])
    return phase.density(cos, media.anisotropy[k])


@part
def sample_phase(media, k, direction, u, v):
    """The direction after a scattering in the k-th volume."""
    if media.table[k] >= 0:
        return phase.sample_rings(direction, media.rings, media.table[k], u, v)
    return phase.sample(direction, media.anisotropy[k], u, v)
