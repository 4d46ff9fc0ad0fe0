"""What no material of ours has."""

from ..registry import case
from ..stage import shader
from .stage import GROUP, painted_floor


@case("Hair Principled BSDF", GROUP, unsupported="Fur")
def hair_shader():
    painted_floor(shader("BsdfHairPrincipled", name="Fur"))
