"""A material's shader nodes as a weighted sum of closures, and that sum as scattering lobes."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import reduce
from math import log

import bpy
import numpy as np

from .expressions import constant
from .lobes import Lobes, black
from .node_math import dielectric_f0, ior_of_f0, mean_of_pane, saturate
from .nodes import Place, output_node

Value = Callable[[Place], np.ndarray]
"""Evaluates a socket, (h, w, 1 or 3) float32; h = w = 1 where it is constant."""


BECKMANN_AS_GGX = log(2) ** 0.25
"""A GGX lobe of this share of the roughness, 0.91, stands for a Beckmann lobe: facets have the same median slope.

P(tan θ < t) is 1 − exp(−t²/α²) for Beckmann's facets and t²/(α² + t²) for GGX's, with the medians α √ln 2 and α. The
width α is the square of the roughness.
"""


@dataclass(frozen=True)
class Factor:
    """What one Mix Shader multiplies a closure by.

    Attributes
    ----------
    place : Place
        The factor's socket.
    inverted : bool
        Whether 1 − factor counts: for the first of the two shaders.
    """

    place: Place
    inverted: bool

    @property
    def fresnel(self) -> Place | None:
        """The index of refraction, or a Layer Weight's blend, where the factor is Fresnel's curve."""
        origin = self.place.origin
        node = origin.socket.node
        if node.type == "FRESNEL":
            return origin.input("IOR")
        if node.type == "LAYER_WEIGHT" and origin.socket.identifier == "Fresnel":
            return origin.input("Blend")
        return None

    def ior(self, value: Value) -> float:
        """The index of refraction of a Fresnel factor, averaged over the surface."""
        place = self.fresnel
        assert place is not None
        of_node = float(value(place).mean())
        is_blend = place.socket.node.type == "LAYER_WEIGHT"
        return 1 / max(1 - of_node, 1e-5) if is_blend else max(of_node, 1e-5)

    def weight(self, value: Value) -> np.ndarray:
        """The factor in [0, 1], (h, w, 1)."""
        factor = saturate(value(self.place))
        return 1 - factor if self.inverted else factor


@dataclass(frozen=True)
class Closure:
    """One shader node and what the Mix Shaders on the way to it multiply it by.

    Attributes
    ----------
    shader : Place
        Its output, or the colour that stands in its place.
    factors : tuple of Factor
    for_shadows : bool
        Whether in Cycles only shadow rays see it.
    """

    shader: Place
    factors: tuple[Factor, ...] = ()
    for_shadows: bool = False

    @property
    def node(self) -> "bpy.types.Node":
        return self.shader.socket.node

    @property
    def kind(self) -> str:
        """Type of the shader node; a colour or number in a shader's place is light, as Cycles has it."""
        return self.node.type if self.shader.socket.type == "SHADER" else "COLOR"

    def weight(self, value: Value, without: set[Place]) -> np.ndarray:
        """Product of the factors, except those of some sockets, (h, w, 1)."""
        weights = [one.weight(value) for one in self.factors if one.place not in without]
        return reduce(np.multiply, weights, np.ones((1, 1, 1), np.float32))


def read_closures(material: "bpy.types.Material") -> list[Closure]:
    """The closures of the surface that Cycles renders; none where it is black."""
    output = output_node(material)
    return _closures(Place(output.inputs["Surface"]), ()) if output else []


def _closures(place: Place, factors: tuple[Factor, ...]) -> list[Closure]:
    origin = place.origin
    node = origin.socket.node
    if origin.socket.is_output and node.type == "GROUP":  # an empty group
        return []
    if origin.socket.type != "SHADER":
        return [Closure(origin, factors)]
    if not origin.socket.is_output:
        return []
    if node.type not in {"MIX_SHADER", "ADD_SHADER"}:
        return [Closure(origin, factors)]
    shaders = [Place(one, origin.groups) for one in node.inputs if one.type == "SHADER"]
    if node.type == "ADD_SHADER":
        return [closure for shader in shaders for closure in _closures(shader, factors)]
    factor = origin.input("Fac")
    if _is_shadow_trick(factor, shaders):
        return [replace(closure, for_shadows=True) for closure in _closures(shaders[1], factors)]
    fixed = constant(factor)
    found = []
    for shader, inverted in zip(shaders, (True, False), strict=True):
        if fixed is None or Factor(factor, inverted).weight(lambda _: fixed) > 0:
            found += _closures(shader, (*factors, Factor(factor, inverted)))
    return found


def _is_shadow_trick(factor: Place, shaders: list[Place]) -> bool:
    """Whether a material lets light of lamps through and blocks the rest, or the other way round.

    What lamps' light meets counts then for all light: it is most of it.
    """
    origin = factor.origin.socket
    asks = origin.is_output and origin.node.type == "LIGHT_PATH" and origin.identifier == "Is Shadow Ray"
    return asks and any(shader.origin.socket.node.type == "BSDF_TRANSPARENT" for shader in shaders)


