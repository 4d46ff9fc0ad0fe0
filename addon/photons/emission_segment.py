"""A photon's way from its source to the first surface: where light linking has a say, and a lamp's fall-off."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..core.sampling.path_numbers import PathNumbers
from ..core.sampling.vectors import rows
from ..emitters import Source
from ..emitters.patterns.arrays import PatternArrays
from ..emitters.patterns.pattern import fall_off_of_many
from ..scene import Scene
from ..tracing import Hits, TransparencyTracer
from .front import Front

_MAX_PASSED = 32


@dataclass(frozen=True)
class LightLinking:
    """Which of o objects sources light, and which block their light.

    Attributes
    ----------
    group : (s,) int
        Sources that are linked alike are of one of g groups.
    group_of_object : (o,) int
        That of the photons that each object emits, where emissive objects are linked; (0,) where none is.
    lit, blocks : (g, o) bool
    met : (o,) bool
        Objects that photons meet.
    falls_off : (s,) int32
        The lamp of each source whose light falls off by another law than that it spreads; −1 of others.
    patterns : PatternArrays
        Of the lamps.
    """

    group: np.ndarray
    group_of_object: np.ndarray
    lit: np.ndarray
    blocks: np.ndarray
    met: np.ndarray
    falls_off: np.ndarray
    patterns: PatternArrays

    @staticmethod
    def of(scene: Scene, sources: Sequence[Source]) -> "LightLinking":
        """That of a scene's sources."""
        objects, groups = scene.objects, dict[bytes, tuple[int, np.ndarray, np.ndarray]]()

        def group_of(illuminates: np.ndarray | None, blocked_by: np.ndarray | None) -> int:
            lit = np.ones(len(objects.names), bool) if illuminates is None else illuminates
            blocks = objects.casts_shadow if blocked_by is None else objects.casts_shadow & blocked_by
            return groups.setdefault(lit.tobytes() + blocks.tobytes(), (len(groups), lit, blocks))[0]

        group = np.array([group_of(source.illuminates, source.blocked_by) for source in sources])
        of_objects = np.zeros(0, np.int64)
        if objects.links is not None:
            rows = zip(objects.links.illuminates, objects.links.blocked_by, strict=True)
            # The last is that of objects without links, whose group is −1
            of_objects = np.array([*(group_of(*row) for row in rows), group_of(None, None)])[objects.links.group]
        lit, blocks = (np.stack([masks[i] for masks in groups.values()]) for i in (1, 2))
        patterns, lamps = (
            sources[0].surroundings.lamps.patterns,
            np.array([source.lamp for source in sources], np.int32),
        )
        plain = np.append((patterns.distance_power == 0) & (patterns.smoothing <= 0), [True, True])
        falls_off = np.where(plain[lamps], np.int32(-1), lamps)
        return LightLinking(group, of_objects, lit, blocks, objects.scatters, falls_off, patterns)

    def group_of(self, front: Front, k: np.ndarray) -> np.ndarray:
        """The groups of photons k of a front that were just emitted."""
        group: np.ndarray = self.group[front.source[k]]
        if len(self.group_of_object) == 0:
            return group
        emitter = front.came_from[k]
        return np.where(emitter >= 0, self.group_of_object[emitter], group)

    @property
    def stops_all(self) -> bool:
        """Whether every photon ends at the first surface that it meets, and lights it."""
        return bool((self.lit & self.blocks)[:, self.met].all())


def emission_segment(
    scene: Scene, tracer: TransparencyTracer, linking: LightLinking, front: Front, random: PathNumbers
) -> Hits:
    """Where emitted photons first meet a surface that their source lights; the front's power becomes that there.

    Objects that do not block a source let its light through, yet are lit where the source illuminates them: there half
    of the photons stop and half go on, with twice the power. Objects that block it without being illuminated take the
    photons' power. What see-through surfaces leave of it is in the power, too.
    """
    hits = tracer.closest_hit(front.origin, front.direction, photons_to=front.kind)
    if hits.tint is not None:
        np.multiply(front.power, hits.tint, out=front.power)
    if not linking.stops_all:
        hits = _past_unlinked(scene, tracer, linking, front, hits.with_tint(), random)
    for group, unseen in enumerate(linking.blocks & ~linking.met):
        if unseen.any():
            hit = np.flatnonzero(hits.hit)
            _shade(tracer, unseen, front, hits, hit[linking.group_of(front, hit) == group])
    if (linking.falls_off >= 0).any():
        lamps = np.where(hits.hit, linking.falls_off[front.source], np.int32(-1))
        fall_off_of_many(linking.patterns, lamps, hits.distance, front.power)
    return hits


def _past_unlinked(
    scene: Scene, tracer: TransparencyTracer, linking: LightLinking, front: Front, hits: Hits, random: PathNumbers
) -> Hits:
    """Move hits on past objects that do not stop photons of their sources."""
    power, flying = front.power, np.flatnonzero(hits.hit)
    for _ in range(_MAX_PASSED):
        at = linking.group_of(front, flying), scene.object_of_triangle[hits.triangle[flying]]
        lit, blocks = linking.lit[at], linking.blocks[at]
        power[flying[blocks & ~lit]] = 0
        power[flying[lit & ~blocks]] *= 2
        half = random.of(front.path[flying]).random(len(flying)) < np.float32(0.5)
        flying = flying[~(blocks | (lit & half))]
        if len(flying) == 0:
            return hits
        beyond = tracer.beyond(rows(front.direction, flying), front.kind[flying], hits.where(flying))
        power[flying] = beyond.tinted(power[flying])
        hits.put(flying, beyond)
        flying = flying[beyond.hit]
    power[flying] = 0  # lost after too many objects
    return hits


def _shade(tracer: TransparencyTracer, blocks: np.ndarray, front: Front, hits: Hits, k: np.ndarray) -> None:
    """Leave photons k the power that objects leave of it which cast shadows although photons do not meet them."""
    near = hits.distance[k] * np.float32(1 - 1e-4)
    front.power[k] *= tracer.transmittance(rows(front.origin, k), rows(front.direction, k), near, blocks=blocks)
