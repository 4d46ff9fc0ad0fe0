"""A material's shader nodes as a weighted sum of closures, and what each of them scatters."""

from collections.abc import Callable, Hashable
from dataclasses import dataclass, replace
from functools import reduce
from typing import Any

import bpy
import numpy as np

from ....scene import Lobe
from .angles import ValueAt, curve_of
from .expressions import constant
from .node_math import dielectric_f0, ior_of_f0, saturate
from .nodes import Factor, Place, Value, output_node
from .own_normals import NormalOf, interpolated
from .shaders.broad import add_base, add_diffuse, add_sheen, add_sheet, add_toon
from .shaders.facets import distribution_of, film_of
from .shaders.hair import add_hair, add_principled_hair
from .shaders.layers import add_layers
from .shaders.metal import add_metal, add_metallic
from .shaders.pane import add_pane
from .shaders.subsurface import add_principled_body, add_subsurface_shader
from .stretches import stretch_of
from .sums import ShaderSum, black, white


@dataclass(frozen=True)
class Closure:
    """One shader node and what the Mix Shaders on the way to it multiply it by.

    Attributes
    ----------
    shader : Place
        Its output, or the colour that stands in its place.
    factors : tuple of Factor
    """

    shader: Place
    factors: tuple[Factor, ...] = ()

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


def read_closures(block: "bpy.types.ID", of: str = "Surface") -> list[Closure]:
    """The closures of the surface that Cycles renders, or of the Volume; none where it is black, or empty."""
    output = output_node(block)
    return _closures(Place(output.inputs[of]), ()) if output else []


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
    fixed = constant(factor, view=None)
    found = []
    for shader, inverted in zip(shaders, (True, False), strict=True):
        if fixed is None or Factor(factor, inverted).weight(lambda _: fixed) > 0:
            found += _closures(shader, (*factors, Factor(factor, inverted)))
    return found


@dataclass(frozen=True)
class Leaf:
    """A closure that is being added to a sum.

    `over` names the lowest of the layers that lie over all it adds. `layer` is the Fresnel factor by which a glossy
    closure lies over a diffuse one, or shares its light with a refractive one where `in_glass`; it is not part of
    `weight`. `reflected` is the colour of the glossy closures that share a refractive one's light. `walks` says whether
    light is seen that walked through bodies.
    """

    closure: Closure
    value: Value
    weight: np.ndarray
    layer: Factor | None
    in_glass: bool
    normal_of: NormalOf
    reflected: np.ndarray | None = None
    over: Hashable = None
    walks: bool = True

    def __getitem__(self, identifier: str) -> np.ndarray:
        return self.value(self.closure.shader.input(identifier))

    @property
    def color(self) -> np.ndarray:
        """Its colour, (h, w, 3)."""
        identifier = next((one.identifier for one in self.closure.node.inputs if one.type == "RGBA"), None)
        return saturate(self[identifier]) if identifier else np.full((1, 1, 3), 0.8, np.float32)

    @property
    def weighted(self) -> np.ndarray:
        """Weight × colour, (h, w, 3)."""
        return self.weight * self.color

    @property
    def facets(self) -> dict[str, Any]:
        """What says of a term how its facets are, which way they face, and what lies over them."""
        node, own = self.closure.node, self.normal()
        keeps_energy = node.distribution == "MULTI_GGX"
        own |= {"roughness": self.roughness, "under": self.over}
        return {"distribution": distribution_of(node), "keeps_energy": keeps_energy, **own}

    @property
    def reflecting_facets(self) -> dict[str, Any]:
        """The same of a glossy term, whose facets alone are stretched."""
        return self.facets | {"stretch": stretch_of(self.closure.kind, self.__getitem__)}

    @property
    def film(self) -> np.ndarray:
        return film_of(self.closure.node, self.__getitem__)

    @property
    def roughness(self) -> np.ndarray:
        return saturate(self["Roughness"])

    @property
    def ior(self) -> float:
        return max(float(self["IOR"].mean()), 1e-5)

    @property
    def is_thin(self) -> bool:
        """Whether a Principled shader (from 5.2) is of a pane, not of a solid."""
        return "Thin Wall" in self.closure.node.inputs and bool(self["Thin Wall"].any())

    def normal(self, identifier: str = "Normal") -> dict[str, object]:
        """The normal of one of its sockets as `Term` has it."""
        socket = next((one for one in self.closure.node.inputs if one.identifier == identifier), None)
        own = self.normal_of(Place(socket, self.closure.shader.groups)) if socket else None
        return {"normal": own.vector, "normal_space": int(own.space)} if own else {}

    def add_glossy(
        self,
        total: ShaderSum,
        weight: np.ndarray,
        f0: np.ndarray,
        f90: np.ndarray,
        ior: float = 0.0,
        covers: "Place | Closure | None" = None,
        film: np.ndarray | None = None,
    ) -> None:
        """Add a glossy closure with the node's facets, by Schlick's curve without `ior`; see `Term`."""
        film = black() if film is None else film
        total.add(Lobe.GLOSSY, weight, f0=f0, f90=f90, ior=ior, covers=covers, film=film, **self.reflecting_facets)

    def add_glass(
        self,
        total: ShaderSum,
        weight: np.ndarray,
        reflection: np.ndarray,
        transmission: np.ndarray,
        fresnel: bool = True,
    ) -> None:
        """Add a glass closure with the node's facets and index of refraction."""
        colors = {"f0": reflection, "f90": transmission, "film": self.film if fresnel else black()}
        total.add(Lobe.GLASS, weight, fresnel=fresnel, ior=self.ior, **colors, **self.facets)


