"""Points that want light."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

Domain = Literal["POINT", "CORNER"]


@dataclass(frozen=True)
class AttributeTarget:
    """A mesh attribute that receivers are for.

    Attributes
    ----------
    object_name, mesh_name : str
    domain : 'POINT' or 'CORNER'
    receiver_of_element : (e,) int32
        The receiver that each element (vertex or corner) of the mesh takes its value from; −1: it takes black.
    """

    object_name: str
    mesh_name: str
    domain: Domain
    receiver_of_element: np.ndarray


@dataclass(frozen=True)
class Receivers:
    """n points that want light.

    Attributes
    ----------
    position : (n, 3) float32, m
        World space, already lifted off the surface.
    normal : (n, 3) float32
        Unit shading normal: the hemisphere that light is wanted from.
    footprint : (n,) float32, m
        Radius of the surface that the receiver stands for.
    targets : tuple of AttributeTarget
        Where the values go.
    """

    position: np.ndarray
    normal: np.ndarray
    footprint: np.ndarray
    targets: tuple[AttributeTarget, ...] = ()

    def __len__(self) -> int:
        return len(self.position)
