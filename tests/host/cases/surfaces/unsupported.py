"""What no material of ours has."""

import bpy
import numpy as np

from ..registry import case
from ..stage import box, matte, nodes, put, shader
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


@case("A hair system", GROUP, unsupported="Lawn")
def hair():
    # Black grass on the floor.
    painted_floor(matte((0.7, 0.7, 0.7)))
    data = bpy.data.hair_curves.new("Lawn")
    roots = np.stack(np.meshgrid(np.linspace(-1, 1, 40), np.linspace(-1, 1, 40)), -1).reshape(-1, 2)
    data.add_curves([2] * len(roots))
    points = np.concatenate([np.c_[roots, np.full(len(roots), z)][:, None] for z in (-2, -1.5)], 1)
    data.position_data.foreach_set("vector", points.ravel().astype(np.float32))
    data.attributes.new("radius", "FLOAT", "POINT").data.foreach_set("value", np.full(len(roots) * 2, 0.01, np.float32))
    data.materials.append(matte((0, 0, 0), "Black"))
    put("Lawn", data)
