"""The way of a ray through one map, until it crosses a surface or that hides it.

On a face of a cube a ray is a straight line. Where it stays nearer than everything in a cell of a mip level, the whole
cell is free: the walk takes free space in large steps and comes down to single texels only near surfaces. There the
ray meets the plane that the texel saw, or passes it, or slips behind it.
"""

from enum import IntEnum

import numpy as np

from ....core.compiling import part
from ....core.vec3 import ONE, TWO, ZERO, along, dot
from ..texels import face_of, onto_face, plane_of

SLACK = np.float32(1 / 64)
"""In texels: how far behind the plane of its own surface a ray may start."""

_CRACK = np.float32(1 / 4)  # in texels: how far the planes of neighbours are apart where they should meet
_FIRST_LEVEL = 2
_MAX_STEPS = 512  # a ray crosses at most about 4 size texels
_NUDGE = np.float32(2**-16)  # over a cell's border, in depths z
_LEAST_DEPTH = np.float32(1e-30)
_INFINITY = np.float32(np.inf)


class End(IntEnum):
    """How a walk ends."""

    OPEN = 0
    HIT = 1
    TURNED = 2  # behind surfaces, or out from behind them
    GONE = 3


_OPEN, _HIT, _TURNED, _GONE = (int(end) for end in End)


@part
def walk(maps, which, side, t, r, start, s_max):
    """A ray t + s r, relative to a map's centre, that walks through the map from `start` on as long as s < `s_max`.

    `side` is 1 in front of what the map sees and −1 behind it, where the same rules hold with near and far exchanged.

    Returns
    -------
    end : int
        `End`.
    s : float32, m
        How far the ray came.
    texel : int64
        What ended it.
    slipped : float32, m
        Where a ray that turned crossed the plane of what hides it, if it did just before it came to its texel, as it
        does where two surfaces meet in an edge; else infinite.
    n_steps : int
    """
    s, s_before, level = start, start, min(_FIRST_LEVEL, maps.n_levels - 1)
    face = face_of(along(t, s, r))
    local_t, local_r = onto_face(t, face), onto_face(r, face)
    for n_steps in range(1, _MAX_STEPS + 1):
        p = along(local_t, s, local_r)
        if max(abs(p[1]), abs(p[2])) > p[0]:  # it has left the face
            face = face_of(along(t, s, r))
            local_t, local_r = onto_face(t, face), onto_face(r, face)
            p = along(local_t, s, local_r)
        cell, length = _cell(maps, which * 6 + face, level, p, local_r)
        free = _is_free(maps, cell, side, p[0], local_r[0], length)
        if not free and level == 0:
            end, way, slipped = _meet(maps, cell, side, t, r, s, p[0], length, s > start, s - s_before)
            if end != _OPEN:
                s += way
                return (end if s < s_max else _GONE), s, cell, slipped, n_steps
            free = True
        if free:
            s_before = s
            s += length + _NUDGE * p[0]
            level = min(level + 1, maps.n_levels - 1)
        else:
            level -= 1
        if not s < s_max:
            return _GONE, s, np.int64(-1), _INFINITY, n_steps
    return _GONE, s, np.int64(-1), _INFINITY, _MAX_STEPS


@part
def _cell(maps, face, level, p, r):
    """The cell of a mip level that a ray is in at p on a face, and the way to where it leaves the cell.

    A ray's slope p_i / z grows all along it, or falls; it leaves over the border that it tends to, if ever.
    """
    n = maps.size >> level
    width = TWO / np.float32(n)
    row, to_row = _along_axis(p[1], r[1], p[0], r[0], n, width)
    column, to_column = _along_axis(p[2], r[2], p[0], r[0], n, width)
    return maps.level_start[level] + (face * n + row) * n + column, min(to_row, to_column)


@part
def _along_axis(p, r, z, r_z, n, width):
    """The row of n, each so wide, that a ray is in, and the way to where it leaves the row."""
    z = max(z, _LEAST_DEPTH)
    at = min(np.int64((p / z + ONE) / width), n - 1)
    up = r * z > p * r_z
    border = np.float32(at + up) * width - ONE
    sign = ONE if up else -ONE
    rate = (r - border * r_z) * sign
    return at, (max((border * z - p) * sign, ZERO) / rate if rate > 0 else _INFINITY)


@part
def _is_free(maps, cell, side, z, r_z, length):
    """Whether a ray stays in front of all that a cell sees, or behind all, on its way through it."""
    z_exit = z + r_z * length if r_z != 0 else z
    if side > 0:
        return max(z, z_exit) <= maps.nearest[cell]  # also where both are infinite
    return min(z, z_exit) > maps.farthest[cell]


@part
def _meet(maps, texel, side, t, r, s, z, length, has_walked, last_step):
    """Whether a ray meets, or slips behind, what a texel saw, which it crosses for a length: end, way, `slipped`.

    A crossing is a hit if the ray comes from its own side of the surface. One that lies a little before the texel
    counts too: the planes of neighbours do not quite meet on their border.
    """
    normal, h = plane_of(maps, texel)
    texel_width = z * (TWO / np.float32(maps.size))
    rate = side * dot(normal, r)
    height = side * (dot(normal, t) + s * dot(normal, r) - h)
    height_at_exit = height + rate * length
    crack = _CRACK * texel_width if has_walked else ZERO
    below = np.float32(-2) * SLACK * texel_width
    if rate < 0 and height_at_exit <= 0 and height >= -crack:
        return _HIT, max(-height / rate, ZERO), _INFINITY
    if height_at_exit >= below:
        return _OPEN, ZERO, _INFINITY
    slipped = s - height / rate if rate < 0 and height >= rate * last_step else _INFINITY
    way = max((below - height) / rate, ZERO) if rate < 0 and height > below else ZERO
    return _TURNED, way, slipped
