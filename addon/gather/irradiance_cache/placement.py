"""Where records are made: few where light changes slowly, many where it does not."""

from dataclasses import dataclass

import numpy as np

from ...core.parallel import Turns, Workers
from ...receivers import Receivers
from ...tracing.embree import EmbreeTracer
from .cells import cell_keys, middles
from .record_index import RecordIndex
from .records import RecordMaker, Records
from .weights import Weights

_FIRST = 1 / 64  # edge of the first cells, over the receivers' extent
_LEVELS = 9
_SIGMAS = 2.5  # of noise, by which records may differ from what those around them say
_DARK = 0.25  # of the mean irradiance: what is darker is held to be as bright
_BLACK = 0.02  # of the mean irradiance: what is darker need not be known better, whatever is around it
_SPACING = 0.7  # edge of a cell over its record's harmonic mean distance, beyond which it is cut
_CLOSEST = 1 / 256  # edge over the extent, that this does not cut on
_SHORT_TURN = 2 * _FIRST
_STRAY = 1 / 128  # edge of the cells of those who see no record, over the extent


@dataclass(frozen=True)
class Placed:
    """Records, and the cells that n receivers are in.

    Attributes
    ----------
    records : Records
    record : (n,) int
        Of each receiver's cell.
    alone : (n,) bool
        Whether its record is its own, and nobody else's.
    """

    records: Records
    record: np.ndarray
    alone: np.ndarray


def place_records(
    receivers: Receivers, extent: float, tolerance: float, maker: RecordMaker, tracer: EmbreeTracer, turns: Turns
) -> Placed:
    """Records of one receiver a cell, cells being cut in eight where records are not what those around them say.

    Where rays for the parts run out, the cells of most receivers a part are cut.

    Parameters
    ----------
    extent : float, m
        Of most receivers.
    tolerance : float
        Share of the irradiance by which records may differ from those around them.
    """
    position, normal, low = receivers.position, receivers.normal, receivers.position.min(axis=0)
    undecided, edge = np.arange(len(receivers)), _FIRST * extent
    records, record_of = Records.none(receivers.directional, maker.n_lights), np.full(len(receivers), -1)
    record, alone = np.zeros(len(receivers), np.int64), np.zeros(len(receivers), bool)
    keys = cell_keys(position, normal, low, edge)
    for _ in range(_LEVELS):
        # One record a cell; some receivers have theirs from the larger cell
        chosen, cell = middles(keys, position[undecided])
        chosen = undecided[chosen]
        records = records.joined(maker.records(chosen[record_of[chosen] < 0], edge))
        record_of[records.receiver] = np.arange(len(records))
        those, n_receivers = record_of[chosen], np.bincount(cell)
        record[undecided], alone[undecided] = those[cell], (n_receivers == 1)[cell]

        # Cut the cells in which light changes
        near = RecordIndex(records.with_edge(those, edge), turn_length(extent, maker.short), tracer)
        cut = disagree(near, those, tolerance, turns.next()) | _close(near.records, those, edge, extent)
        cut &= n_receivers > 1
        edge /= 2
        keys = cell_keys(position[undecided], normal[undecided], low, edge)
        cut = affordable(cut, cell, keys, maker.room)
        records = near.records.with_edge(those[cut], edge)
        undecided, keys = undecided[cut[cell]], keys[cut[cell]]
        if len(undecided) == 0:
            break
    return Placed(records, record, alone)


def affordable(cut: np.ndarray, cell: np.ndarray, keys: np.ndarray, room: float) -> np.ndarray:
    """Those of the cells to `cut` (c,) bool that have at most `room` parts together, most receivers a part first.

    Parameters
    ----------
    cell, keys : (n,) int
        Of each receiver: its cell, and the key of the part of it that it is in.
    """
    if room == np.inf:
        return cut
    n_receivers = np.bincount(cell)
    _, first = np.unique(keys, return_index=True)
    n_parts = np.bincount(cell[first], minlength=len(cut))
    wanted = np.flatnonzero(cut)
    order = wanted[np.argsort(-n_receivers[wanted] / n_parts[wanted], kind="stable")]
    chosen = np.zeros(len(cut), bool)
    chosen[order[np.cumsum(n_parts[order]) <= room]] = True
    return chosen


