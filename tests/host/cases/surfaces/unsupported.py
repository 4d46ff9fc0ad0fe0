"""What no material of ours has."""

from ..registry import case
from ..stage import box, matte, nodes, shader
from .stage import GROUP, painted_floor


@case("Fog in the room (volume)", GROUP, unsupported="Fog")
def volume():
    tree = nodes("Fog")
    fog = tree.add("VolumePrincipled", {"Density": 0.5})
    tree.feed(tree.add("OutputMaterial").inputs["Volume"], fog)
    painted_floor(matte((0.6, 0.6, 0.6)))
    box("Fog", (0, 0, 0), (1.9, 1.9, 1.9), tree.block)


@case("Hair Principled BSDF", GROUP, unsupported="Fur")
def hair_shader():
    painted_floor(shader("BsdfHairPrincipled", name="Fur"))
