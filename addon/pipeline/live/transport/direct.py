"""Direct light at vertices and on the sides of elements."""

import numpy as np

from ....bsdf.scatter import lit_normal
from ....core.compiling import kernel
from ....core.vec3 import BLACK, ONE, ZERO, plus, row, times
from ....gather.direct.visible import arriving
from ....scene import RayKind
from ....scene.hit import look_up
from ....tracing.coplanar import coplanar_occluded
from .estimates import put_estimate
from .links import INSIDE, side_ray

_DIFFUSE, _PER_PI = int(RayKind.DIFFUSE), np.float32(1 / np.pi)
_DIRECT = 16  # of a path's pairs of numbers, the first that direct light takes


@kernel
def light_vertices(direct, tracing, room, positions, normals, objects, key, start, stop, first, last, of):
    """Make estimates `first` to `last` of vertices `start` to `stop`."""
    n = of.value.shape[1]
    for vertex in range(start, stop):
        at = row(positions, vertex), row(normals, vertex), objects[vertex]
        for k in range(first, last):
            _, light, _, met = arriving(direct, tracing, room, *at, key, vertex * n + k, _DIRECT, True)
            put_estimate(of, vertex, k, times(plus(light, met), _PER_PI), ONE)


@kernel
def light_sides(direct, tracing, room, elements, points, key, link_key, sides, link_ends, start, stop, first, last, of):
    """Make estimates `first` to `last` of `sides` from `start` to `stop`, at the points that their links start from.

    Where a link found that it starts inside of something, or where another surface lies, there is nothing to light.
    """
    scene, n = tracing.scene, of.value.shape[1]
    for i in range(start, stop):
        side = sides[i]
        for k in range(first, last):
            hit, origin, _ = side_ray(scene, elements, points, link_key, side, k)
            light, weight = BLACK, ZERO
            if link_ends[side, k] != INSIDE and not coplanar_occluded(tracing, hit):
                weight = look_up(scene, scene.materials.coverage, hit.triangle, hit.u, hit.v, hit.back, _DIFFUSE)[0]
            if weight > ZERO:
                at = origin, lit_normal(scene, hit), scene.object[hit.triangle]
                _, lit, _, met = arriving(direct, tracing, room, *at, key, side * n + k, _DIRECT, True)
                light = times(plus(lit, met), _PER_PI)
            of.weight[side, k] = weight
            put_estimate(of, side, k, light, weight)
