"""Points that want light."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from .camera.camera import Camera, SeenSurface

if TYPE_CHECKING:
    from .attribute_map import AttributeMap

Domain = Literal["POINT", "CORNER"]


@dataclass(frozen=True)
class AttributeTarget:
    """A mesh attribute that receivers are for.

    Attributes
    ----------
    object_name, mesh_name : str
    domain : 'POINT' or 'CORNER'
        Of the attribute.
    receiver_of_element : (e,) int32
        The receiver that each element (vertex or corner) of the mesh takes its value from; −1: it takes black. With a
        map these are the corners of the evaluated mesh.
    map : AttributeMap or None
        What modifiers make of the attribute, where they change the mesh's elements.
    """

    object_name: str
    mesh_name: str
    domain: Domain
    receiver_of_element: np.ndarray
    map: "AttributeMap | None" = None

    @property
    def n_elements(self) -> int:
        """Of the attribute."""
        return len(self.receiver_of_element if self.map is None else self.map.stand_in)

    def values(self, of_receiver: np.ndarray) -> np.ndarray:
        """Values of the attribute's elements (e, d) float32 from the receivers' (n, d)."""
        receiver = self.receiver_of_element
        values = np.zeros((len(receiver), of_receiver.shape[1]), np.float32)
        lit = receiver >= 0
        values[lit] = of_receiver[receiver[lit]]
        return values if self.map is None else np.maximum(self.map.stored(values, lit), 0).astype(np.float32)


@dataclass(frozen=True)
class View:
    """How a camera sees receivers: as one of the p points of `seen` each; of those behind a surface, its other side."""

    camera: Camera
    seen: SeenSurface


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
    takes_caustics : (n,) bool or None
        Whether light that lamps send over mirrors and glass is wanted too; None: by all. Pixels find it otherwise.
    directional : bool
        Whether it is asked, too, how the light changes with the normal: `Irradiance.slope`.
    view : View or None
        Of the camera whose pixels they all are for.
    base_normal : (n, 3) float32 or None
        The interpolated normals where `normal` is a normal map's or a bump's: light from below them does not count,
        and what grazes them is shadowed (`bump_shadowing`).
    """

    position: np.ndarray
    normal: np.ndarray
    footprint: np.ndarray
    targets: tuple[AttributeTarget, ...] = ()
    takes_caustics: np.ndarray | None = None
    directional: bool = False
    view: View | None = None
    base_normal: np.ndarray | None = None

    def __len__(self) -> int:
        return len(self.position)

    @staticmethod
    def join(parts: "list[Receivers]") -> "Receivers":
        """All receivers, in order."""
        if len(parts) == 1:
            return parts[0]
        targets: list[AttributeTarget] = []
        first = 0
        for part in parts:
            for target in part.targets:
                of_element = target.receiver_of_element
                moved = np.where(of_element >= 0, of_element + np.int32(first), np.int32(-1))
                targets.append(replace(target, receiver_of_element=moved))
            first += len(part)
        position, normal, footprint = (
            np.concatenate([getattr(part, name) for part in parts]) for name in ("position", "normal", "footprint")
        )
        takes = None
        if any(part.takes_caustics is not None for part in parts):
            ones = [np.ones(len(part), bool) if part.takes_caustics is None else part.takes_caustics for part in parts]
            takes = np.concatenate(ones)
        base = None
        if any(part.base_normal is not None for part in parts):
            base = np.concatenate([part.normal if part.base_normal is None else part.base_normal for part in parts])
        directional = any(part.directional for part in parts)
        return Receivers(position, normal, footprint, tuple(targets), takes, directional, base_normal=base)

    def where(self, chosen: np.ndarray) -> "Receivers":
        """The receivers that a mask or an index array chooses, for no targets and no camera."""
        takes = None if self.takes_caustics is None else self.takes_caustics[chosen]
        position, normal, footprint = self.position[chosen], self.normal[chosen], self.footprint[chosen]
        base = None if self.base_normal is None else self.base_normal[chosen]
        return Receivers(position, normal, footprint, (), takes, self.directional, base_normal=base)
