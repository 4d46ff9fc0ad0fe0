"""Rounds of splits, after each of which the light of all new vertices and of new points in triangles is gathered."""

from dataclasses import dataclass, field, replace

import numpy as np

from ...core.errors import BakeError
from ...core.progress import Progress
from .samples import LEAST_LIGHT, Light, Samples, corner_receivers, mean_by, on_objects
from .triangles import Placed, Triangles

STAGE = "Refining meshes"
BUDGET = 50_000
TOLERANCE = 0.05

_LEAST_SAMPLES = 4  # in a triangle
_SAMPLES_OF_BUDGET = 1.0  # at first, in all triangles by their areas
_MOST_ROUNDS = 64

_NEGLIGIBLE = 1 / 16
"""Of what a triangle of mean area may be off when the budget is used up: edges of shadows end there."""


@dataclass(frozen=True)
class RefineOptions:
    """When meshes are fine enough.

    Attributes
    ----------
    tolerance : float
        Mean error that is left in a triangle, as a share of its light.
    budget : int
        Vertices that are added at most, in all meshes.

    Raises
    ------
    BakeError
        If a value is out of its range.
    """

    tolerance: float = TOLERANCE
    budget: int = BUDGET

    def __post_init__(self) -> None:
        if not 1e-4 <= self.tolerance <= 1:
            raise BakeError(f"tolerance is {self.tolerance:g}; choose a number from 0.0001 to 1.")
        if not 1 <= self.budget <= 10_000_000:
            raise BakeError(f"budget is {self.budget}; choose a number from 1 to 10,000,000.")


@dataclass(frozen=True)
class Refinement:
    """How meshes are refined.

    Attributes
    ----------
    ends : dict of str to (s, 2) int32
        Of each mesh the vertices that new ones lie halfway between, in this order: new ones follow the mesh's own, and
        may be ends of later ones.
    cut : dict of str to (k,) int32
        Faces of each that are cut within; others keep their corners, with new ones along their sides.
    error : float
        Mean error that is left, relative to the light.
    before : float
        The same of the meshes as they were.
    """

    ends: dict[str, np.ndarray]
    cut: dict[str, np.ndarray]
    error: float
    before: float

    @property
    def n_vertices(self) -> int:
        """That are added."""
        return sum(len(ends) for ends in self.ends.values())


def refine(meshes: list[Placed], light: Light, options: RefineOptions, seed: int, progress: Progress) -> Refinement:
    """Find splits that make light linear within triangles, for no more vertices than may be added.

    Parameters
    ----------
    light : callable
        The light of receivers.

    Raises
    ------
    Cancelled
        If `progress` was cancelled.
    """
    state = _State.begin(meshes, light, options, seed, progress)
    before, ends = state.mean_error, [np.zeros((0, 2), np.int32)]
    left = options.budget
    for turn in range(1, _MOST_ROUNDS):
        chosen = state.worst_edges(options, left)
        if not len(chosen):
            break
        progress.update(STAGE, 1 - left / options.budget)
        state, new = state.split(chosen, meshes, light, seed, turn)
        left -= len(new)
        ends.append(new)
    progress.update(STAGE, 1)
    return _of_meshes(state, np.concatenate(ends), meshes, before)


