"""Photons scattered outside of the region where light is wanted, half of which come home to it.

Of the photons that wide ground scatters, few fly through a window, and each of them stands for much ground: a room
would have bright spots where they end. So half of what is scattered outside goes towards the region. With a density
p(ω) = ½ cos θ/π + ½ [ω in the cone to the region]/Ω the light that a direction carries changes by (cos θ/π)/p(ω), which
is small towards the region, and never more than 2 (one-sample balance heuristic: Veach 1997, 9.2.4).
"""

from dataclasses import replace

import numpy as np

from ..bsdf import Lobe
from ..core.sampling.streams import PathNumbers
from ..core.sampling.vectors import dot, rows
from ..core.sampling.warps import pdf_cosine_hemisphere, pdf_uniform_cone, sample_uniform_cone, to_world
from ..emitters import Sphere
from ..emitters.aiming.projection_map import cones_to_ball
from ..emitters.aiming.target_region import FAR
from .scattering import Scattered

HOMING = np.float32(0.5)
"""Share of what is scattered outside that is sent towards the region."""

MOST_GAIN = np.float32(2)
"""Those that stay away carry up to twice as much each time, and would be bright spots if they came in after all."""


def sent_home(
    scattered: Scattered,
    positions: np.ndarray,
    normals: np.ndarray,
    region: Sphere,
    random: np.random.Generator | PathNumbers,
    gained: np.ndarray | None = None,
) -> tuple[Scattered, np.ndarray]:
    """Half of the photons that wide lobes scatter outside of the region sent there instead.

    Parameters
    ----------
    scattered : Scattered
        n photons.
    positions, normals : (n, 3) float32
        Where they were scattered, and geometric normals there.
    gained : (n,) float32, optional
        The product of their ratios so far: photons that have stayed away for `MOST_GAIN` are left alone.

    Returns
    -------
    Scattered
        With other directions.
    ratio : (n,) float32
        What their weights are to be multiplied by; 1 for all others.
    """
    away, ratio = positions - region.centre, np.ones(len(positions), np.float32)
    if region.radius == 0:
        return scattered, ratio
    outside = dot(away, away) > np.float32(FAR * region.radius) ** 2
    if gained is not None:
        outside &= gained < MOST_GAIN
    k = np.flatnonzero(outside & (scattered.lobe < Lobe.GLOSSY))
    u = rows(random.random((len(positions), 3), dtype=np.float32), k)  # of all paths, so that no other's numbers move
    directions = scattered.directions.copy()
    up = rows(normals, k)
    up = np.where(dot(rows(directions, k), up) < 0, -1, 1)[:, None].astype(np.float32) * up
    versine, axis = cones_to_ball(region.centre, float(region.radius), rows(positions, k))
    cos_max = 1 - versine
    home = np.flatnonzero(u[:, 2] < HOMING)
    directions[k[home]] = to_world(sample_uniform_cone(rows(u, home), cos_max[home]), rows(axis, home))
    onward = rows(directions, k)
    cosine_pdf = pdf_cosine_hemisphere(np.maximum(dot(onward, up), 0))
    inside = dot(onward, axis) >= cos_max
    inside[home] = True  # whatever rounding says of narrow cones
    cone_pdf = np.where(inside, pdf_uniform_cone(cos_max), 0)
    ratio[k] = cosine_pdf / np.maximum((1 - HOMING) * cosine_pdf + HOMING * cone_pdf, np.float32(1e-30))
    return replace(scattered, directions=directions), ratio
