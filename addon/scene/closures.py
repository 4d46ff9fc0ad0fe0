"""What a material's scattering is made of: closures, each a way to scatter light with a weight and parameters."""

from dataclasses import dataclass, fields
from enum import IntEnum
from functools import cached_property
from typing import Any

import numpy as np

from .textures import Channel


class Lobe(IntEnum):
    """A way to scatter light: the kind of a closure.

    The Lambertian ones come first, and have no parameter but their weight: to kernels they are those below GLOSSY.
    """

    DIFFUSE = 0
    TRANSLUCENT = 1
    GLOSSY = 2
    GLASS = 3
    ROUGH_DIFFUSE = 4
    SHEEN = 5
    VELVET = 6
    TOON = 7
    GLOSSY_TOON = 8
    ABSORBING = 9
    PANE = 10
    SUBSURFACE = 11
    FIBRE = 12


LAMBERTIAN = (Lobe.DIFFUSE, Lobe.TRANSLUCENT)
BROAD = (Lobe.ROUGH_DIFFUSE, Lobe.SHEEN, Lobe.VELVET, Lobe.TOON)
NARROW = (Lobe.GLOSSY, Lobe.GLASS, Lobe.GLOSSY_TOON, Lobe.PANE, Lobe.FIBRE)
GLOSSY_KINDS = (Lobe.GLOSSY, Lobe.GLOSSY_TOON)
DIRECTED = (Lobe.SHEEN, Lobe.VELVET, Lobe.TOON)
"""Kinds by who finds light in them.

- LAMBERTIAN: the radiance cache has the radiance that they reflect.
- BROAD: the cache has the irradiance without that of lamps, which shadow rays find. DIRECTED are those whose reflection
  depends so much on where light comes from that rays follow them as well; of the cache they take caustics alone.
- NARROW: rays follow them. GLOSSY_KINDS are those that only reflect: their f and density are known, so that shadow rays
  find lamps where f is low; in their peaks, and in all other narrow ones, photons do.

SUBSURFACE is none of these: the cache has its radiance, and light comes out elsewhere than it entered. ABSORBING is not
either: it is a layer that scatters nothing.
"""


class Distribution(IntEnum):
    """How the normals of a rough closure's facets are distributed."""

    GGX = 0
    BECKMANN = 1
    ASHIKHMIN_SHIRLEY = 2


class FibreModel(IntEnum):
    """What a fibre does to light: by Chiang's model, as Cycles' Hair BSDF of either kind, or as a translucent side."""

    CHIANG = 0
    REFLECTION = 1
    TRANSMISSION = 2
    TRANSLUCENT = 3


class FresnelCurve(IntEnum):
    """How a glossy closure's reflectance goes from f0 at normal incidence to grazing.

    DIELECTRIC : to f90 as Fresnel's equations for `ior` go to 1, or by Schlick's curve.
    F82 : by Schlick's curve, times `edge` at 82°.
    CONDUCTOR : by Fresnel's equations of a complex index, whose real part is `edge`.
    """

    DIELECTRIC = 0
    F82 = 1
    CONDUCTOR = 2


class NormalSpace(IntEnum):
    """What the three numbers x, y, z of a closure's own normal mean; N is the interpolated normal, of unit length.

    TANGENT is xT + yB + zN by the tangents of `ShadingFrames`. OBJECT and WORLD are a vector in the object's space or
    in the world, whose length s says how far the normal is moved from N to its direction d: s d + (1 − s) N. HEIGHT is
    the slope of a height over the surface, N − ∇h: x and y are h's derivatives by the texture coordinates, m, and z
    the strength s as before. On a surface's back, all but ∇h point the other way.
    """

    TANGENT = 0
    OBJECT = 1
    WORLD = 2
    HEIGHT = 3


N_ANGLES = 33
"""Points of a curve over the viewing angle: cosines (k / 32)², which lie close where Fresnel's curves are steep."""


@dataclass(frozen=True)
class AngleCurves:
    """What the weights of c closures are multiplied by where they are seen at an angle.

    Attributes
    ----------
    of_closure : (c,) int32
        Which curve, −1 for none.
    curves : (k, N_ANGLES) float32
        In [0, 1], by the cosine to the normal on the viewing side.
    """

    of_closure: np.ndarray
    curves: np.ndarray

    @staticmethod
    def none(n: int) -> "AngleCurves":
        return AngleCurves(np.full(n, -1, np.int32), np.zeros((0, N_ANGLES), np.float32))


def angle_cosines() -> np.ndarray:
    """The cosines at which curves are known, (N_ANGLES,)."""
    return (np.arange(N_ANGLES) / (N_ANGLES - 1)) ** 2


