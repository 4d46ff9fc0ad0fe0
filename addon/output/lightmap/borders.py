"""The borders of charts: what bilinear look-ups find there, and agreement along seams.

A texel that a chart covers in part was lit at a place off its centre, and look-ups at the chart's edge also reach for
texels that the chart does not cover at all. These texels, and those along seams, are the unknowns x of least squares:

    Σ (L(p) x − v)²  +  s² Σ (L(a) x − L(b) x)²  +  c² Σ (x₋ − 2 x + x₊)²

L(p) is a bilinear look-up at the place p. The first sum says that look-ups where light was gathered give what was
gathered; the second that both places a and b of a seam look alike; the third, weak one carries the light on in
straight lines to texels of which nothing is known. All other texels keep their values.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import binary_dilation, distance_transform_edt
from scipy.sparse import coo_array, csr_array, vstack

from ...core.compiling import kernel_array
from ...core.parallel import Workers
from ...core.progress import Progress
from ...receivers import Seams
from .conjugate_gradients import scaled, solve
from .texel_images import TexelImage

SEAM = 3.0
"""Weight s of a sample of a seam against a texel's own value."""

CURVATURE = 0.1
"""Weight c of straightness where texels are not covered."""

REAL_JUMP = 0.5
"""A seam whose sides differ by more, as a share of the brighter one, parts lit from unlit; it stays as it is."""

_OFF_CENTRE = 0.01  # texels
_TOLERANCE, _STEPS = 1e-4, 300


@dataclass(frozen=True)
class Bordered:
    """An image whose texels are right as far as look-ups within charts reach.

    Attributes
    ----------
    value : (h, w, c) float32
    known : (h, w) bool
        Texels that charts cover, and those around them.
    """

    value: np.ndarray
    known: np.ndarray


def with_borders(images: Sequence[TexelImage], seams: Seams, workers: Workers) -> list[Bordered]:
    """The images with the texels along the charts' borders fitted.

    A fitted value lies between 0 and twice the value of the nearest covered texel.
    """
    if not images:
        return []
    plane = _Plane.of(images, workers.progress)
    active = plane.outside | plane.off_centre
    looks = plane.seam_look_ups(seams)
    for look in looks:
        active[look.indices] = True
    active &= plane.covered | plane.outside
    seam = SEAM * (looks[0] - looks[1])
    data_rows = np.flatnonzero(active & plane.covered)
    data = plane.look_ups(plane.image[data_rows], plane.place[data_rows])
    bends = CURVATURE * plane.bends(plane.outside | plane.off_centre)
    unknowns = np.flatnonzero(active)
    matrix = vstack([data, seam, bends], format="csr")
    fixed = np.where(active[:, None], np.float32(0), plane.value)
    target = -(matrix @ fixed)
    target[: len(data_rows)] += plane.value[data_rows]
    system = matrix[:, unknowns]
    solved = _least_squares(system, target, plane.value[unknowns], workers)
    value = plane.value.copy()
    twice = 2 * plane.value[unknowns]
    value[unknowns] = np.clip(solved, np.minimum(twice, 0), np.maximum(twice, 0))
    return plane.split(value)


