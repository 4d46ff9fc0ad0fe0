"""Which links an edit makes stale: those whose first segment crosses the box around what moved, or left from it.

Rays are not stored: the k-th of a row has the k-th point (u, v) of a set, shifted, and its direction's height over the
surface is √(1 − u), its azimuth 2πv. So the cone around the box, seen from a vertex, is a range of u and one of v, and
of all rays only those in it are looked at more closely.
"""

import numpy as np

from ....core.compiling import kernel, part
from ....core.sampling.path_numbers import two_numbers
from ....core.vec3 import ONE, ZERO, length, minus, row, times, to_local
from ....gather.direct.ray_directions import shifted
from .links import AGAIN, FOLLOWED, RENEWED, SHIFT, STALE, is_stale, side_ray, vertex_ray

_EVERY = (ZERO, ONE, ZERO, ONE)
_HALF, _PER_TURN, _TINY = np.float32(0.5), np.float32(0.5 / np.pi), np.float32(1e-12)
_MARGIN = np.float32(1e-4)


@part
def _range_of_box(low, high, position, normal):
    """Where the (u, v) of rays from a point lie that may meet a box: u from … to, v around … within; u ends before it
    starts where none does.
    """
    middle = times((low[0] + high[0], low[1] + high[1], low[2] + high[2]), _HALF)
    radius, way = length(minus(high, middle)), minus(middle, position)
    far = length(way)
    if far <= radius * (ONE + _MARGIN):
        return _EVERY
    sine, local = radius / far, times(to_local(way, normal), ONE / far)
    across = np.sqrt(max(ONE - local[2] * local[2], ZERO))
    cosine = np.sqrt(max(ONE - sine * sine, ZERO))
    # Heights of the cone's edges: cos(θ ∓ α), the pole being within it where θ < α
    highest = ONE if local[2] > ZERO and across < sine else local[2] * cosine + across * sine
    lowest = local[2] * cosine - across * sine
    if highest <= ZERO:
        return ONE, ZERO, ZERO, ZERO
    first = ONE - highest * highest - _MARGIN
    last = ONE if lowest <= ZERO else ONE - lowest * lowest + _MARGIN
    if across <= sine * (ONE + _MARGIN):
        return first, last, ZERO, ONE
    width = np.float32(np.arcsin(sine / across)) * _PER_TURN + _MARGIN
    return first, last, np.float32(np.arctan2(local[1], local[0])) * _PER_TURN, width


@part
def crosses(low, high, origin, direction, far):
    """Whether a ray meets a box as far as `far`."""
    near, end = ZERO, far
    for axis in range(3):
        d = direction[axis]
        if abs(d) < _TINY:
            if origin[axis] < low[axis] or origin[axis] > high[axis]:
                return False
            continue
        a, b = (low[axis] - origin[axis]) / d, (high[axis] - origin[axis]) / d
        near, end = max(near, min(a, b)), min(end, max(a, b))
    return near <= end * (ONE + _MARGIN) + _TINY


@part
def _mark(links, i, k):
    links.state[i, k] = AGAIN if links.state[i, k] == RENEWED or links.state[i, k] == AGAIN else STALE
    links.split[i] = True


@kernel
def mark_vertex_links(positions, normals, objects, points, key, moved, boxes, start, stop, first, last, links):
    """Mark which of links `first` to `last` of vertices `start` to `stop` are stale: of those on an object, all."""
    for vertex in range(start, stop):
        links.changed[vertex] = links.changed[vertex] and links.split[vertex]
        if objects[vertex] == moved:
            for k in range(first, last):
                _mark(links, vertex, k)
            links.changed[vertex] = True
            continue
        origin, normal = row(positions, vertex), row(normals, vertex)
        a, b = two_numbers(key, vertex, SHIFT)
        for box in range(len(boxes)):
            low, high = row(boxes[box], 0), row(boxes[box], 1)
            lowest, highest, around, width = _range_of_box(low, high, origin, normal)
            if lowest > highest:
                continue
            for k in range(first, last):
                u, v = shifted(points, k, a, b)
                away = v - around
                away -= np.rint(away)
                if u < lowest or u > highest or abs(away) > width or is_stale(links, vertex, k):
                    continue
                far = links.length[vertex, k]
                if crosses(low, high, origin, vertex_ray(points, normal, key, vertex, k), abs(far)):
                    _mark(links, vertex, k)


@kernel
def mark_side_links(scene, elements, points, key, moved, boxes, sides, start, stop, first, last, links):
    """Mark which of links `first` to `last` of `sides` from `start` to `stop` are stale."""
    for i in range(start, stop):
        side = sides[i]
        links.changed[side] = links.changed[side] and links.split[side]
        on = scene.object[elements.triangle[elements.order[elements.start[side // 2]]]]
        for k in range(first, last):
            if on == moved:
                _mark(links, side, k)
                links.changed[side] = True
                continue
            _, origin, direction = side_ray(scene, elements, points, key, side, k)
            for box in range(len(boxes)):
                low, high = row(boxes[box], 0), row(boxes[box], 1)
                if crosses(low, high, origin, direction, abs(links.length[side, k])):
                    _mark(links, side, k)


@kernel
def mark_followed(rows, start, stop, n, links):
    """Mark those of the first n links of `rows` from `start` to `stop` that were followed: of these only the first
    segment is known, so that they may be stale whatever moved.
    """
    for i in range(start, stop):
        for k in range(n):
            if links.length[rows[i], k] <= FOLLOWED:
                _mark(links, rows[i], k)
