"""What the Volume of a material or a world says: coefficients and phase functions, as Cycles has them."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from math import prod

import bpy
import numpy as np

from ....bsdf.phase.functions import PhaseFunction, draine, fournier_forand, mie, rayleigh, rings_of
from ....scene import Medium, VoxelGrid
from ..materials.closures import Closure, read_closures
from ..materials.expressions import constant
from ..materials.nodes import Place, all_nodes, output_node, source, uses_nodes

Parts = tuple[np.ndarray, np.ndarray]
"""Coefficients of absorption and scattering, (1 or n, 3) each, 1/m."""

_DENSEST = 1e9
"""More, 1/m, would be as opaque; products of it stay finite."""

_SAME_COLOR = 0.02
"""Coefficients that differ by less of the greatest from those of one colour and a density need no word."""


@dataclass(frozen=True)
class VolumeShader:
    """The shaders on the Volume of a material or a world, all of which are media.

    Attributes
    ----------
    block : bpy.types.Material or bpy.types.World
        Original, not evaluated.
    closures : tuple of Closure
    """

    block: "bpy.types.ID"
    closures: tuple[Closure, ...]

    @staticmethod
    def of(block: "bpy.types.ID") -> "VolumeShader | None":
        """That of a material or a world; None where it has none, or one that is not baked (`volume_shortcomings`)."""
        if not has_volume(block) or any(volume_shortcomings(block)):
            return None
        return VolumeShader(block.original, tuple(read_closures(block, "Volume")))

    @cached_property
    def varying(self) -> list[Place]:
        """The sockets whose values differ from place to place."""
        return _varying(self.closures)

    @property
    def grids(self) -> set[str]:
        """The names of grids that it may read of a volume object."""
        nodes = all_nodes(self.block.node_tree)
        named = {node.attribute_name for node in nodes if node.type == "ATTRIBUTE"}
        return named | {"density"} | {_density_grid(closure) for closure in self.closures}

    def at_voxels(
        self, value: Callable[[Place], np.ndarray], voxels: Mapping[str, np.ndarray]
    ) -> dict[Place, np.ndarray]:
        """What its sockets are by their values, (n, 1, 1 or 3) of voxels or (1, 1, 1 or 3), and by grids, (n,) each."""
        values = {}
        for closure in self.closures:
            for place in _places(closure):
                values[place] = value(place).reshape(-1, value(place).shape[-1])
            grid = voxels.get(_density_grid(closure))
            if grid is not None:
                density = closure.shader.input("Density")
                values[density] = values[density] * grid[:, None]
        return values

    def medium(self) -> Medium | None:
        """The medium that is the same everywhere; None where it is empty."""
        parts, lobes = self._read({})
        return _medium([part[0] for part in parts], lobes, None)

    def medium_in(
        self, values: Mapping[Place, np.ndarray], shape: tuple[int, ...], grid_from_world: np.ndarray
    ) -> tuple[Medium | None, bool]:
        """The medium by what the sockets that differ are in the cells of a lattice, (n, 1 or 3), in C order.

        Its coefficients have one colour, the mean by density; also tells whether that is what each cell has.
        """
        (absorption, scattering), lobes = self._read(values)
        by_cell = np.concatenate([np.broadcast_to(part, (prod(shape), 3)) for part in (absorption, scattering)], 1)
        by_cell = np.nan_to_num(by_cell, posinf=_DENSEST)
        density = by_cell.sum(axis=1)
        if not density.any():
            return None, True
        density /= density.max()
        coefficients = by_cell.sum(axis=0) / density.sum()
        off = np.abs(by_cell - density[:, None] * coefficients).max()
        grid = VoxelGrid(density.reshape(shape).astype(np.float32), grid_from_world.astype(np.float32))
        return _medium([coefficients[:3], coefficients[3:]], lobes, grid), off <= _SAME_COLOR * coefficients.max()

    def _read(self, values: Mapping[Place, np.ndarray]) -> "tuple[Parts, list[_Lobe]]":
        """The coefficients of all shaders together, and the phase function of each."""
        total: Parts = np.zeros((1, 3)), np.zeros((1, 3))
        lobes = []
        for closure in self.closures:
            leaf = _Leaf(closure, values)
            absorption, scattering = _COEFFICIENTS[closure.kind](leaf)
            share = leaf.share
            added = np.maximum(share * absorption, 0), np.maximum(share * scattering, 0)
            total = total[0] + added[0], total[1] + added[1]
            lobes.append(_Lobe.of(leaf, float(added[1].mean())))
        return total, [lobe for lobe in lobes if lobe.weight > 0]


@dataclass(frozen=True)
class _Leaf:
    """A volume shader's values, each (1 or n, 1 or 3) float64."""

    closure: Closure
    values: Mapping[Place, np.ndarray]

    def __getitem__(self, identifier: str) -> np.ndarray:
        return self.at(self.closure.shader.input(identifier))

    def at(self, place: Place) -> np.ndarray:
        """The value of a socket."""
        value = self.values.get(place)
        if value is None:
            value = constant(place)
        assert value is not None
        return np.asarray(value, np.float64).reshape(-1, np.shape(value)[-1])

    def mean(self, identifier: str) -> float:
        """The mean of a number."""
        return float(self[identifier].mean())

    @property
    def share(self) -> np.ndarray:
        """Product of the shares of the Mix Shaders on the way to it, (1 or n, 1)."""
        weight = self.closure.weight(lambda place: self.at(place)[None], set())
        return np.asarray(weight, np.float64).reshape(-1, 1)

    @property
    def density(self) -> np.ndarray:
        return np.maximum(self["Density"], 0)