@dataclass(frozen=True)
class _Plane:
    """The N texels of all images in a row, image after image.

    Attributes
    ----------
    width, height, first : (i,) int64
        Of each image, and its first texel.
    image : (N,) int32
    value : (N, c) float32
        Of the nearest covered texel.
    chart : (N,) int32
    place : (N, 2) float32
    covered, outside, off_centre : (N,) bool
        Covered by a chart; not, but beside such a texel; covered, but lit off its centre.
    """

    width: np.ndarray
    height: np.ndarray
    first: np.ndarray
    image: np.ndarray
    value: np.ndarray
    chart: np.ndarray
    place: np.ndarray
    covered: np.ndarray
    outside: np.ndarray
    off_centre: np.ndarray

    @staticmethod
    def of(images: Sequence[TexelImage], progress: Progress) -> "_Plane":
        """The texels of images."""
        height, width = np.array([image.covered.shape for image in images], np.int64).T
        first = np.cumsum([0, *(width * height)])[:-1]
        columns = []
        for image in images:
            progress.check()
            columns.append(_columns(image))
        joined = [np.concatenate(column) for column in zip(*columns, strict=True)]
        return _Plane(width, height, first, np.repeat(np.arange(len(images)), width * height), *joined)

    def look_ups(self, image: np.ndarray, place: np.ndarray) -> csr_array:
        """Bilinear look-ups at places (n, 2) of images (n,), as a matrix (n, N)."""
        size = np.stack([self.width[image], self.height[image]], axis=1)
        at = np.clip(place - 0.5, 0, size - 1)
        low = np.minimum(at.astype(np.int64), np.maximum(size - 2, 0))
        high, share = np.minimum(low + 1, size - 1), at - low
        texels, weights = [], []
        for column, of_column in ((low[:, 0], 1 - share[:, 0]), (high[:, 0], share[:, 0])):
            for row, of_row in ((low[:, 1], 1 - share[:, 1]), (high[:, 1], share[:, 1])):
                texels.append(self.first[image] + row * size[:, 0] + column)
                weights.append(of_column * of_row)
        rows = np.tile(np.arange(len(place)), 4)
        found = coo_array(
            (np.concatenate(weights), (rows, np.concatenate(texels))), shape=(len(place), len(self.image))
        )
        found = found.tocsr()
        found.eliminate_zeros()
        return found

    def seam_look_ups(self, seams: Seams) -> tuple[csr_array, csr_array]:
        """Look-ups (s', N) at the two sides of seams, where both are known of and no jump is too large to be false."""
        looks = [self.look_ups(seams.image[:, side], seams.place[:, side]) for side in range(2)]
        unknown = (~(self.covered | self.outside)).astype(np.float32)
        light = self.value[:, :3].mean(axis=1)
        a, b = (look @ light for look in looks)
        sound = np.abs(a - b) <= REAL_JUMP * np.maximum(a, b)
        sound &= (looks[0] @ unknown < 1e-3) & (looks[1] @ unknown < 1e-3)
        k = np.flatnonzero(sound)
        return looks[0][k], looks[1][k]

    def bends(self, wanted: np.ndarray) -> csr_array:
        """Second differences along rows and columns, of triples in one chart with a wanted texel (N,), a matrix."""
        triples = []
        known = self.covered | self.outside
        for width, height, first in zip(self.width, self.height, self.first, strict=True):
            number = first + np.arange(width * height).reshape(height, width)
            for grid in (number, number.T):
                near, usable = wanted[grid], known[grid]
                usable = usable[:-2] & usable[1:-1] & usable[2:] & (near[:-2] | near[1:-1] | near[2:])
                row, column = np.nonzero(usable)
                triple = np.stack([grid[row + i, column] for i in range(3)], axis=1)
                chart = self.chart[triple]
                triples.append(triple[(chart == chart[:, :1]).all(axis=1)])
        texel = np.concatenate(triples)
        row = np.repeat(np.arange(len(texel)), 3)
        weight = np.tile([1.0, -2.0, 1.0], len(texel))
        return coo_array((weight, (row, texel.reshape(-1))), shape=(len(texel), len(self.image))).tocsr()

    def split(self, value: np.ndarray) -> list[Bordered]:
        """The images of values (N, c)."""
        images = []
        for width, height, first in zip(self.width, self.height, self.first, strict=True):
            own = slice(first, first + width * height)
            known = (self.covered | self.outside)[own].reshape(height, width)
            images.append(Bordered(value[own].reshape(height, width, -1), known))
        return images


def _columns(image: TexelImage) -> tuple[np.ndarray, ...]:
    """Value, chart, place, covered, outside and off_centre of `_Plane` for one image."""
    covered = image.covered
    nearest = distance_transform_edt(~covered, return_distances=False, return_indices=True)
    row, column = nearest if covered.any() else np.indices(covered.shape)
    outside = binary_dilation(covered, np.ones((3, 3), bool)) & ~covered
    away = np.abs(image.place - np.floor(image.place) - np.float32(0.5))
    off_centre = covered & (away.max(axis=2) > _OFF_CENTRE)
    value = image.value[row, column]
    columns = (image.chart[row, column], covered, outside, off_centre)
    chart, *masks = (column.reshape(-1) for column in columns)
    return value.reshape(-1, value.shape[2]), chart, image.place.reshape(-1, 2), *masks


def _least_squares(matrix: csr_array, target: np.ndarray, start: np.ndarray, workers: Workers) -> np.ndarray:
    """Values x (n, c) with least |matrix x − target|², the one near `start` where there are several."""
    normal = (matrix.T @ matrix).tocsr()
    right, check = matrix.T @ target, workers.progress.check
    idle = np.flatnonzero(normal.diagonal() == 0)  # of which nothing is known
    if len(idle):
        normal = (normal + coo_array((np.ones(len(idle)), (idle, idle)), shape=normal.shape)).tocsr()
        right[idle] = start[idle]
    normal, scale = scaled(normal)
    right, start = right * scale[:, None], start / scale[:, None]

    def solved(first: int) -> np.ndarray:
        of, begin = (kernel_array(a[:, first : first + 3], np.float32) for a in (right, start))
        return solve(normal, of, begin, _TOLERANCE, _STEPS, check)

    solution = np.concatenate(list(workers.map(solved, range(0, start.shape[1], 3))), axis=1)
    return solution * scale[:, None]
