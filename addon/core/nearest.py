"""The nearest of many points with normals, by place and direction alike: a k-d tree that kernels search.

A point counts as a place in six dimensions: its position, and its unit normal times a length. So at a point as far away
as that length is as near as one at the same position whose normal differs by one (57°).
"""

from typing import NamedTuple

import numpy as np

from .compiling import by_reference, kernel, part
from .vec3 import ZERO, dot, times

_LEAF = 8
"""Points that are not parted any more."""

_EVEN_FROM = 24
"""The level from which nodes are parted into halves of their points, however these lie: trees are no deeper than this
and the logarithm of the number of points, for which `_DEPTH` is enough."""

_DEPTH = 64


@by_reference
class PointTree(NamedTuple):
    """A tree over m points. Nodes come in depth-first order: a node's first child is the next one.

    Attributes
    ----------
    place : (m, 6) float32, m
        Positions, and normals times `turn`, in the order of the leaves.
    number : (m,) int32
        Of each point, in that order.
    low, high : (nodes, 6) float32, m
        The box around each node's points.
    first, last : (nodes,) int32
        The node's first point, and the one after its last.
    second : (nodes,) int32
        The node's second child; 0 for leaves.
    turn : float32, m
        The length that normals are multiplied by.
    """

    place: np.ndarray
    number: np.ndarray
    low: np.ndarray
    high: np.ndarray
    first: np.ndarray
    last: np.ndarray
    second: np.ndarray
    turn: np.float32

    @staticmethod
    def of(position: np.ndarray, normal: np.ndarray, turn: float) -> "PointTree":
        """Of positions (m, 3) with unit normals (m, 3)."""
        place = np.concatenate([position, np.float32(turn) * normal], axis=1).astype(np.float32)
        n = len(place)
        number, boxes = np.arange(n, dtype=np.int32), np.zeros((2, max(2 * n, 1), 6), np.float32)
        nodes, stack = np.zeros((3, max(2 * n, 1)), np.int32), np.zeros((_DEPTH, 4), np.int32)
        n_nodes = _build(place, number, boxes[0], boxes[1], nodes[0], nodes[1], nodes[2], stack)
        low, high, first, last, second = (a[:n_nodes].copy() for a in (*boxes, *nodes))
        return PointTree(place[number], number, low, high, first, last, second, np.float32(turn))


class Search(NamedTuple):
    """Memory of a search for the k nearest points; each call of a kernel brings its own.

    Attributes
    ----------
    number : (k,) int32
        The nearest points.
    distance2 : (k,) float32, m²
        Their squared distances, ascending.
    node : (64,) int32, bound : (64,) float32
        Nodes that are still to be looked at, and their squared distances.
    """

    number: np.ndarray
    distance2: np.ndarray
    node: np.ndarray
    bound: np.ndarray


def new_search(k: int) -> Search:
    """Memory for the k nearest points."""
    (number, node), (distance2, bound) = (([np.zeros(n, kind) for n in (k, _DEPTH)]) for kind in (np.int32, np.float32))
    return Search(number, distance2, node, bound)


@part
def find_nearest(tree, search, position, normal, nearly):
    """Fill `search` with the points nearest to a point with a unit normal; the tree has at least as many.

    Parameters
    ----------
    nearly : float32
        (1 + ε)²: the distances may be 1 + ε times those of the nearest.
    """
    turned, worst = times(normal, tree.turn), len(search.number) - 1
    search.distance2[:] = np.inf
    search.node[0], search.bound[0], n_left = 0, ZERO, 1
    while n_left > 0:
        n_left -= 1
        if search.bound[n_left] * nearly >= search.distance2[worst]:
            continue
        node = search.node[n_left]
        if tree.second[node] == 0:
            for i in range(tree.first[node], tree.last[node]):
                _keep(search, worst, tree.number[i], _point_distance2(tree, i, position, turned))
            continue
        near, far = node + 1, tree.second[node]
        near2, far2 = _box_distance2(tree, near, position, turned), _box_distance2(tree, far, position, turned)
        if far2 < near2:
            near, far, near2, far2 = far, near, far2, near2
        search.node[n_left], search.bound[n_left] = far, far2
        search.node[n_left + 1], search.bound[n_left + 1] = near, near2
        n_left += 2