def turn_length(extent: float, short: bool) -> float:
    """How far away a record that faces the same way is preferred to one that is turned by 57°, m.

    Where rays are short, things are small and many: all around a record on one of them is within a cell.
    """
    return _SHORT_TURN * extent if short else extent


def _close(records: Records, which: np.ndarray, edge: float, extent: float) -> np.ndarray:
    """Whether lit things are so close to some records that light may change within their cells, (w,) bool."""
    values = [of_light.irradiance.mean(axis=1) for of_light in records.lights()]
    lit = np.any([value[which] > _BLACK * value.mean() for value in values], axis=0)
    return lit & (edge > _SPACING * records.harmonic_distance[which]) & (edge > _CLOSEST * extent)


def disagree(near: RecordIndex, which: np.ndarray, tolerance: float, workers: Workers) -> np.ndarray:
    """Which of some records are not what those around them say, or have none around them, in any light, (w,) bool."""
    others = near.of_records(which, workers)
    return np.any([_differ(of_light, others, which, tolerance) for of_light in near.records.lights()], axis=0)


def _differ(records: Records, others: Weights, which: np.ndarray, tolerance: float) -> np.ndarray:
    """`disagree` of one light, by what `others` say of the records."""
    value = records.irradiance.mean(axis=1)
    off = np.abs(others.apply(value) - value[which])
    noise = np.sqrt(records.variance[which] + others.apply_squares(records.variance))
    level = np.maximum(value[which], _DARK * value.mean())
    alone = ~others.supported & (value[which] > _BLACK * value.mean())
    return alone | others.supported & (off > _SIGMAS * noise + tolerance * level)


def look_up_all(
    placed: Placed, receivers: Receivers, extent: float, maker: RecordMaker, tracer: EmbreeTracer, turns: Turns
) -> tuple[Records, Weights]:
    """Weights for all receivers, and the records, with those added that receivers who see none need.

    Such strays are in narrow gaps: records are made among them, at which they look straight, and at last of each. Where
    rays are short, a receiver with a record of its own keeps to it, and strays look at their cell's if rays run out.
    """
    position, normal, records = receivers.position, receivers.normal, placed.records
    weights = Weights.of_one(placed.record)
    others = np.flatnonzero(~placed.alone) if maker.short else np.arange(len(position))
    near = RecordIndex(records, turn_length(extent, maker.short), tracer)
    weights = weights.replaced(others, near.of_points(position[others], normal[others], turns.next()))
    for edge in (_STRAY * extent, 0.0):
        stray = np.flatnonzero(~weights.supported)
        keys = np.arange(len(stray))
        if edge:
            keys = cell_keys(position[stray], normal[stray], position.min(axis=0), edge)
        chosen = stray[middles(keys, position[stray])[0]]
        if 0 < len(chosen) <= maker.room:
            made = maker.records(chosen, edge or 1e-6 * extent)
            near = RecordIndex(made, extent, tracer, lift=0.0)
            found = near.of_points(position[stray], normal[stray], turns.next())
            weights = weights.replaced(stray, found, len(records))
            records = records.joined(made)
    stray = np.flatnonzero(~weights.supported)
    return records, weights.replaced(stray, Weights.of_one(placed.record[stray]))


def look_around(records: Records, which: np.ndarray, length: float, tracer: EmbreeTracer, turns: Turns) -> Weights:
    """What the others say of some records; those in narrow gaps, who see none as receivers do, look straight at them.

    Parameters
    ----------
    length : float, m
        See `turn_length`.
    """
    weights = RecordIndex(records, length, tracer).of_records(which, turns.next())
    lonely = np.flatnonzero(~weights.supported)
    straight = RecordIndex(records, length, tracer, lift=0.0).of_records(which[lonely], turns.next())
    return weights.replaced(lonely, straight)
