"""Receivers on surfaces whose materials bend normals: light as their own normal maps and bumps see it."""

from dataclasses import replace

import numpy as np

from ..bsdf import lambertian_normals
from ..core.sampling.vectors import rows
from ..scene import Scene
from ..tracing import EmbreeTracer
from .receivers import Receivers

_NEAR = 0.5
"""How far below a receiver its surface is, at most, of the radius that it stands for."""


def on_normal_maps(receivers: Receivers, scene: Scene, tracer: EmbreeTracer) -> Receivers:
    """The receivers with the normals that the material below each gives its Lambertian closures.

    A ray down from each finds its surface; where it finds none the normal is kept.
    """
    if not scene.materials.perturbed.any() or len(receivers) == 0:
        return receivers
    down = -receivers.normal
    hits = tracer.closest_hit(receivers.position, down)
    perturbed = scene.materials.perturbed[scene.material_of_triangle[np.maximum(hits.triangle, 0)]]
    k = np.flatnonzero((hits.triangle >= 0) & perturbed & (hits.distance <= _NEAR * receivers.footprint))
    met, normal = hits.where(k), receivers.normal.copy()
    side = met.points(scene, rows(down, k))[1]
    normal[k] = lambertian_normals(scene, met.triangle, met.u, met.v, side)
    return replace(receivers, normal=normal, base_normal=receivers.normal)
