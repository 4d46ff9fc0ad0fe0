"""What a material's shader nodes add up to: terms of one closure each, and from them the channels of `Materials`."""

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ....scene import Distribution, FibreModel, FresnelCurve, Lobe
from .node_math import saturate


def black() -> np.ndarray:
    """No light, (1, 1, 3)."""
    return np.zeros((1, 1, 3), np.float32)


def white() -> np.ndarray:
    """All light, (1, 1, 3)."""
    return np.ones((1, 1, 3), np.float32)


def rough() -> np.ndarray:
    """Full roughness, (1, 1, 1)."""
    return np.ones((1, 1, 1), np.float32)


_SHEEN = 0.2
"""What sheen reflects of the light from everywhere, about."""


@dataclass(frozen=True)
class Term:
    """One closure, as `Closures` holds it in a row.

    Attributes
    ----------
    kind : Lobe
    weight, f0, f90, roughness, edge, film, stretch : (h, w, 1 or 3) float32
        h = w = 1 where constant.
    ior, fresnel, keeps_energy, distribution, curve
        As those of `Closures`.
    normal, normal_space
        Its own normal as `Closures` has it; −1 for none.
    covers, under : hashable, optional
        By what name this one is a layer, and the name of the layer that lies over it.
    by_angle : tuple of float
        What the weight is multiplied by at `angle_cosines`; empty where that is 1.
    """

    kind: Lobe
    weight: np.ndarray
    f0: np.ndarray = field(default_factory=black)
    f90: np.ndarray = field(default_factory=black)
    roughness: np.ndarray = field(default_factory=rough)
    ior: float = 0.0
    fresnel: bool = True
    keeps_energy: bool = True
    normal: np.ndarray = field(default_factory=white)
    normal_space: int = -1
    covers: Hashable = None
    under: Hashable = None
    by_angle: tuple[float, ...] = ()
    distribution: Distribution | FibreModel = Distribution.GGX
    curve: FresnelCurve = FresnelCurve.DIELECTRIC
    edge: np.ndarray = field(default_factory=white)
    film: np.ndarray = field(default_factory=black)
    stretch: np.ndarray = field(default_factory=white)

    @property
    def scatters(self) -> bool:
        """Whether it scatters any light."""
        rough = self.kind in (Lobe.GLOSSY, Lobe.GLASS, Lobe.SHEEN)
        return bool(self.weight.any()) and (not rough or any(one.any() for one in (self.f0, self.f90, self.film)))

    @property
    def scattered(self) -> np.ndarray:
        """What it scatters of the light, about, (h, w, 3)."""
        if self.kind == Lobe.GLOSSY:
            return self.weight * (self.f0 * 20 + self.f90) / 21  # Schlick's curve averaged over the hemisphere
        if self.kind == Lobe.GLASS:
            return self.weight * np.maximum(self.f0, self.f90)
        if self.kind == Lobe.SHEEN:
            return self.weight * self.f0 * np.float32(_SHEEN)
        if self.kind == Lobe.ABSORBING:
            return black()
        return self.weight * np.ones(3, np.float32)

    @property
    def _said(self) -> tuple:
        """What is the same all over a surface."""
        alike = self.kind, self.ior, self.fresnel, self.keeps_energy, self.under
        return (*alike, self.normal_space, self.by_angle, self.distribution, self.curve)

    def adds_to(self, other: "Term") -> bool:
        """Whether the two differ in nothing but their weights."""
        if self._said != other._said:
            return False
        channels = ("f0", "f90", "roughness", "edge", "film", "stretch", "normal")
        return all(_alike(getattr(self, name), getattr(other, name)) for name in channels)


def _alike(a: np.ndarray, b: np.ndarray) -> bool:
    return a is b or (a.shape == b.shape and np.allclose(a, b, rtol=0, atol=1e-6))