@dataclass(frozen=True)
class _Leaf:
    """A closure that is being added to a sum.

    `layer` is the Fresnel factor by which a glossy closure lies over a diffuse one, or shares its light with a
    refractive one where `in_glass`; it is not part of `weight`.
    """

    closure: Closure
    value: Value
    weight: np.ndarray
    layer: Factor | None
    in_glass: bool

    def __getitem__(self, identifier: str) -> np.ndarray:
        return self.value(self.closure.shader.input(identifier))

    @property
    def color(self) -> np.ndarray:
        """Weight × colour, (h, w, 3)."""
        identifier = next((one.identifier for one in self.closure.node.inputs if one.type == "RGBA"), None)
        return self.weight * (saturate(self[identifier]) if identifier else np.full((1, 1, 3), 0.8, np.float32))

    @property
    def roughness(self) -> np.ndarray:
        narrowed = BECKMANN_AS_GGX if self.closure.node.distribution == "BECKMANN" else 1
        return saturate(self["Roughness"]) * np.float32(narrowed)

    @property
    def ior(self) -> float:
        return max(float(self["IOR"].mean()), 1e-5)

    @property
    def is_thin(self) -> bool:
        """Whether a Principled shader (from 5.2) is of a pane, not of a solid."""
        return "Thin Wall" in self.closure.node.inputs and bool(self["Thin Wall"].any())

    @property
    def keeps_energy(self) -> bool:
        return bool(self.closure.node.distribution in {"MULTI_GGX", "BECKMANN"})


def combine(closures: list[Closure], value: Value) -> Lobes:
    """The sum of closures.

    A mix of a diffuse with a glossy shader by Fresnel's curve, as materials were built before Principled, is read as
    what it means, a glossy layer over a diffuse base; one of refraction and gloss is glass. Any other shader that is
    mixed by the angle gets the factor's mean over the hemisphere.
    """
    over = _layers([one for one in closures if one.kind == "BSDF_GLOSSY"], inverted=False)
    coated = over & _layers([one for one in closures if _is_diffuse(one)], inverted=True)
    glass = over & _layers([one for one in closures if one.kind == "BSDF_REFRACTION"], inverted=True) - coated
    lobes = Lobes()
    for closure in closures:
        layers = {"BSDF_GLOSSY": coated | glass, "BSDF_REFRACTION": glass}.get(closure.kind, set())
        layers = coated if _is_diffuse(closure) else layers
        layer = next((one for one in closure.factors if one.place in layers), None)
        weight = closure.weight(value, layers)
        if (weight > 0).any():
            leaf = _Leaf(closure, value, weight, layer, layer is not None and layer.place in glass)
            ADDERS.get(closure.kind, _add_diffuse)(leaf, lobes)
    return lobes


def _layers(closures: list[Closure], inverted: bool) -> set[Place]:
    """The Fresnel factors of closures that are the second of two mixed shaders, or the first where inverted."""
    return {
        factor.place
        for closure in closures
        for factor in closure.factors
        if factor.inverted == inverted and factor.fresnel is not None
    }


def _is_diffuse(closure: Closure) -> bool:
    return closure.kind not in ADDERS or closure.kind == "BSDF_DIFFUSE"


def _add_diffuse(leaf: _Leaf, lobes: Lobes) -> None:
    lobes.diffuse = lobes.diffuse + leaf.color


def _add_translucent(leaf: _Leaf, lobes: Lobes) -> None:
    lobes.translucent = lobes.translucent + leaf.color


def _add_transparent(leaf: _Leaf, lobes: Lobes) -> None:
    lobes.transparent = lobes.transparent + leaf.color


def _add_emission(leaf: _Leaf, lobes: Lobes, color: str = "Color", strength: str = "Strength") -> None:
    radiance = leaf[strength] * leaf.weight  # negative light takes light away
    if radiance.any():
        lobes.emission = lobes.emission + radiance * leaf[color]


def _add_color(leaf: _Leaf, lobes: Lobes) -> None:
    lobes.emission = lobes.emission + leaf.weight * leaf.value(leaf.closure.shader)


def _add_glossy(leaf: _Leaf, lobes: Lobes) -> None:
    color = leaf.color
    if leaf.layer is None:
        lobes.add_glossy(color, color, leaf.roughness, 0.0, leaf.keeps_energy)
    elif leaf.in_glass:
        lobes.glass_reflection = lobes.glass_reflection + color
    else:
        ior = leaf.layer.ior(leaf.value)
        f0 = float(dielectric_f0(np.array(ior)))
        lobes.layer_f0 = max(lobes.layer_f0, f0)
        lobes.add_glossy(f0 * color, color, leaf.roughness, ior, leaf.keeps_energy)


