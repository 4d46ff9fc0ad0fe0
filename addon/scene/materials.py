"""What surfaces do to light: what they emit and let through, and the closures that their scattering is a sum of."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from .closures import BROAD, LAMBERTIAN, NARROW, Closures, Lobe, closures_of_lobes
from .textures import Channel, Textures


@dataclass(frozen=True)
class Materials:
    """The m materials of a scene; all surfaces are two-sided.

    Light that meets a material passes straight through with the probability 1 − `coverage`, tinted; emission and
    closures are of the light that does not.

    Attributes
    ----------
    names : tuple of str
        Names for messages.
    closures : Closures
        What scatters light; they add up.
    emission : Channel, W/(m² sr)
        Emitted radiance, the same in every direction on both sides; below 0 where light is taken away.
    coverage : Channel, scalar in [0, 1]
        Share of the light that does not pass straight through.
    tint : Channel
        Colour of the light that passes straight through.
    textures : Textures
    """

    names: tuple[str, ...]
    closures: Closures
    emission: Channel
    coverage: Channel
    tint: Channel
    textures: Textures

    def __len__(self) -> int:
        return len(self.names)

    def has(self, *lobes: Lobe) -> np.ndarray:
        """Which materials have a closure of one of some kinds, (m,) bool."""
        return self.closures.count(*lobes) > 0

    @cached_property
    def matte(self) -> np.ndarray:
        """Which materials have no closure but diffuse ones, (m,) bool."""
        return ~(self.has(Lobe.TRANSLUCENT) | self.directional)

    @cached_property
    def directional(self) -> np.ndarray:
        """Which materials have closures that are not Lambertian, (m,) bool."""
        return self.has(*(lobe for lobe in Lobe if lobe not in LAMBERTIAN))

    @cached_property
    def narrow(self) -> np.ndarray:
        """Which materials have a closure that rays follow, glossy or glass, (m,) bool."""
        return self.has(*NARROW)

    @cached_property
    def broad(self) -> np.ndarray:
        """Which materials have a closure that is broad and not Lambertian, (m,) bool."""
        return self.has(*BROAD)

    @cached_property
    def spreads_light(self) -> np.ndarray:
        """Which materials scatter light widely, to either of their sides, (m,) bool: photons are stored on those."""
        return self.has(*LAMBERTIAN, *BROAD)

    @cached_property
    def perturbed(self) -> np.ndarray:
        """Which materials have a closure with a normal of its own, (m,) bool."""
        of = self.closures.material[self.closures.normal_space >= 0]
        return np.bincount(of, minlength=len(self)) > 0

    @cached_property
    def see_through(self) -> np.ndarray:
        """Which materials let light pass straight through somewhere, (m,) bool."""
        return (self.coverage.texture >= 0) | (self.coverage.value[:, 0] < 1)

    @staticmethod
    def of(m: int, textures: Textures | None = None, closures: Closures | None = None, **columns: Any) -> "Materials":
        """The m materials that `columns` say; what they leave out is black and opaque.

        Parameters
        ----------
        closures : Closures, optional
            Without them there are at most one of each kind, by those columns that `closures_of_lobes` takes.
        """
        ones = np.ones(m, np.float32)
        default = {
            "names": tuple(f"Material {i}" for i in range(m)),
            "emission": Channel.constant(np.zeros(m)),
            "coverage": Channel.constant(ones),
            "tint": Channel.constant(ones),
        }
        own = {name: columns.pop(name, value) for name, value in default.items()}
        closures = closures or closures_of_lobes(m, **columns)
        return Materials(**own, closures=closures, textures=textures or Textures.pack([]))

    @staticmethod
    def matte_of(albedo: np.ndarray, emission: np.ndarray | None = None) -> "Materials":
        """Untextured Lambertian materials of (m, 3) albedos and, where given, (m, 3) emitted radiances."""
        albedo = np.asarray(albedo, np.float32).reshape(-1, 3)
        glow = np.zeros_like(albedo) if emission is None else np.asarray(emission, np.float32)
        return Materials.of(len(albedo), diffuse=Channel.constant(albedo), emission=Channel.constant(glow))