@dataclass(frozen=True)
class _State:
    """Triangles between two rounds, and their light.

    Attributes
    ----------
    corner_light : (t, 3, 3), W/m²
    corner_stderr : (t, 3), W/m²
    samples : Samples
    least : float, W/m²
        Light that errors are compared to where there is less.
    cut : (n,) bool
        Which polygons are cut within.
    """

    triangles: Triangles
    corner_light: np.ndarray
    corner_stderr: np.ndarray
    samples: Samples
    least: float
    cut: np.ndarray
    error: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        errors = self.samples.errors(self.corner_light, self.corner_stderr, self.least)
        object.__setattr__(self, "error", mean_by(self.samples.triangle, errors, len(self.triangles)))

    @staticmethod
    def begin(meshes: list[Placed], light: Light, options: RefineOptions, seed: int, progress: Progress) -> "_State":
        """Light at the corners of all triangles, and at points spread over them."""
        progress.update(STAGE, 0)
        triangles = Triangles.of(meshes)
        n, total = len(triangles), max(float(triangles.area.sum()), 1e-30)
        by_area = np.rint(_SAMPLES_OF_BUDGET * options.budget * triangles.area / total).astype(np.int64)
        samples = Samples.placed(np.maximum(by_area, _LEAST_SAMPLES), seed, 0)
        corners, of_corner = corner_receivers(triangles, np.arange(n))
        owner = np.zeros(len(corners), np.int32)
        owner[of_corner] = triangles.owner[:, None]
        parts, owners = [corners, samples.receivers(triangles)], [owner, triangles.owner[samples.triangle]]
        value, stderr = light(on_objects(parts, owners, meshes))
        k = len(corners)
        least = LEAST_LIGHT * max(float(part.mean(dtype=np.float64)) for part in (value[:k], value[k:]))
        samples = samples.lit(value[k:], stderr[k:])
        cut = np.zeros(int(triangles.polygon.max(initial=-1)) + 1, bool)
        return _State(triangles, value[of_corner], stderr[of_corner], samples, least, cut)

    @property
    def mean_error(self) -> float:
        """Over the area of all triangles."""
        area = self.triangles.area
        return float((area * self.error).sum() / max(float(area.sum()), 1e-30))

    def worst_edges(self, options: RefineOptions, left: int) -> np.ndarray:
        """Edges to split next: those that lead on to less error, the most of it first, for so many vertices at most."""
        harm = self.error * self.triangles.area
        negligible = _NEGLIGIBLE * options.tolerance * self.triangles.area.sum() / (2 * options.budget)
        wanted = np.flatnonzero((self.error > options.tolerance) & (harm > negligible))
        edges = self.triangles.edges
        of_edge = np.bincount(edges.to[edges.longest[wanted]], harm[wanted], len(edges.to))
        worst = np.argsort(-of_edge, kind="stable")[: np.count_nonzero(of_edge)]
        return worst[np.cumsum(edges.n_vertices[worst]) <= left]

    def split(
        self, edges: np.ndarray, meshes: list[Placed], light: Light, seed: int, turn: int
    ) -> tuple["_State", np.ndarray]:
        """Split edges, and gather what is new; returns also the vertices (m, 2) that new ones lie between."""
        split = self.triangles.split(edges)
        after, n = split.after, len(split.after)
        halves = np.concatenate([split.row, np.arange(len(self.triangles), n)])
        receivers, of_corner = corner_receivers(after, halves)
        new = after.point[halves] >= len(self.triangles.position)
        used, of_new = np.unique(of_corner[new], return_inverse=True)
        owner = np.zeros(len(used), np.int32)
        owner[of_new] = np.repeat(after.owner[halves], 3)[new.ravel()]
        kept = self.samples.after(split)
        missing = np.maximum(_LEAST_SAMPLES - np.bincount(kept.triangle, minlength=n), 0)
        added = Samples.placed(missing, seed, turn)
        parts, owners = [receivers.where(used), added.receivers(after)], [owner, after.owner[added.triangle]]
        value, stderr = light(on_objects(parts, owners, meshes))
        corner_light, corner_stderr = split.halves(self.corner_light), split.halves(self.corner_stderr)
        row, corner = np.nonzero(new)
        corner_light[halves[row], corner] = value[of_new]
        corner_stderr[halves[row], corner] = stderr[of_new]
        samples = kept.joined(added.lit(value[len(used) :], stderr[len(used) :]))
        cut = self.cut.copy()
        cut[_cut_within(self.triangles, split.row, split.side)] = True
        state = replace(
            self, triangles=after, corner_light=corner_light, corner_stderr=corner_stderr, samples=samples, cut=cut
        )
        return state, split.ends


def _cut_within(triangles: Triangles, row: np.ndarray, side: np.ndarray) -> np.ndarray:
    """Polygons of which an edge between two of their own triangles is split."""
    key = triangles.edges.of_side[row, side].astype(np.int64) * (int(triangles.owner.max()) + 1) + triangles.owner[row]
    both = np.stack([key, triangles.polygon[row].astype(np.int64)], axis=1)
    pairs, counts = np.unique(both, axis=0, return_counts=True)
    return pairs[counts > 1, 1]


def _of_meshes(state: _State, ends: np.ndarray, meshes: list[Placed], before: float) -> Refinement:
    """Splits and cut polygons by mesh, in each mesh's own numbers."""
    stored = {mesh.mesh_name: mesh for mesh in meshes}
    mesh_of, n_own = state.triangles.mesh, len(state.triangles.mesh) - len(ends)
    own = np.zeros(len(mesh_of), np.int32)
    of_ends: dict[str, np.ndarray] = {}
    cut: dict[str, np.ndarray] = {}
    first_polygon = 0
    for i, (name, mesh) in enumerate(stored.items()):
        mine = np.flatnonzero(mesh_of == i)
        own[mine] = np.arange(len(mine))
        of_ends[name] = own[ends[mine[mine >= n_own] - n_own]]
        last_polygon = first_polygon + mesh.n_polygons
        cut[name] = np.flatnonzero(state.cut[first_polygon:last_polygon]).astype(np.int32)
        first_polygon = last_polygon
    return Refinement(of_ends, cut, state.mean_error, before)
