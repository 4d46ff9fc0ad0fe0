"""What every tracer promises."""

from dataclasses import dataclass, fields
from typing import Protocol

import numpy as np

from ..sampling.vectors import dot


@dataclass(frozen=True)
class Hits:
    """Where n rays end.

    Attributes
    ----------
    triangle : (n,) int32
        Triangle of the scene that each ray meets first, −1 where it meets none.
    distance : (n,) float32, m
        Along the ray's unit direction; infinite where the ray meets nothing.
    u, v : (n,) float32
        Barycentric weights of the triangle's second and third vertex.
    normal : (n, 3) float32
        The triangle's unit geometric normal by its winding; undefined where the ray meets nothing.
    """

    triangle: np.ndarray
    distance: np.ndarray
    u: np.ndarray
    v: np.ndarray
    normal: np.ndarray

    def back(self, directions: np.ndarray) -> np.ndarray:
        """Which rays came to the back of their triangle, (n,) bool."""
        return dot(self.normal, directions) > 0

    def points(self, origins: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Positions of the hits, and the unit normals of the sides that the rays came to, (n, 3) float32 each."""
        normals = np.where(self.back(directions)[:, None], -self.normal, self.normal)
        return origins + self.distance[:, None] * directions, normals

    def where(self, chosen: np.ndarray) -> "Hits":
        """The hits of the rays that a mask or an index array chooses."""
        return Hits(*(getattr(self, f.name)[chosen] for f in fields(self)))

    @staticmethod
    def none(n: int) -> "Hits":
        """As many rays that meet nothing."""
        zeros = np.zeros(n, np.float32)
        return Hits(
            np.full(n, -1, np.int32), np.full(n, np.inf, np.float32), zeros, zeros, np.zeros((n, 3), np.float32)
        )

    @property
    def hit(self) -> np.ndarray:
        """Which rays meet a triangle, (n,) bool."""
        return self.triangle >= 0


class Tracer(Protocol):
    """Finds where rays meet a scene. Both calls may be made from several threads at once."""

    def closest_hit(self, origins: np.ndarray, directions: np.ndarray, t_max: float = np.inf) -> Hits:
        """The first triangle that scatters light along each ray.

        Parameters
        ----------
        origins, directions : (n, 3) float32
            World space, m; directions have unit length.
        t_max : float
            Farthest distance looked at, m.
        """
        ...

    def occluded(self, origins: np.ndarray, targets: np.ndarray) -> np.ndarray:
        """Whether a triangle that casts shadows lies strictly between each origin and its target, (n,) bool.

        Parameters
        ----------
        origins, targets : (n, 3) float32
            World space, m. The last 1e-4 of the way to the target is not looked at.
        """
        ...
