"""Records: what chosen receivers gathered."""

from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np

from ...core.parallel import Turns
from ...core.sampling.path_numbers import path_key
from ...core.sampling.vectors import rows
from ...core.z_curve import z_curve
from ...receivers import Receivers
from ..rays.gather_rays import GatherRays
from ..rays.receiver_rays import RaySums, gather_at

N_BATCHES = 4
STAGE = "Gathering light"
_GATHER = 21  # stream of random numbers
_CHUNK = 1 << 14  # rays
_RAY_BYTES, _LIGHT_BYTES, _ARRIVAL_BYTES = 150, 24, 75  # a ray takes; for each light more; where it walks to bodies


@dataclass(frozen=True)
class Records:
    """m receivers that gathered.

    Attributes
    ----------
    receiver : (m,) int
    position, normal : (m, 3) float32
        World space, m.
    edge : (m,) float32, m
        Of the cell that the record stands for.
    total : (m, batches, 3 l) float64, W/(m² sr)
        Radiance that the rays of each batch met, summed; of one light, or of several side by side (`lights`).
    n_rays : (m,) int
        Rays of all batches together.
    nearness : (m,) float64, 1/m
        Inverse distances of what the rays met, summed.
    bend : (m, 3, 3 l) float64, W/(m² sr)
        For each axis and colour: what the rays say of the slope, summed. (m, 0, 3 l) where nobody asks for it.
    """

    receiver: np.ndarray
    position: np.ndarray
    normal: np.ndarray
    edge: np.ndarray
    total: np.ndarray
    n_rays: np.ndarray
    nearness: np.ndarray
    bend: np.ndarray

    def __len__(self) -> int:
        return len(self.receiver)

    @staticmethod
    def none(directional: bool = False, n_lights: int = 1) -> "Records":
        """No records."""
        nothing, whole = np.zeros(0, np.float32), np.zeros(0, np.int64)
        points = np.zeros((0, 3), np.float32)
        total, bend = np.zeros((0, N_BATCHES, 3 * n_lights)), _no_bend(0, directional, n_lights)
        return Records(whole, points, points, nothing, total, whole, np.zeros(0), bend)

    def lights(self) -> "list[Records]":
        """The records of each light by itself."""
        columns = (slice(i, i + 3) for i in range(0, self.total.shape[2], 3))
        return [replace(self, total=self.total[..., of], bend=self.bend[..., of]) for of in columns]

    @property
    def irradiance(self) -> np.ndarray:
        """(m, 3) float64, W/m²: E = π · mean of L over cosine-weighted rays."""
        return np.pi * self.total.sum(axis=1) / self.n_rays[:, None]

    @property
    def slope(self) -> np.ndarray:
        """How the irradiance changes with the normal (`turned_normals`), for each axis and colour, (m, 3, 3), W/m²."""
        return np.pi * self.bend / self.n_rays[:, None, None]

    @property
    def variance(self) -> np.ndarray:
        """Of the irradiance's mean over colours, from the batches, (m,) float64."""
        of_batch = np.pi * N_BATCHES / self.n_rays[:, None] * self.total.mean(axis=2)
        return of_batch.var(axis=1, ddof=1) / N_BATCHES

    @property
    def harmonic_distance(self) -> np.ndarray:
        """Harmonic mean of the distances to what was met, (m,) float64, m.

        Within a part of it irradiance stays about the same (Ward, Rubinstein and Clear, "A Ray Tracing Solution for
        Diffuse Interreflection", 1988).
        """
        return self.n_rays / np.maximum(self.nearness, 1e-30)

    def joined(self, others: "Records") -> "Records":
        """These records and others."""
        names = self.__dataclass_fields__
        return Records(*(np.concatenate([getattr(self, name), getattr(others, name)]) for name in names))

    def with_edge(self, k: np.ndarray, edge: float) -> "Records":
        """The same, the records `k` standing for cells of another edge."""
        edges = self.edge.copy()
        edges[k] = edge
        return replace(self, edge=edges)

    def with_rays(self, more: "Records") -> "Records":
        """The same, with the rays of `more`, which hold some of these receivers, each any number of times."""
        place = np.full(int(self.receiver.max()) + 1, -1)
        place[self.receiver] = np.arange(len(self))
        k = place[more.receiver]
        sums = {name: getattr(self, name).copy() for name in ("total", "n_rays", "nearness", "bend")}
        for name, sum_ in sums.items():
            np.add.at(sum_, k, getattr(more, name))
        return replace(self, **sums)


