"""Surface elements: pieces of surface that receivers see about equally often, whatever the size of the triangles.

A triangle that is seen much is cut into n² equal elements; triangles that are seen little share one element with their
neighbours. Element k of a cut triangle lies in row i = ⌊nu⌋, column j = ⌊nv⌋ of its barycentric grid; a row holds
2(n−i)−1 elements, lower and upper ones in turn, so that k = i(2n−i) + 2j + [upper]. Finding an element is arithmetic,
not a search.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..scene import Scene
from ..scene.z_curve import z_curve

_MAX_CUTS = 1024
_AREA_SHARE = 0.05  # of the elements goes by area, so that what no pilot ray met is not one lump


@dataclass(frozen=True)
class SurfaceElements:
    """Elements of a scene's triangles.

    Attributes
    ----------
    cuts : (t,) int32
        n for each triangle: its edges are cut into n pieces. 1 for triangles that share an element.
    first : (t,) int32
        First element of each triangle.
    triangle_areas : (t,) float64, m²
    """

    cuts: np.ndarray
    first: np.ndarray
    triangle_areas: np.ndarray

    @staticmethod
    def by_visits(scene: Scene, visits: np.ndarray, n_elements: int) -> "SurfaceElements":
        """About `n_elements` elements that get about as many of the triangles' `visits` (t,) each.

        Small triangles of one object, one material and one of six main directions share elements in the order of a
        Z-curve through space.
        """
        areas = scene.areas
        by_visits = visits / max(visits.sum(), 1)
        wanted = n_elements * ((1 - _AREA_SHARE) * by_visits + _AREA_SHARE * areas / areas.sum())
        cuts = np.clip(np.rint(np.sqrt(wanted)), 1, _MAX_CUTS).astype(np.int32)
        alone = wanted >= 0.5
        small = np.flatnonzero(~alone)
        n_of_triangle = np.where(alone, cuts.astype(np.int64) ** 2, 0)
        first = np.cumsum(n_of_triangle) - n_of_triangle
        first[small] = n_of_triangle.sum() + _groups(scene, small, wanted[small])
        return SurfaceElements(cuts, first.astype(np.int32), areas)

    @cached_property
    def _n(self) -> int:
        return int((self.first + self.cuts.astype(np.int64) ** 2).max()) if len(self.cuts) else 0

    def __len__(self) -> int:
        return self._n

    @cached_property
    def _order(self) -> np.ndarray:
        """Triangles in the order of their first elements, so that an element's triangles stand together."""
        return np.argsort(self.first, kind="stable")

    @cached_property
    def _cumulative_area(self) -> np.ndarray:
        """Area of the triangles before each place of `_order`, (t + 1,) float64, m²."""
        return np.concatenate([[0], np.cumsum(self.triangle_areas[self._order])])

    @cached_property
    def _run(self) -> tuple[np.ndarray, np.ndarray]:
        """Where the triangles of each element start and end in `_order`, (e,) each."""
        elements = np.arange(len(self))
        first = self.first[self._order]
        end = np.searchsorted(first, elements, side="right")
        start = np.searchsorted(first, first[end - 1], side="left")
        return start, end

    @cached_property
    def areas(self) -> np.ndarray:
        """Area of each element, (e,) float64, m²."""
        start, end = self._run
        area = self._cumulative_area[end] - self._cumulative_area[start]
        return area / self.cuts[self._order[start]].astype(np.float64) ** 2

    def of_triangles(self, values: np.ndarray) -> np.ndarray:
        """Whether a flag (t, …) bool is set on any triangle of each element, (e, …) bool."""
        start, _ = self._run
        runs, run_of_element = np.unique(start, return_inverse=True)
        return np.logical_or.reduceat(values[self._order], runs, axis=0)[run_of_element]

    @cached_property
    def _padded(self) -> tuple[np.ndarray, np.ndarray]:
        """`cuts` and `first`, and at index −1 what makes `len(self)` the element of no triangle."""
        return np.append(self.cuts, np.int32(1)), np.append(self.first, np.int32(len(self)))

    def find(self, triangle: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Elements at barycentric coordinates (1−u−v, u, v) of triangles, (n,) int32; `len(self)` for triangle −1."""
        cuts, first = self._padded
        n = cuts[triangle]
        x, y = u * n, v * n
        i = np.clip(x.astype(np.int32), 0, n - 1)
        j = np.clip(y.astype(np.int32), 0, n - 1 - i)
        upper = (x - i + y - j > 1) & (i + j < n - 1)
        return first[triangle] + i * (2 * n - i) + 2 * j + upper

    def sample(self, element: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Points uniform by area on elements, from (n, 3) numbers in [0, 1): triangle, u, v, (n,) each."""
        start, end = (ends[element] for ends in self._run)
        low, high = self._cumulative_area[start], self._cumulative_area[end]
        place = np.searchsorted(self._cumulative_area, low + u[:, 2] * (high - low), side="right") - 1
        triangle = self._order[np.clip(place, start, end - 1)].astype(np.int32)
        n = self.cuts[triangle].astype(np.int64)
        k = element - self.first[triangle]
        # The rows from i on hold (n−i)² elements, so i is the largest with (n−i)² ≥ n² − k.
        i = n - np.ceil(np.sqrt(n * n - k)).astype(np.int64)
        rest = k - i * (2 * n - i)
        j, upper = rest // 2, rest % 2 == 1
        folded = u[:, 0] + u[:, 1] > 1
        a, b = np.where(folded, 1 - u[:, 0], u[:, 0]), np.where(folded, 1 - u[:, 1], u[:, 1])
        # An upper element is a lower one turned by half a turn.
        u = (i + np.where(upper, 1 - a, a)) / n
        v = (j + np.where(upper, 1 - b, b)) / n
        return triangle, u.astype(np.float32), v.astype(np.float32)


def _groups(scene: Scene, triangles: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Number of the group that each triangle belongs to, from 0: runs along a Z-curve that want one element each."""
    if len(triangles) == 0:
        return np.zeros(0, np.int64)
    normals = scene.normals[triangles]
    axis = np.abs(normals).argmax(axis=1)
    facing = 2 * axis + (normals[np.arange(len(axis)), axis] < 0)
    kind = scene.object_of_triangle[triangles].astype(np.int64) * len(scene.materials.names)
    kind = (kind + scene.material_of_triangle[triangles]) * 6 + facing
    middles = scene.points(triangles, *np.full((2, len(triangles)), np.float32(1 / 3)))
    order = np.lexsort([z_curve(middles), kind])
    # A new group starts where the kind changes, or where the run so far has filled one element
    filled = np.floor(np.cumsum(wanted[order])).astype(np.int64)
    new = (np.diff(kind[order]) != 0) | (np.diff(filled) != 0)
    group = np.zeros(len(triangles), np.int64)
    group[order[1:]] = np.cumsum(new)
    return group
