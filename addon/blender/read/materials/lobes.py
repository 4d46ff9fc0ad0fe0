"""What a material's shader nodes add up to: scattering lobes, and from them the channels of `Materials`."""

from dataclasses import dataclass, field

import numpy as np

from .node_math import saturate


def black() -> np.ndarray:
    """No light, (1, 1, 3)."""
    return np.zeros((1, 1, 3), np.float32)


@dataclass(frozen=True)
class Lobe:
    """What the glossy or glass lobes of one material differ in.

    Attributes
    ----------
    weight : (h, w, 1) float32
        Mean share of the light that the lobe scatters.
    roughness : (h, w, 1) float32
    ior : float
        0 for Schlick's curve.
    fresnel : bool
        Of a glass lobe, whether it reflects by Fresnel's equations.
    keeps_energy : bool
        Whether it gives back what scatters more than once between facets.
    """

    weight: np.ndarray
    roughness: np.ndarray
    ior: float
    fresnel: bool
    keeps_energy: bool

    @property
    def mean_weight(self) -> float:
        return float(self.weight.mean())


@dataclass
class Lobes:
    """The sum of a material's closures, as (h, w, 3) float32 arrays, h = w = 1 where constant.

    `transparent` is what passes straight through; the others are as in `Materials`, but shares of all light.
    """

    transparent: np.ndarray = field(default_factory=black)
    emission: np.ndarray = field(default_factory=black)
    diffuse: np.ndarray = field(default_factory=black)
    translucent: np.ndarray = field(default_factory=black)
    f0: np.ndarray = field(default_factory=black)
    f90: np.ndarray = field(default_factory=black)
    glass_reflection: np.ndarray = field(default_factory=black)
    glass_transmission: np.ndarray = field(default_factory=black)
    layer_f0: float = 0.0
    glossy: list[Lobe] = field(default_factory=list)
    glass: list[Lobe] = field(default_factory=list)

    def add_glossy(self, f0: np.ndarray, f90: np.ndarray, roughness: np.ndarray, ior: float, keeps: bool) -> None:
        """Add a glossy lobe."""
        self.f0, self.f90 = self.f0 + f0, self.f90 + f90
        self.glossy.append(Lobe(_largest(_mean_reflectance(f0, f90)), roughness, ior, False, keeps))

    def add_glass(
        self,
        reflection: np.ndarray,
        transmission: np.ndarray,
        roughness: np.ndarray,
        ior: float,
        fresnel: bool,
        keeps: bool,
    ) -> None:
        """Add a glass lobe."""
        self.glass_reflection = self.glass_reflection + reflection
        self.glass_transmission = self.glass_transmission + transmission
        self.glass.append(Lobe(_largest(transmission), roughness, ior, fresnel, keeps))

    @property
    def roughness(self) -> np.ndarray:
        """Of all lobes, weighed by what they scatter; 1 where there is none, (h, w, 1)."""
        lobes = self.glossy + self.glass
        if len(lobes) == 1:
            return lobes[0].roughness
        weight = sum((one.weight for one in lobes), np.zeros((1, 1, 1), np.float32))
        total = sum((one.weight * one.roughness for one in lobes), np.zeros((1, 1, 1), np.float32))
        return np.where(weight > 0, total / np.where(weight > 0, weight, 1), 1)

    @property
    def unlike(self) -> bool:
        """Whether lobes of very different roughness were merged."""
        both = [lobe for lobe in self.glossy + self.glass if lobe.mean_weight > 0.05]
        return bool(both) and float(np.ptp([float(lobe.roughness.mean()) for lobe in both])) > 0.4

    @property
    def coverage(self) -> np.ndarray:
        """Share of the light that does not pass straight through, (h, w, 1).

        Where transparency is added to something, as in flames, there is no such share; it is ½ there, which
        leaves a tint of up to 2.
        """
        if not self.transparent.any():
            return np.ones((1, 1, 1), np.float32)
        share = saturate(1 - _largest(self.transparent))
        glass = np.maximum(self.glass_reflection, self.glass_transmission)
        scattered = _largest(self.diffuse + self.translucent + _mean_reflectance(self.f0, self.f90) + glass)
        added = (scattered > 1.1 * share + 1e-3) | ((_largest(np.abs(self.emission)) > 0) & (share < 1e-3))
        return np.where(added, np.maximum(share, 0.5), share).astype(np.float32)

    def channels(self) -> dict[str, np.ndarray]:
        """Values of the channels of `Materials`, (h, w, 1 or 3) float32."""
        coverage = self.coverage
        passing = 1 - coverage
        inside = np.where(coverage > 0, coverage, 1)
        shares = ("diffuse", "translucent", "f0", "f90", "glass_reflection", "glass_transmission")
        return {name: saturate(getattr(self, name) / inside) for name in shares} | {
            "emission": self.emission / inside,
            "coverage": coverage,
            "tint": np.where(passing > 0, self.transparent / np.where(passing > 0, passing, 1), 1),
            "roughness": self.roughness,
        }


def _largest(color: np.ndarray) -> np.ndarray:
    red, green, blue = (color[..., i : i + 1] for i in range(3))
    return np.maximum(np.maximum(red, green), blue)  # several times as fast as color.max(axis=2)


def _mean_reflectance(f0: np.ndarray, f90: np.ndarray) -> np.ndarray:
    """Schlick's curve averaged over the hemisphere by the cosine."""
    return (f0 * 20 + f90) / 21
