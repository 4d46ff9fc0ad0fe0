"""The map: what photons bring to receivers and to the sides of elements, in whole numbers.

A photon of power Φ at x gives a receiver at y the irradiance Φ κ(y − x), κ being the kernel of photon splatting. It is
added as a multiple of a small unit, so that what a photon has added is taken away to the last bit when it leaves,
whatever came and went between, on whatever threads. No error adds up, and both take as long as the photon has receivers
around it.

Radii follow progressive photon mapping in the form of Knaus and Zwicker (2011): the i-th round of photons has the
radius r₀ i^(−1/6) for good, and light is the mean over rounds. So noise and blur both go to 0 as rounds are added, and
light never jumps. Radii come in levels, that each sum is known for.
"""

from threading import Lock
from typing import NamedTuple

import numpy as np

from ....core.compiling import by_reference, kernel
from ....core.sampling.octahedral import octahedral_vector
from ....core.sampling.sobol import fixed_points
from ....core.sampling.warps import sample_uniform_disk
from ....core.vec3 import BLACK, ZERO, row
from ....gather.density.density import surface_share
from ....gather.photon_splatting.point_rows import PointRows, first_from, key
from ....gather.photon_splatting.splat import splat_kernel, steps_of_box
from ....receivers import Receivers
from ....tracing import Tracer
from .paths import PathArrays

N_LEVELS = 8
_LEVEL = 0.25  # of an octave of radii
_FIRST_RADIUS = 2.25  # of the first round, over the receivers' spacing
_BITS = 24  # of the largest that an average photon adds
_N_AROUND, _AROUND = 8, np.sqrt(2)  # in a square grid the eighth neighbour is √2 cells away


def level_of_round(i: np.ndarray) -> np.ndarray:
    """The level of radii of rounds, counted from 0, uint8: of r₀ (i+1)^(−1/6), rounded up."""
    return np.minimum(np.log2(i + 1.0) / 6 / _LEVEL, N_LEVELS - 1).astype(np.uint8)


@by_reference
class Around(NamedTuple):
    """Receivers of about one spacing, as those around a photon are found.

    Attributes
    ----------
    rows : PointRows
    order : (m,) int64
        Receiver of each place in the rows.
    position, normal : (m, 3) float32, m
        In the rows' order.
    radius : (l,) float32, m
        Of photons' kernels, by level.
    """

    rows: PointRows
    order: np.ndarray
    position: np.ndarray
    normal: np.ndarray
    radius: np.ndarray


@kernel
def _add(paths, chosen, sign, around, per_watt, sums):
    """Add what chosen photons bring to the receivers around them to sums (l, n, 3); with the sign −1, take it away."""
    keys = around.rows.keys
    for j in range(len(chosen)):
        i = chosen[j]
        level = paths.level[i]
        r = around.radius[level]
        for k in range(1, paths.n_surfaces[i]):
            power = row(paths.power[i], k)
            if power == BLACK:
                continue
            x = row(paths.position[i], k)
            n = octahedral_vector(paths.normal[i, k, 0], paths.normal[i, k, 1])
            low, high = steps_of_box(around.rows, x, n, r)
            for z in range(low[2], high[2] + 1):
                for y in range(low[1], high[1] + 1):
                    start = first_from(keys, key(low[0], y, z), 0, len(keys))
                    stop = first_from(keys, key(high[0] + 1, y, z), start, len(keys))
                    for at in range(start, stop):
                        kappa = splat_kernel(row(around.position, at), row(around.normal, at), x, n, r)
                        if kappa > ZERO:
                            share, to = np.float64(kappa) * per_watt, sums[level, around.order[at]]
                            to[0] += sign * np.int64(np.rint(power[0] * share))
                            to[1] += sign * np.int64(np.rint(power[1] * share))
                            to[2] += sign * np.int64(np.rint(power[2] * share))


