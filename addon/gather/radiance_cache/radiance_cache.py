"""The radiance cache: the light that every surface element reflects or transmits diffusely, to either side."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...core.sampling.vectors import rows
from ...tracing import Hits
from .elements import SurfaceElements

NEAR = 1.0
"""Rays that end nearer than this many sizes (√area) of the element they hit are not answered by the cache.

An element is the mean of its area; from afar that is what a gather ray needs, but from closer by than its own size
parts of it that the receiver does not see, round an edge or on the lit side of a shadow, would shine into dark places.
A larger number is more accurate and slower, as more rays have to be followed on.
"""


@dataclass(frozen=True)
class RadianceCache:
    """Diffuse radiance of each side of each element.

    Attributes
    ----------
    elements : SurfaceElements
    radiance : (2 e + 2, 3 l) float32, W/(m² sr)
        Of one light or of several side by side.
        Element k's front (the side its normal is on) at 2k, its back at 2k + 1; the last two, for rays that meet
        nothing, are black. Emission is not in it.
    caustic : (2 e + 2, 3 l) float32, W/(m² sr)
        The part of it that is light of lamps over mirrors, glass and narrow gloss.
    """

    elements: SurfaceElements
    radiance: np.ndarray
    caustic: np.ndarray

    @staticmethod
    def of_sides(elements: SurfaceElements, radiance: np.ndarray, caustic: np.ndarray | None = None) -> "RadianceCache":
        """A cache of the radiance (2 e, 3) of the elements' sides, and of the caustics in it."""
        padded = np.concatenate([radiance, np.zeros((2, 3), np.float32)])
        if caustic is None:
            return RadianceCache(elements, padded, np.zeros_like(padded))
        return RadianceCache(elements, padded, np.concatenate([caustic, np.zeros((2, 3), np.float32)]))

    @staticmethod
    def beside(caches: "Sequence[RadianceCache]") -> "RadianceCache":
        """The light of several caches of the same elements side by side, three columns each."""
        light, caustic = (
            np.concatenate([getattr(c, name) for c in caches], axis=1) for name in ("radiance", "caustic")
        )
        return RadianceCache(caches[0].elements, light, caustic)

    @cached_property
    def _reach(self) -> np.ndarray:
        """Distance from which each element can be looked up, and 0 for no element, (e + 1,) float32, m."""
        return np.append(NEAR * np.sqrt(self.elements.areas), 0).astype(np.float32)

    def look_up(self, hits: Hits, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Radiance that rays meet, (n, 3 l) float32, 0 where they meet nothing; and which ones end too near, (n,)."""
        element = self.elements.find(hits.triangle, hits.u, hits.v)
        return rows(self.radiance, 2 * element + hits.back(directions)), hits.distance < self._reach[element]

    def caustic_at(self, hits: Hits, directions: np.ndarray) -> np.ndarray:
        """Radiance of caustics that each ray meets, (n, 3 l) float32."""
        return rows(self.caustic, 2 * self.elements.find(hits.triangle, hits.u, hits.v) + hits.back(directions))
