"""Receivers that look at nothing while their back is open: those of a plane whose normals look at the wall behind it.

Light between surfaces comes to a side from the surfaces that it sees. Of rays around the normals of both sides, those
count that end on a surface farther away than `NEAR`: a side is open if a quarter of them does, as in the corner of a
room, and shut if next to none does.

Bodies that are inside out, whose normals look inwards, are asked by their light instead: seen from within, their faces
are wide apart, as those of a room are. Their back counts where not any light comes to their front.
"""

from dataclasses import dataclass, replace

import numpy as np

from ..core.parallel import Workers, slices
from ..core.sampling.vectors import dot
from ..photons import Photons
from ..receivers import AttributeTarget, Receivers
from ..scene import Scene
from ..tracing import Tracer
from .direct.ray_directions import gather_directions
from .irradiance import Irradiance

NEAR = 0.05
"""What is this near is in the way, as a share of the diagonal of the box around an object's receivers."""

SHUT, OPEN = 0.1, 0.25
"""Shares of a side's rays: at most, at least."""

MOSTLY = 0.5
"""Share of an object's receivers that makes it worth a warning."""

N_RAYS = 16
N_ASKED = 16
"""Receivers of an object that tell of all of it."""

BRIGHTER = 4.0
"""How many times as much light has to come to an object's back as to its front to be worth a warning."""

DARK = 1e-3
"""Of the light on the outside of an object that is inside out, at most as much comes to its inside."""

INWARDS = 0.01
"""How far the faces of an object look inwards at least, for it to be inside out: see `_inside_out`."""

_CHUNK = 1 << 12
_TRIANGLES = 1 << 17  # in a chunk
_STREAM = 91
_STAGE = "Looking at both sides"


@dataclass(frozen=True)
class OpenBacks:
    """Receivers whose front is shut and whose back is open, and those of objects that are inside out.

    Attributes
    ----------
    receiver : (b,) int32
    back : (b, 3) float32, m
        A point as far off the other side of their surface.
    only_if_dark : (b,) bool
        Whether it has the light of its back only where its front has next to none: it may be in a room.
    share : dict of str to float
        Of those of an object's receivers that were asked, how many have a shut front and an open back, by its name.
    inside_out : frozenset of str
        Names of objects with receivers whose faces look inwards, while others are around them.
    """

    receiver: np.ndarray
    back: np.ndarray
    only_if_dark: np.ndarray
    share: dict[str, float]
    inside_out: frozenset[str]

    @staticmethod
    def of(scene: Scene, receivers: Receivers, tracer: Tracer, workers: Workers, every: bool) -> "OpenBacks":
        """Those of the receivers for targets; ask every one of them, or a few of each object."""
        names = [target.object_name for target in receivers.targets]
        of_target = [_asked(target, every) for target in receivers.targets]
        counts = [len(part) for part in of_target]
        asked = np.concatenate([np.zeros(0, np.int32), *of_target])
        extents = [_extent(receivers.position[asked]) for asked in of_target]
        near = NEAR * np.repeat(np.array(extents, np.float32), counts)
        inside_out = _inside_out(scene)
        inside = np.repeat(np.array([name in inside_out for name in names], bool), counts)
        turned, sees, known = np.zeros((3, len(asked)), bool)
        backs = np.zeros((len(asked), 3), np.float32)

        def look(chunk: slice, random: np.random.Generator) -> tuple[np.ndarray, ...]:
            at = asked[chunk]
            place = receivers.position[at], receivers.normal[at], receivers.footprint[at]
            return _look(tracer, *place, near[chunk], inside[chunk], random)

        for chunk, found in workers.chunks(_STAGE, len(asked), _CHUNK, look, (_STREAM,)):
            turned[chunk], sees[chunk], known[chunk], backs[chunk] = found
        share, around = dict[str, float](), set[str]()
        for name, end, n in zip(names, np.cumsum(counts), counts, strict=True):
            of = slice(end - n, end)
            if n:
                share[name] = float(turned[of].mean())
            inside[of] &= sees[of].any()
            if inside[of].any():
                around.add(name)
        k = np.flatnonzero(turned | inside & known)
        return OpenBacks(asked[k], backs[k], ~turned[k], share, frozenset(around))

    def added_to(self, receivers: Receivers) -> Receivers:
        """The receivers, followed by one on the back of each of these."""
        k, n = self.receiver, len(receivers)
        if len(k) == 0:
            return receivers
        row = np.full(n, -1, np.int32)
        row[k] = np.arange(n, n + len(k), dtype=np.int32)
        targets = [_of_backs(target, row) for target in receivers.targets]
        takes = receivers.takes_caustics
        return Receivers(
            position=np.concatenate([receivers.position, self.back]),
            normal=np.concatenate([receivers.normal, -receivers.normal[k]]),
            footprint=np.concatenate([receivers.footprint, receivers.footprint[k]]),
            targets=(*receivers.targets, *targets),
            takes_caustics=None if takes is None else np.concatenate([takes, takes[k]]),
            directional=receivers.directional,
        )

    def taken(self, light: Irradiance, of_all: Irradiance | None = None) -> Irradiance:
        """Light of the receivers that `added_to` made as that of the first ones: of these, the brighter side's.

        Parameters
        ----------
        of_all : Irradiance, optional
            All light, by which that side is told, where `light` is a part of it.
        """
        if len(self.receiver) == 0:
            return light
        n = len(light.value) - len(self.receiver)
        row, brightness = np.arange(n), (of_all or light).value.mean(axis=1)
        lit = brightness[n:] > brightness[self.receiver] / np.where(self.only_if_dark, DARK, 1)
        row[self.receiver[lit]] = n + np.flatnonzero(lit)
        return replace(light.where(row), counts={**light.counts, "receivers": n})

    def lit_behind(self, scene: Scene, photons: Photons) -> list[str]:
        """Names of the objects that mostly turn their back to what is open, and to the light."""
        return _lit_behind(scene, photons, [name for name, share in self.share.items() if share >= MOSTLY], BRIGHTER)

    def lit_outside(self, scene: Scene, photons: Photons) -> list[str]:
        """Names of the objects that are inside out, and dark within."""
        return _lit_behind(scene, photons, sorted(self.inside_out), 1 / DARK)


