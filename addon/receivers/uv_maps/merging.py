"""Charts that meet, made one where their faces look one way: fewer charts have fewer seams, and waste fewer texels."""

from collections.abc import Callable

import numpy as np

from ...core.sampling.vectors import dot
from .faces import Faces

ANGLE = float(np.radians(40))
"""Between the mean normal of a chart that was made of two and its faces, at most."""

_ROUNDS = 24


def merged(
    faces: Faces, chart: np.ndarray, first: np.ndarray, second: np.ndarray, check: Callable[[], None]
) -> np.ndarray:
    """The chart of each face (f,) after pairs of charts were made one, as long as any can be.

    Whether two can is told by cones about their mean normals that hold their faces' normals. Each round joins the
    charts that are each other's best partner: of those that it can be joined with, that with the longest border.

    Parameters
    ----------
    first, second : (p,) int32
        Pairs of faces that share an edge.
    """
    if not len(chart):
        return chart
    for _ in range(_ROUNDS):
        check()
        n = int(chart.max()) + 1
        total = np.stack([np.bincount(chart, column, n) for column in faces.vector_areas.T], axis=1)
        cosine = _narrowest(faces, chart, total)
        a, b, shared = _borders(chart, first, second, n)
        fits = _fits(total, cosine, a, b)
        partner = _best_partners(a[fits], b[fits], shared[fits], n)
        mutual = (partner >= 0) & (partner[partner] == np.arange(n))
        number = np.where(mutual, np.minimum(partner, np.arange(n)), np.arange(n))
        if not mutual.any():
            break
        chart = np.unique(number[chart], return_inverse=True)[1].reshape(-1).astype(np.int32)
    return chart


def _narrowest(faces: Faces, chart: np.ndarray, total: np.ndarray) -> np.ndarray:
    """Cosine of the half angle of the cone about each chart's mean normal that holds its faces' normals, (n,)."""
    area = np.sqrt(dot(faces.vector_areas, faces.vector_areas))
    length = np.sqrt(dot(total, total))
    cosine = dot(faces.vector_areas, total[chart]) / np.maximum(area * length[chart], 1e-300)
    least = np.ones(len(total))
    np.minimum.at(least, chart[area > 0], cosine[area > 0])
    return np.clip(least, -1, 1)


def _borders(chart: np.ndarray, first: np.ndarray, second: np.ndarray, n: int) -> tuple[np.ndarray, ...]:
    """Pairs of charts that meet, each in both orders, and how many edges they share."""
    a, b = chart[first].astype(np.int64), chart[second].astype(np.int64)
    apart = a != b
    low, high = np.minimum(a, b)[apart], np.maximum(a, b)[apart]
    pair, shared = np.unique(low * n + high, return_counts=True)
    low, high = np.divmod(pair, n)
    return np.concatenate([low, high]), np.concatenate([high, low]), np.tile(shared, 2)


def _fits(total: np.ndarray, cosine: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Whether the faces of two charts lie within `ANGLE` about their common mean normal."""
    mean = total[a] + total[b]
    length = np.sqrt(dot(mean, mean))
    fits = length > 0
    for one in (a, b):
        own = np.sqrt(dot(total[one], total[one]))
        away = np.arccos(np.clip(dot(mean, total[one]) / np.maximum(length * own, 1e-300), -1, 1))
        fits &= (own == 0) | (away + np.arccos(cosine[one]) < ANGLE)
    return fits


def _best_partners(a: np.ndarray, b: np.ndarray, shared: np.ndarray, n: int) -> np.ndarray:
    """For each chart that of its partners with which it shares most edges, (n,); −1 for none.

    Of several as good, that is taken which a hash of the pair says, so that chains of them do not all wait for one.
    """
    mixed = (np.minimum(a, b) * 2654435761 + np.maximum(a, b) * 40503) % 65536
    order = np.lexsort([b, mixed, shared, a])
    last = np.flatnonzero(np.append(np.diff(a[order]) != 0, True)) if len(order) else order
    partner = np.full(n, -1)
    partner[a[order[last]]] = b[order[last]]
    return partner
