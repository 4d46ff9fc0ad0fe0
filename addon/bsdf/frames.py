"""The frames in which closures scatter: around normals of their own, from normal maps and heights, along tangents.

The local frame of a point has the interpolated normal as +z, and each closure scatters in it. Only in a material of
which a closure has a normal or a tangent of its own is +z the geometric normal instead, with a `Frame` of each closure.
There light is weighed as Cycles has it (`bsdf.h`, `bsdf_util.h`): N is the closure's normal, n the geometric and s the
interpolated one.
"""

from typing import NamedTuple

import numpy as np

from ..core.compiling import part, routine
from ..core.sampling.warps import TWO_PI
from ..core.vec3 import ONE, ZERO, dot, minus, negative, normalized, plus, times, to_local, to_world
from ..scene.closures import NARROW, Lobe, NormalSpace
from ..scene.hit import between_corners, channel_at, corners, shading_normal_at

_TRANSLUCENT, _SUBSURFACE = int(Lobe.TRANSLUCENT), int(Lobe.SUBSURFACE)
_MIRRORING = sum(1 << lobe for lobe in (Lobe.TRANSLUCENT, Lobe.SUBSURFACE, *NARROW))
_TANGENT, _OBJECT, _HEIGHT = int(NormalSpace.TANGENT), int(NormalSpace.OBJECT), int(NormalSpace.HEIGHT)
_TINY, _LEAST_COS, _NEAR = np.float32(1e-20), np.float32(1e-6), np.float32(1e-12)
_TWO, _FOUR, _QUARTER, _EIGHTH = np.float32(2), np.float32(4), np.float32(0.25), np.float32(0.125)
_AT_45 = np.float32(np.sqrt(0.5))
_SHALLOW, _AS_SHALLOW = np.float32(0.01), np.float32(0.9)
_MOST = np.float32(16)
"""Beyond it light grazes the facet, where very few photons meet it."""

UP = ZERO, ZERO, ONE


class Frame(NamedTuple):
    """A closure's frame within the local frame of its point.

    Attributes
    ----------
    own : bool
        Whether it is another than that.
    axis : triple
        Its normal, in the local frame.
    turn : pair
        Cosine and sine of its tangent's azimuth in the frame that `to_local` makes of the axis.
    """

    own: bool
    axis: tuple
    turn: tuple


THE_POINTS = Frame(False, UP, (ONE, ZERO))
"""That of the point, which closures have without one of their own."""


@part
def frame_of(scene, bsdf, k, wo):
    """The frame of the k-th closure, which is viewed from a local direction."""
    if not bsdf.perturbed:
        return THE_POINTS
    axis, turn = to_local(own_normal(scene, bsdf, k, to_world(wo, bsdf.normal)), bsdf.normal), THE_POINTS.turn
    if scene.materials.closures.stretched[k]:
        turns = channel_at(scene, scene.materials.closures.stretch, k, bsdf.triangle, bsdf.u, bsdf.v)[1]
        turn = _turn(scene.corner_tangents, bsdf.triangle, bsdf.u, bsdf.v, bsdf.normal, axis, turns)
    return Frame(True, axis, turn)


@routine
def _turn(corner_tangents, triangle, u, v, normal, axis, turns):
    """The azimuth of a tangent around an axis of the local frame of a normal, turned further about it."""
    if len(corner_tangents) == 0:
        return THE_POINTS.turn
    tangent = _tangent(corner_tangents, 2, triangle, u, v)
    x, y, _ = to_local(to_local(tangent, normal), axis)
    size = np.sqrt(x * x + y * y)
    if size <= ZERO:
        return THE_POINTS.turn
    cos, sin = np.cos(TWO_PI * turns), np.sin(TWO_PI * turns)
    x, y = x / size, y / size
    return x * cos - y * sin, x * sin + y * cos


@part
def into(frame, w):
    """A local direction of a point in a closure's frame: the one place where they part, for axes and for azimuths."""
    if not frame.own:
        return w
    x, y, z = to_local(w, frame.axis)
    cos, sin = frame.turn
    return x * cos + y * sin, y * cos - x * sin, z


@part
def out_of(frame, w):
    """A direction of a closure's frame in the local frame of its point."""
    if not frame.own:
        return w
    cos, sin = frame.turn
    return to_world((w[0] * cos - w[1] * sin, w[0] * sin + w[1] * cos, w[2]), frame.axis)


