"""A photon's way from its source to the first surface, which is the only one that light linking has a say in."""

import numpy as np

from ..emitters import Source
from ..scene import Scene
from ..tracing import Hits, TransparencyTracer

_MAX_PASSED = 32


def first_flight(
    scene: Scene,
    tracer: TransparencyTracer,
    source: Source,
    origins: np.ndarray,
    directions: np.ndarray,
    power: np.ndarray,
    random: np.random.Generator,
) -> tuple[Hits, np.ndarray]:
    """Where photons first meet a surface that their source lights, and their power there, (n, 3) W.

    Objects that do not block the source let its light through, yet are lit where the source illuminates them: there
    half of the photons stop and half go on, with twice the power. Objects that block it without being illuminated
    take the photons' power. What see-through surfaces leave of it is in the power, too.

    Parameters
    ----------
    origins, directions, power : (n, 3) float32
        As emitted.
    """
    objects = scene.objects
    lit = np.ones(len(objects.names), bool) if source.illuminates is None else source.illuminates
    blocks = objects.casts_shadow if source.blocked_by is None else objects.casts_shadow & source.blocked_by
    hits = tracer.closest_hit(origins, directions)
    power = hits.tinted(power)
    if (lit & blocks)[objects.scatters].all():
        return hits, _unless_shadowed(scene, tracer, blocks, origins, hits, directions, power)

    hits, power = hits.with_tint(), power.copy()
    flying = np.flatnonzero(hits.hit)
    for _ in range(_MAX_PASSED):
        of_object = scene.object_of_triangle[hits.triangle[flying]]
        either = lit[of_object] & ~blocks[of_object]
        power[flying[blocks[of_object] & ~lit[of_object]]] = 0
        power[flying[either]] *= 2
        stops = blocks[of_object] | (either & (random.random(len(flying), dtype=np.float32) < np.float32(0.5)))
        flying = flying[~stops]
        if len(flying) == 0:
            break
        beyond = tracer.beyond(directions[flying], hits.where(flying))
        power[flying] = beyond.tinted(power[flying])
        hits.put(flying, beyond)
        flying = flying[beyond.hit]
    power[flying] = 0  # lost after too many objects
    return hits, _unless_shadowed(scene, tracer, blocks, origins, hits, directions, power)


def _unless_shadowed(
    scene: Scene,
    tracer: TransparencyTracer,
    blocks: np.ndarray,
    origins: np.ndarray,
    hits: Hits,
    directions: np.ndarray,
    power: np.ndarray,
) -> np.ndarray:
    """The power that objects leave that cast shadows although photons do not meet them."""
    unseen = blocks & ~scene.objects.scatters
    k = np.flatnonzero(hits.hit)
    if not unseen.any() or len(k) == 0:
        return power
    power = power.copy()
    near = hits.distance[k] * np.float32(1 - 1e-4)
    power[k] *= tracer.transmittance(origins[k], directions[k], near, blocks=unseen)
    return power
