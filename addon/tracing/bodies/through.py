"""Light through a body: what a photon that enters it becomes, and where it comes out; see `bsdf.subsurface`."""

import numpy as np

from ...bsdf.closure import bsdf_at
from ...bsdf.frames import UP, adjoint, frame_of, into, out_of
from ...bsdf.mixture import SUBSURFACE, choose_closure
from ...bsdf.scatter import Scattered, mean_normal
from ...bsdf.subsurface.interface import enter, leave
from ...bsdf.subsurface.medium import medium_at
from ...core.compiling import part, routine
from ...core.sampling.path_numbers import two_numbers
from ...core.vec3 import BLACK, ONE, ZERO, dot, mul, negative, times, to_local, to_world
from ...scene.hit import hit_at, off_surface
from ..embree import BODIES
from .walk import N_PAIRS, no_exit, walk

_SUBSURFACE_LOBE = 1 << SUBSURFACE
_STREAM = np.uint64(0xD1B54A32D192ED03)  # that walks' numbers are apart from those of the surfaces on a path


@part
def walk_key(key, bounce):
    """The key of the numbers of a path's walk after so many surfaces."""
    return key ^ (np.uint64(bounce + 1) * _STREAM)


@part
def exit_of(tracing, room, hit, medium, direction, key, path):
    """The `Exit` of a walk along a direction of the world from a hit, by the first `N_PAIRS` of a path's numbers."""
    return walk(tracing.scene, tracing.trees[BODIES], room, hit, direction, medium, key, path)


@part
def outside_of(scene, exit_):
    """The surface where a walk comes out, as a `Hit` of its outer side."""
    return hit_at(scene, negative(exit_.direction), exit_.triangle, ZERO, exit_.u, exit_.v)


@part
def body_normal(scene, hit, seen, view):
    """The normal of a body's surface where light passes it, as rays of a `RayKind` see its subsurface closures."""
    return mean_normal(scene, hit, seen, _SUBSURFACE_LOBE, view)


@routine
def seen_walk(tracing, room, hit, bsdf, k, axis, wo, choice, u, v, key, path):
    """The `Exit` of what a view from the local direction wo around an axis sees by a point's k-th closure."""
    scene = tracing.scene
    medium, frame = medium_at(scene, k, hit.triangle, hit.u, hit.v), frame_of(scene, bsdf, k, wo)
    own_wo = into(frame, wo)
    if own_wo[2] <= ZERO:
        return no_exit()
    inside = enter(medium, own_wo, choice, u, v)
    inwards = to_world(out_of(frame, inside.direction), axis)
    if inside.weight <= ZERO or dot(inwards, hit.normal) >= ZERO:
        return no_exit()
    return exit_of(tracing, room, hit, medium, inwards, key, path)


@part
def medium_of(scene, hit, seen, choice):
    """The medium of a hit, as rays of a `RayKind` see it; of several one, by their weights."""
    bsdf = bsdf_at(scene, hit, seen)
    chosen, _, _ = choose_closure(scene, bsdf, UP, choice, _SUBSURFACE_LOBE, True)
    return medium_at(scene, max(chosen, bsdf.first), hit.triangle, hit.u, hit.v)


@routine
def entered(tracing, room, hit, direction, seen, key, path):
    """The `Exit` of what enters a body against a direction of the world."""
    choice, _ = two_numbers(key, path, N_PAIRS)
    medium = medium_of(tracing.scene, hit, seen, choice)
    return exit_of(tracing, room, hit, medium, negative(direction), key, path)


@routine
def through_body(tracing, room, hit, on, seen, key, path):
    """How a photon flies on whose way `on` (`Scattered`) off the surface, mirrored, leads into the body."""
    scene = tracing.scene
    choice, other = two_numbers(key, path, N_PAIRS)
    medium = medium_of(scene, hit, seen, choice)
    exit_ = exit_of(tracing, room, hit, medium, negative(on.direction), key, path)
    if not exit_.found:
        return Scattered(False, on.origin, on.direction, BLACK, on.lobe, on.kind, False, False, ONE)
    out = outside_of(scene, exit_)
    u, v = two_numbers(key, path, N_PAIRS + 1)
    axis = body_normal(scene, out, seen, out.normal)  # of all views that may be
    inside = to_local(exit_.direction, axis)
    left = leave(medium, inside, other, u, v)
    onward = to_world(left.direction, axis)
    alive = left.weight > ZERO and inside[2] > ZERO and dot(onward, out.normal) > ZERO
    weight = BLACK
    if alive:  # by the cosines with the geometric normal, and not the view's own
        cosines = adjoint(to_local(exit_.direction, out.normal), to_local(onward, out.normal), inside, left.direction)
        weight = times(mul(on.weight, exit_.weight), left.weight * cosines)
    return Scattered(alive, off_surface(scene, out, ONE), onward, weight, on.lobe, on.kind, False, False, ONE)
