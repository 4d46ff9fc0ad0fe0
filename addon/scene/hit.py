"""Points on triangles inside kernels: where a ray met one, with the normals and colours that it has there.

`scene` is `SceneArrays`; points of triangles have barycentric weights (1−u−v, u, v).
"""

from typing import NamedTuple

import numpy as np

from ..core.compiling import kernel, part, routine
from ..core.vec3 import ONE, ZERO, dot, largest, length, minus, mul, negative, plus, put, row, times, wide
from .closures import Lobe
from .ray_kinds import RayKind

_LEAST_COORDINATE = np.float32(0.01)  # m, that rounding is taken from: the origin is no better known than what is near
_PER_COORDINATE = np.float32(2.0**-18)  # 64 roundings
_DIFFUSE, _SUBSURFACE, _DIFFUSE_RAY = int(Lobe.DIFFUSE), int(Lobe.SUBSURFACE), int(RayKind.DIFFUSE)
_SHORTEST_NORMAL = np.float32(1e-3)
_TINY, _TINIEST = np.float32(1e-20), 1e-300


class Hit(NamedTuple):
    """Where a ray met a surface.

    Attributes
    ----------
    triangle : int32
    distance : float32, m
        Along the ray.
    u, v : float32
        Barycentric weights of the triangle's second and third vertex.
    position : triple, m
        On the triangle to within its rounding, however far the ray flew.
    normal : triple
        Unit geometric normal of the side that the ray came to.
    back : bool
        Whether that is the triangle's back.
    """

    triangle: np.int32
    distance: np.float32
    u: np.float32
    v: np.float32
    position: tuple
    normal: tuple
    back: bool


@part
def hit_at(scene, direction, triangle, distance, u, v):
    """The `Hit` of a ray that meets a triangle."""
    normal = row(scene.normals, triangle)
    back = dot(normal, direction) > ZERO
    if back:
        normal = negative(normal)
    return Hit(triangle, distance, u, v, point_at(scene, triangle, u, v), normal, back)


@part
def corners(scene, triangle):
    """The three corners of a triangle."""
    t = scene.triangles
    return (
        row(scene.vertices, t[triangle, 0]),
        row(scene.vertices, t[triangle, 1]),
        row(scene.vertices, t[triangle, 2]),
    )


@part
def point_at(scene, triangle, u, v):
    """Position of a point of a triangle."""
    a, b, c = corners(scene, triangle)
    return plus(plus(times(a, ONE - u - v), times(b, u)), times(c, v))


@part
def plane_coordinates(scene, triangle, position):
    """Barycentric weights (u, v), float64, of where a point lies over the plane of a triangle."""
    a, b, c = corners(scene, triangle)
    first = wide(a)  # slivers need the digits
    e1, e2, p = minus(wide(b), first), minus(wide(c), first), minus(wide(position), first)
    d11, d12, d22, p1, p2 = dot(e1, e1), dot(e1, e2), dot(e2, e2), dot(p, e1), dot(p, e2)
    scale = 1.0 / max(d11 * d22 - d12 * d12, _TINIEST)
    return (d22 * p1 - d12 * p2) * scale, (d11 * p2 - d12 * p1) * scale


@part
def barycentrics(scene, triangle, position):
    """Barycentric weights (u, v) of a point on a triangle, clipped to the triangle."""
    u, v = plane_coordinates(scene, triangle, position)
    u = min(max(u, 0.0), 1.0)
    return np.float32(u), np.float32(min(max(v, 0.0), 1.0 - u))


@part
def uv_at(scene, triangle, u, v):
    """Texture coordinates of a point of a triangle."""
    uvs, w = scene.corner_uvs, ONE - u - v
    x = w * uvs[triangle, 0, 0] + u * uvs[triangle, 1, 0] + v * uvs[triangle, 2, 0]
    y = w * uvs[triangle, 0, 1] + u * uvs[triangle, 1, 1] + v * uvs[triangle, 2, 1]
    return x, y


@part
def shading_normal(scene, hit):
    """Unit normal that shades a hit, on the side that was met: on the back it points the other way, as `normal` does.

    It may lie beyond the triangle's own plane; what Cycles makes of that is dark.
    """
    return shading_normal_at(scene, hit.triangle, hit.u, hit.v, hit.normal, hit.back)


@part
def shading_normal_at(scene, triangle, u, v, normal, back):
    """`shading_normal` of a point of a triangle; `normal` is the geometric one of its side."""
    if not scene.smooth[triangle]:
        return normal
    smooth = between_corners(scene.corner_normals, triangle, u, v)
    size = length(smooth)
    if size <= _SHORTEST_NORMAL:
        return normal
    signed = (-size if back else size) + _TINY
    return smooth[0] / signed, smooth[1] / signed, smooth[2] / signed


@part
def between_corners(values, triangle, u, v):
    """A (t, 3, 3) array of triples at triangles' corners, interpolated."""
    a, b, c = _corner(values, triangle, 0), _corner(values, triangle, 1), _corner(values, triangle, 2)
    return plus(plus(times(a, ONE - u - v), times(b, u)), times(c, v))


@part
def _corner(values, triangle, k):
    """The triple of a triangle's k-th corner."""
    return values[triangle, k, 0], values[triangle, k, 1], values[triangle, k, 2]


