"""A tracer whose rays read cube maps."""

from collections.abc import Callable
from typing import Literal

import numpy as np

from ...core.parallel import Workers, slices
from ...core.sampling.vectors import dot
from ...scene import RayKind, Scene, seen_by
from ..protocol import Hits, Tracer, tree_of_each_kind
from .box import thickened, through_box, widened
from .cube_maps import CubeMaps
from .placement import placed, regular
from .search.crossing import Crossing
from .search.map_hit import MapHits, Method
from .search.map_index import MapIndex
from .search.segments import LightRays
from .search.statistics import Statistics

_CHUNK = 1 << 13  # rays, which take less than 0.05 s
_SHORT_OF_TARGET = np.float32(1 - 1e-4)
_MARGIN = 1e-3  # around the scene's bounds, of their diagonal: rays have to enter clear of surfaces
_BEYOND = 0.02  # of the same: how far beyond the bounds hits may lie, as walls lie in them and some methods are rough


class MultiImageTracer:
    """A `Tracer` that reads cube maps, see `build`. Kinds of rays that see the same objects share their maps.

    A hit is a point of the plane that a texel saw, and belongs to the triangle that the texel saw. Surfaces that no map
    sees, and what is finer than a texel, are missed.

    Attributes
    ----------
    statistics : Statistics or None
        Counts what rays take, while there is one.
    """

    def __init__(self, scene: Scene, methods: list[Method]) -> None:
        self._scene, self._methods = scene, methods
        self._bounds = widened(scene.bounds, _MARGIN)
        self.statistics: Statistics | None = None

    @staticmethod
    def build(
        scene: Scene,
        tracer: Tracer,
        region: np.ndarray,
        n_maps: int = 27,
        size: int = 64,
        placement: Literal["placed", "regular"] = "placed",
        method: Callable[[CubeMaps], Method] | None = None,
        workers: Workers | None = None,
        light: LightRays | None = None,
    ) -> "MultiImageTracer":
        """Place maps, take their pictures and make a tracer of them.

        Parameters
        ----------
        tracer : Tracer
            Traces the pictures.
        region : (2, 3) float32, m
            The box in which light matters, see `lit_region`; maps stand in it or near its surfaces.
        n_maps : int
        size : int
            Texels along the edge of a face, a power of two.
        placement : str
            "placed": where maps see most of what light meets; "regular": in a regular grid.
        method : callable, optional
            Makes another method of maps than `Crossing`.
        light : LightRays, optional
            Rays that leave the lamps, for "placed"; without them, light is taken to come from all surfaces evenly.
        """
        workers = workers or Workers()
        region = thickened(region)
        if placement == "placed":
            centres = placed(scene, tracer, region, n_maps, size, workers.part(0, 0.5), light)
        else:
            centres = regular(region, n_maps)

        def method_for(seen: np.ndarray) -> Method:
            kind = next(kind for kind in RayKind if np.array_equal(seen_by(scene.objects, kind), seen))
            maps = CubeMaps.taken_from(centres, size, scene, tracer, kind, workers.part(0.5, 0.8))
            if method is not None:
                return method(maps)
            return Crossing(maps, MapIndex.of(maps, region, scene.bounds, workers.part(0.8, 1)))

        return MultiImageTracer(scene, tree_of_each_kind(scene.objects, method_for))

    @property
    def maps(self) -> CubeMaps:
        """The maps that diffuse rays read."""
        return self._methods[RayKind.DIFFUSE].maps

    @property
    def n_bytes(self) -> int:
        """Memory of all maps."""
        return sum({id(method): method.maps.n_bytes for method in self._methods}.values())

    def closest_hit(
        self,
        origins: np.ndarray,
        directions: np.ndarray,
        t_max: np.ndarray | float = np.inf,
        kind: RayKind = RayKind.DIFFUSE,
    ) -> Hits:
        """See `Tracer.closest_hit`."""
        found = self._find(origins, directions, np.broadcast_to(np.float32(t_max), len(origins)), kind)
        k = np.flatnonzero(found.texel >= 0)
        hits = Hits.none(len(origins))
        hits.triangle[k] = triangle = self._methods[kind].maps.triangle[found.texel[k]]
        hits.distance[k] = found.distance[k]
        points = origins[k] + found.distance[k, None] * directions[k]
        hits.u[k], hits.v[k] = self._scene.barycentrics(triangle, points)
        hits.normal[k] = self._scene.normals[triangle]
        return hits

    def occluded(self, origins: np.ndarray, targets: np.ndarray) -> np.ndarray:
        """See `Tracer.occluded`. A plane that goes through the target is taken to be the target's own surface."""
        way = targets - origins
        length = np.sqrt(dot(way, way))
        directions = way / np.maximum(length, np.float32(1e-30))[:, None]
        found = self._find(origins, directions, length * _SHORT_OF_TARGET, RayKind.SHADOW)
        occluded = found.texel >= 0
        k = np.flatnonzero(occluded)
        occluded[k] = ~self._methods[RayKind.SHADOW].maps.goes_through(found.texel[k], targets[k])
        return occluded

    def _find(self, origins: np.ndarray, directions: np.ndarray, t_max: np.ndarray, kind: RayKind) -> MapHits:
        """What rays meet on their way through the scene's bounds; outside of them there is nothing."""
        found = MapHits.none(len(origins))
        enter, leave = through_box(self._bounds, origins, directions)
        through = np.flatnonzero(enter < np.minimum(leave, t_max))
        farthest = np.minimum(leave + np.float32(_BEYOND * self._scene.diagonal), t_max)
        for k in (through[part] for part in slices(len(through), _CHUNK)):
            start = origins[k] + enter[k, None] * directions[k]
            part = self._methods[kind].find(start, directions[k], farthest[k] - enter[k])
            found.distance[k], found.texel[k], found.loops[k] = part.distance + enter[k], part.texel, part.loops
            found.n_look_ups += part.n_look_ups
        if self.statistics is not None:
            self.statistics.add(found)
        return found
