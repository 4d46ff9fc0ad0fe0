"""Triangles cut in parts until their edges are short, without gaps: an edge is cut by its own length alone."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Corners:
    """v vertices and t triangles of them.

    Attributes
    ----------
    position, normal : (v, 3) float32
    uv : (v, 2) float32
    triangles : (t, 3) int64
    source : (t,) int64
        Triangle of the scene that each is a part of, in ascending runs.
    """

    position: np.ndarray
    normal: np.ndarray
    uv: np.ndarray
    triangles: np.ndarray
    source: np.ndarray


def refined(corners: Corners, spacing: float, n_most: int) -> Corners:
    """Triangles whose edges are no longer than `spacing`, or as short as `n_most` vertices allow: the longest first."""
    longest = float(_lengths(corners).max(initial=0))
    limit = max(longest / _STEP, spacing)
    while longest > spacing:
        finer = _cut(corners, limit)
        if len(finer.position) > n_most:
            break
        corners, longest = finer, float(_lengths(finer).max(initial=0))
        if longest <= limit:
            limit = max(limit / _STEP, spacing)
    return corners


_STEP = 2**0.25


def _lengths(corners: Corners) -> np.ndarray:
    """Lengths of the edges from each corner to the next, (t, 3)."""
    at = corners.position[corners.triangles]
    lengths: np.ndarray = np.linalg.norm(at[:, [1, 2, 0]] - at, axis=2).astype(np.float64)
    return lengths


_PARTS = {
    0: [(0, 1, 2)],
    1: [(0, 3, 2), (3, 1, 2)],
    2: [(1, 4, 0), (4, 2, 0)],
    4: [(2, 5, 1), (5, 0, 1)],
    3: [(3, 1, 4), (0, 3, 4), (0, 4, 2)],
    6: [(4, 2, 5), (1, 4, 5), (1, 5, 0)],
    5: [(5, 0, 3), (2, 5, 3), (2, 3, 1)],
    7: [(0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)],
}
"""By which edges are cut (a bit each): the parts, of corners 0 to 2 and the middles 3 to 5 of the edges after them."""


def _cut(corners: Corners, limit: float) -> Corners:
    """Every edge cut in its middle that is longer than a limit."""
    triangles, n = corners.triangles, len(corners.position)
    long = _lengths(corners) > limit
    ends = np.sort(np.stack([triangles, triangles[:, [1, 2, 0]]], axis=2)[long], axis=1)
    edges, of_edge = np.unique(ends[:, 0] * n + ends[:, 1], return_inverse=True)
    a, b = edges // n, edges % n
    middles = np.full(triangles.shape, -1)
    middles[long] = n + of_edge
    normal = corners.normal[a] + corners.normal[b]
    normal = normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    all_six, pattern = np.concatenate([triangles, middles], axis=1), long @ np.array([1, 2, 4])
    parts, sources = [], []
    for number, cut in _PARTS.items():
        k = np.flatnonzero(pattern == number)
        for part in cut:
            parts.append(all_six[k][:, part])
            sources.append(k)
    order = np.argsort(np.concatenate(sources), kind="stable")
    return Corners(
        np.concatenate([corners.position, (corners.position[a] + corners.position[b]) / 2]),
        np.concatenate([corners.normal, normal.astype(np.float32)]),
        np.concatenate([corners.uv, (corners.uv[a] + corners.uv[b]) / 2]),
        np.concatenate(parts)[order],
        corners.source[np.concatenate(sources)[order]],
    )