@part
def own_normal(scene, bsdf, k, view):
    """Unit normal of the k-th closure in the world, as it is seen from a direction of the world.

    Glossy, glass and, as in Cycles, translucent and subsurface ones that would mirror the view into the surface are
    turned. Where light leaves a body on a walk's way out, that is the view.
    Of a photon in gloss, whose view is not known before it is scattered, that is by where it comes from.
    """
    closures = scene.materials.closures
    shading = shading_normal_at(scene, bsdf.triangle, bsdf.u, bsdf.v, bsdf.normal, bsdf.back)
    if closures.normal_space[k] < 0:
        return shading
    at = bsdf.triangle, bsdf.u, bsdf.v, bsdf.back
    return _own_normal(scene, k, *at, shading, bsdf.normal, view, _MIRRORING >> closures.kind[k] & 1 == 1)


@routine
def _own_normal(scene, k, triangle, u, v, back, shading, geometric, view, mirrors):
    """`own_normal` of a closure that has one, and of one that `mirrors` such that the view is to the right side."""
    closures, strength = scene.materials.closures, ONE
    space, vector = closures.normal_space[k], channel_at(scene, closures.normal, k, triangle, u, v)
    if space == _HEIGHT:
        strength = vector[2]
        slope = _slope(scene, triangle, vector[0], vector[1])
        # As Cycles has it, the slope lies in the plane of the shading normal
        lean = dot(slope, shading) / max(dot(geometric, shading), _LEAST_COS)
        normal = normalized(minus(shading, minus(slope, times(geometric, lean))))
    else:
        if space == _TANGENT:
            normal = plus(
                times(_tangent(scene.corner_tangents, 0, triangle, u, v), vector[0]),
                times(_tangent(scene.corner_tangents, 1, triangle, u, v), vector[1]),
            )
            normal = plus(normal, times(between_corners(scene.corner_normals, triangle, u, v), vector[2]))
        else:
            strength, normal = np.sqrt(dot(vector, vector)), vector
            if space == _OBJECT:
                normal = _turned(scene.normal_matrices, scene.object[triangle], vector)
        normal = normalized(negative(normal) if back else normal)
    normal = normalized(plus(times(normal, strength), times(shading, ONE - strength)))
    if dot(normal, normal) < np.float32(0.5):
        normal = shading
    return _valid_normal(geometric, view, normal) if mirrors else normal


@part
def _tangent(tangents, i, triangle, u, v):
    """The i-th of the tangents at triangles' corners (t, 3, 3, 3), interpolated."""
    return between_corners(tangents[:, :, i], triangle, u, v)


@part
def _turned(matrices, k, a):
    """A triple times the k-th of matrices (n, 3, 3)."""
    return (
        matrices[k, 0, 0] * a[0] + matrices[k, 0, 1] * a[1] + matrices[k, 0, 2] * a[2],
        matrices[k, 1, 0] * a[0] + matrices[k, 1, 1] * a[1] + matrices[k, 1, 2] * a[2],
        matrices[k, 2, 0] * a[0] + matrices[k, 2, 1] * a[1] + matrices[k, 2, 2] * a[2],
    )


@part
def _slope(scene, triangle, x, y):
    """Gradient over a triangle of a height with derivatives x, y by texture coordinates."""
    uvs, (a, b, c) = scene.corner_uvs, corners(scene, triangle)
    first, second = minus(b, a), minus(c, a)
    along_first = x * (uvs[triangle, 1, 0] - uvs[triangle, 0, 0]) + y * (uvs[triangle, 1, 1] - uvs[triangle, 0, 1])
    along_second = x * (uvs[triangle, 2, 0] - uvs[triangle, 0, 0]) + y * (uvs[triangle, 2, 1] - uvs[triangle, 0, 1])
    d11, d12, d22 = dot(first, first), dot(first, second), dot(second, second)
    scale = ONE / max(d11 * d22 - d12 * d12, _TINY)
    p = (d22 * along_first - d12 * along_second) * scale
    q = (d11 * along_second - d12 * along_first) * scale
    return plus(times(first, p), times(second, q))


@part
def _valid_normal(n, view, normal):
    """A normal N that reflects a view to the surface's side, turned towards n as little as that takes.

    With x the direction of N across n, the view V = (Vx, ·, Vz) and N' = (Nx, 0, Nz) the mirrored direction has the
    height 2 (N'·V) Nz − Vz = t over the surface. Its square is a Nz⁴ − b Nz² + c/4 = 0, a = Vx² + Vz², b = a + Vz t
    and c = (t + Vz)².
    """
    vz = dot(view, n)
    t = min(_AS_SHALLOW * vz, _SHALLOW)
    if vz <= ZERO or _TWO * dot(normal, view) * dot(normal, n) - vz >= t:
        return normal
    x = normalized(minus(normal, times(n, dot(normal, n))))
    vx = dot(view, x)
    a, b, c = vx * vx + vz * vz, _TWO * (vx * vx + vz * vz + vz * t), (t + vz) * (t + vz)
    root = np.sqrt(max(b * b - _FOUR * a * c, ZERO))
    square = min(max(_QUARTER * (b + root if vx < ZERO else b - root) / max(a, _TINY), ZERO), ONE)
    return plus(times(x, np.sqrt(ONE - square)), times(n, np.sqrt(square)))


