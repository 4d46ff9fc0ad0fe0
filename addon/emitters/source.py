"""What emits photons, and where they are aimed.

Every source turns points of the unit hypercube into rays that carry flux. The mean of the flux over the hypercube is
the source's power, so n points make n photons of flux/n watts each.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..scene import ALL_BOUNCES, Lights, Scene
from .projection_map import Aim

N_DIMENSIONS = 5
"""Dimensions of the hypercube that sources sample: two for a direction, two for a place, one to choose."""


@dataclass(frozen=True)
class Sphere:
    """A ball in world space, m."""

    centre: np.ndarray
    radius: float


def region_of(positions: np.ndarray) -> Sphere:
    """The ball around most receivers: the middle 96 % of their positions along each axis.

    The sun and the world aim at it. A lone receiver far away (the corner of a ground plane) does not blow it up, and
    still gets light: a share of the photons goes to the whole scene.
    """
    low, high = np.percentile(positions, [2, 98], axis=0)
    return Sphere(((low + high) / 2).astype(np.float32), float(np.linalg.norm(high - low)) / 2)


def bounding_sphere(scene: Scene) -> Sphere:
    """A ball around the whole scene."""
    low, high = scene.bounds
    return Sphere((low + high) / 2, max(scene.diagonal / 2 * 1.001, 1e-6))


@dataclass(frozen=True)
class Rays:
    """Emitted light: origins (n, 3) m, unit directions (n, 3), flux (n, 3) W whose mean is the source's power.

    Also the objects that emitted it, (n,) int32, unless it was none of the scene's.
    """

    origins: np.ndarray
    directions: np.ndarray
    flux: np.ndarray
    objects: np.ndarray | None = None


class Source:
    """Something that emits photons.

    Attributes
    ----------
    name : str
    lamp : int
        Index in the scene's `Lights`; the number of lamps for emissive meshes, −1 for the world.
    power : (3,) float64, W
        For the sun and the world, what enters the region of the receivers. Below 0 where light is taken away.
    importance : float
        What photons are shared out by: the power's size, until it is known what the photons are worth.
    sampled_directly : bool
        Its direct light is found by next-event estimation, so that its photons need not be stored where they first hit.
    illuminates, blocked_by : (o,) bool or None
        Objects that its light falls on, and that keep it away; None: all.
    max_bounces : int
        As in `Lights`.
    n_cells : tuple of 5 int
        Into how many cells each dimension of the hypercube is cut where photons are guided.
    aim : Aim or None
        What half of the photons are aimed at.
    """

    name: str
    lamp: int
    power: np.ndarray
    n_cells: tuple[int, ...] = (8, 8, 8, 8, 1)
    sampled_directly = True
    max_bounces = ALL_BOUNCES
    illuminates: np.ndarray | None = None
    blocked_by: np.ndarray | None = None
    aim: Aim | None = None

    @cached_property
    def importance(self) -> float:
        return float(np.abs(self.power).sum())

    def aim_at(self, aim: Aim) -> None:
        """Aim half of the photons: those whose last number is below a half."""
        self.aim = aim
        self.n_cells = (*self.n_cells[:4], max(2 * self.n_cells[4], 2))

    def _halved(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Which photons are aimed, by their last numbers (n,): (n,) bool; and what is left of the numbers."""
        if self.aim is None:
            return np.zeros(len(u), bool), u
        aimed = u < np.float32(0.5)
        return aimed, 2 * u - ~aimed

    def _be_lamp(self, lights: Lights, lamp: int) -> None:
        """Take over what all lamps have."""
        self._lights, self.lamp, self.name = lights, lamp, lights.names[lamp]
        self.max_bounces = int(lights.max_bounces[lamp])
        self.illuminates = None if lights.illuminates is None else lights.illuminates[lamp]
        self.blocked_by = None if lights.blocked_by is None else lights.blocked_by[lamp]

    def _be_like(self, source: "Source") -> None:
        """Take over what all sources have."""
        self.name, self.lamp, self.power, self.importance = source.name, source.lamp, source.power, source.importance
        self.sampled_directly, self.max_bounces = source.sampled_directly, source.max_bounces
        self.illuminates, self.blocked_by = source.illuminates, source.blocked_by

    def emit(self, u: np.ndarray) -> Rays:
        """Rays for points `u` (n, 5) of the unit hypercube."""
        raise NotImplementedError