def combine(
    closures: list[Closure],
    value: Value,
    normal_of: NormalOf = interpolated,
    value_at: ValueAt = lambda *_: None,
    walks: bool = True,
) -> ShaderSum:
    """The sum of closures.

    A mix of a diffuse with a glossy shader by Fresnel's curve, as materials were built before Principled, is read as
    what it means, a glossy layer over a diffuse base; one of refraction and gloss is glass. Any other closure that is
    mixed by the angle gets the factor's curve, by `value_at`. Emission, and what is mixed with transparency by the
    angle, get its mean over the hemisphere.
    """
    over = _layers([one for one in closures if one.kind == "BSDF_GLOSSY"], inverted=False)
    coated = over & _layers([one for one in closures if _is_diffuse(one)], inverted=True)
    glass = over & _layers([one for one in closures if one.kind == "BSDF_REFRACTION"], inverted=True) - coated
    leaves, curves, averaged = [], [], _averaged(closures, value_at)
    for closure in closures:
        layers = {"BSDF_GLOSSY": coated | glass, "BSDF_REFRACTION": glass}.get(closure.kind, set())
        layers = coated if _is_diffuse(closure) else layers
        layer = next((one for one in closure.factors if one.place in layers), None)
        turned, curve = curve_of(closure.factors, value_at, layers | averaged)
        weight = closure.weight(value, layers | set(turned))
        if (weight > 0).any():
            curves.append(curve)
            in_glass = layer is not None and layer.place in glass
            leaves.append(Leaf(closure, value, weight, layer, in_glass, normal_of, walks=walks))
    reflected: dict[Place, np.ndarray] = {}
    for leaf in leaves:
        if leaf.layer and leaf.in_glass and leaf.closure.kind == "BSDF_GLOSSY":
            reflected[leaf.layer.place] = reflected.get(leaf.layer.place, black()) + leaf.weighted
    total = ShaderSum()
    for leaf, total.by_angle in zip(leaves, curves, strict=True):
        leaf = replace(leaf, reflected=reflected.get(leaf.layer.place) if leaf.layer else None)
        ADDERS.get(leaf.closure.kind, _add_diffuse)(leaf, total)
    return total


def _averaged(closures: list[Closure], value_at: ValueAt) -> set[Place]:
    """The sockets of factors whose mean over the angle counts.

    They are those of emission and of what light passes straight, and all where light is both reflected and transmitted
    broadly: a cache knows the sum of the two.
    """
    passing = [one for one in closures if one.kind in {"BSDF_TRANSPARENT", "EMISSION", "BACKGROUND", "COLOR"}]
    kinds = {one.kind for one in closures}
    if "BSDF_TRANSLUCENT" in kinds and ("BSDF_PRINCIPLED" in kinds or any(map(_is_diffuse, closures))):
        passing = closures
    return {place for closure in passing for place in curve_of(closure.factors, value_at, set())[0]}


def _layers(closures: list[Closure], inverted: bool) -> set[Place]:
    """The Fresnel factors of closures that are the second of two mixed shaders, or the first where inverted."""
    return {
        factor.place
        for closure in closures
        for factor in closure.factors
        if factor.inverted == inverted and factor.fresnel is not None
    }


def _is_diffuse(closure: Closure) -> bool:
    return closure.kind not in ADDERS or closure.kind in {"BSDF_DIFFUSE", "SUBSURFACE_SCATTERING"}


def _add_diffuse(leaf: Leaf, total: ShaderSum) -> None:
    total.add(Lobe.DIFFUSE, leaf.weighted, under=leaf.layer and leaf.layer.place, **leaf.normal())


def _add_translucent(leaf: Leaf, total: ShaderSum) -> None:
    total.add(Lobe.TRANSLUCENT, leaf.weighted, **leaf.normal())


def _add_transparent(leaf: Leaf, total: ShaderSum) -> None:
    total.transparent = total.transparent + leaf.weighted


