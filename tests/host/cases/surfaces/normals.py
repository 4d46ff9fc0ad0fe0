"""Shading normals: Normal Map and Bump nodes, coats and lobes with normals of their own."""

import numpy as np

from ..registry import case
from ..stage import lamp, nodes, picture, probes, room
from .stage import GROUP


@case("Normal map", GROUP)
def normal_map():
    # Leans the floor by 40° to the red wall.
    tree = nodes("Tiles")
    pixels = np.full((4, 4, 3), (0.5 - 0.5 * np.sin(0.7), 0.5, 0.5 + 0.5 * np.cos(0.7)))
    image = tree.add("TexImage", image=picture(pixels, colorspace="Non-Color"))
    bumped = tree.add("NormalMap", {"Color": image})
    floor = tree.done(tree.add("BsdfDiffuse", {"Color": (0.8, 0.8, 0.8), "Normal": bumped}))
    room(paint={"Floor": floor}, dim=0.5)
    probes("Left Right Ceiling", 32)
    lamp("AREA", (-1.5, 0, -0.5), (0.5, 0, -2), size=0.8, energy=100)