@part
def _keep(search, worst, number, distance2):
    """Keep a point if it is one of the nearest so far."""
    slot = worst
    if distance2 < search.distance2[slot]:
        while slot > 0 and search.distance2[slot - 1] > distance2:
            search.distance2[slot], search.number[slot] = search.distance2[slot - 1], search.number[slot - 1]
            slot -= 1
        search.distance2[slot], search.number[slot] = distance2, number


@part
def _box_distance2(tree, node, position, turned):
    """Squared distance of a place from a node's box."""
    low, high = tree.low[node], tree.high[node]
    off = _off(low[0], high[0], position[0]), _off(low[1], high[1], position[1]), _off(low[2], high[2], position[2])
    turn = _off(low[3], high[3], turned[0]), _off(low[4], high[4], turned[1]), _off(low[5], high[5], turned[2])
    return dot(off, off) + dot(turn, turn)


@part
def _off(low, high, x):
    return max(low - x, ZERO) + max(x - high, ZERO)


@part
def _point_distance2(tree, i, position, turned):
    """Squared distance of a place from a point's."""
    place = tree.place[i]
    off = place[0] - position[0], place[1] - position[1], place[2] - position[2]
    turn = place[3] - turned[0], place[4] - turned[1], place[5] - turned[2]
    return dot(off, off) + dot(turn, turn)


@kernel
def _build(place, number, low, high, first, last, second, stack):
    """Order the points' numbers so that each node's are together, and make the nodes; returns how many."""
    stack[0, 0], stack[0, 1], stack[0, 2], stack[0, 3] = 0, len(number), -1, 0
    n_left, n_nodes = 1, 0
    while n_left > 0:
        n_left -= 1
        begin, end, parent, level = stack[n_left, 0], stack[n_left, 1], stack[n_left, 2], stack[n_left, 3]
        node, n_nodes = n_nodes, n_nodes + 1
        if parent >= 0:
            second[parent] = node
        first[node], last[node] = begin, end
        axis, widest = _box(place, number, begin, end, low, high, node)
        if end - begin <= _LEAF or not widest > ZERO:
            continue
        middle = begin
        if level < _EVEN_FROM:
            middle = _part_by(place, axis, number, begin, end, (low[node, axis] + high[node, axis]) / np.float32(2))
        if not begin < middle < end:
            middle = (begin + end) // 2
            _part_at(place, axis, number, begin, end, middle)
        stack[n_left, 0], stack[n_left, 1], stack[n_left, 2], stack[n_left, 3] = middle, end, node, level + 1
        n_left += 1
        stack[n_left, 0], stack[n_left, 1], stack[n_left, 2], stack[n_left, 3] = begin, middle, -1, level + 1
        n_left += 1
    return n_nodes


@part
def _box(place, number, begin, end, low, high, node):
    """Find the box of a node; returns its widest axis and how wide it is there."""
    widest, axis = np.float32(-1), 0
    for a in range(6):
        least, most = np.float32(np.inf), np.float32(-np.inf)
        for i in range(begin, end):
            least, most = min(least, place[number[i], a]), max(most, place[number[i], a])
        low[node, a], high[node, a] = least, most
        if most - least > widest:
            widest, axis = most - least, a
    return axis, widest


@part
def _part_by(place, axis, number, begin, end, value):
    """Order some numbers so that those up to a value come first; returns the first of the others."""
    middle = begin
    for i in range(begin, end):
        if place[number[i], axis] <= value:
            number[i], number[middle] = number[middle], number[i]
            middle += 1
    return middle


@part
def _part_at(place, axis, number, begin, end, middle):
    """Order some numbers so that those before `middle` are not above those after it (Hoare's selection)."""
    low, high = begin, end - 1
    while low < high:
        pivot, i, j = place[number[middle], axis], low, high
        while i <= j:
            while place[number[i], axis] < pivot:
                i += 1
            while place[number[j], axis] > pivot:
                j -= 1
            if i <= j:
                number[i], number[j] = number[j], number[i]
                i += 1
                j -= 1
        if j < middle:
            low = i
        if middle < i:
            high = j
