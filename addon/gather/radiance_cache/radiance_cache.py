"""The radiance cache: the light that every surface element reflects or transmits diffusely, to either side.

Of lobes that are broad and not Lambertian, what is reflected depends on the direction: for them the cache has the mean
radiance that comes to the side, without direct light. As that comes from many directions, a look-up multiplies it by
the lobe's albedo as seen from there; direct light is found by shadow rays.
"""

from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ...core.compiling import by_reference, part
from .elements import ElementArrays, SurfaceElements, element_at

NEAR = 1.0
"""Rays that end nearer than this many sizes (√area) of the element they hit are not answered by the cache.

An element is the mean of its area; from afar that is what a gather ray needs, but from closer by than its own size
parts of it that the receiver does not see, round an edge or on the lit side of a shadow, would shine into dark places.
A larger number is more accurate and slower, as more rays have to be followed on.
"""


@by_reference
class CacheArrays(NamedTuple):
    """A radiance cache as kernels take it.

    Attributes
    ----------
    elements : ElementArrays
    radiance, caustic : (2 e, 3) float32, W/(m² sr)
        See `RadianceCache`.
    incident, incident_caustic : (2 e, 3) or (0, 3) float32, W/(m² sr)
        See `RadianceCache`.
    arriving : (2 e, 3) or (0, 3) float32, W/(m² sr)
        See `RadianceCache`.
    reach : (e,) float32, m
        Distance from which each element can be looked up; infinity where it never can.
    """

    elements: ElementArrays
    radiance: np.ndarray
    caustic: np.ndarray
    incident: np.ndarray
    incident_caustic: np.ndarray
    arriving: np.ndarray
    reach: np.ndarray


def _none() -> np.ndarray:
    return np.zeros((0, 3), np.float32)


@dataclass(frozen=True)
class RadianceCache:
    """Diffuse radiance of each side of each element.

    Attributes
    ----------
    elements : SurfaceElements
    radiance : (2 e, 3) float32, W/(m² sr)
        Element k's front (the side its normal is on) at 2k, its back at 2k + 1. Emission is not in it.
    caustic : (2 e, 3) float32, W/(m² sr)
        The part of it that is light of lamps over mirrors, glass and narrow gloss.
    incident, incident_caustic : (2 e, 3) float32, W/(m² sr)
        Mean radiance that comes to each side but for direct light, E/π, and the caustics' part of it; (0, 3) where no
        material of the scene is `broad` or has subsurface scattering.
    arriving : (2 e, 3) float32, W/(m² sr)
        The same with direct light, E/π of all: what a walk through a body finds where it ends (`seen_through_body`);
        (0, 3) where none of the scene's materials has subsurface scattering.
    unresolved : (e,) bool, optional
        Elements that are never asked: rays that end there go on.
    """

    elements: SurfaceElements
    radiance: np.ndarray
    caustic: np.ndarray
    incident: np.ndarray = field(default_factory=_none)
    incident_caustic: np.ndarray = field(default_factory=_none)
    arriving: np.ndarray = field(default_factory=_none)
    unresolved: np.ndarray | None = None

    @cached_property
    def arrays(self) -> CacheArrays:
        """The cache as kernels take it."""
        reach = (NEAR * np.sqrt(self.elements.areas)).astype(np.float32)
        if self.unresolved is not None:
            reach[self.unresolved] = np.inf
        light = self.radiance, self.caustic, self.incident, self.incident_caustic, self.arriving
        return CacheArrays(self.elements.arrays, *light, reach)


@part
def side_at(cache, triangle, u, v, back):
    """The side of an element that a point of a triangle's back or else its front is on."""
    return 2 * element_at(cache.elements, triangle, u, v) + np.int32(back)
