"""Surface elements: every triangle cut into n² equal triangles, found again from barycentric coordinates.

Element k of a triangle lies in row i = ⌊nu⌋, column j = ⌊nv⌋ of its barycentric grid; a row holds 2(n−i)−1 elements,
lower and upper ones in turn, so that k = i(2n−i) + 2j + [upper]. Finding an element is arithmetic, not a search.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..scene import Scene


@dataclass(frozen=True)
class SurfaceElements:
    """Elements of a scene's triangles.

    Attributes
    ----------
    cuts : (t,) int32
        n for each triangle: its edges are cut into n pieces.
    first : (t + 1,) int32
        First element of each triangle.
    """

    cuts: np.ndarray
    first: np.ndarray

    @staticmethod
    def of_cuts(cuts: np.ndarray) -> "SurfaceElements":
        """Elements of triangles whose edges are cut into `cuts` (t,) pieces."""
        cuts = cuts.astype(np.int32)
        return SurfaceElements(cuts, np.concatenate([[0], np.cumsum(cuts.astype(np.int64) ** 2)]).astype(np.int32))

    def __len__(self) -> int:
        return int(self.first[-1])

    @cached_property
    def triangle(self) -> np.ndarray:
        """Triangle of each element, (e,) int32."""
        return np.repeat(np.arange(len(self.cuts), dtype=np.int32), self.cuts**2)

    def areas(self, scene: Scene) -> np.ndarray:
        """Area of each element, (e,) float64, m²."""
        return np.repeat(scene.areas / self.cuts.astype(np.float64) ** 2, self.cuts**2)

    @cached_property
    def _cuts_or_one(self) -> np.ndarray:
        """`cuts`, and a 1 at index −1 that makes `first[-1]`, the number of elements, the element of no triangle."""
        return np.append(self.cuts, np.int32(1))

    def find(self, triangle: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Elements at barycentric coordinates (1−u−v, u, v) of triangles, (n,) int32; `len(self)` for triangle −1."""
        n = self._cuts_or_one[triangle]
        x, y = u * n, v * n
        i = np.clip(x.astype(np.int32), 0, n - 1)
        j = np.clip(y.astype(np.int32), 0, n - 1 - i)
        upper = (x - i + y - j > 1) & (i + j < n - 1)
        return self.first[triangle] + i * (2 * n - i) + 2 * j + upper

    def sample(self, element: np.ndarray, u1: np.ndarray, u2: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Points uniform by area on elements, from (n,) numbers in [0, 1): triangle, u, v, (n,) each."""
        triangle = self.triangle[element]
        n = self.cuts[triangle].astype(np.int64)
        k = element - self.first[triangle]
        # The rows from i on hold (n−i)² elements, so i is the largest with (n−i)² ≥ n² − k.
        i = n - np.ceil(np.sqrt(n * n - k)).astype(np.int64)
        rest = k - i * (2 * n - i)
        j, upper = rest // 2, rest % 2 == 1
        folded = u1 + u2 > 1
        a, b = np.where(folded, 1 - u1, u1), np.where(folded, 1 - u2, u2)
        # An upper element is a lower one turned by half a turn.
        u = (i + np.where(upper, 1 - a, a)) / n
        v = (j + np.where(upper, 1 - b, b)) / n
        return triangle, u.astype(np.float32), v.astype(np.float32)
