"""What photons are aimed at: objects of glass and of smooth metal, as balls around them."""

import numpy as np

from ...bsdf import PEAK, Lobe
from ...core.sampling.streams import stream
from ...core.sampling.vectors import largest
from ...scene import Scene
from .projection_map import ProjectionMap

_LEAST_REFLECTANCE = 0.2  # of metal or a mirror; a varnish's caustics are dim, and most floors have one
_MOST_BALLS = 32


def caustic_makers(scene: Scene, largest_radius: float) -> ProjectionMap | None:
    """Balls around the objects that make caustics and have a radius below `largest_radius`, m; None without any.

    Those close together are joined.
    """
    makes = _focuses(scene)[scene.material_of_triangle] & scene.objects.scatters[scene.object_of_triangle]
    triangles = np.flatnonzero(makes)
    if len(triangles) == 0:
        return None
    corners = scene.corners(triangles)
    objects, of_triangle = np.unique(scene.object_of_triangle[triangles], return_inverse=True)
    centre, radius = _balls(corners, of_triangle)
    small = np.flatnonzero((radius > 0) & (radius < largest_radius))
    if len(small) == 0:
        return None
    group = np.full(len(objects), -1)
    group[small] = np.arange(len(small))
    if len(small) > _MOST_BALLS:
        from scipy.cluster.vq import kmeans2  # here, as Blender's start should not wait for SciPy

        _, group[small] = kmeans2(centre[small].astype(np.float64), _MOST_BALLS, minit="++", rng=stream(0))
    k = np.flatnonzero(group[of_triangle] >= 0)
    return ProjectionMap(*_balls(corners[k], group[of_triangle[k]]))


def _focuses(scene: Scene) -> np.ndarray:
    """Which materials are glass, or gloss whose peak F/(4πα²) is left to photons, (m,) bool."""
    closures = scene.materials.closures
    reflectance, alpha = largest(closures.weight.value * closures.f0.value), closures.roughness.value[:, 0] ** 2
    peaks = (reflectance >= _LEAST_REFLECTANCE) & (reflectance >= PEAK * 4 * np.pi * alpha**2)
    focuses = np.zeros(len(scene.materials), bool)
    focuses[closures.material[(closures.kind == Lobe.GLASS) | ((closures.kind == Lobe.GLOSSY) & peaks)]] = True
    return scene.materials.of_any_view(focuses)


def _balls(corners: np.ndarray, group: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Balls around the corners (t, 3, 3) of each group's triangles: centre (g, 3) and radius (g,), float32, m."""
    order = np.argsort(group, kind="stable")
    corners, group = corners[order], group[order]
    first = np.flatnonzero(np.append(True, group[1:] != group[:-1]))
    low = np.minimum.reduceat(corners.min(axis=1), first)
    centre = (low + np.maximum.reduceat(corners.max(axis=1), first)) / 2
    away = corners - np.repeat(centre, np.diff(np.append(first, len(group))), axis=0)[:, None]
    radius = np.sqrt(np.maximum.reduceat((away**2).sum(axis=2).max(axis=1), first))
    return centre.astype(np.float32), (radius * 1.0001).astype(np.float32)
