"""The final gather itself: records, what all receivers take from them, and rays where they are needed."""

from dataclasses import dataclass

import numpy as np

from ...core.parallel import Turns, Workers
from ...receivers import Receivers
from ...tracing.embree import EmbreeTracer
from ..irradiance import Estimate, OwnRays
from ..rays.gather_rays import GatherRays
from .placement import look_around, look_up_all, place_records, turn_length
from .record_error import Around, RecordErrorModel
from .records import STAGE, RecordMaker, Records
from .refinement import refined
from .sample_budget import SampleBudget, rays_for_budget, rays_for_noise
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
        From surfaces, of each light that the rays tell apart; standard errors are by `RecordErrorModel`.
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
        self,
        rays: GatherRays,
        receivers: Receivers,
        budget: SampleBudget,
        extent: float,
        tracer: EmbreeTracer,
        workers: Workers,
    ) -> None:
        self._receivers, self._budget, self._turns = receivers, budget, Turns(workers)
        most = budget.most_rays(len(receivers))
        self._maker = maker = RecordMaker(rays, receivers, max(1, budget.n_rays // 2), self._turns, most)
        records = Records.none(receivers.directional, maker.n_lights)
        if budget.interpolate:
            placed = place_records(receivers, extent, budget.tolerance, maker, tracer, self._turns)
            records, weights = look_up_all(placed, receivers, extent, maker, tracer, self._turns)
        few_left = _FEW * len(receivers) <= len(records) and not maker.short
        self._all_gather = all_gather = not budget.interpolate or few_left
        if all_gather:
            others = np.setdiff1d(np.arange(len(receivers)), records.receiver)
            records = records.joined(maker.records(others, extent))
            weights = Weights.identity(records.receiver)
            alike = records.with_edge(np.arange(len(records)), extent)
            length = turn_length(extent, maker.short)
            around = look_around(alike, np.arange(len(records)), length, tracer, self._turns)
        else:
            length = turn_length(extent, maker.short)
            at = receivers, placed, records, weights, budget.tolerance, length
            records, weights, around = refined(*at, maker, tracer, self._turns)
        self.records, self.weights = records, weights
        blends, fair = budget.interpolate or maker.short, maker.short or all_gather
        self._around = Around.of(around, records, blends, fair)

    @property
    def takes_caustics_through_bodies(self) -> np.ndarray:
        """Receivers (k,) whose rays bring caustics as well, since these walk to them."""
        on = self._maker.on_bodies
        return np.zeros(0, np.int64) if on is None else np.flatnonzero(on.there & on.takes_caustics)

    def finish(self) -> Gathered:
        """What the receivers gathered, after rays were added as the budget says."""
        records = self._with_rays()
        self._turns.end(STAGE)
        lights = [self._taken(of_light) for of_light in records.lights()]
        return Gathered(lights, len(records), int(records.n_rays.sum()))

    def _taken(self, records: Records) -> Estimate:
        """What receivers take of the records of one light."""
        weights, model = self.weights, RecordErrorModel.of(records, self._around)
        lowest = min(float(records.irradiance.min(initial=0)), 0.0)  # not 0 where lamps take light away
        irradiance = np.maximum(weights.apply(model.blended(records.irradiance), np.float32), np.float32(lowest))
        slope = _slope(records, model, weights) if self._receivers.directional else None
        stderr = np.sqrt(model.variance(records, weights, self._receivers.position))
        gathered = np.zeros(len(irradiance), bool)
        gathered[records.receiver] = True
        own = self._own_rays(records, model, irradiance, stderr) if self._receivers.view is None else None
        return Estimate(irradiance, stderr, slope, gathered, None, own)

    def _own_rays(
        self, records: Records, model: RecordErrorModel, irradiance: np.ndarray, stderr: np.ndarray
    ) -> OwnRays:
        """What the records found by themselves, beside what their receivers took.

        Their errors are told by others' rays: by its own, one that missed what is bright would be believed.
        """
        off, own = np.zeros_like(irradiance), np.zeros_like(stderr)
        off[records.receiver] = records.irradiance - irradiance[records.receiver]
        own[records.receiver] = np.sqrt(model.expected / records.n_rays)
        return OwnRays(off, own, stderr)

    def _with_rays(self) -> Records:
        """The records with more rays, in turns, until the budget is spent."""
        records, maker, budget = self.records, self._maker, self._budget
        sensitivity = self.weights.sums_of_squares(len(records))
        for turn in range(_MAX_TURNS):
            wanted = self._wanted_by_all(records, sensitivity, turn)
            packets = np.minimum(wanted - records.n_rays, _MOST_MORE * records.n_rays) / maker.n_rays
            whole = np.floor(packets + 0.5)
            if budget.noise > 0 and not whole.any():
                whole = np.ceil(packets)
            if not whole.any():
                break
            records = records.with_rays(maker.records(np.repeat(records.receiver, whole.astype(np.int64)), 0.0))
        return records

    def _wanted_by_all(self, records: Records, sensitivity: np.ndarray, turn: int) -> np.ndarray:
        """Rays that each record should have, (m,): for each light as little noise as asked, or its part."""
        lights, budget = records.lights(), self._budget
        wanted = [self._wanted(of_light, budget.of_light(i), sensitivity, turn) for i, of_light in enumerate(lights)]
        return np.max(wanted, axis=0) if budget.noise > 0 else np.mean(wanted, axis=0)

    def _wanted(self, records: Records, budget: SampleBudget, sensitivity: np.ndarray, turn: int) -> np.ndarray:
        """Rays that each record should have for one light, (m,)."""
        maker, model = self._maker, RecordErrorModel.of(records, self._around)
        # Where all gather, one that met a rare bright thing would get fewer rays than its neighbours, which did not
        per_ray = np.full(len(records), model.expected.mean()) if self._all_gather else model.expected
        seconds = budget.seconds_left
        if seconds < _LEAST_SECONDS:
            return records.n_rays
        if budget.noise > 0:
            mean = float(self.weights.apply(records.irradiance, np.float32).mean(dtype=np.float64))
            variance = model.variance(records, self.weights, self._receivers.position)
            now, asked = float(variance.mean(dtype=np.float64)), budget.variance_for(mean)
            if now <= asked:
                return records.n_rays
            of_rays = float((sensitivity * per_ray / records.n_rays).sum())
            return rays_for_noise(per_ray, sensitivity, records.n_rays, of_rays * max(asked / now, _LEAST_STEP))
        if seconds < np.inf:
            return rays_for_budget(per_ray, sensitivity, records.n_rays, maker.rate * _TIME_SHARE * seconds)
        if turn == 0:
            as_many = float(records.n_rays.sum())
            more = maker.left if maker.short else min(as_many, maker.left)
            return rays_for_budget(per_ray, sensitivity, records.n_rays, more)
        return records.n_rays


def _slope(records: Records, model: RecordErrorModel, weights: Weights) -> np.ndarray:
    """What receivers take of the records' slopes, (n, 3, 3) float32: as of their irradiance, axis by axis."""
    blended = [model.blended(axis) for axis in np.moveaxis(records.slope, 1, 0)]
    return weights.apply(np.stack(blended, axis=1), np.float32)
