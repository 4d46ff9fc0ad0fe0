"""What modifiers make of a mesh's attribute, as a sparse matrix, and the attribute that shows wanted values after it.

Modifiers mix attributes linearly: the value v at a corner of the evaluated mesh is Σ a·x over elements of the stored
mesh, or v = A·x. The stored values x that show wanted values b best minimise

    Σ w·(A·x − b)² + λ·Σ d·(x − x₀)²

over the corners' areas w, where x₀ is the mean of the values that an element takes part in, Aᵀw·b / Aᵀw, d the diagonal
of AᵀwA, and λ is so small that it decides only what no corner shows.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .receivers import Domain

REGULARIZATION = 1e-6

N_PLACES = 2
"""Places that a stored value is fitted to where it is shown in more: the light there is much the same."""


@dataclass(frozen=True)
class AttributeMap:
    """A of c evaluated corners and e stored elements, with k entries.

    Attributes
    ----------
    domain : 'POINT' or 'CORNER'
        Of the stored elements.
    area : (c,) float32, m²
        Of the surface, per corner.
    stand_in : (e,) int32
        The element that each takes its value from: itself, or where no corner shows it, the nearest that one shows.
    corner, element : (k,) int32
    weight : (k,) float32
        A corner's weights add up to 1. Corners without an entry show what no stored value can change.
    misplaced : float
        See `with_misplaced`.
    """

    domain: Domain
    area: np.ndarray
    stand_in: np.ndarray
    corner: np.ndarray
    element: np.ndarray
    weight: np.ndarray
    misplaced: float = 0.0

    @property
    def reached(self) -> np.ndarray:
        """Corners that show a stored value, (c,) bool."""
        reached = np.zeros(len(self.area), bool)
        reached[self.corner] = True
        return reached

    def shown(self, stored: np.ndarray) -> np.ndarray:
        """Values at the corners, (c, d), of stored values (e, d)."""
        return self._matrix() @ stored

    def decisive(self) -> np.ndarray:
        """Corners that decide on stored values, (c,) bool: for each value the `N_PLACES` that count most."""
        score = self.weight**2 * self.area[self.corner]
        order = np.lexsort((-score, self.element))
        element = self.element[order]
        first = np.searchsorted(element, element)
        decisive = np.zeros(len(self.area), bool)
        decisive[self.corner[order[np.arange(len(order)) - first < N_PLACES]]] = True
        return decisive

    def stored(self, wanted: np.ndarray, known: np.ndarray | None = None) -> np.ndarray:
        """Values (e, d) float64 to store, for which those at the corners come nearest to the wanted ones (c, d).

        Parameters
        ----------
        wanted : (c, d)
        known : (c,) bool, optional
            At which corners there is one.
        """
        from scipy.sparse import diags
        from scipy.sparse.linalg import splu

        matrix = self._matrix()
        # Even what has hardly any area counts for something, or nothing would hold its values.
        weight = self.area + 1e-6 * max(float(self.area.mean()), 1e-30)
        weight = weight if known is None else weight * known
        weighted = matrix.multiply(weight[:, None]).T.tocsr()
        normal = (weighted @ matrix).tocsc()
        diagonal = normal.diagonal()
        shown = diagonal > 0
        share = weighted @ np.ones(len(weight))
        prior = (weighted @ wanted) / np.where(share > 0, share, 1)[:, None]
        normal = normal + diags(np.where(shown, REGULARIZATION * diagonal, 1), format="csc")
        change = splu(normal, permc_spec="MMD_AT_PLUS_A").solve(weighted @ (wanted - matrix @ prior))
        return (prior + change)[self.stand_in]

    def with_misplaced(self, position: np.ndarray, normal: np.ndarray) -> "AttributeMap":
        """The same, knowing how far off the light is that corners show, 0 to about 1: 0 where each can show its own.

        That is the root mean square, over the surface, of how far what is shown is from where it is shown: in place, as
        a share of the object's radius, or in normal, whichever is more.

        Parameters
        ----------
        position : (c, 3) float32, m
        normal : (c, 3) float32
        """
        area = np.where(self.reached, self.area, 0).astype(np.float64)
        area /= max(area.sum(), 1e-300)
        centred = position - area @ position
        radius = np.sqrt(area @ (centred**2).sum(1))
        wanted = np.concatenate([centred / max(radius, 1e-30), normal], axis=1)
        off = area @ (self.shown(self.stored(wanted)) - wanted) ** 2
        return replace(self, misplaced=float(np.sqrt(max(off[:3].sum(), off[3:].sum()))))

    def _matrix(self) -> Any:
        """A, a ``scipy.sparse.csr_array`` of float64."""
        from scipy.sparse import csr_array

        shape = len(self.area), len(self.stand_in)
        return csr_array((self.weight.astype(np.float64), (self.corner, self.element)), shape)


def unreached_share(maps: Sequence[AttributeMap]) -> float:
    """Share of a surface that shows no stored value, by the maps of all meshes that it shows values of."""
    area = maps[0].area.astype(np.float64)
    reached = np.any([one.reached for one in maps], axis=0)
    return float(area[~reached].sum() / max(area.sum(), 1e-300))
