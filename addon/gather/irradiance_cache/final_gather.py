"""The final gather itself: records, what all receivers take from them, and rays where they are needed."""

from dataclasses import dataclass

import numpy as np

from ...core.parallel import Turns, Workers
from ...receivers import Receivers
from ...tracing import Tracer
from ..irradiance import Estimate, OwnRays
from ..rays.gather_rays import GatherRays
from .placement import look_around, look_up_all, place_records, turn_length
from .record_error import Arms, Around, Spread
from .records import STAGE, RecordMaker, Records
from .refinement import refined
from .sample_budget import Effort, rays_for_budget, rays_for_noise
from .weights import Weights

_MAX_TURNS = 24
_MOST_MORE = 3.0  # times the rays that a record has, in one turn: what is known of its noise is not known well
_TIME_SHARE = 0.6  # of the time that is left, in one turn
_LEAST_SECONDS = 0.05
_FEW = 0.5  # of the receivers: where more of them would be records, all are
_LEAST_STEP = 0.25  # of the variance, to which a turn may bring it down


@dataclass(frozen=True)
class Gathered:
    """What n receivers gathered.

    Attributes
    ----------
    lights : list of Estimate
        From surfaces, of each light that the rays tell apart; standard errors are by `Spread`.
    n_records, n_rays : int
        Receivers that gathered, and rays that they sent.
    """

    lights: list[Estimate]
    n_records: int
    n_rays: int

    @property
    def light(self) -> Estimate:
        """That of the first, or only, light."""
        return self.lights[0]


