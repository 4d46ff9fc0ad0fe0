"""Objects whose light is not linear between their vertices, found by few points in their widest triangles."""

from dataclasses import dataclass, replace

import numpy as np

from ...receivers import Receivers
from .samples import LEAST_LIGHT, Samples, mean_by, on_objects
from .triangles import Placed, Triangles

WIDEST = 16
"""Triangles of an object that are looked at."""

COARSE = 0.1
"""Mean error between vertices, relative to the light, from which on an object is said to be too coarse."""

_N_POINTS = 1_000
_OF_TRIANGLE = 4


@dataclass(frozen=True)
class WidePoints:
    """Points in the widest triangles of objects, with their light.

    Attributes
    ----------
    meshes : list of Placed
        With those triangles alone.
    triangles : Triangles
    samples : Samples
    """

    meshes: list[Placed]
    triangles: Triangles
    samples: Samples

    @staticmethod
    def of(meshes: list[Placed], seed: int) -> "WidePoints | None":
        """Points in triangles of at least one mesh, the widest of all; None without any."""
        if not any(len(mesh.corner) for mesh in meshes):
            return None
        triangles = Triangles.of(meshes)
        counts = np.zeros(len(triangles), np.int64)
        counts[np.argsort(-triangles.area, kind="stable")[: _N_POINTS // _OF_TRIANGLE]] = _OF_TRIANGLE
        return WidePoints(meshes, triangles, Samples.placed(counts, seed, 0))

    @property
    def receivers(self) -> Receivers:
        owner = self.triangles.owner[self.samples.triangle]
        return on_objects([self.samples.receivers(self.triangles)], [owner], self.meshes)

    def lit(self, light: np.ndarray, stderr: np.ndarray) -> "WidePoints":
        """The same points with their light (s, 3), W/m², and its standard error (s,)."""
        return replace(self, samples=self.samples.lit(light, stderr))

    def coarse(self, corner_light: np.ndarray, corner_stderr: np.ndarray, mean: float, least: float) -> list[str]:
        """Names of objects that are too coarse for their light, those of most error first.

        Parameters
        ----------
        corner_light : (t, 3, 3), W/m²
            At the triangles' corners.
        corner_stderr : (t, 3), W/m²
        mean : float, W/m²
            Of all light.
        least : float
            Error that is not told from noise, relative to the light.
        """
        errors = self.samples.errors(corner_light, corner_stderr, LEAST_LIGHT * mean)
        of_triangle = mean_by(self.samples.triangle, errors, len(self.triangles))
        seen = np.bincount(self.samples.triangle, minlength=len(self.triangles)) > 0
        owner, area = self.triangles.owner[seen], self.triangles.area[seen]
        n = len(self.meshes)
        error = np.bincount(owner, area * of_triangle[seen], n) / np.maximum(np.bincount(owner, area, n), 1e-30)
        order = np.argsort(-error, kind="stable")
        return [self.meshes[i].object_name for i in order if error[i] > max(COARSE, least)]