@dataclass(frozen=True)
class Closures:
    """The c closures of m materials, those of material i in rows `start[i]` to `start[i + 1]`; they add up.

    Attributes
    ----------
    start : (m + 1,) int32
    kind : (c,) int32
        `Lobe`.
    weight : Channel
        What it is multiplied by. Of Lambertian, rough diffuse, velvet, toon and subsurface closures that is the albedo,
        before what `layer` takes. The own colour of others is in f0 and f90: light that scatters more than once between
        facets takes it each time, and a layer's share of the light is told by it.
    roughness : Channel, scalar in [0, 1]
        Of a glossy, a glass or a pane's closure; GGX's α is its square. What a pane scatters is what a glossy one
        reflects, mirrored to the other side of the surface. Of a rough diffuse closure σ, of sheen and velvet theirs,
        of toon the size, and of an absorbing one the share of the surface that it covers. Of a subsurface closure that
        of the facets through which views enter. Of a fibre the variance of light's angle about the mirrored one that
        passes it, or the width of the cone.
    f0, f90 : Channel
        Of a glossy closure the reflectance at normal and at grazing incidence; between them it follows `ior`. Of a
        glass closure the colour of what is reflected, and of what is transmitted. f0 of a rough diffuse closure is the
        colour that scattering more than once takes, of sheen its colour and weight, and of an absorbing one the
        transmittance along the normal; f90 of toon, a scalar, is the width of its edge. Of a subsurface closure f0 is
        the colour that a half-space has, and f90 the mean free path, m. Of a fibre f0 is the absorption a radius, and
        f90 the scale or width of its azimuths, its tilt in rad, and the variance of what its surface reflects.
    ior : (c,) float32
        Of a glossy closure the index of refraction whose Fresnel curve takes f0 to f90, 0 for Schlick's. Of a glass
        or subsurface closure that inside over that outside, in front of the surface.
    fresnel : (c,) bool
        Of a glass closure, whether Fresnel's equations share the light between reflection and transmission; otherwise
        all is transmitted.
    preserves_energy : (c,) bool
        Whether a rough closure gives back what scatters more than once between its facets.
    layer : (c,) int32
        The closure that lies over this one, −1 for none: glossy or sheen, which takes its albedo from it, or absorbing.
    distribution : (c,) int32
        `Distribution` of a rough closure's facets; `FibreModel` of a fibre.
    curve : (c,) int32
        `FresnelCurve` of a glossy closure.
    edge : Channel
        What that takes. Of a subsurface closure, without texture: the anisotropy, the share of views that enter by the
        cosine, and 1 where Chiang's inversion says of the colour what scatters (see `bsdf.subsurface.medium`), else 0.
    film : Channel
        The thin film on the facets of a glossy or a glass closure: thickness in nm, 0 for none; index of refraction;
        and whose response to interference counts, 0 for Blender 4.5 and 1 for later ones.
    stretch : Channel
        How many times a glossy closure's α is as large along the tangent of `ShadingFrames`, and as small across it;
        and by how much of a turn that tangent is turned about the normal.
    normal_space : (c,) int32
        `NormalSpace` of a closure that has a normal of its own, −1 of one that has the interpolated normal.
    normal : Channel
        That normal.
    by_angle : AngleCurves, optional
        None where no weight depends on the angle.
    """

    start: np.ndarray
    kind: np.ndarray
    weight: Channel
    roughness: Channel
    f0: Channel
    f90: Channel
    ior: np.ndarray
    fresnel: np.ndarray
    preserves_energy: np.ndarray
    layer: np.ndarray
    distribution: np.ndarray
    curve: np.ndarray
    edge: Channel
    film: Channel
    stretch: Channel
    normal_space: np.ndarray
    normal: Channel
    by_angle: AngleCurves | None = None

    @staticmethod
    def of(start: np.ndarray, kind: np.ndarray, **columns: Any) -> "Closures":
        """Closures of some kinds; columns that are left out are those of a white lobe without a layer over it."""
        c, kind = len(kind), np.asarray(kind, np.int32)
        none, one, zero = np.full(c, -1, np.int32), Channel.constant(np.ones(c)), np.zeros(c, np.int32)
        default: dict[str, Any] = dict.fromkeys(("weight", "roughness", "f0", "f90", "edge", "normal", "stretch"), one)
        default |= {"ior": np.zeros(c, np.float32), "distribution": zero, "curve": zero, "layer": none}
        default |= {"fresnel": np.ones(c, bool), "preserves_energy": np.ones(c, bool)}
        default["normal_space"], default["film"] = none, Channel.constant(np.zeros(c))
        return Closures(start=np.asarray(start, np.int32), kind=kind, **default | columns)

    def __len__(self) -> int:
        return len(self.kind)

    @cached_property
    def material(self) -> np.ndarray:
        """The material of each, (c,) int64."""
        return np.repeat(np.arange(len(self.start) - 1), np.diff(self.start))

    @property
    def angles(self) -> AngleCurves:
        """`by_angle`, of no closure where there is none."""
        return self.by_angle or AngleCurves.none(len(self))

    @cached_property
    def stretched(self) -> np.ndarray:
        """Which have facets that are wider along a tangent or narrower, (c,) bool."""
        return (self.stretch.texture >= 0) | (self.stretch.value[:, 0] != 1)

    def count(self, *kinds: Lobe) -> np.ndarray:
        """How many closures of some kinds each material has, (m,) int64."""
        return np.bincount(self.material[np.isin(self.kind, kinds)], minlength=len(self.start) - 1)

    def where(self, chosen: np.ndarray) -> "Closures":
        """Those that a mask (c,) chooses; without a layer where that is not chosen."""
        index = np.append(np.where(chosen, np.cumsum(chosen) - 1, -1), -1)
        ends = np.concatenate([[0], np.cumsum(chosen)])
        apart = ("start", "kind", "layer", "by_angle")
        columns = {f.name: getattr(self, f.name) for f in fields(self) if f.name not in apart}
        taken: dict[str, Any] = {
            name: column.where(chosen) if isinstance(column, Channel) else column[chosen]
            for name, column in columns.items()
        }
        by_angle = AngleCurves(self.angles.of_closure[chosen], self.angles.curves)
        layer = index[self.layer[chosen]].astype(np.int32)
        return Closures.of(ends[self.start], self.kind[chosen], layer=layer, by_angle=by_angle, **taken)