class FinalGather:
    """A final gather whose records are placed, and may get more rays.

    Parameters
    ----------
    extent : float, m
        Of most receivers; not 0.
    tracer : Tracer
        For whether receivers see records.

    Attributes
    ----------
    records : Records
    weights : Weights
        What each receiver takes from them.
    """

    def __init__(
        self, rays: GatherRays, receivers: Receivers, effort: Effort, extent: float, tracer: Tracer, workers: Workers
    ) -> None:
        self._receivers, self._effort, self._turns = receivers, effort, Turns(workers)
        most = effort.most_rays(len(receivers))
        self._maker = maker = RecordMaker(rays, receivers, max(1, effort.n_rays // 2), self._turns, most)
        records = Records.none(receivers.directional, maker.n_lights)
        if effort.interpolate:
            placed = place_records(receivers, extent, effort.tolerance, maker, tracer, self._turns)
            records, weights = look_up_all(placed, receivers, extent, maker, tracer, self._turns)
        few_left = _FEW * len(receivers) <= len(records) and not maker.short
        self._all_gather = all_gather = not effort.interpolate or few_left
        if all_gather:
            others = np.setdiff1d(np.arange(len(receivers)), records.receiver)
            records = records.joined(maker.records(others, extent))
            weights = Weights.identity(records.receiver)
            alike = records.with_edge(np.arange(len(records)), extent)
            length = turn_length(extent, maker.short)
            around = look_around(alike, np.arange(len(records)), length, tracer, self._turns)
        else:
            length = turn_length(extent, maker.short)
            at = receivers, placed, records, weights, effort.tolerance, length
            records, weights, around = refined(*at, maker, tracer, self._turns)
        self.records, self.weights = records, weights
        self._arms = Arms.of(weights, receivers.position, records)
        arms = Arms.of(around, records.position, records)
        self._around = Around(around, arms, effort.interpolate or maker.short, maker.short or all_gather)

    def finish(self) -> Gathered:
        """What the receivers gathered, after rays were added as the effort says."""
        records = self._with_rays()
        self._turns.end(STAGE)
        lights = [self._taken(of_light) for of_light in records.lights()]
        return Gathered(lights, len(records), int(records.n_rays.sum()))

    def _taken(self, records: Records) -> Estimate:
        """What receivers take of the records of one light."""
        weights, spread = self.weights, Spread.of(records, self._around)
        lowest = min(float(records.irradiance.min(initial=0)), 0.0)  # not 0 where lamps take light away
        irradiance = np.maximum(weights.apply(spread.blended(records.irradiance)), lowest).astype(np.float32)
        slope = _slope(records, spread, weights) if self._receivers.directional else None
        stderr = np.sqrt(spread.variance(records, weights, self._arms)).astype(np.float32)
        gathered = np.zeros(len(irradiance), bool)
        gathered[records.receiver] = True
        own = self._own_rays(records, spread, irradiance, stderr) if self._receivers.view is None else None
        return Estimate(irradiance, stderr, slope, gathered, None, own)

    def _own_rays(self, records: Records, spread: Spread, irradiance: np.ndarray, stderr: np.ndarray) -> OwnRays:
        """What the records found by themselves, beside what their receivers took.

        Their errors are told by others' rays: by its own, one that missed what is bright would be believed.
        """
        off, own = np.zeros_like(irradiance), np.zeros_like(stderr)
        off[records.receiver] = records.irradiance - irradiance[records.receiver]
        own[records.receiver] = np.sqrt(spread.expected / records.n_rays)
        return OwnRays(off, own, stderr)

    def _with_rays(self) -> Records:
        """The records with more rays, in turns, until the effort is made."""
        records, maker, effort = self.records, self._maker, self._effort
        harm = self.weights.square().column_sums(len(records))
        for turn in range(_MAX_TURNS):
            wanted = self._wanted_by_all(records, harm, turn)
            packets = np.minimum(wanted - records.n_rays, _MOST_MORE * records.n_rays) / maker.n_rays
            whole = np.floor(packets + 0.5)
            if effort.noise > 0 and not whole.any():
                whole = np.ceil(packets)
            if not whole.any():
                break
            records = records.with_rays(maker.records(np.repeat(records.receiver, whole.astype(np.int64)), 0.0))
        return records

    def _wanted_by_all(self, records: Records, harm: np.ndarray, turn: int) -> np.ndarray:
        """Rays that each record should have, (m,): for each light as little noise as asked, or its part."""
        lights, effort = records.lights(), self._effort
        wanted = [self._wanted(of_light, effort.of_light(i), harm, turn) for i, of_light in enumerate(lights)]
        return np.max(wanted, axis=0) if effort.noise > 0 else np.mean(wanted, axis=0)

    def _wanted(self, records: Records, effort: Effort, harm: np.ndarray, turn: int) -> np.ndarray:
        """Rays that each record should have for one light, (m,)."""
        maker, weights, spread = self._maker, self.weights, Spread.of(records, self._around)
        # Where all gather, one that met a rare bright thing would get fewer rays than its neighbours, which did not
        per_ray = np.full(len(records), spread.expected.mean()) if self._all_gather else spread.expected
        seconds = effort.seconds_left
        if seconds < _LEAST_SECONDS:
            return records.n_rays
        if effort.noise > 0:
            mean = float(weights.apply(records.irradiance).mean())
            now, asked = float(spread.variance(records, weights, self._arms).mean()), effort.variance_for(mean)
            if now <= asked:
                return records.n_rays
            of_rays = float((harm * per_ray / records.n_rays).sum())
            return rays_for_noise(per_ray, harm, records.n_rays, of_rays * max(asked / now, _LEAST_STEP))
        if seconds < np.inf:
            return rays_for_budget(per_ray, harm, records.n_rays, maker.rate * _TIME_SHARE * seconds)
        if turn == 0:
            as_many = float(records.n_rays.sum())
            budget = maker.left if maker.short else min(as_many, maker.left)
            return rays_for_budget(per_ray, harm, records.n_rays, budget)
        return records.n_rays


def _slope(records: Records, spread: Spread, weights: Weights) -> np.ndarray:
    """What receivers take of the records' slopes, (n, 3, 3) float32: as of their irradiance, axis by axis."""
    axes = np.moveaxis(records.slope, 1, 0)
    return np.stack([weights.apply(spread.blended(axis)).astype(np.float32) for axis in axes], axis=1)
