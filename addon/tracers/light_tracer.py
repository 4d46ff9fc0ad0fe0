"""How light travels between surfaces: past and through those that let it pass.

A surface of coverage c stops a ray with the probability c and lets it through otherwise, so that cut-out leaves stop
photons where they are opaque. Whether it does is drawn from the ray itself (a hash of its origin and direction), which
makes it the same whichever thread asks.
"""

from dataclasses import replace

import numpy as np

from ..scene import Scene
from .coincident import CoincidentSurfaces
from .protocol import Hits, RayKind, Tracer

_MAX_SURFACES = 64  # see-through surfaces along one ray
_MIX_1, _MIX_2, _STEP = np.uint32(0x7FEB352D), np.uint32(0x846CA68B), np.uint32(0x9E3779B9)


class LightTracer:
    """A tracer for light in a scene with see-through surfaces; without them it adds nothing to `tracer`.

    Parameters
    ----------
    scene : Scene
    tracer : Tracer

    Attributes
    ----------
    surfaces : Tracer
        `tracer`: where any surface is, see-through or not.
    """

    def __init__(self, scene: Scene, tracer: Tracer) -> None:
        self._scene, self.surfaces = scene, tracer
        # One more entry for triangle −1
        self._see_through = np.append(scene.materials.see_through[scene.material_of_triangle], False)
        self._any_see_through = bool(self._see_through.any())
        self._coincident = CoincidentSurfaces(scene, tracer)
        self._tints = self._any_see_through or self._coincident.any
        objects = scene.objects
        self._kinds_differ = not (
            np.array_equal(objects.scatters, objects.seen_in_gloss)
            and np.array_equal(objects.scatters, objects.seen_through_glass)
        )

    def closest_hit(
        self, origins: np.ndarray, directions: np.ndarray, kind: np.ndarray | RayKind = RayKind.DIFFUSE
    ) -> Hits:
        """Where each ray is stopped; `kind` is one for all or (n,) of `RayKind`."""
        if isinstance(kind, RayKind) or not self._kinds_differ:
            return self._stopped(origins, directions, kind if isinstance(kind, RayKind) else RayKind.DIFFUSE)
        hits = Hits.none(len(origins))
        if self._tints:
            hits = hits.with_tint()
        for one in np.unique(kind):
            k = np.flatnonzero(kind == one)
            hits.put(k, self._stopped(origins[k], directions[k], RayKind(one)))
        return hits

    def _stopped(self, origins: np.ndarray, directions: np.ndarray, kind: RayKind) -> Hits:
        """Hits of rays of one kind, see-through surfaces passed with the probability that they let light through."""
        hits = self.surfaces.closest_hit(origins, directions, kind=kind)
        if not self._tints:
            return hits
        hits = hits.with_tint()
        if self._any_see_through:
            self._pass_through(hits, origins, directions, kind)
        assert hits.tint is not None
        hits.tint[self.smothered(hits.triangle, hits.u, hits.v)] = 0
        return hits

    def smothered(self, triangle: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Whether another surface lies where points of triangles are, so that no light leaves them, (n,) bool."""
        return self._coincident.smother(triangle, u, v)

    def _pass_through(self, hits: Hits, origins: np.ndarray, directions: np.ndarray, kind: RayKind) -> None:
        """Move hits on to where the rays are stopped."""
        scene, materials = self._scene, self._scene.materials
        open_ = np.flatnonzero(self._see_through[hits.triangle])
        for step in range(_MAX_SURFACES):
            # Draw which rays go through
            met = hits.where(open_)
            coverage = scene.look_up(materials.coverage, met.triangle, met.u, met.v)[:, 0]
            through = np.flatnonzero(_hash(origins[open_], directions[open_], step) >= coverage)
            if len(through) == 0:
                break
            k, met = open_[through], met.where(through)

            # Send them on from behind the surface
            tint = met.tint * scene.look_up(materials.tint, met.triangle, met.u, met.v)
            start = origins[k] + met.distance[:, None] * directions[k]
            gap = scene.ray_offset(start)
            onward = self.surfaces.closest_hit(start + gap * directions[k], directions[k], kind=kind)
            distance = onward.distance + met.distance + gap[:, 0]
            hits.put(k, replace(onward, distance=distance, tint=tint))
            open_ = k[self._see_through[onward.triangle]]

    def visibility(self, origins: np.ndarray, targets: np.ndarray) -> np.ndarray:
        """Share of the light that passes from each origin to its target, (n, 3) or (n, 1) float32."""
        blocked = self.surfaces.occluded(origins, targets)
        passes = (~blocked)[:, None].astype(np.float32)
        if not self._any_see_through or not blocked.any():
            return passes
        k = np.flatnonzero(blocked)
        passes = np.repeat(passes, 3, axis=1)
        way = targets[k] - origins[k]
        length = np.linalg.norm(way, axis=1, keepdims=True)
        passes[k] = self.transmittance(origins[k], way / np.maximum(length, 1e-30), length[:, 0] * np.float32(1 - 1e-4))
        return passes

    def transmittance(
        self, origins: np.ndarray, directions: np.ndarray, t_max: np.ndarray, blocks: np.ndarray | None = None
    ) -> np.ndarray:
        """What surfaces that cast shadows leave of the light along each ray as far as `t_max` (n,), (n, 3) float32.

        Parameters
        ----------
        blocks : (o,) bool, optional
            Objects that count; all without it.
        """
        scene, materials = self._scene, self._scene.materials
        passes = np.ones((len(origins), 3), np.float32)
        ray, left = np.arange(len(origins)), np.asarray(t_max, np.float32)
        for _ in range(_MAX_SURFACES):
            hits = self.surfaces.closest_hit(origins, directions, left, kind=RayKind.SHADOW)
            k = np.flatnonzero(hits.hit)
            hits, ray, origins, directions, left = hits.where(k), ray[k], origins[k], directions[k], left[k]
            if len(ray) == 0:
                return passes
            share = scene.look_up(materials.tint, hits.triangle, hits.u, hits.v)
            share *= 1 - scene.look_up(materials.coverage, hits.triangle, hits.u, hits.v)
            if blocks is not None:
                share[~blocks[scene.object_of_triangle[hits.triangle]]] = 1
            passes[ray] *= share
            start = origins + hits.distance[:, None] * directions
            gap = scene.ray_offset(start)
            left = left - hits.distance - gap[:, 0]
            k = np.flatnonzero((share > 0).any(axis=1) & (left > 0))
            origins, directions, left, ray = start[k] + gap[k] * directions[k], directions[k], left[k], ray[k]
        passes[ray] = 0
        return passes


def _hash(origins: np.ndarray, directions: np.ndarray, step: int) -> np.ndarray:
    """A number in [0, 1) of each ray and step, (n,) float32, by the mixing of Wellons' "Hash Function Prospector"."""
    bits = np.concatenate([origins, directions], axis=1).astype(np.float32).view(np.uint32)
    mixed = np.full(len(bits), step + 1, np.uint32) * _STEP
    for column in bits.T:
        mixed = mixed ^ column
        mixed = (mixed ^ (mixed >> np.uint32(16))) * _MIX_1
        mixed = (mixed ^ (mixed >> np.uint32(15))) * _MIX_2
        mixed ^= mixed >> np.uint32(16)
    return (mixed >> np.uint32(8)).astype(np.float32) * np.float32(2**-24)
