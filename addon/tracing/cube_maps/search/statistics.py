"""Counts of what tracing through cube maps costs."""

from threading import Lock

import numpy as np

from .map_hit import MapHits


class Statistics:
    """Adds up what rays took, from any thread.

    Attributes
    ----------
    n_rays, n_look_ups : int
        Rays that were traced, and reads of a map that they took.
    n_rays_of_loops : (l,) int64
        Rays that took each number of loops; 0: they miss the scene's bounds.
    """

    def __init__(self) -> None:
        self.n_rays = self.n_look_ups = 0
        self.n_rays_of_loops = np.zeros(0, np.int64)
        self._lock = Lock()

    def add(self, found: MapHits) -> None:
        """Add some rays."""
        with self._lock:
            self.n_rays += len(found.loops)
            self.n_look_ups += found.n_look_ups
            counts = np.bincount(found.loops, minlength=len(self.n_rays_of_loops))
            counts[: len(self.n_rays_of_loops)] += self.n_rays_of_loops
            self.n_rays_of_loops = counts
