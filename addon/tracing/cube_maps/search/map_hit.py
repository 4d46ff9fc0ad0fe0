"""What a method of tracing through cube maps promises, and what it finds."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..cube_maps import CubeMaps


@dataclass
class MapHits:
    """Where n rays meet the surfaces of cube maps, filled in by the method that looks.

    Attributes
    ----------
    distance : (n,) float32, m
        Infinite where the ray meets nothing.
    texel : (n,) int64
        What the ray meets; −1: nothing.
    loops : (n,) int32
        What these are, the method says.
    n_look_ups : int
        Reads of a map that all rays took together.
    """

    distance: np.ndarray
    texel: np.ndarray
    loops: np.ndarray
    n_look_ups: int = 0

    @staticmethod
    def none(n: int) -> "MapHits":
        """As many rays that meet nothing."""
        return MapHits(np.full(n, np.inf, np.float32), np.full(n, -1), np.zeros(n, np.int32))


class Method(Protocol):
    """Finds where rays meet the surfaces of cube maps. Calls may be made from several threads at once."""

    @property
    def maps(self) -> CubeMaps: ...

    def find(self, origins: np.ndarray, directions: np.ndarray, t_max: np.ndarray) -> MapHits:
        """Where rays (n, 3) in world space meet a surface nearer than `t_max` (n,), float32, m."""
        ...
