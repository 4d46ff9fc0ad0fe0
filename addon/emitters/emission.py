"""The emission of photons: points of the unit hypercube become rays that carry flux.

The mean of the flux over the hypercube is the source's power, so n points make n photons of flux/n watts each. All
sources are rows of one set of arrays, so that photons of many lamps share a batch.
"""

from typing import NamedTuple

import numpy as np

from ..core.compiling import by_reference, kernel, part
from ..core.vec3 import ONE, put, times
from ..scene import LightKind
from ..scene.arrays import SceneArrays
from .aiming.discs import Discs
from .aiming.guided import GuideCells, guided
from .aiming.projection_map import Balls
from .area import emit_area
from .lamps import LampArrays
from .mesh import MeshArrays, emit_mesh
from .patterns.emit import emit_pattern
from .point import emit_point
from .row import MESH, PATTERN, WORLD
from .spot import emit_spot
from .sun import emit_sun
from .world import WorldArrays, emit_world

N_DIMENSIONS = 5
"""Dimensions of the hypercube that sources sample: two for a direction, two for a place, one to choose."""

_POINT, _SPOT, _SUN = int(LightKind.POINT), int(LightKind.SPOT), int(LightKind.SUN)
_NO_OBJECT = np.int32(-1)


@by_reference
class Emitters(NamedTuple):
    """s sources of photons, and what they have in common.

    Attributes
    ----------
    kind, lamp : (s,) int32
        As in `SourceRow`.
    axis : (s, 3) float32
    versine : (s,) float64
    aims : (s,) bool
    balls : Balls
        Of their projection maps.
    cells : GuideCells
        Of their guides.
    """

    kind: np.ndarray
    lamp: np.ndarray
    axis: np.ndarray
    versine: np.ndarray
    aims: np.ndarray
    balls: Balls
    cells: GuideCells
    lamps: LampArrays
    mesh: MeshArrays
    world: WorldArrays
    discs: Discs
    scene: SceneArrays


@part
def emit(emitters, source, u0, u1, u2, u3, u4):
    """The photon of a point of a source's hypercube: origin, direction, flux, and the object it leaves (−1: none)."""
    u, density = guided(emitters.cells, source, (u0, u1, u2, u3, u4))
    kind, object_ = emitters.kind[source], _NO_OBJECT
    if kind == _POINT:
        origin, direction, flux = emit_point(emitters, source, u)
    elif kind == _SPOT:
        origin, direction, flux = emit_spot(emitters, source, u)
    elif kind == _SUN:
        origin, direction, flux = emit_sun(emitters, source, u)
    elif kind == MESH:
        origin, direction, flux, object_ = emit_mesh(emitters, source, u)
    elif kind == WORLD:
        origin, direction, flux = emit_world(emitters, source, u)
    elif kind == PATTERN:
        origin, direction, flux = emit_pattern(emitters, source, u)
    else:
        origin, direction, flux = emit_area(emitters, source, u)
    return origin, direction, times(flux, ONE / density), object_


@kernel
def emit_rays(emitters, source, u, origins, directions, flux, objects):
    """`emit` of many: of sources (n,) int32 and points `u` (n, 5) float32."""
    for k in range(len(u)):
        s = source[k]
        origin, direction, power, objects[k] = emit(emitters, s, u[k, 0], u[k, 1], u[k, 2], u[k, 3], u[k, 4])
        put(origins, k, origin)
        put(directions, k, direction)
        put(flux, k, power)
