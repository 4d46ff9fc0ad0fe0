"""A densely subdivided mesh over a scene's surfaces, as somebody has who bakes light to vertices."""

import bpy
import numpy as np
from camera_only import LIFT, camera_only_mesh

_SMALL = 1 / 64  # of the region's diagonal


def add_receivers(scene, region, n):
    """Add the object "Receivers" of about n vertices, even by area over the surfaces' front sides in a region.

    Parameters
    ----------
    scene : Scene
    region : (2, 3) float, m
        Corners of a box.
    n : int
    """
    corners = _inside(scene.vertices[scene.triangles].astype(np.float64), np.asarray(region, np.float64))
    cuts, corners = _cuts(corners, n)
    vertices, triangles = _grids(corners, cuts)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    lift = LIFT * np.linalg.norm(region[1] - region[0]) * np.repeat(normal, _n_vertices(cuts), axis=0)
    receivers = camera_only_mesh("Receivers", vertices + lift, triangles)
    _add_twin(receivers, np.mean(region, axis=0))
    return receivers


def _add_twin(obj, place):
    """Add a tiny object of the same mesh, which makes instances of both.

    Cycles leaves out whole instances that a ray does not see. A mesh of one object it would merge into the scene's
    tree, where every ray would meet it on every surface: the cost of a sample would double.
    """
    twin = obj.copy()
    twin.name, twin.location, twin.scale = f"{obj.name}' Twin", place, (1e-3, 1e-3, 1e-3)
    bpy.context.scene.collection.objects.link(twin)
    bpy.context.view_layer.update()


def grown(points, share=0.003):
    """The box (2, 3) round points, grown by a share of its diagonal on every side."""
    low, high = points.min(axis=0), points.max(axis=0)
    margin = share * np.linalg.norm(high - low)
    return np.stack([low - margin, high + margin])


def _inside(corners, region):
    """The parts of triangles (t, 3, 3) in a box: those across its sides are cut in four until they are small."""
    low, high = region
    small = _SMALL * np.linalg.norm(high - low)
    found = []
    while len(corners):
        least, most = corners.min(axis=1), corners.max(axis=1)
        corners = corners[((least <= high) & (most >= low)).all(axis=1)]
        least, most = corners.min(axis=1), corners.max(axis=1)
        within = ((least >= low) & (most <= high)).all(axis=1)
        fine = ~within & ((most - least).max(axis=1) < small)
        middle = corners.mean(axis=1)
        found.append(corners[within | (fine & ((middle >= low) & (middle <= high)).all(axis=1))])
        corners = _quarters(corners[~within & ~fine])
    return np.concatenate(found)


def _quarters(corners):
    a, b, c = np.moveaxis(corners, 1, 0)
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    return np.concatenate([np.stack(part, axis=1) for part in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])


def _cuts(corners, n):
    """Into how many pieces the edges of triangles are cut for n vertices in all, and the triangles' corners.

    Triangles that should have fewer than three vertices are left out in part, as chance decides, so that the vertices
    are even by area.
    """
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    wanted = n * area / area.sum()
    chosen = np.random.default_rng(0).random(len(wanted)) < wanted / 3
    wanted = wanted[chosen]
    return np.maximum(np.rint((np.sqrt(1 + 8 * wanted) - 3) / 2), 1).astype(np.int64), corners[chosen]


def _n_vertices(cuts):
    return (cuts + 1) * (cuts + 2) // 2


def _grids(corners, cuts):
    """Vertices (v, 3) and triangles (f, 3) of triangles cut n times along lines parallel to their edges."""
    n_vertices, n_rows = _n_vertices(cuts), cuts + 1
    of_row = np.repeat(np.arange(len(cuts)), n_rows)
    row = np.arange(len(of_row)) - np.repeat(np.cumsum(n_rows) - n_rows, n_rows)
    n_in_row = cuts[of_row] + 1 - row
    start = np.cumsum(n_in_row) - n_in_row  # the first vertex of each row
    j = np.arange(n_vertices.sum()) - np.repeat(start, n_in_row)
    of_vertex, i = np.repeat(of_row, n_in_row), np.repeat(row, n_in_row)
    u, v = (i / cuts[of_vertex])[:, None], (j / cuts[of_vertex])[:, None]
    a, b, c = np.moveaxis(corners[of_vertex], 1, 0)
    vertices = a + u * (b - a) + v * (c - a)

    # Each vertex but a row's last is the corner of a face with the next in its row and the one in the next row
    here = np.flatnonzero(i + j < cuts[of_vertex])
    above = here + (cuts[of_vertex] + 1 - i)[here]
    lower = np.stack([here, above, here + 1], axis=1)
    both = (i + j < cuts[of_vertex] - 1)[here]
    upper = np.stack([above, above + 1, here + 1], axis=1)[both]
    return vertices, np.concatenate([lower, upper])