def _lit_behind(scene: Scene, photons: Photons, names: list[str], brighter: float) -> list[str]:
    """Those of some objects whose backs get so many times as much light as their fronts."""
    names = [name for name in names if name in scene.objects.names]
    if not names:
        return []
    on = scene.object_of_triangle[photons.triangle]
    behind = dot(scene.normals[photons.triangle], photons.normal) < 0
    power = np.bincount(2 * on + behind, photons.power.mean(axis=1), 2 * len(scene.objects.names)).reshape(-1, 2)
    of_name = {name: power[scene.objects.names.index(name)] for name in names}
    return [name for name, (front, back) in of_name.items() if back > brighter * front]


def _inside_out(scene: Scene) -> frozenset[str]:
    """Names of the objects whose faces look inwards: ∫ (x − c) · n dA is under −`INWARDS` times ∫ |x − c| dA.

    x are the middles of triangles, and c is their mean. Of a closed body, or of several, the first is three times the
    volume, negative if it is inside out, wherever c lies; a flat sheet has none.
    """
    n, on = len(scene.objects.names), scene.object_of_triangle
    sums = np.zeros((6, n))

    def add(first: int, chunk: slice, *values: np.ndarray) -> None:
        for row, value in enumerate(values, first):
            sums[row] += np.bincount(on[chunk], np.where(scene.areas[chunk] > 0, scene.areas[chunk] * value, 0), n)

    def middles(chunk: slice) -> np.ndarray:
        return np.asarray(scene.vertices[scene.triangles[chunk]].mean(axis=1, dtype=np.float64))

    for chunk in slices(len(on), _TRIANGLES):
        add(0, chunk, np.ones(chunk.stop - chunk.start), *middles(chunk).T)
    centre = sums[1:4].T / np.maximum(sums[0], 1e-30)[:, None]
    for chunk in slices(len(on), _TRIANGLES):
        away = middles(chunk) - centre[on[chunk]]
        add(4, chunk, dot(away, scene.normals[chunk]), np.linalg.norm(away, axis=1))
    inwards = sums[4] < -INWARDS * sums[5]
    return frozenset(name for name, is_inside_out in zip(scene.objects.names, inwards, strict=True) if is_inside_out)


def _asked(target: AttributeTarget, every: bool) -> np.ndarray:
    """Receivers of a target: each, or a few spread over all."""
    of = target.receiver_of_element
    if not every and len(of) > N_ASKED:
        of = of[np.linspace(0, len(of) - 1, N_ASKED).astype(int)]
    return np.unique(of[of >= 0])


def _extent(position: np.ndarray) -> float:
    """Diagonal of the box around points, m."""
    return float(np.linalg.norm(np.ptp(position, axis=0))) if len(position) else 0.0


def _of_backs(target: AttributeTarget, row: np.ndarray) -> AttributeTarget:
    """The rows that stand for the backs of a target's receivers; they count to its object."""
    on = target.receiver_of_element
    backs = np.unique(row[on[on >= 0]])
    return replace(target, receiver_of_element=backs[backs >= 0])


def _look(
    tracer: Tracer,
    position: np.ndarray,
    normal: np.ndarray,
    footprint: np.ndarray,
    near: np.ndarray,
    inside: np.ndarray,
    random: np.random.Generator,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Whether receivers' fronts are shut and their backs open, (n,) bool; whether the backs of these, and of those that
    are `inside` (n,), see anything; and whether there are points behind their surfaces, and these, (n, 3).
    """
    own = tracer.closest_hit(position, -normal, footprint)
    below = np.where(own.hit, own.distance, 0)[:, None]
    back = (position - 2 * below * normal).astype(np.float32)
    directions = gather_directions(np.repeat(normal, N_RAYS, axis=0), N_RAYS, random).reshape(-1, N_RAYS, 3)

    def open_share(k: np.ndarray, at: np.ndarray, side: int) -> np.ndarray:
        """Share of the rays of some receivers, from points `at`, to one side, that count."""
        hits = tracer.closest_hit(np.repeat(at[k], N_RAYS, axis=0), side * directions[k].reshape(-1, 3))
        far = hits.hit & (hits.distance > np.repeat(near[k], N_RAYS))
        return far.reshape(-1, N_RAYS).mean(axis=1)

    k, shut, behind = np.flatnonzero(own.hit), np.zeros(len(position), bool), np.zeros(len(position))
    shut[k] = open_share(k, position, 1) <= SHUT
    k = np.flatnonzero(shut | inside & own.hit)
    behind[k] = open_share(k, back, -1)
    return shut & (behind >= OPEN), behind > 0, own.hit, back