def _add_metal(leaf: _Leaf, lobes: Lobes) -> None:
    if leaf.closure.node.fresnel_type == "F82":
        f0 = saturate(leaf["Base Color"])
    else:
        n, k = leaf["IOR"], leaf["Extinction"]
        f0 = ((n - 1) ** 2 + k**2) / ((n + 1) ** 2 + k**2)
    white = np.ones((1, 1, 3), np.float32)
    lobes.add_glossy(leaf.weight * f0, leaf.weight * white, leaf.roughness, 0.0, leaf.keeps_energy)


def _add_glass(leaf: _Leaf, lobes: Lobes) -> None:
    color = leaf.color
    lobes.add_glass(color, color, leaf.roughness, leaf.ior, True, leaf.keeps_energy)


def _add_refraction(leaf: _Leaf, lobes: Lobes) -> None:
    lobes.add_glass(black(), leaf.color, leaf.roughness, leaf.ior, leaf.in_glass, leaf.keeps_energy)


def _add_principled(leaf: _Leaf, lobes: Lobes) -> None:
    """Cycles' order: what alpha lets through, emission, metal, glass, and a dielectric layer over diffuse."""
    alpha = saturate(leaf["Alpha"])
    lobes.transparent = lobes.transparent + leaf.weight * (1 - alpha)
    weight = leaf.weight * alpha
    _add_emission(replace(leaf, weight=weight), lobes, "Emission Color", "Emission Strength")
    base, metallic = saturate(leaf["Base Color"]), saturate(leaf["Metallic"])
    if metallic.any():
        metal = weight * metallic
        lobes.add_glossy(metal * base, metal, leaf.roughness, 0.0, leaf.keeps_energy)
    weight = weight * (1 - metallic)
    transmission = saturate(leaf["Transmission Weight"]) if weight.any() else np.zeros((1, 1, 1), np.float32)
    if transmission.any():
        add = _add_pane if leaf.is_thin else _add_principled_glass
        add(replace(leaf, weight=weight * transmission), lobes, base)
    weight = weight * (1 - transmission)
    if weight.any():
        _add_dielectric(replace(leaf, weight=weight), lobes)
        lobes.diffuse = lobes.diffuse + weight * base


def _add_principled_glass(leaf: _Leaf, lobes: Lobes, base: np.ndarray) -> None:
    tint = leaf.weight * np.sqrt(base)
    lobes.add_glass(leaf.weight, tint, leaf.roughness, leaf.ior, True, leaf.keeps_energy)


def _add_pane(leaf: _Leaf, lobes: Lobes, base: np.ndarray) -> None:
    """Glass with a thin wall: mean reflection, and the rest straight through, or scattered as it is rough."""
    reflectance, way = mean_of_pane(leaf.ior)
    mirror = leaf.weight * np.full((1, 1, 3), reflectance, np.float32)
    lobes.add_glossy(mirror, mirror, leaf.roughness, 0.0, leaf.keeps_energy)
    passing = leaf.weight * (1 - reflectance) * base**way
    lobes.transparent = lobes.transparent + passing * (1 - leaf.roughness)
    lobes.translucent = lobes.translucent + passing * leaf.roughness


def _add_dielectric(leaf: _Leaf, lobes: Lobes) -> None:
    """The specular layer of Principled."""
    level = np.maximum(leaf["Specular IOR Level"], 0)
    f0 = saturate(2 * level * dielectric_f0(np.maximum(leaf["IOR"], 1e-5)))
    if f0.any():
        tint = np.maximum(leaf["Specular Tint"], 0)
        eta = float(ior_of_f0(f0).mean())
        lobes.layer_f0 = max(lobes.layer_f0, float((f0 * tint).max(axis=2).mean()))
        lobes.add_glossy(
            leaf.weight * saturate(f0 * tint), leaf.weight * (f0 > 0), leaf.roughness, eta, leaf.keeps_energy
        )


ADDERS: dict[str, Callable[[_Leaf, Lobes], None]] = {
    "BSDF_PRINCIPLED": _add_principled,
    "BSDF_DIFFUSE": _add_diffuse,
    "BSDF_GLOSSY": _add_glossy,
    "BSDF_METALLIC": _add_metal,
    "BSDF_GLASS": _add_glass,
    "BSDF_REFRACTION": _add_refraction,
    "BSDF_TRANSLUCENT": _add_translucent,
    "BSDF_TRANSPARENT": _add_transparent,
    "EMISSION": _add_emission,
    "BACKGROUND": _add_emission,
    "COLOR": _add_color,
    "HOLDOUT": lambda leaf, lobes: None,
}
"""How a shader node is added to the sum; any other one counts as diffuse."""
