"""Worlds as many directions see and sample them: loops over the parts in `emitters.world`."""

import numpy as np
from photon_bake.addon.core.compiling import kernel, kernel_array
from photon_bake.addon.core.vec3 import put, row
from photon_bake.addon.emitters.world import sample_world, world_arrays, world_towards
from photon_bake.addon.scene import World


@kernel
def _look_along(world, directions, radiance, density):
    for k in range(len(directions)):
        seen, density[k] = world_towards(world, row(directions, k))
        put(radiance, k, seen)


@kernel
def _sample(world, u, directions):
    for k in range(len(u)):
        direction, _, _ = sample_world(world, u[k, 0], u[k, 1])
        put(directions, k, direction)


def radiance_along(world: World, directions: np.ndarray) -> np.ndarray:
    """Radiance from directions (n, 3), (n, 3) float32."""
    return _along(world, directions)[0]


def density_along(world: World, directions: np.ndarray) -> np.ndarray:
    """Density of `sample_world` in directions (n, 3), (n,) float32, 1/sr."""
    return _along(world, directions)[1]


def _along(world: World, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    radiance, density = np.empty((len(directions), 3), np.float32), np.empty(len(directions), np.float32)
    _look_along(world_arrays(world), kernel_array(directions, np.float32), radiance, density)
    return radiance, density


def sampled_directions(world: World, u: np.ndarray) -> np.ndarray:
    """`sample_world` of points `u` (n, 2) of the unit square, (n, 3) float32."""
    directions = np.empty((len(u), 3), np.float32)
    _sample(world_arrays(world), kernel_array(u, np.float32), directions)
    return directions
