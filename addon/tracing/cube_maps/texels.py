"""What kernels read of cube maps: texels and the planes that they saw."""

from typing import NamedTuple

import numpy as np

from ...core.compiling import by_reference, kernel, part
from ...core.sampling.octahedral import octahedral_vector
from ...core.vec3 import ONE, TWO, dot, length, minus, put, row

_LEAST_DEPTH = np.float32(1e-30)


@by_reference
class MapArrays(NamedTuple):
    """The arrays of `CubeMaps`, for kernels."""

    centres: np.ndarray
    size: int
    n_levels: int
    level_start: np.ndarray
    distance: np.ndarray
    packed_normal: np.ndarray
    nearest: np.ndarray
    farthest: np.ndarray


@part
def face_of(p):
    """The face that a direction goes through."""
    x, y, z = abs(p[0]), abs(p[1]), abs(p[2])
    if x >= y and x >= z:
        return 0 if p[0] >= 0 else 1
    if y >= z:
        return 2 if p[1] >= 0 else 3
    return 4 if p[2] >= 0 else 5


@part
def onto_face(p, face):
    """A vector along the axis, the rows and the columns of a face."""
    axis = face >> 1
    sign = -ONE if face & 1 else ONE
    if axis == 0:
        return sign * p[0], p[1], p[2]
    if axis == 1:
        return sign * p[1], p[2], p[0]
    return sign * p[2], p[0], p[1]


@part
def from_face(along, across, down, face):
    """The vector that `onto_face` takes to these."""
    axis = face >> 1
    along = -along if face & 1 else along
    if axis == 0:
        return along, across, down
    if axis == 1:
        return down, along, across
    return across, down, along


@part
def texel_at(maps, which, p):
    """The texel of a map that a point, relative to the map's centre, is seen in, and the point's depth z."""
    face = face_of(p)
    along, across, down = onto_face(p, face)
    z, half = max(along, _LEAST_DEPTH), np.float32(maps.size) / TWO
    i = min(np.int64((across / z + ONE) * half), maps.size - 1)
    j = min(np.int64((down / z + ONE) * half), maps.size - 1)
    return ((which * 6 + face) * maps.size + i) * maps.size + j, z


@part
def plane_of(maps, texel):
    """The plane n · p = h that a texel saw, relative to the map's centre; h is −∞ where it saw nothing."""
    normal = octahedral_vector(maps.packed_normal[texel, 0], maps.packed_normal[texel, 1])
    j, i = texel % maps.size, texel // maps.size % maps.size
    face = texel // (maps.size * maps.size) % 6
    width = TWO / np.float32(maps.size)
    half = np.float32(0.5)
    way = from_face(ONE, (np.float32(i) + half) * width - ONE, (np.float32(j) + half) * width - ONE, face)
    return normal, dot(normal, way) * maps.distance[texel] / length(way)


@kernel
def texels_at(maps, which, p, texel, z):
    """`texel_at` of many."""
    for k in range(len(p)):
        texel[k], z[k] = texel_at(maps, which[k], row(p, k))


@kernel
def planes_of(maps, texel, normal, h):
    """`plane_of` of many."""
    for k in range(len(texel)):
        n, h[k] = plane_of(maps, texel[k])
        put(normal, k, n)


@part
def above_plane(maps, which, x, direction):
    """How far a point is above the plane that a map sees there, in texels, and whether a direction goes into it."""
    p = minus(x, row(maps.centres, which))
    texel, z = texel_at(maps, which, p)
    normal, h = plane_of(maps, texel)
    above = (dot(normal, p) - h) / (z * (TWO / np.float32(maps.size)))
    return above, dot(normal, direction) < 0