@part
def bump_shadowing(shading, normal, light):
    """Share of light from a direction that a closure with its own normal takes beside the cosine.

    It has no light from behind the interpolated surface, and less where that grazes it: by Smith's masking of GGX
    facets with α² = tan²/8 of the angle between the normals (Conty Estevez, Lecocq and Stein, "A Microfacet-Based
    Shadowing Function to Solve the Bump Terminator Problem", 2019).
    """
    cos_light, cos_normal = dot(shading, light), dot(shading, normal)
    if cos_light * cos_normal * dot(normal, light) < ZERO:
        return ZERO
    light2, normal2 = cos_light * cos_light, cos_normal * cos_normal
    if light2 < _NEAR:
        return ZERO
    alpha2 = min(_EIGHTH * (ONE / max(normal2, _TINY) - ONE), ONE)
    tan2 = ONE / light2 - ONE
    return _TWO / (ONE + np.sqrt(max(ONE + alpha2 * tan2, ONE)))


@part
def bump_shadowing_in(scene, bsdf, frame, light):
    """`bump_shadowing` of light from a local direction, by a closure with a frame.

    What translucent closures take is not shadowed: so it is where Cycles samples them, if not where it samples lamps.
    """
    shading = shading_normal_at(scene, bsdf.triangle, bsdf.u, bsdf.v, bsdf.normal, bsdf.back)
    return bump_shadowing(to_local(shading, bsdf.normal), frame.axis, light)


@part
def received(scene, bsdf, k, light):
    """What a Lambertian closure takes of light from a local direction ω: (N·ω)⁺/|n·ω| and what bumps shadow of it.

    Of a material without normals of its own it is 1: light is measured on its interpolated normal.
    """
    if not bsdf.perturbed:
        return ONE
    kind = scene.materials.closures.kind[k]
    if kind in (_TRANSLUCENT, _SUBSURFACE):
        cos = _mean_cosine_through(scene, bsdf, k, light, kind == _SUBSURFACE)
        return min(cos / max(abs(light[2]), _LEAST_COS), _MOST)
    frame = frame_of(scene, bsdf, k, UP)
    cos = dot(frame.axis, light)
    if cos <= ZERO:
        return ZERO
    share = min(cos / max(abs(light[2]), _LEAST_COS), _MOST)
    return share * bump_shadowing_in(scene, bsdf, frame, light)


@routine
def _mean_cosine_through(scene, bsdf, k, light, shadowed):
    """The mean (N·ω)⁺ of a closure over its views, by which its normal is turned (`own_normal`), with bumps' shadows.

    A cache keeps one radiance for all of them. They are four at 45°, where half of the light leaves on either side.
    """
    total = ZERO
    shading = to_local(shading_normal_at(scene, bsdf.triangle, bsdf.u, bsdf.v, bsdf.normal, bsdf.back), bsdf.normal)
    for x, y in ((_AT_45, ZERO), (-_AT_45, ZERO), (ZERO, _AT_45), (ZERO, -_AT_45)):
        normal = to_local(own_normal(scene, bsdf, k, to_world((x, y, _AT_45), bsdf.normal)), bsdf.normal)
        cos = max(dot(normal, light), ZERO)
        total += cos * bump_shadowing(shading, normal, light) if shadowed else cos
    return total * _QUARTER


@part
def adjoint(wo, wi, own_wo, own_wi):
    """What a photon's weight is multiplied by where a closure's normal N scatters it from wo to wi.

    A lobe's weight is f |N·ωi| over the density; of photons, which arrive and leave by cosines with the geometric
    normal n, it is f |N·ωo|/|n·ωo| |n·ωi| (Veach 1997, 5.3.2). Takes both directions in the local frame, whose z is n,
    and in the closure's.
    """
    arrives = abs(own_wo[2]) / max(abs(wo[2]), _LEAST_COS)
    leaves = abs(wi[2]) / max(abs(own_wi[2]), _LEAST_COS)
    return min(arrives * leaves, _MOST)
