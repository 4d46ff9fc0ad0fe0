"""Emissive faces that lie in the place of others, as panels do that are flush with a wall."""

import numpy as np

from ..core.sampling.vectors import dot
from ..scene import Scene
from .protocol import Hits, Tracer


def flush_emitters(scene: Scene, tracer: Tracer, first: np.ndarray, second: np.ndarray) -> list[tuple[int, int]]:
    """Emissive objects of which faces lie in the place of opaque ones, and the objects of these.

    A solid lamp that stands on something does not count: nothing is seen of its emissive foot, and what lies before
    that turns its back to it, or is nothing. Inside of a solid a ray meets the same object's light.

    Parameters
    ----------
    first, second : (p,) int32
        Pairs of triangles in one place, each both ways round.
    """
    opaque = ~scene.materials.see_through[scene.material_of_triangle]
    k = np.flatnonzero(scene.shines[first] & opaque[second])
    first, second = first[k], second[k]
    facing = dot(scene.normals[first], scene.normals[second])
    seen = np.ones(len(k), bool)
    emitter, of_pair = np.unique(first, return_inverse=True)
    sides = [_met(scene, tracer, emitter, np.float32(side)) for side in (1, -1)]
    inside = [side.hit & _same_light(scene, emitter, side.triangle) for side in sides]
    for outward, within, before in zip((1, -1), inside[::-1], sides, strict=True):
        foot = (outward * facing < 0) | ~before.hit[of_pair]
        seen &= ~(within[of_pair] & foot)
    objects = scene.object_of_triangle[np.stack([first, second], axis=1)[seen]]
    pairs = dict.fromkeys((int(one), int(other)) for one, other in np.unique(objects, axis=0))
    return [(a, b) for a, b in pairs if a <= b or (b, a) not in pairs]  # of two that emit, one sentence


def _same_light(scene: Scene, triangle: np.ndarray, other: np.ndarray) -> np.ndarray:
    return scene.shines[other] & (scene.object_of_triangle[other] == scene.object_of_triangle[triangle])


def _met(scene: Scene, tracer: Tracer, triangle: np.ndarray, side: np.float32) -> Hits:
    """What rays meet that leave the middles of triangles at right angles."""
    third = np.full(len(triangle), 1 / 3, np.float32)
    x, directions = scene.points(triangle, third, third), side * scene.normals[triangle]
    return tracer.closest_hit(x + 4 * scene.ray_offset(triangle, x) * directions, directions)
