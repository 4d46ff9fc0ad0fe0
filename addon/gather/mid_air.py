"""Receivers that look at nothing while their back is open: those of a plane whose normals look at the wall behind it.

Light between surfaces comes to a side from the surfaces that it sees. Of rays around the normals of both sides, those
count that end on a surface farther away than `NEAR`: a side is open if a quarter of them does, as in the corner of a
room, and shut if next to none does.
"""

from dataclasses import dataclass, replace

import numpy as np

from ..core.parallel import Workers
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

_CHUNK = 1 << 12
_STREAM = 91
_STAGE = "Looking at both sides"


@dataclass(frozen=True)
class OpenBacks:
    """Receivers whose front is shut and whose back is open.

    Attributes
    ----------
    receiver : (b,) int32
    back : (b, 3) float32, m
        A point as far off the other side of their surface.
    share : dict of str to float
        Of those of an object's receivers that were asked, by its name.
    """

    receiver: np.ndarray
    back: np.ndarray
    share: dict[str, float]

    @staticmethod
    def of(receivers: Receivers, tracer: Tracer, workers: Workers, every: bool) -> "OpenBacks":
        """Those of the receivers for targets; ask every one of them, or a few of each object."""
        of_target = [_asked(target, every) for target in receivers.targets]
        extents = [_extent(receivers.position[asked]) for asked in of_target]
        asked = np.concatenate([np.zeros(0, np.int32), *of_target])
        near = NEAR * np.repeat(np.array(extents, np.float32), [len(part) for part in of_target])
        found, backs = np.zeros(len(asked), bool), np.zeros((len(asked), 3), np.float32)

        def look(chunk: slice, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
            at = asked[chunk]
            place = receivers.position[at], receivers.normal[at], receivers.footprint[at]
            return _look(tracer, *place, near[chunk], random)

        for chunk, (is_open, back) in workers.chunks(_STAGE, len(asked), _CHUNK, look, (_STREAM,)):
            found[chunk], backs[chunk] = is_open, back
        ends = np.cumsum([len(part) for part in of_target])
        share: dict[str, float] = {}
        for target, part, end in zip(receivers.targets, of_target, ends, strict=True):
            if len(part):
                share[target.object_name] = float(found[end - len(part) : end].mean())
        return OpenBacks(asked[found], backs[found], share)

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
        lit = brightness[n:] > brightness[self.receiver]
        row[self.receiver[lit]] = n + np.flatnonzero(lit)
        return replace(light.where(row), counts={**light.counts, "receivers": n})

    def lit_behind(self, scene: Scene, photons: Photons) -> list[str]:
        """Names of the objects that mostly turn their back to what is open, and to the light."""
        names = [name for name, share in self.share.items() if share >= MOSTLY and name in scene.objects.names]
        if not names:
            return []
        on = scene.object_of_triangle[photons.triangle]
        behind = dot(scene.normals[photons.triangle], photons.normal) < 0
        power = np.bincount(2 * on + behind, photons.power.mean(axis=1), 2 * len(scene.objects.names)).reshape(-1, 2)
        of_name = {name: power[scene.objects.names.index(name)] for name in names}
        return [name for name, (front, back) in of_name.items() if back > BRIGHTER * front]


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
    random: np.random.Generator,
) -> tuple[np.ndarray, np.ndarray]:
    """Whether receivers' fronts are shut and their backs open, (n,) bool, and the points behind them, (n, 3)."""
    own = tracer.closest_hit(position, -normal, footprint)
    below = np.where(own.hit, own.distance, 0)[:, None]
    back = (position - 2 * below * normal).astype(np.float32)
    directions = gather_directions(np.repeat(normal, N_RAYS, axis=0), N_RAYS, random).reshape(-1, N_RAYS, 3)

    def open_share(k: np.ndarray, at: np.ndarray, side: int) -> np.ndarray:
        """Share of the rays of some receivers, from points `at`, to one side, that count."""
        hits = tracer.closest_hit(np.repeat(at[k], N_RAYS, axis=0), side * directions[k].reshape(-1, 3))
        far = hits.hit & (hits.distance > np.repeat(near[k], N_RAYS))
        return far.reshape(-1, N_RAYS).mean(axis=1)

    k = np.flatnonzero(own.hit)
    k = k[open_share(k, position, 1) <= SHUT]
    k = k[open_share(k, back, -1) >= OPEN]
    turned = np.zeros(len(position), bool)
    turned[k] = True
    return turned, back