@part
def ray_offset(scene, triangle, position):
    """How far a ray has to start off its triangle so as not to meet it again, m.

    That is what rounding leaves uncertain of the height over the plane (`Scene.height_errors`), and 64 roundings of the
    point's own coordinates: the errors of level planes may be 0, but a ray that starts in a plane meets it, and the
    corners of the surfaces next to it were rounded, too. Neither grows with the scene. The position is by barycentric
    weights (`point_at`), not by the distance that a ray flew.
    """
    near = max(largest((abs(position[0]), abs(position[1]), abs(position[2]))), _LEAST_COORDINATE)
    return near * _PER_COORDINATE + scene.height_errors[triangle]


@part
def off_surface(scene, hit, side):
    """Where a ray starts that leaves a hit on the side it came to (`side` +1), or on the other (−1)."""
    step = ray_offset(scene, hit.triangle, hit.position) * np.float32(side)
    return plus(hit.position, times(hit.normal, step))


@part
def is_back(scene, triangle, direction):
    """Whether a ray that flies along a direction comes to a triangle's back."""
    return dot(row(scene.normals, triangle), direction) > ZERO


@part
def material_seen(scene, triangle, back, kind):
    """The row of the materials that stands for a triangle's where rays of a kind see its back or else its front."""
    return scene.materials.seen_as[scene.material[triangle], 2 * kind + (1 if back else 0)]


@part
def look_up(scene, channel, triangle, u, v, back, kind):
    """A channel of the materials (`ChannelArrays`) at a point of a triangle, as `material_seen` has it."""
    return channel_at(scene, channel, material_seen(scene, triangle, back, kind), triangle, u, v)


@part
def channel_at(scene, channel, k, triangle, u, v):
    """The k-th value of a channel at a point of a triangle."""
    value, image = row(channel.value, k), channel.texture[k]
    if image < 0:
        return value
    return mul(value, texel_at(scene, image, triangle, u, v))


@routine
def texel_at(scene, image, triangle, u, v):
    """The nearest texel of an image at a point of a triangle."""
    x, y = uv_at(scene, triangle, u, v)
    return texel(scene.textures, image, x, y)


@part
def weight_of_kind(scene, kind, first, last, triangle, u, v):
    """Sum of the weights of closures `first` to `last` of a kind (`Lobe`): of Lambertian ones the albedo, before what
    layers take.
    """
    closures, total = scene.materials.closures, (ZERO, ZERO, ZERO)
    for k in range(first, last):
        if closures.kind[k] == kind:
            total = plus(total, channel_at(scene, closures.weight, k, triangle, u, v))
    return total


@part
def texel(textures, image, x, y):
    """The nearest texel of an image (`TextureArrays`) at texture coordinates."""
    width, height = textures.width[image], textures.height[image]
    if textures.extends[image]:
        x, y = min(max(x, ZERO), ONE), min(max(y, ZERO), ONE)
    else:
        x, y = x - np.floor(x), y - np.floor(y)
    x, y = x if x > ZERO else ZERO, y if y > ZERO else ZERO  # where a UV map has no number, too
    column = min(np.int32(x * np.float32(width)), width - 1)
    line = min(np.int32(y * np.float32(height)), height - 1)
    return row(textures.pixels, textures.offset[image] + line * width + column)


@part
def emitted(scene, triangle, u, v, back, kind):
    """Radiance that a point of a triangle emits, to its back or else its front, where rays of a kind end on it."""
    if not scene.emits[scene.object[triangle]]:
        return ZERO, ZERO, ZERO
    return look_up(scene, scene.materials.emission, triangle, u, v, back, kind)


@kernel
def points_of(scene, triangle, u, v, out):
    """`point_at` of many."""
    for i in range(len(triangle)):
        put(out, i, point_at(scene, triangle[i], u[i], v[i]))


@kernel
def barycentrics_of(scene, triangle, positions, u, v):
    """`barycentrics` of many."""
    for i in range(len(triangle)):
        u[i], v[i] = barycentrics(scene, triangle[i], row(positions, i))


@kernel
def plane_coordinates_of(scene, triangle, positions, u, v):
    """`plane_coordinates` of many."""
    for i in range(len(triangle)):
        u[i], v[i] = plane_coordinates(scene, triangle[i], row(positions, i))


@kernel
def shading_normals_of(scene, triangle, u, v, normals, out):
    """`shading_normal` of many, on the side of `normals`."""
    for i in range(len(triangle)):
        normal = row(normals, i)
        back = dot(row(scene.normals, triangle[i]), normal) < ZERO
        put(out, i, shading_normal_at(scene, triangle[i], u[i], v[i], normal, back))


@kernel
def ray_offsets_of(scene, triangle, positions, out):
    """`ray_offset` of many."""
    for i in range(len(triangle)):
        out[i] = ray_offset(scene, triangle[i], row(positions, i))


@kernel
def look_up_of(scene, channel, triangle, u, v, back, out):
    """`look_up` of many."""
    for i in range(len(triangle)):
        put(out, i, look_up(scene, channel, triangle[i], u[i], v[i], back[i], _DIFFUSE_RAY))


@kernel
def albedos_of(scene, triangle, u, v, back, kind, out):
    """Diffuse albedos of many points that rays of a kind see, before what layers take."""
    start = scene.materials.closures.start
    for i in range(len(triangle)):
        material = material_seen(scene, triangle[i], back[i], kind)
        of = start[material], start[material + 1]
        albedo = weight_of_kind(scene, _DIFFUSE, *of, triangle[i], u[i], v[i])
        put(out, i, plus(albedo, weight_of_kind(scene, _SUBSURFACE, *of, triangle[i], u[i], v[i])))
