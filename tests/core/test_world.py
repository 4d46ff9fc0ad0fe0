"""The world as an image: where its pixels are, and directions sampled by them."""

import numpy as np
import pytest
from photon_bake.addon.core.sampling.streams import stream
from photon_bake.addon.scene import World
from photon_bake.tests.core.scenes import chi_square
from photon_bake.tests.core.world_loops import density_along, radiance_along, sampled_directions

WHITE = np.ones(3, np.float32)
N = 1 << 18


def noise(height=8, width=16, seed=1):
    """A world of random pixels, some of them black."""
    image = np.random.default_rng(seed).uniform(0, 1, (height, width, 3)).astype(np.float32) ** 4
    image[height // 2, :3] = 0
    return World(WHITE, image)


def cell_edges(world):
    height, width = world.image.shape[:2]
    return -np.cos(np.pi * np.arange(height + 1) / height), np.linspace(-np.pi, np.pi, width + 1)


@pytest.mark.parametrize(
    "direction, row, column",
    [
        ((0, 0, -1), 0, None),
        ((0, 0, 1), 7, None),
        ((-1, 0.1, 0.1), 4, 0),
        ((-1, -0.1, 0.1), 4, 15),
        ((1, -0.1, -0.1), 3, 8),
    ],
)
def test_where_pixels_are(direction, row, column):
    world = noise()
    direction = np.array([direction], np.float32) / np.linalg.norm(direction)
    assert (world.image[row] if column is None else world.image[row, column]) in radiance_along(world, direction)


def test_samples_follow_the_density():
    """χ² over cells four times as fine as the pixels."""
    world = noise()
    directions = sampled_directions(world, stream(5).random((N, 2), dtype=np.float32))
    assert np.allclose(np.linalg.norm(directions, axis=1), 1, atol=1e-5)
    z, azimuth = (np.interp(np.arange(0, len(e) - 0.5, 0.5), np.arange(len(e)), e) for e in cell_edges(world))
    counts, _, _ = np.histogram2d(directions[:, 2], np.arctan2(directions[:, 1], directions[:, 0]), [z, azimuth])
    middle_z, middle = (z[1:] + z[:-1]) / 2, (azimuth[1:] + azimuth[:-1]) / 2
    r = np.sqrt(1 - middle_z**2)[:, None]
    middles = np.stack([r * np.cos(middle), r * np.sin(middle), np.broadcast_to(middle_z[:, None], (16, 32))], axis=-1)
    density = density_along(world, middles.reshape(-1, 3).astype(np.float32)).reshape(16, 32)
    mass = density * np.diff(z)[:, None] * np.diff(azimuth)
    assert mass.sum() == pytest.approx(1, rel=1e-5)
    assert chi_square(counts, mass * N) > 1e-3


def test_brightness_over_density_is_constant():
    """With white pixels the density is all of the variation: L/p is the integral of L."""
    world = noise()
    grey = World(np.array([0.5, 0.5, 0.5], np.float32), world.image.mean(axis=2, keepdims=True).repeat(3, axis=2))
    directions = sampled_directions(grey, stream(6).random((N, 2), dtype=np.float32))
    ratio = radiance_along(grey, directions)[:, 0] / density_along(grey, directions)
    assert np.allclose(ratio, grey.integral[0], rtol=1e-4)


def test_integral_of_a_world():
    assert World.constant(0.5).integral == pytest.approx([2 * np.pi] * 3)
    assert World(np.array([1, 2, 3], np.float32), np.ones((4, 8, 3), np.float32)).integral == pytest.approx(
        4 * np.pi * np.array([1, 2, 3])
    )
    assert World(WHITE, np.zeros((4, 8, 3), np.float32)).black and not noise().black


def test_a_small_sun_is_sampled():
    image = np.full((512, 1024, 3), 1e-3, np.float32)
    image[300, 100] = 1e5
    world = World(WHITE, image)
    directions = sampled_directions(world, stream(7).random((N, 2), dtype=np.float32))
    assert (radiance_along(world, directions)[:, 0] > 1).mean() > 0.9
