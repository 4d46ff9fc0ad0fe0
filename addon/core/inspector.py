"""What a bake lets people see of its insides: points in space, and the light that they have."""

from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

View = Literal["maps", "photons", "cells"]
VIEWS: tuple[View, ...] = get_args(View)

MOST_POINTS = 200_000
"""Points of a view that are kept, evenly taken from all."""

LIFT = np.float32(5e-3)
"""How far photons are to be seen off their surfaces, which would hide them, in radii of the region that is lit."""


@dataclass(frozen=True)
class ViewPoints:
    """Some or all of the points of a view.

    Attributes
    ----------
    position : (k, 3) float32, m
        World space.
    light : (k, 3) float32 or None
        Of a unit that is the view's own; None: these have no light.
    n_all : int
        How many points there were.
    """

    position: np.ndarray
    light: np.ndarray | None
    n_all: int


class Inspector:
    """Handed to a bake, it keeps what it was made to look at.

    The bake may run on a thread of its own while `seen` is read.

    Parameters
    ----------
    wanted : collection of View
        What is kept; nothing is made or copied for the other views.

    Attributes
    ----------
    seen : dict of View to ViewPoints
        As far as the bake has come.
    """

    def __init__(self, wanted: Collection[View] = ()) -> None:
        self._wanted = frozenset(wanted)
        self.seen: dict[View, ViewPoints] = {}

    def see(self, view: View, points: Callable[[], tuple[np.ndarray, np.ndarray | None]]) -> None:
        """Keep positions (n, 3) and light (n, 3) that `points` returns; it is called only where they are wanted."""
        if view not in self._wanted:
            return
        position, light = points()
        n = len(position)
        chosen = np.linspace(0, n - 1, min(n, MOST_POINTS)).astype(np.int64)
        self.seen[view] = ViewPoints(position[chosen], None if light is None else light[chosen], n)
