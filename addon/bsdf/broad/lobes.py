"""Which file a kind of closure means: the lobes of this room sampled and evaluated, and the layers weighed."""

from ...core.compiling import routine
from ...core.vec3 import BLACK
from ...scene.closures import Lobe
from . import absorbing, rough_diffuse, sheen, toon, velvet

_ROUGH_DIFFUSE, _SHEEN, _VELVET = int(Lobe.ROUGH_DIFFUSE), int(Lobe.SHEEN), int(Lobe.VELVET)
_TOON, _GLOSSY_TOON = int(Lobe.TOON), int(Lobe.GLOSSY_TOON)


@routine
def sample(closure, wo, u, v, from_light):
    """A direction of one closure, and f |cos| over its density."""
    if closure.kind == _ROUGH_DIFFUSE:
        return rough_diffuse.sample(closure, wo, u, v)
    if closure.kind == _SHEEN:
        return sheen.sample(closure, wo, u, v, from_light)
    if closure.kind == _VELVET:
        return velvet.sample(closure, wo, u, v)
    return toon.sample(closure, wo, u, v, from_light)


@routine
def evaluate(closure, view, light):
    """A closure's f in 1/sr, without the cosine."""
    if closure.kind == _ROUGH_DIFFUSE:
        return rough_diffuse.evaluate(closure, view, light)
    if closure.kind == _SHEEN:
        return sheen.evaluate(closure, view, light)
    if closure.kind == _VELVET:
        return velvet.evaluate(closure, view, light)
    return toon.evaluate(closure, view, light)


@routine
def albedo(closure, cos):
    """A closure's directional albedo, seen at `cos`; none of a layer that only absorbs."""
    if closure.kind == _ROUGH_DIFFUSE:
        return rough_diffuse.albedo(closure, cos)
    if closure.kind == _SHEEN:
        return sheen.albedo(closure, cos)
    if closure.kind == _VELVET:
        return velvet.albedo(closure, cos)
    if closure.kind == _TOON or closure.kind == _GLOSSY_TOON:
        return toon.albedo(closure)
    return BLACK


@routine
def transmittance(closure, cos):
    """Share of the light that a layer leaves to what it covers, seen at `cos`."""
    if closure.kind == _SHEEN:
        left = sheen.transmittance(closure, cos)
        return left, left, left
    return absorbing.transmittance(closure, cos)