def _add_emission(leaf: Leaf, total: ShaderSum, color: str = "Color", strength: str = "Strength") -> None:
    radiance = leaf[strength] * leaf.weight  # negative light takes light away
    if radiance.any():
        total.emission = total.emission + radiance * leaf[color]


def _add_color(leaf: Leaf, total: ShaderSum) -> None:
    total.emission = total.emission + leaf.weight * leaf.value(leaf.closure.shader)


def _add_glossy(leaf: Leaf, total: ShaderSum) -> None:
    if leaf.layer is None:
        leaf.add_glossy(total, leaf.weight, leaf.color, leaf.color)
    elif not leaf.in_glass:  # what glass reflects is added with what it refracts
        ior = leaf.layer.ior(leaf.value)
        f0 = white() * dielectric_f0(np.array(ior, np.float32))
        leaf.add_glossy(total, leaf.weighted, f0, white(), ior=ior, covers=leaf.layer.place)


def _add_glass(leaf: Leaf, total: ShaderSum) -> None:
    leaf.add_glass(total, leaf.weight, leaf.color, leaf.color)


def _add_refraction(leaf: Leaf, total: ShaderSum) -> None:
    reflection = black() if leaf.reflected is None else leaf.reflected / np.maximum(leaf.weight, np.float32(1e-6))
    leaf.add_glass(total, leaf.weight, reflection, leaf.color, fresnel=leaf.in_glass)


def _add_principled(leaf: Leaf, total: ShaderSum) -> None:
    """Cycles' order: what alpha lets through, sheen, coat, emission, metal, glass, a dielectric layer over diffuse."""
    alpha = saturate(leaf["Alpha"])
    total.transparent = total.transparent + leaf.weight * (1 - alpha)
    weight = leaf.weight * alpha
    over, left = add_layers(replace(leaf, weight=weight), total)
    leaf = replace(leaf, over=over)
    _add_emission(replace(leaf, weight=weight * left), total, "Emission Color", "Emission Strength")
    base, metallic = saturate(leaf["Base Color"]), saturate(leaf["Metallic"])
    if metallic.any():
        add_metal(leaf, total, weight * metallic, base, leaf["Specular Tint"])
    weight = weight * (1 - metallic)
    transmission = saturate(leaf["Transmission Weight"]) if weight.any() else np.zeros((1, 1, 1), np.float32)
    if transmission.any():
        part = replace(leaf, weight=weight * transmission)
        if leaf.is_thin:
            add_pane(part, total, base, left)
        else:
            part.add_glass(total, part.weight, white(), np.sqrt(base))
    weight = weight * (1 - transmission)
    if weight.any():
        under, ior = _add_dielectric(replace(leaf, weight=weight), total)
        if leaf.is_thin:
            weight = add_sheet(leaf, total, weight, base, under)
        else:
            weight = add_principled_body(leaf, total, weight, base, ior, under)
        add_base(leaf, total, weight * base, base, "Diffuse Roughness", under)


def _add_dielectric(leaf: Leaf, total: ShaderSum) -> tuple[Hashable, float]:
    """The specular layer of Principled; the name of what lies over the base, and the layer's index of refraction."""
    level = np.maximum(leaf["Specular IOR Level"], 0)
    f0 = saturate(2 * level * dielectric_f0(np.maximum(leaf["IOR"], 1e-5)))
    film, eta = leaf.film, float(ior_of_f0(f0).mean())
    if f0.any() or film.any():
        tint = np.maximum(leaf["Specular Tint"], 0)
        f90 = white() * ((f0 > 0) | (film[..., :1] > 0))
        leaf.add_glossy(total, leaf.weight, saturate(f0 * tint), f90, ior=eta, covers=leaf.closure, film=film)
        return leaf.closure, eta
    return leaf.over, eta


ADDERS: dict[str, Callable[[Leaf, ShaderSum], None]] = {
    "BSDF_PRINCIPLED": _add_principled,
    "BSDF_DIFFUSE": add_diffuse,
    "BSDF_SHEEN": add_sheen,
    "BSDF_TOON": add_toon,
    "SUBSURFACE_SCATTERING": add_subsurface_shader,
    "BSDF_HAIR": add_hair,
    "BSDF_HAIR_PRINCIPLED": add_principled_hair,
    "BSDF_GLOSSY": _add_glossy,
    "BSDF_METALLIC": add_metallic,
    "BSDF_GLASS": _add_glass,
    "BSDF_REFRACTION": _add_refraction,
    "BSDF_TRANSLUCENT": _add_translucent,
    "BSDF_TRANSPARENT": _add_transparent,
    "EMISSION": _add_emission,
    "BACKGROUND": _add_emission,
    "COLOR": _add_color,
    "HOLDOUT": lambda leaf, total: None,
}
"""How a shader node is added to the sum; any other one counts as diffuse."""