class RecordMaker:
    """Sends rays from receivers.

    Parameters
    ----------
    n_rays : int
        Of a record; a multiple of the batches is used.
    most_rays : float
        That all records should send together. Where half of what is left of them is too little for records that are
        wanted, these and all later ones send fewer, down to one a batch.

    Attributes
    ----------
    on_bodies : OnBodies or None
        Which receivers get light through the bodies that they are on.
    """

    def __init__(
        self, rays: GatherRays, receivers: Receivers, n_rays: int, turns: Turns, most_rays: float = np.inf
    ) -> None:
        self._rays, self._receivers, self._turns, self._most = rays, receivers, turns, most_rays
        self.on_bodies = rays.on_bodies(receivers)
        self.rays_a_batch = self._wanted_a_batch = max(1, n_rays // N_BATCHES)
        self._n_calls = 0
        self._n_sent, self._seconds = 0, 0.0

    @property
    def n_lights(self) -> int:
        """How many lights the rays tell apart."""
        return self._rays.n_lights

    @property
    def n_rays(self) -> int:
        """Rays that each record sends."""
        return self.rays_a_batch * N_BATCHES

    @property
    def short(self) -> bool:
        """Whether records send fewer rays than they should."""
        return self.rays_a_batch < self._wanted_a_batch

    @property
    def left(self) -> float:
        """Rays that may still be sent."""
        return max(self._most - self._n_sent, 0)

    @property
    def room(self) -> float:
        """Records that half of these rays are enough for."""
        return self.left / 2 / N_BATCHES

    @property
    def rate(self) -> float:
        """Rays a second, so far."""
        return self._n_sent / max(self._seconds, 1e-6)

    def records(self, chosen: np.ndarray, edge: float) -> Records:
        """Records of receivers (m,) that stand for cells of an edge in m; receivers may come several times.

        An edge of 0 is for rays that are added to records.
        """
        began = perf_counter()
        if edge and len(chosen) * self.n_rays > self.left / 2:
            self.rays_a_batch = max(1, int(self.room / len(chosen)))
        size, key = max(1, _CHUNK // self.n_rays), (_GATHER, self._n_calls)
        self._n_calls += 1
        at, n, n_lights = self._receivers, len(chosen), self.n_lights
        total, nearness = np.zeros((n, N_BATCHES, 3 * n_lights)), np.zeros(n)
        bend = _no_bend(n, at.directional, n_lights)
        # Neighbours are gathered together, whose rays meet the same surfaces: that is faster
        order = np.argsort(z_curve(at.position[chosen]), kind="stable") if n else np.zeros(0, int)
        of_ray = _RAY_BYTES + (n_lights - 1) * _LIGHT_BYTES + (self.on_bodies is not None) * _ARRIVAL_BYTES
        workers, bytes_ = self._turns.next(), self.n_rays * of_ray
        numbers, rays = path_key(workers.seed, *key), (N_BATCHES, self.rays_a_batch, at.directional)

        def gather(chunk: slice, _: np.random.Generator) -> RaySums:
            k = chosen[order[chunk]]
            bases = np.zeros((0, 3), np.float32) if at.base_normal is None else rows(at.base_normal, k)
            on = self.on_bodies and self.on_bodies.where(k)
            here = rows(at.position, k), rows(at.normal, k), bases
            return gather_at(self._rays, *here, *rays, numbers, chunk.start, on)

        for chunk, sums in workers.chunks(STAGE, n, size, gather, key, row_bytes=bytes_):
            k = order[chunk]
            total[k], nearness[k], bend[k] = sums.total, sums.nearness, sums.gradient
        self._n_sent += n * self.n_rays
        self._seconds += perf_counter() - began
        edges, n_rays = np.full(n, edge, np.float32), np.full(n, self.n_rays)
        return Records(chosen, at.position[chosen], at.normal[chosen], edges, total, n_rays, nearness, bend)


def _no_bend(n: int, directional: bool, n_lights: int) -> np.ndarray:
    """The bend of n records without rays, with or without rows."""
    return np.zeros((n, 3 if directional else 0, 3 * n_lights))