@dataclass(frozen=True)
class _Lobe:
    """A phase function, by how much is scattered by it; `g` of Henyey and Greenstein's, else None."""

    weight: float
    g: float | None
    function: PhaseFunction

    @staticmethod
    def of(leaf: _Leaf, weight: float) -> "_Lobe":
        """That of a volume shader."""
        kind = getattr(leaf.closure.node, "phase", "HENYEY_GREENSTEIN")
        if kind == "RAYLEIGH":
            return _Lobe(weight, None, rayleigh())
        if kind == "MIE":
            return _Lobe(weight, None, mie(leaf.mean("Diameter")))
        if kind == "FOURNIER_FORAND":
            return _Lobe(weight, None, fournier_forand(leaf.mean("IOR"), leaf.mean("Backscatter")))
        has_g = "Anisotropy" in leaf.closure.node.inputs
        g = float(np.clip(leaf.mean("Anisotropy"), -0.999, 0.999)) if has_g else 0.0
        if kind == "DRAINE":
            return _Lobe(weight, None, draine(g, max(leaf.mean("Alpha"), 0)))
        return _Lobe(weight, g, draine(g))


def _medium(coefficients: list[np.ndarray], lobes: list[_Lobe], density: VoxelGrid | None) -> Medium | None:
    """A medium of coefficients (3,) of absorption and scattering that is scattered by some phase functions."""
    absorption, scattering = (np.minimum(part, _DENSEST).astype(np.float32) for part in coefficients)
    if not absorption.any() and not scattering.any():
        return None
    gs = {lobe.g for lobe in lobes}
    if len(gs) <= 1 and None not in gs:
        return Medium(absorption, scattering, next(iter(gs), 0.0) or 0.0, None, density)
    weights = np.array([lobe.weight for lobe in lobes])
    weights /= weights.sum()
    rings = rings_of(lambda v: sum(w * lobe.function(v) for w, lobe in zip(weights, lobes, strict=True)))
    return Medium(absorption, scattering, float(1 - rings.mean()), rings, density)


def has_volume(block: "bpy.types.ID") -> bool:
    """Whether anything is linked to the Volume of a material or a world."""
    output = output_node(block) if uses_nodes(block) else None
    return bool(output and source(output.inputs["Volume"]))


def volume_shortcomings(block: "bpy.types.ID") -> Iterator[str]:
    """Half sentences about why a volume is not baked."""
    closures = read_closures(block, "Volume") if has_volume(block) else []
    for closure in closures:
        if closure.kind not in _COEFFICIENTS:
            yield f"its volume is not baked, as its {closure.node.bl_label} is no medium that absorbs or scatters"
            return
    if isinstance(block, bpy.types.World) and _varying(closures):
        yield "its volume is not baked, as it differs from place to place"


def volume_differences(block: "bpy.types.ID") -> Iterator[str]:
    """Half sentences about what of a volume is not baked that is baked otherwise."""
    if has_volume(block) and any(_emits(closure) for closure in read_closures(block, "Volume")):
        yield "the light that its volume emits is not baked"


_READ = {"Color", "Density", "Anisotropy", "Absorption Color", "Absorption Coefficients", "Scatter Coefficients"}
_READ |= {"IOR", "Backscatter", "Alpha", "Diameter"}


def _varying(closures: "tuple[Closure, ...] | list[Closure]") -> list[Place]:
    """The sockets of volume shaders, and of what they are mixed by, whose values are not constant."""
    places = dict.fromkeys(place for closure in closures for place in _places(closure))
    return [place for place in places if constant(place) is None]


def _places(closure: Closure) -> Iterator[Place]:
    """The sockets of a volume shader, and of what it is mixed by, that say what medium it is."""
    yield from (closure.shader.input(one.identifier) for one in closure.node.inputs if one.identifier in _READ)
    yield from (factor.place for factor in closure.factors)


def _density_grid(closure: Closure) -> str:
    """The grid that a volume shader multiplies its density by, without a node that reads it; empty for none."""
    attribute = closure.node.inputs.get("Density Attribute")
    return attribute.default_value if attribute is not None else ""


def _absorption(leaf: _Leaf) -> Parts:
    return leaf.density * (1 - leaf["Color"]), np.zeros((1, 3))


def _scatter(leaf: _Leaf) -> Parts:
    return np.zeros((1, 3)), leaf.density * leaf["Color"]


def _principled(leaf: _Leaf) -> Parts:
    density, color, tint = leaf.density, leaf["Color"], np.sqrt(np.maximum(leaf["Absorption Color"], 0))
    return density * np.maximum(1 - color, 0) * np.maximum(1 - tint, 0), density * color


def _by_coefficients(leaf: _Leaf) -> Parts:
    return leaf["Absorption Coefficients"], leaf["Scatter Coefficients"]


def _nothing(leaf: _Leaf) -> Parts:
    return np.zeros((1, 3)), np.zeros((1, 3))


_COEFFICIENTS: dict[str, Callable[[_Leaf], Parts]] = {
    "VOLUME_ABSORPTION": _absorption,
    "VOLUME_SCATTER": _scatter,
    "PRINCIPLED_VOLUME": _principled,
    "VOLUME_COEFFICIENTS": _by_coefficients,
    "EMISSION": _nothing,
}


def _emits(closure: Closure) -> bool:
    """Whether a volume shader may emit light."""
    if closure.kind == "EMISSION":
        return True
    strengths = ("Emission Strength", "Blackbody Intensity", "Emission Coefficients")
    for name in strengths:
        if name in closure.node.inputs:
            value = constant(closure.shader.input(closure.node.inputs[name].identifier))
            if value is None or np.any(value > 0):
                return True
    return False
