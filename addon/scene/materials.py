"""What surfaces do to light: the parameters of their scattering, as constants or image textures."""

from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np

from .closures import Closures, closures_of_lobes
from .textures import Channel, Textures


@dataclass(frozen=True)
class Materials:
    """The m materials of a scene; all surfaces are two-sided.

    A material is a sum of scattering lobes, each with a weight that holds its colour. Light that meets it passes
    straight through with the probability 1 − `coverage`, tinted; all other channels are of the light that does not.

    Attributes
    ----------
    names : tuple of str
        Names for messages.
    diffuse : Channel
        Albedo of Lambertian reflection, before what `layer_f0` takes.
    translucent : Channel
        Albedo of Lambertian transmission.
    emission : Channel, W/(m² sr)
        Emitted radiance, the same in every direction on both sides; below 0 where light is taken away.
    coverage : Channel, scalar in [0, 1]
        Share of the light that does not pass straight through.
    tint : Channel
        Colour of the light that passes straight through.
    roughness : Channel, scalar in [0, 1]
        Of the glossy and the glass lobe; GGX's α is its square.
    f0, f90 : Channel
        Reflectance of the glossy lobe at normal and at grazing incidence; between them it follows `fresnel_ior`.
    fresnel_ior : (m,) float32
        Index of refraction whose Fresnel curve takes f0 to f90; 0 for Schlick's.
    layer_f0 : (m,) float32
        Reflectance f0 of that part of the glossy lobe that lies over the diffuse one and takes its albedo from it
        (a dielectric's; its f90 is 1), 0 for none.
    preserves_energy : (m,) bool
        Whether the rough lobes give back what scatters more than once between their facets.
    glass_reflection : Channel
        Colour of the reflection of the glass lobe.
    glass_transmission : Channel
        Colour of what the glass lobe transmits.
    glass_ior : (m,) float32
        Index of refraction inside over that outside, in front of the surface.
    glass_fresnel : (m,) bool
        Whether Fresnel's equations share the light between reflection and transmission; otherwise all is transmitted.
    textures : Textures
    """

    names: tuple[str, ...]
    diffuse: Channel
    translucent: Channel
    emission: Channel
    coverage: Channel
    tint: Channel
    roughness: Channel
    f0: Channel
    f90: Channel
    fresnel_ior: np.ndarray
    layer_f0: np.ndarray
    preserves_energy: np.ndarray
    glass_reflection: Channel
    glass_transmission: Channel
    glass_ior: np.ndarray
    glass_fresnel: np.ndarray
    textures: Textures

    def __len__(self) -> int:
        return len(self.names)

    @cached_property
    def closures(self) -> Closures:
        """The lobes, one after the other."""
        names = ("diffuse", "translucent", "f0", "f90", "roughness", "fresnel_ior", "layer_f0", "preserves_energy")
        glass = ("glass_reflection", "glass_transmission", "glass_ior", "glass_fresnel")
        return closures_of_lobes(**{name: getattr(self, name) for name in (*names, *glass)})

    @cached_property
    def matte(self) -> np.ndarray:
        """Which materials have no lobe but the diffuse one, (m,) bool."""
        others = (self.translucent, self.f0, self.f90, self.glass_reflection, self.glass_transmission)
        return ~np.logical_or.reduce([channel.nonzero for channel in others])

    @cached_property
    def glossy_or_glass(self) -> np.ndarray:
        """Which materials have a glossy or a glass lobe, (m,) bool."""
        lobes = (self.f0, self.f90, self.glass_reflection, self.glass_transmission)
        return np.logical_or.reduce([channel.nonzero for channel in lobes])

    @cached_property
    def spreads_light(self) -> np.ndarray:
        """Which materials scatter light widely, to either of their sides, (m,) bool: photons are stored on those."""
        return self.diffuse.nonzero | self.translucent.nonzero

    @cached_property
    def see_through(self) -> np.ndarray:
        """Which materials let light pass straight through somewhere, (m,) bool."""
        return (self.coverage.texture >= 0) | (self.coverage.value[:, 0] < 1)

    @staticmethod
    def of(m: int, textures: Textures | None = None, **columns: Any) -> "Materials":
        """The m materials that `columns` say; what they leave out is black, opaque, rough and without gloss."""
        zeros, ones = np.zeros(m, np.float32), np.ones(m, np.float32)
        default: dict[str, Any] = {f.name: Channel.constant(zeros) for f in fields(Materials) if f.type is Channel}
        default |= {
            "names": tuple(f"Material {i}" for i in range(m)),
            "coverage": Channel.constant(ones),
            "tint": Channel.constant(ones),
            "roughness": Channel.constant(ones),
            "fresnel_ior": zeros,
            "layer_f0": zeros,
            "preserves_energy": np.ones(m, bool),
            "glass_ior": np.full(m, 1.5, np.float32),
            "glass_fresnel": np.ones(m, bool),
            "textures": textures or Textures.pack([]),
        }
        return Materials(**(default | columns))

    @staticmethod
    def matte_of(albedo: np.ndarray, emission: np.ndarray | None = None) -> "Materials":
        """Untextured Lambertian materials of (m, 3) albedos and, where given, (m, 3) emitted radiances."""
        albedo = np.asarray(albedo, np.float32).reshape(-1, 3)
        glow = np.zeros_like(albedo) if emission is None else np.asarray(emission, np.float32)
        return Materials.of(len(albedo), diffuse=Channel.constant(albedo), emission=Channel.constant(glow))
