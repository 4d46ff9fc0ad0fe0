"""What is shown: kinds of light, each with its level."""

from dataclasses import dataclass
from typing import Literal

from ..lightmap.writing import IMAGE

LightSource = Literal["vertex", "lightmap"]
"""Where light can be: in color attributes, or in lightmaps."""


@dataclass(frozen=True)
class Layer:
    """One kind of baked light, as of a light group, whose level can change while it is shown.

    Attributes
    ----------
    name : str
        Empty: all light in one.
    attribute : str
        Color attribute of meshes that holds it.
    image_property : str
        Custom property of objects with the name of the image file that holds it.
    strength : float
    color : (r, g, b)
        Scene-linear; what is shown is strength × color × light.
    """

    name: str = ""
    attribute: str = "Indirect"
    image_property: str = IMAGE
    strength: float = 1.0
    color: tuple[float, float, float] = (1.0, 1.0, 1.0)
