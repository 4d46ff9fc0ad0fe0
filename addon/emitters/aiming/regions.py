"""Balls around what photons fly to: the receivers, and the whole scene."""

from dataclasses import dataclass

import numpy as np

from ...scene import Scene


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
