"""What no material of ours has."""

from ..registry import case
from ..stage import box, matte, nodes, shader
from .stage import GROUP, divided, painted_floor


@case("Principled BSDF, subsurface", GROUP, unsupported="Wax")
def subsurface():
    # A thin slab of wax lets light through.
    inputs = {"Base Color": (0.8, 0.5, 0.3), "Roughness": 1.0, "Specular IOR Level": 0.0}
    wax = {"Subsurface Weight": 1.0, "Subsurface Radius": (1, 0.5, 0.3), "Subsurface Scale": 0.5}
    divided(shader("BsdfPrincipled", {**inputs, **wax}, "Wax"), 0.1)


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
