"""Photons' flights past places that stop none of them, where light is wanted all the same."""

from dataclasses import dataclass, field, fields

import numpy as np

from ..core.sampling.vectors import dot, rows
from ..emitters import Sphere


@dataclass(frozen=True)
class Flights:
    """f straight ways of photons through a ball, as far as they lie in it.

    Attributes
    ----------
    origin : (f, 3) float32, m
    direction : (f, 3) float32
        Unit vectors.
    length : (f,) float32, m
    power : (f, 3) float32, W
        At the start: what see-through surfaces on the way take is in it still.
    specular : (f,) bool
        Whether the photon came from its light over specular surfaces only, so that it makes caustics.
    """

    origin: np.ndarray
    direction: np.ndarray
    length: np.ndarray
    power: np.ndarray
    specular: np.ndarray

    def __len__(self) -> int:
        return len(self.origin)

    def where(self, chosen: np.ndarray) -> "Flights":
        """The flights that a mask or an index array chooses."""
        k = np.flatnonzero(chosen) if chosen.dtype == bool else chosen
        return Flights(**{f.name: rows(getattr(self, f.name), k) for f in fields(self)})

    @staticmethod
    def join(parts: "list[Flights]") -> "Flights":
        """All flights of several `Flights`, at least one, in order."""
        return Flights(**{f.name: np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(Flights)})

    @staticmethod
    def none() -> "Flights":
        """No flights."""
        nothing = np.zeros((0, 3), np.float32)
        return Flights(nothing, nothing, nothing[:, 0], nothing, np.zeros(0, bool))


@dataclass(frozen=True)
class FlightLog:
    """Takes down the flights through a ball, of several threads in the order of their batches.

    Attributes
    ----------
    ball : Sphere
    scattered : bool
        Whether flights are wanted that make no caustics.
    """

    ball: Sphere
    scattered: bool = False
    _of_batch: dict[int, list[Flights]] = field(default_factory=dict)

    def take(self, batch: int, flights: Flights) -> None:
        """Take down those parts of a batch's flights, which may be infinitely long, that lie in the ball."""
        k = np.arange(len(flights)) if self.scattered else np.flatnonzero(flights.specular)
        origin, direction = rows(flights.origin, k), rows(flights.direction, k)
        to_centre = self.ball.centre - origin
        along = dot(to_centre, direction)
        half = np.sqrt(np.maximum(self.ball.radius**2 - (dot(to_centre, to_centre) - along**2), 0)).astype(np.float32)
        start, end = np.maximum(along - half, 0), np.minimum(along + half, flights.length[k])
        inside = np.flatnonzero((half > 0) & (end > start))
        start, end, k = start[inside], end[inside], k[inside]
        origin, direction = rows(origin, inside), rows(direction, inside)
        part = Flights(
            origin + start[:, None] * direction, direction, end - start, rows(flights.power, k), flights.specular[k]
        )
        self._of_batch.setdefault(batch, []).append(part)

    def flights(self) -> Flights:
        """All that were taken down."""
        parts = [part for batch in sorted(self._of_batch) for part in self._of_batch[batch]]
        return Flights.join([Flights.none(), *parts])
