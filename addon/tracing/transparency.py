"""How light travels between surfaces: past and through those that let it pass.

A surface of coverage c stops a ray with the probability c and lets it through otherwise, so that cut-out leaves stop
photons where they are opaque. Whether it does is drawn from the ray itself (a hash of its origin and direction), which
makes it the same whichever thread asks.
"""

from dataclasses import replace

import numpy as np

from ..core.progress import Progress
from ..core.sampling.vectors import rows
from ..scene import RayKind, Scene, seen_by
from .coincident import CoincidentSurfaces
from .onward import onward
from .protocol import Hits, Tracer

_MAX_SURFACES = 64  # see-through surfaces along one ray
_MIX_1, _MIX_2, _STEP = np.uint32(0x7FEB352D), np.uint32(0x846CA68B), np.uint32(0x9E3779B9)


class LightTracer:
    """A tracer for light in a scene with see-through surfaces; without them it adds nothing to `tracer`.

    Parameters
    ----------
    scene : Scene
    tracer : Tracer
    progress : Progress, optional
        Of the search for surfaces in one place.

    Attributes
    ----------
    surfaces : Tracer
        `tracer`: where any surface is, see-through or not.
    """

    def __init__(self, scene: Scene, tracer: Tracer, progress: Progress | None = None) -> None:
        self._scene, self.surfaces = scene, tracer
        # One more entry for triangle −1
        self._see_through = np.append(scene.materials.see_through[scene.material_of_triangle], False)
        self._any_see_through = bool(self._see_through.any())
        self._coincident = CoincidentSurfaces(scene, tracer, progress or Progress())
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
        if self._coincident.any:
            self._coincident.bring_forward(hits, seen_by(self._scene.objects, kind))
            hits = replace(hits, tint=hits.tinted(self._coincident.leave(hits.triangle, hits.u, hits.v)))
        return hits

    @property
    def flush_emitters(self) -> list[tuple[str, str]]:
        """Names of emissive objects, and of those whose place they share."""
        names = self._scene.objects.names
        return list(dict.fromkeys((names[one], names[other]) for one, other in self._coincident.flush_emitters))

    def smothered(self, triangle: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Whether an opaque surface lies where points of triangles are, so that no light leaves them, (n,) bool."""
        return self._coincident.smother(triangle, u, v)

    def _pass_through(self, hits: Hits, origins: np.ndarray, directions: np.ndarray, kind: RayKind) -> None:
        """Move hits on to where the rays are stopped."""
        scene, materials = self._scene, self._scene.materials
        open_ = np.flatnonzero(self._see_through[hits.triangle])
        first = hits.triangle[open_]
        for step in range(_MAX_SURFACES):
            # Draw which rays go through
            met = hits.where(open_)
            coverage = scene.look_up(materials.coverage, met.triangle, met.u, met.v)[:, 0]
            through = np.flatnonzero(_hash(origins[open_], directions[open_], step) >= coverage)
            if len(through) == 0:
                break
            k, met, first = open_[through], met.where(through), first[through]

            # Send them on from behind the surface
            tint = met.tint * scene.look_up(materials.tint, met.triangle, met.u, met.v)
            beyond, first = self._onward(directions[k], met, first, np.inf, kind)
            hits.put(k, replace(beyond, tint=tint))
            left = np.flatnonzero(self._see_through[beyond.triangle])
            open_, first = k[left], first[left]

    def _onward(
        self,
        directions: np.ndarray,
        passed: Hits,
        first: np.ndarray,
        t_max: np.ndarray | float,
        kind: RayKind,
    ) -> tuple[Hits, np.ndarray]:
        """The surface that each ray meets after the one that it passed: another in the same place, else one beyond.

        Parameters
        ----------
        first : (n,) int32
            Triangle that the ray met first of those in the place passed; returned anew for the hits.
        """
        scene = self._scene

        def closest(starts: np.ndarray, ways: np.ndarray, left: np.ndarray) -> Hits:
            return self.surfaces.closest_hit(starts, ways, left, kind=kind)

        if not self._coincident.any:
            hits = onward(scene, closest, directions, passed, t_max)
            return hits, hits.triangle
        seen = seen_by(scene.objects, kind)
        triangle = self._coincident.following(passed.triangle, passed.u, passed.v, first, seen)
        here, beyond = np.flatnonzero(triangle >= 0), np.flatnonzero(triangle < 0)
        hits, at, triangle = Hits.none(len(triangle)), passed.where(here), triangle[here]
        u, v = scene.barycentrics(triangle, scene.points(at.triangle, at.u, at.v))
        hits.put(here, Hits(triangle, at.distance, u, v, rows(scene.normals, triangle)))
        t_max = np.broadcast_to(np.float32(t_max), len(directions))[beyond]
        hits.put(beyond, onward(scene, closest, directions[beyond], passed.where(beyond), t_max, first[beyond]))
        first = first.copy()
        first[beyond] = hits.triangle[beyond]
        return hits, first

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
        t_max = np.asarray(t_max, np.float32)
        hits = self.surfaces.closest_hit(origins, directions, t_max, kind=RayKind.SHADOW)
        ray, first = np.arange(len(origins)), hits.triangle
        for _ in range(_MAX_SURFACES):
            k = np.flatnonzero(hits.hit)
            hits, ray, first = hits.where(k), ray[k], first[k]
            if len(ray) == 0:
                return passes
            share = scene.look_up(materials.tint, hits.triangle, hits.u, hits.v)
            share *= 1 - scene.look_up(materials.coverage, hits.triangle, hits.u, hits.v)
            if blocks is not None:
                share[~blocks[scene.object_of_triangle[hits.triangle]]] = 1
            passes[ray] *= share
            k = np.flatnonzero((share > 0).any(axis=1))
            ray, passed = ray[k], hits.where(k)
            hits, first = self._onward(directions[ray], passed, first[k], t_max[ray], RayKind.SHADOW)
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
