"""Photons where they met surfaces."""

from dataclasses import dataclass, fields
from enum import IntEnum

import numpy as np

from ..core.sampling.octahedral import decode_octahedral
from ..core.sampling.vectors import rows


class PathKind(IntEnum):
    """How a photon came from its light: straight, over diffuse surfaces, or over specular ones only."""

    DIRECT = 0
    INDIRECT = 1
    CAUSTIC = 2


@dataclass(frozen=True)
class Photons:
    """The p photons of a scene, 46 bytes each.

    Attributes
    ----------
    position : (p, 3) float32, m
        World space.
    power : (p, 3) float32, W
    packed_direction, packed_normal : (p, 2) int16
        Octahedral codes of `direction` and `normal`.
    triangle : (p,) int32
        The triangle that was hit.
    path : (p,) int32
        The emitted photon that this one is a part of.
    path_density : (p,) float32
        Probability that Russian roulette let the path come this far.
    kind : (p,) uint8
        `PathKind`.
    bounce : (p,) uint8
        Surfaces hit before this one, at most 255.
    """

    position: np.ndarray
    power: np.ndarray
    packed_direction: np.ndarray
    packed_normal: np.ndarray
    triangle: np.ndarray
    path: np.ndarray
    path_density: np.ndarray
    kind: np.ndarray
    bounce: np.ndarray

    def __len__(self) -> int:
        return len(self.position)

    @property
    def direction(self) -> np.ndarray:
        """Unit directions in which the photons flew when they hit, (p, 3) float32."""
        return decode_octahedral(self.packed_direction)

    @property
    def normal(self) -> np.ndarray:
        """Unit geometric normals of the sides that were hit, (p, 3) float32."""
        return decode_octahedral(self.packed_normal)

    @property
    def bytes_per_photon(self) -> int:
        return sum(getattr(self, f.name)[:1].nbytes for f in fields(self)) if len(self) else 0

    def where(self, chosen: np.ndarray | slice) -> "Photons":
        """The photons that a mask, an index array or a slice chooses."""
        if isinstance(chosen, slice):
            return Photons(**{f.name: getattr(self, f.name)[chosen] for f in fields(self)})
        return Photons(**{f.name: rows(getattr(self, f.name), chosen) for f in fields(self)})

    @staticmethod
    def join(parts: "list[Photons]") -> "Photons":
        """All photons of several `Photons`, in order."""
        return Photons(**{f.name: np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(Photons)})

    @staticmethod
    def none() -> "Photons":
        """No photons."""
        return Photons(
            position=np.zeros((0, 3), np.float32),
            power=np.zeros((0, 3), np.float32),
            packed_direction=np.zeros((0, 2), np.int16),
            packed_normal=np.zeros((0, 2), np.int16),
            triangle=np.zeros(0, np.int32),
            path=np.zeros(0, np.int32),
            path_density=np.zeros(0, np.float32),
            kind=np.zeros(0, np.uint8),
            bounce=np.zeros(0, np.uint8),
        )