@dataclass
class ShaderSum:
    """The sum of a material's closures, as shares of all light; arrays are (h, w, 3) float32, h = w = 1 where constant.

    Attributes
    ----------
    transparent
        What passes straight through.
    emission
    terms : list of Term
    by_angle : tuple of float
        That of the terms that are being added.
    """

    transparent: np.ndarray = field(default_factory=black)
    emission: np.ndarray = field(default_factory=black)
    terms: list[Term] = field(default_factory=list)
    by_angle: tuple[float, ...] = ()

    def add(self, kind: Lobe, weight: np.ndarray, **values: object) -> None:
        """Add a closure."""
        self.terms.append(Term(kind, weight, by_angle=self.by_angle, **values))  # type: ignore[arg-type]

    @cached_property
    def coverage(self) -> np.ndarray:
        """Share of the light that does not pass straight through, (h, w, 1).

        Where transparency is added to something, as in flames, there is no such share; it is ½ there, which
        leaves a tint of up to 2.
        """
        if not self.transparent.any():
            return np.ones((1, 1, 1), np.float32)
        share = saturate(1 - _largest(self.transparent))
        scattered = _largest(sum((term.scattered for term in self.terms), black()))
        added = (scattered > 1.1 * share + 1e-3) | ((_largest(np.abs(self.emission)) > 0) & (share < 1e-3))
        return np.where(added, np.maximum(share, 0.5), share).astype(np.float32)

    def channels(self) -> dict[str, np.ndarray]:
        """Values of the channels of `Materials`, (h, w, 1 or 3) float32."""
        coverage = self.coverage
        passing = 1 - coverage
        tint = np.where(passing > 0, self.transparent / np.where(passing > 0, passing, 1), 1)
        return {"emission": self.emission / _inside(coverage), "coverage": coverage, "tint": tint}

    def closures(self) -> list[Term]:
        """The terms that scatter anything, alike ones added up, `under` the index of the layer over each, or −1.

        Their weights are of the light that does not pass straight through.
        """
        known: dict[Hashable, int] = {None: -1}
        found: list[Term] = []
        waiting = [term for term in self.terms if term.scatters]
        while waiting:
            ready = [term for term in waiting if term.under in known] or waiting  # layers that scatter nothing are none
            waiting = [term for term in waiting if not any(term is one for one in ready)]
            layers = [known.get(term.under, -1) for term in ready]
            for term, layer in zip(ready, layers, strict=True):
                index = _add(found, replace(term, under=layer))
                if term.covers is not None:
                    known.setdefault(term.covers, index)
        coverage = self.coverage
        return [replace(term, weight=_within(term, coverage)) for term in found]


def _add(found: list[Term], term: Term) -> int:
    """Add a term to that which it is like, or as a further one; which it is."""
    for i, other in enumerate(found):
        if term.adds_to(other):
            found[i] = replace(other, weight=other.weight + term.weight)
            return i
    found.append(term)
    return len(found) - 1


def _within(term: Term, coverage: np.ndarray) -> np.ndarray:
    """A term's weight in the light that does not pass straight through, of which it scatters no more than all.

    Where all passes, the weight is what it is elsewhere.
    """
    share = term.weight / _inside(coverage)
    scattered = replace(term, weight=share).scattered
    if scattered.max() > 1:  # the weight itself may be above 1: f0 and f90 take their part of it
        share = share / np.maximum(scattered, 1)
    hole = np.broadcast_to(coverage, (*share.shape[:2], 1))[..., 0] <= 0
    if hole.any() and not hole.all():
        share[hole] = share[~hole].mean(axis=0)
    return share


def _inside(coverage: np.ndarray) -> np.ndarray:
    return np.where(coverage > 0, coverage, 1)


def _largest(color: np.ndarray) -> np.ndarray:
    red, green, blue = (color[..., i : i + 1] for i in range(3))
    return np.maximum(np.maximum(red, green), blue)  # several times as fast as color.max(axis=2)


def matte(albedo: Sequence[float]) -> ShaderSum:
    """A diffuse surface of one colour, (3,)."""
    return ShaderSum(terms=[Term(Lobe.DIFFUSE, np.array(albedo, np.float32).reshape(1, 1, 3))])
