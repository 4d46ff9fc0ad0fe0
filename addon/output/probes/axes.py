"""Probes with their light, in Blender's axes or in those of glTF."""

from dataclasses import dataclass, replace

import numpy as np

from ...core.sampling.spherical_harmonics import turned_harmonics
from ...gather import ProbeLight
from ...gather.rays.probe_light import N_BANDS, SIDES
from ...receivers import ProbePlaces
from ...settings.probes import Axes

TO_GLTF = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]], np.float64)
"""From Blender's axes, z up, to those of glTF, y up: (x, y, z) is (x, z, −y) there, as the exporter has it."""


@dataclass(frozen=True)
class LitProbes:
    """Probes and what they hold.

    Attributes
    ----------
    places : ProbePlaces
    light : ProbeLight
    valid : (n,) bool
        Those that lie in no solid; the others have the light of their neighbours.
    """

    places: ProbePlaces
    light: ProbeLight
    valid: np.ndarray


def in_axes(probes: LitProbes, axes: Axes) -> LitProbes:
    """The same probes, given in Blender's axes, in others."""
    if axes == "blender":
        return probes
    places, light = probes.places, probes.light
    turn = np.eye(4)
    turn[:3, :3] = TO_GLTF
    grids = tuple(replace(grid, matrix=turn @ grid.matrix) for grid in places.grids)
    points = (places.points @ TO_GLTF.T).astype(np.float32)
    turned = turned_harmonics(TO_GLTF, N_BANDS)
    side = np.argmax(SIDES @ TO_GLTF @ SIDES.T, axis=1)  # Blender's, for each of the others
    sh = np.einsum("ij,njc->nic", turned, light.sh).astype(np.float32)
    n_sh = light.sh.shape[1]
    of_sh = np.sqrt((light.stderr[:, :n_sh] ** 2) @ (turned**2).T)
    stderr = np.concatenate([of_sh, light.stderr[:, n_sh:][:, side]], axis=1).astype(np.float32)
    return LitProbes(
        replace(places, grids=grids, points=points),
        ProbeLight(sh, light.irradiance[:, side], stderr, light.backs),
        probes.valid,
    )