def closures_of_lobes(
    m: int,
    diffuse: Channel | None = None,
    translucent: Channel | None = None,
    f0: Channel | None = None,
    f90: Channel | None = None,
    roughness: Channel | None = None,
    fresnel_ior: np.ndarray | None = None,
    layer_f0: np.ndarray | None = None,
    preserves_energy: np.ndarray | None = None,
    glass_reflection: Channel | None = None,
    glass_transmission: Channel | None = None,
    glass_ior: np.ndarray | None = None,
    glass_fresnel: np.ndarray | None = None,
) -> Closures:
    """Closures of m materials with at most one of each kind; what is black is left out.

    Parameters
    ----------
    diffuse, translucent : Channel
        Albedos of reflection and transmission; black.
    f0, f90, fresnel_ior
        Of the glossy closure, which lies over the diffuse one where `layer_f0` (m,) is above 0; black, by Schlick.
    roughness, preserves_energy
        Of the glossy and the glass closure; 1 and true.
    glass_reflection, glass_transmission, glass_ior, glass_fresnel
        Of the glass closure; black, 1.5 and true.
    """
    none, one = Channel.constant(np.zeros(m)), Channel.constant(np.ones(m))
    no, zero = np.zeros(m, bool), np.zeros(m, np.float32)
    diffuse, translucent, f0, f90 = diffuse or none, translucent or none, f0 or none, f90 or none
    glass_reflection, glass_transmission = glass_reflection or none, glass_transmission or none
    roughness = roughness or one
    fresnel_ior, layer_f0 = zero if fresnel_ior is None else fresnel_ior, zero if layer_f0 is None else layer_f0
    preserves_energy = ~no if preserves_energy is None else preserves_energy
    glass_ior = np.full(m, 1.5, np.float32) if glass_ior is None else glass_ior
    glass_fresnel = ~no if glass_fresnel is None else glass_fresnel
    has_gloss, has_glass = f0.nonzero | f90.nonzero, glass_reflection.nonzero | glass_transmission.nonzero
    lobes: Any = (
        (diffuse.nonzero, diffuse, none, none, zero, no),
        (translucent.nonzero, translucent, none, none, zero, no),
        (has_gloss, one, f0, f90, fresnel_ior, no),
        (has_glass, one, glass_reflection, glass_transmission, glass_ior, glass_fresnel),
    )
    material = np.concatenate([np.flatnonzero(has) for has, *_ in lobes])
    kind = np.repeat(np.arange(len(lobes)), [int(has.sum()) for has, *_ in lobes])
    order = np.argsort(material, kind="stable")
    row = kind[order] * m + material[order]  # of the lobes, one after the other
    material, kind = material[order], kind[order]
    index_of_glossy = np.full(m, -1)
    index_of_glossy[material[kind == Lobe.GLOSSY]] = np.flatnonzero(kind == Lobe.GLOSSY)
    layered = (kind == Lobe.DIFFUSE) & (layer_f0[material] > 0)

    def column(i: int) -> Channel:
        return Channel.join([lobe[i] for lobe in lobes]).where(row)

    return Closures.of(
        start=np.searchsorted(material, np.arange(m + 1)),
        kind=kind,
        weight=column(1),
        roughness=roughness.where(material),
        f0=column(2),
        f90=column(3),
        ior=np.concatenate([lobe[4] for lobe in lobes])[row].astype(np.float32),
        fresnel=np.concatenate([lobe[5] for lobe in lobes])[row],
        preserves_energy=preserves_energy[material],
        layer=np.where(layered, index_of_glossy[material], -1).astype(np.int32),
    )
