"""Surface elements: pieces of surface that receivers see about equally often, whatever the size of the triangles.

Triangles that are seen much are cut into cells, and each cell is cut again by how much it is seen itself: of a ground
plane that runs on outside, the part inside the room gets the elements. Cells that are seen little share one element
with their neighbours.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ...core.compiling import by_reference, kernel, part
from ...core.vec3 import ONE
from ...core.z_curve import z_curve
from ...scene import Scene
from .barycentric_grid import cell_at, point_in

_MAX_CUTS = 1024
_MAX_CELL_CUTS = 128
_ELEMENTS_OF_CELL = 64  # so many that how often a cell is seen is known well
_AREA_SHARE = 0.05  # of the elements goes by area, so that what no pilot ray met is not one lump


def _wanted(visits: np.ndarray, areas: np.ndarray, n_elements: int) -> np.ndarray:
    """Elements that pieces of surface ask for, (n,)."""
    by_visits = visits / max(visits.sum(), 1)
    return n_elements * ((1 - _AREA_SHARE) * by_visits + _AREA_SHARE * areas / areas.sum())


@dataclass(frozen=True)
class SurfaceCells:
    """Equal parts of triangles, all those of one triangle after the other.

    Attributes
    ----------
    cuts : (t,) int32
        Each triangle's edges are cut into so many pieces, which makes cuts² cells.
    first : (t + 1,) int32
        First cell of each triangle; last, the number of cells.
    """

    cuts: np.ndarray
    first: np.ndarray

    @staticmethod
    def by_visits(scene: Scene, visits: np.ndarray, n_elements: int) -> "SurfaceCells":
        """Cells for about `n_elements` elements, by how often triangles are visited, (t,)."""
        wanted = _wanted(visits, scene.areas, n_elements) / _ELEMENTS_OF_CELL
        cuts = np.clip(np.ceil(np.sqrt(wanted)), 1, _MAX_CELL_CUTS).astype(np.int32)
        return SurfaceCells(cuts, np.concatenate([[0], np.cumsum(cuts.astype(np.int64) ** 2)]).astype(np.int32))

    def __len__(self) -> int:
        return int(self.first[-1])

    @cached_property
    def triangle(self) -> np.ndarray:
        """Triangle of each cell, (c,) int32."""
        return np.repeat(np.arange(len(self.cuts), dtype=np.int32), self.cuts.astype(np.int64) ** 2)

    def areas(self, scene: Scene) -> np.ndarray:
        """Area of each cell, (c,) float64, m²."""
        return scene.areas[self.triangle] / self.cuts[self.triangle].astype(np.float64) ** 2

    def find(self, triangle: np.ndarray, u: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Cells at points of triangles and the coordinates in them, (n,) each."""
        cell, a, b = np.empty(len(triangle), np.int32), *np.empty((2, len(triangle)), np.float32)
        _find_cells(self.cuts, self.first, triangle, u, v, cell, a, b)
        return cell, a, b

    def points(self, cell: np.ndarray, a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Triangle, u and v of coordinates a, b in cells, (n,) each."""
        triangle, (u, v) = self.triangle[cell], np.empty((2, len(cell)), np.float32)
        _cell_points(self.cuts, self.first, triangle, cell, a, b, u, v)
        return triangle, u, v


@dataclass(frozen=True)
class SurfaceElements:
    """Elements of a scene's triangles.

    Attributes
    ----------
    cells : SurfaceCells
    cuts : (c,) int32
        n for each cell: its edges are cut into n pieces. 1 for cells that share an element.
    first : (c,) int32
        First element of each cell.
    cell_areas : (c,) float64, m²
    """

    cells: SurfaceCells
    cuts: np.ndarray
    first: np.ndarray
    cell_areas: np.ndarray

    @staticmethod
    def by_visits(scene: Scene, cells: SurfaceCells, visits: np.ndarray, n_elements: int) -> "SurfaceElements":
        """About `n_elements` elements that get about as many of the cells' `visits` (c,) each.

        Small cells of one object, one material and one of six main directions share elements in the order of a
        Z-curve through space.
        """
        areas = cells.areas(scene)
        wanted = _wanted(visits, areas, n_elements)
        cuts = np.clip(np.rint(np.sqrt(wanted)), 1, _MAX_CUTS).astype(np.int32)
        alone = wanted >= 0.5
        small = np.flatnonzero(~alone)
        n_of_cell = np.where(alone, cuts.astype(np.int64) ** 2, 0)
        first = np.cumsum(n_of_cell) - n_of_cell
        first[small] = n_of_cell.sum() + _groups(scene, cells, small, wanted[small])
        return SurfaceElements(cells, cuts, first.astype(np.int32), areas)

    @cached_property
    def _n(self) -> int:
        return int((self.first + self.cuts.astype(np.int64) ** 2).max()) if len(self.cuts) else 0

    def __len__(self) -> int:
        return self._n

    @cached_property
    def _order(self) -> np.ndarray:
        """Cells in the order of their first elements, so that an element's cells stand together."""
        return np.argsort(self.first, kind="stable")

    @cached_property
    def _cumulative_area(self) -> np.ndarray:
        """Area of the cells before each place of `_order`, (c + 1,) float64, m²."""
        return np.concatenate([[0], np.cumsum(self.cell_areas[self._order])])

    @cached_property
    def _run(self) -> tuple[np.ndarray, np.ndarray]:
        """Where the cells of each element start and end in `_order`, (e,) each."""
        elements = np.arange(len(self))
        first = self.first[self._order]
        end = np.searchsorted(first, elements, side="right")
        start = np.searchsorted(first, first[end - 1], side="left")
        return start, end

    @cached_property
    def areas(self) -> np.ndarray:
        """Area of each element, (e,) float64, m²."""
        start, _ = self._run
        return self._reduced(np.add, self.cell_areas) / self.cuts[self._order[start]].astype(np.float64) ** 2

    def of_cells(self, values: np.ndarray) -> np.ndarray:
        """Whether a flag (c, …) bool is set on any cell of each element, (e, …) bool."""
        return self._reduced(np.logical_or, values)

    def _reduced(self, reduce: np.ufunc, values: np.ndarray) -> np.ndarray:
        """Values (c, …) of each element's cells made one, (e, …)."""
        start, _ = self._run
        runs, run_of_element = np.unique(start, return_inverse=True)
        reduced: np.ndarray = reduce.reduceat(values[self._order], runs, axis=0)[run_of_element]
        return reduced

    @cached_property
    def arrays(self) -> "ElementArrays":
        """The elements as kernels take them."""
        start, end = self._run
        cells, order = self.cells, self._order.astype(np.int32)
        return ElementArrays(
            cells.cuts, cells.first, self.cuts, self.first, cells.triangle, order, start, end, self._cumulative_area
        )

    def find(self, triangle: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Elements at barycentric coordinates (1−u−v, u, v) of triangles, (n,) int32; `len(self)` for triangle −1."""
        found = np.full(len(triangle), len(self), np.int32)
        _find_elements(self.arrays, triangle, u, v, found)
        return found


@by_reference
class ElementArrays(NamedTuple):
    """Elements as kernels take them; see `SurfaceElements`.

    Attributes
    ----------
    triangle_cuts, triangle_first
        `cuts` and `first` of the cells.
    cuts, first
        Of the elements.
    triangle : (c,) int32
        Of each cell.
    order : (c,) int32
        Cells in the order of their elements.
    start, end : (e,) int64
        Where the cells of each element start and end in `order`.
    cumulative_area : (c + 1,) float64, m²
        Of the cells before each place of `order`.
    """

    triangle_cuts: np.ndarray
    triangle_first: np.ndarray
    cuts: np.ndarray
    first: np.ndarray
    triangle: np.ndarray
    order: np.ndarray
    start: np.ndarray
    end: np.ndarray
    cumulative_area: np.ndarray


@part
def element_at(elements, triangle, u, v):
    """The element at a point of a triangle."""
    nth, a, b = cell_at(elements.triangle_cuts[triangle], u, v)
    cell = elements.triangle_first[triangle] + nth
    nth, _, _ = cell_at(elements.cuts[cell], a, b)
    return elements.first[cell] + nth


@part
def point_on(elements, element, u, v, choice):
    """A point uniform by area on an element from three numbers in [0, 1): its triangle and barycentric coordinates."""
    first, last, areas = elements.start[element], elements.end[element] - 1, elements.cumulative_area
    area = areas[first] + choice * (areas[last + 1] - areas[first])
    while first < last:  # the last cell before which there is no more area than that
        middle = (first + last + 1) // 2
        if areas[middle] <= area:
            first = middle
        else:
            last = middle - 1
    cell = elements.order[first]
    if u + v > ONE:
        u, v = ONE - u, ONE - v
    u, v = point_in(elements.cuts[cell], element - elements.first[cell], u, v)
    triangle = elements.triangle[cell]
    u, v = point_in(elements.triangle_cuts[triangle], cell - elements.triangle_first[triangle], u, v)
    return triangle, u, v


@kernel
def _find_cells(cuts, first, triangle, u, v, cell, a, b):
    """Cells at n points of triangles, and the coordinates in them."""
    for k in range(len(triangle)):
        nth, a[k], b[k] = cell_at(cuts[triangle[k]], u[k], v[k])
        cell[k] = first[triangle[k]] + nth


@kernel
def _cell_points(cuts, first, triangle, cell, a, b, u, v):
    """Barycentric coordinates on their triangles of n points of cells."""
    for k in range(len(cell)):
        u[k], v[k] = point_in(cuts[triangle[k]], cell[k] - first[triangle[k]], a[k], b[k])


@kernel
def _find_elements(elements, triangle, u, v, found):
    """Elements at n points of triangles; nothing is written for triangle −1."""
    for k in range(len(triangle)):
        if triangle[k] >= 0:
            found[k] = element_at(elements, triangle[k], u[k], v[k])


def _groups(scene: Scene, cells: SurfaceCells, small: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Number of the group that each small cell belongs to, from 0: runs along a Z-curve that want one element each."""
    if len(small) == 0:
        return np.zeros(0, np.int64)
    third = np.full(len(small), np.float32(1 / 3))
    triangles, u, v = cells.points(small, third, third)
    normals = scene.normals[triangles]
    axis = np.abs(normals).argmax(axis=1)
    facing = 2 * axis + (normals[np.arange(len(axis)), axis] < 0)
    kind = scene.object_of_triangle[triangles].astype(np.int64) * len(scene.materials.names)
    kind = (kind + scene.material_of_triangle[triangles]) * 6 + facing
    order = np.lexsort([z_curve(scene.points(triangles, u, v)), kind])
    # A new group starts where the kind changes, or where the run so far has filled one element
    filled = np.floor(np.cumsum(wanted[order])).astype(np.int64)
    new = (np.diff(kind[order]) != 0) | (np.diff(filled) != 0)
    group = np.zeros(len(small), np.int64)
    group[order[1:]] = np.cumsum(new)
    return group
