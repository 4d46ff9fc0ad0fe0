"""More records where receivers are unsure of what they take, as near contacts and beyond the last record of a face."""

import numpy as np

from ...core.parallel import Turns
from ...receivers import Receivers
from ...tracing.embree import EmbreeTracer
from .cells import cell_keys, middles
from .placement import Placed, look_around
from .record_error import Around, RecordErrorModel
from .record_index import RecordIndex
from .records import RecordMaker, Records
from .weights import Weights

_DARK = 0.25  # of the mean irradiance: what is darker is held to be as bright
_MOST_MORE = 0.1  # of the records there are: so many may be added, where they tell most
_UNSURE = 1.5  # tolerances that what light changes between records may be off by


def refined(
    receivers: Receivers,
    placed: Placed,
    records: Records,
    weights: Weights,
    tolerance: float,
    length: float,
    maker: RecordMaker,
    tracer: EmbreeTracer,
    turns: Turns,
) -> tuple[Records, Weights, Weights]:
    """Records, weights of the receivers and what others say of the records, with records added.

    Where what light changes between the records is off by more than `tolerance`, a share of the irradiance, one
    receiver of each cell of half the edge becomes a record, those cells first that are off by most together.

    Parameters
    ----------
    length : float, m
        See `turn_length`.
    """
    around = look_around(records, np.arange(len(records)), length, tracer, turns)
    if maker.short or len(records) == 0:
        return records, weights, around
    chosen, edges = _wanted(receivers, placed, records, weights, around, tolerance)
    if len(chosen) == 0 or len(chosen) > maker.room:
        return records, weights, around
    n_before, cells = len(records), np.unique(placed.record[chosen])
    for edge in np.unique(edges):
        records = records.joined(maker.records(chosen[edges == edge], float(edge)))
    k = np.flatnonzero(np.isin(placed.record, cells))
    near = RecordIndex(records, length, tracer)
    found = near.of_points(receivers.position[k], receivers.normal[k], turns.next())
    weights = weights.replaced(k, found, only=found.supported)
    anew = np.concatenate([cells, np.arange(n_before, len(records))])
    around = Weights.joined([around, Weights.none(len(records) - n_before)])
    return records, weights, around.replaced(anew, look_around(records, anew, length, tracer, turns))


def _wanted(
    receivers: Receivers, placed: Placed, records: Records, weights: Weights, around: Weights, tolerance: float
) -> tuple[np.ndarray, np.ndarray]:
    """Receivers that are to become records, and the edges of their cells, m."""
    position = receivers.position
    around_records, bias2 = Around.of(around, records), np.zeros(len(position), np.float32)
    unsure = np.zeros(len(position), bool)
    for of_light in records.lights():
        of_bias2 = RecordErrorModel.of(of_light, around_records).bias2_of(of_light, weights, position)
        value = of_light.irradiance.mean(axis=1)
        level = np.maximum(weights.mean(value), _DARK * value.mean())
        unsure |= of_bias2 > (_UNSURE * tolerance * level) ** 2
        bias2 += of_bias2
    unsure[records.receiver] = False
    k = np.flatnonzero(unsure)
    edge = records.edge[placed.record[k]] / 2
    chosen: list[np.ndarray] = [np.zeros(0, np.int64)]
    edges: list[np.ndarray] = [np.zeros(0, np.float32)]
    worth: list[np.ndarray] = [np.zeros(0)]
    for one in np.unique(edge):
        of_edge = k[edge == one]
        keys = cell_keys(position[of_edge], receivers.normal[of_edge], position.min(axis=0), one)
        middle, cell = middles(keys, position[of_edge])
        chosen.append(of_edge[middle])
        edges.append(np.full(len(middle), one, np.float32))
        worth.append(np.bincount(cell, bias2[of_edge]))
    worst = np.argsort(-np.concatenate(worth), kind="stable")[: int(_MOST_MORE * len(records))]
    worst.sort()
    return np.concatenate(chosen)[worst], np.concatenate(edges)[worst]