@kernel
def _add_to_sides(paths, chosen, sign, per_watt, sums):
    """Add the power that chosen photons bring to sums (s, 3) of the sides of elements."""
    for j in range(len(chosen)):
        i = chosen[j]
        for k in range(1, paths.n_surfaces[i]):
            side = paths.side[i, k]
            if side >= 0:
                for c in range(3):
                    sums[side, c] += sign * np.int64(np.rint(paths.power[i, k, c] * per_watt))


class PhotonMap:
    """What photons bring, in two sums: of those that are as they were, and of those traced again since an edit.

    Parameters
    ----------
    receivers : Receivers
        n of them, which may move; `moved` is told so.
    n_sides : int
    watts : float, W
        That a photon is emitted with, about.
    """

    def __init__(self, receivers: Receivers, n_sides: int, watts: float) -> None:
        self._receivers, self._lock, n = receivers, Lock(), len(receivers)
        spacing = _spacing(receivers.position)
        middle = float(np.median(spacing))
        octave = np.clip(np.rint(np.log2(np.maximum(spacing, 1e-30) / middle)), -1, 1)
        self._first_radius = (_FIRST_RADIUS * middle * 2.0**octave).astype(np.float32)
        self._sums = np.zeros((2, N_LEVELS, n, 3), np.int64)
        self._of_sides = np.zeros((2, n_sides, 3), np.int64)
        smallest = float(self._first_radius.min()) * 2 ** (-_LEVEL * (N_LEVELS - 1))
        self._per_watt = 2.0**_BITS / (watts * 2 / (np.pi * smallest**2))
        self._per_watt_of_sides = 2.0**_BITS / watts
        self.share = np.full((N_LEVELS, n), np.nan, np.float32)
        self._around = self._rows_of(np.arange(n))

    def add(self, paths: PathArrays, chosen: np.ndarray, renewed: bool = False) -> None:
        """Photons, (m,) int64, enter the map."""
        self._put(paths, chosen, 1, int(renewed), self._around, True)

    def remove(self, paths: PathArrays, chosen: np.ndarray, renewed: bool = False) -> None:
        """Photons leave it, which are what they were when they entered."""
        self._put(paths, chosen, -1, int(renewed), self._around, True)

    def add_to(self, moved: list[Around], paths: PathArrays, chosen: np.ndarray, renewed: bool) -> None:
        """Photons that are in the map enter it for moved receivers as well."""
        self._put(paths, chosen, 1, int(renewed), moved, False)

    def _put(
        self, paths: PathArrays, chosen: np.ndarray, sign: int, which: int, around: list[Around], with_sides: bool
    ) -> None:
        with self._lock:
            for one in around:
                _add(paths, chosen, sign, one, self._per_watt, self._sums[which])
            if with_sides:
                _add_to_sides(paths, chosen, sign, self._per_watt_of_sides, self._of_sides[which])

    def clear(self) -> None:
        """All photons are out of it."""
        self._sums[:] = 0
        self._of_sides[:] = 0

    def moved(self, rows: np.ndarray) -> list[Around]:
        """Nothing is known of some receivers any more, which are elsewhere: what `add_to` takes of them."""
        self._sums[:, :, rows] = 0
        self.share[:, rows] = np.nan
        self._around = self._rows_of(np.arange(len(self._receivers)))
        return self._rows_of(rows)

    def merge(self) -> None:
        """Those traced again are as good as others."""
        for sums in (self._sums, self._of_sides):
            sums[0] += sums[1]
            sums[1] = 0

    def irradiance(self, share_of_renewed: float) -> np.ndarray:
        """Of receivers, (n, 3) float64, W/m²; those traced again stand for so many times as many."""
        total = np.zeros((len(self._receivers), 3))
        for level in self._levels():
            total += self._of_level(level, share_of_renewed)
        return total

    def variance(self, n_rounds: np.ndarray) -> np.ndarray:
        """Of that, the mean over colours, (n,) float64: by how much levels differ, of (l,) rounds each.

        Rounds are independent and each has the variance σ². The means eₗ of L levels with a share wₗ of the R rounds
        differ from the mean of all by Σ wₗ (eₗ − e)², (L − 1) σ²/R on the average; in it is by how much they blur.
        """
        levels = np.flatnonzero(n_rounds)
        if len(levels) < 2:
            return np.full(len(self._receivers), np.inf)
        share = n_rounds[levels] / n_rounds.sum()
        parts = [self._of_level(k, 1.0).mean(axis=1) for k in levels]
        mean = np.sum(parts, axis=0)
        squares = sum(w * (part / w - mean) ** 2 for w, part in zip(share, parts, strict=True))
        return np.asarray(squares) / (len(levels) - 1)

    def _levels(self) -> np.ndarray:
        return np.flatnonzero(self._sums.any(axis=(0, 2, 3)))

    def _of_level(self, level: int, share_of_renewed: float) -> np.ndarray:
        """What photons of one level bring, (n, 3) float64, W/m²."""
        sums = self._sums[0, level] + share_of_renewed * self._sums[1, level]
        share = np.where(np.isnan(self.share[level]), 1, self.share[level]) * self._per_watt
        return np.asarray(sums / share[:, None])

    def of_sides(self, share_of_renewed: float) -> np.ndarray:
        """Power that comes to sides, (s, 3) float64, W."""
        sums: np.ndarray = self._of_sides[0] + share_of_renewed * self._of_sides[1]
        return sums / self._per_watt_of_sides

    # --- where surfaces end -------------------------------------------------------------------------------------

    def unmeasured(self, n: int) -> np.ndarray:
        """Up to n receivers that are lit, and of whose kernels it is not known which share of them is surface."""
        lit = self._sums.any(axis=(0, 3))
        return np.flatnonzero((lit & np.isnan(self.share)).any(axis=0))[:n]

    def measure(self, rows: np.ndarray, tracer: Tracer) -> None:
        """Find which share of photons' kernels is surface around receivers, by short rays."""
        at, disc = self._receivers, kernel_disc()
        position, normal = at.position[rows], at.normal[rows]
        near = np.arange(len(rows))
        self.share[:, rows] = 1
        for level in range(N_LEVELS):  # what is whole by a large radius is by smaller ones
            r = self._radius(rows[near], level)
            share = surface_share(tracer, position[near], normal[near], r, disc)[0]
            self.share[level, rows[near]] = share
            near = near[share < 1]
            if len(near) == 0:
                break

    def unmeasure(self, rows: np.ndarray) -> None:
        """Surfaces around some receivers have changed."""
        self.share[:, rows] = np.nan

    @property
    def largest_radius(self) -> float:
        return float(self._first_radius.max())

    def _radius(self, rows: np.ndarray, level: int) -> np.ndarray:
        return self._first_radius[rows] * np.float32(2 ** (-_LEVEL * level))

    def _rows_of(self, rows: np.ndarray) -> list[Around]:
        """Some receivers, apart by their radii."""
        found, of_rows = [], self._first_radius[rows]
        for radius in np.unique(of_rows):
            some = rows[of_rows == radius]
            position = self._receivers.position[some]
            sorted_, order = PointRows.of(position, float(radius))
            radii = (radius * 2.0 ** (-_LEVEL * np.arange(N_LEVELS))).astype(np.float32)
            normal = self._receivers.normal[some][order]
            found.append(Around(sorted_, some[order], position[order], normal, radii))
        return found


def kernel_disc() -> np.ndarray:
    """Points of a disc of radius 1 as dense as the kernel, (32, 2) float32: within ρr, ∫κ dA is 2ρ² − ρ⁴."""
    u = fixed_points(32)
    disc: np.ndarray = sample_uniform_disk(np.stack([1 - np.sqrt(1 - u[:, 0]), u[:, 1]], axis=1))
    return disc


def _spacing(position: np.ndarray) -> np.ndarray:
    """How far receivers are from each other, about, (n,), m."""
    from scipy.spatial import cKDTree  # here, as Blender's start should not wait for it

    k = min(_N_AROUND + 1, len(position))
    distance = cKDTree(position).query(position, k=[k])[0][:, 0]
    spacing: np.ndarray = np.maximum(distance, 1e-12) / _AROUND
    return spacing
