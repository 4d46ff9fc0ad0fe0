"""Light through a body: what a photon that enters it becomes, and where it comes out; see `bsdf.subsurface`."""

import numpy as np

from ...bsdf.closure import bsdf_at
from ...bsdf.frames import UP
from ...bsdf.mixture import SUBSURFACE, choose_closure
from ...bsdf.scatter import Scattered
from ...bsdf.subsurface.interface import leave
from ...bsdf.subsurface.medium import medium_at
from ...core.compiling import part, routine
from ...core.sampling.path_numbers import two_numbers
from ...core.vec3 import BLACK, ONE, ZERO, mul, negative, times, to_local, to_world
from ...scene.hit import hit_at, off_surface
from ..embree import BODIES
from .walk import N_PAIRS, walk

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
def medium_of(scene, hit, seen, choice):
    """The medium of a hit, as rays of a `RayKind` see it; of several one, by their weights."""
    bsdf = bsdf_at(scene, hit, seen)
    chosen, _, _ = choose_closure(scene, bsdf, UP, choice, 1 << SUBSURFACE, True)
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
        return Scattered(False, on.origin, on.direction, BLACK, on.lobe, on.kind, False, False)
    out = outside_of(scene, exit_)
    u, v = two_numbers(key, path, N_PAIRS + 1)
    left = leave(medium, to_local(exit_.direction, out.normal), other, u, v)
    weight = times(mul(on.weight, exit_.weight), left.weight)
    onward = to_world(left.direction, out.normal)
    return Scattered(left.weight > ZERO, off_surface(scene, out, ONE), onward, weight, on.lobe, on.kind, False, False)
