"""Media whose density differs from place to place: what rays pass of them, and where they are scattered."""

from dataclasses import replace

import numpy as np
import pytest
from photon_bake.addon.pipeline.bake import bake
from photon_bake.addon.scene import LightKind, VoxelGrid
from photon_bake.addon.settings.bake import settings_for
from photon_bake.addon.tracing.embree import EmbreeTracer, new_ray
from photon_bake.tests.core.media_scenes import RHO, flights, lengths, medium, tracing_of, with_media
from photon_bake.tests.core.scenes import box, fewer, grid_on_walls, lamp, plane

INFINITY = np.float32(np.inf)


def grid_over(low, high, values):
    """A lattice of values (x, y, z) over a box along the axes."""
    scale = np.array(values.shape) / (np.array(high) - low)
    return VoxelGrid(np.float32(values), np.float32(np.column_stack([np.diag(scale), -scale * low])))


def in_box(values, half=1.0, **of_medium):
    """A box of a medium with densities."""
    there = replace(medium(**of_medium), density=grid_over(np.full(3, -half), np.full(3, half), values))
    return with_media(plane(0.1, -9), [box(half, inwards=False)], [there])


def masses(scene, origins, directions, far=INFINITY, most=INFINITY):
    tracer, (mass, distance) = tracing_of(scene), np.empty((2, len(origins)), np.float32)
    lengths(tracer.arrays, new_ray(), 0, origins, directions, np.float32(far), np.float32(most), mass, distance)
    return mass, distance


def rays_through(n, seed=3):
    random = np.random.default_rng(seed)
    origins = random.normal(size=(n, 3))
    origins *= 3 / np.linalg.norm(origins, axis=1, keepdims=True)
    directions = random.uniform(-0.9, 0.9, (n, 3)) - origins
    return np.float32(origins), np.float32(directions / np.linalg.norm(directions, axis=1, keepdims=True))


def test_masses_through_cells():
    """Sums by cells equal those by 20,000 points of a ray, from all sides and along the axes."""
    values = np.random.default_rng(1).uniform(0, 4, (5, 7, 3))
    scene, (origins, directions) = in_box(values, absorption=1), rays_through(40)
    origins[:3], directions[:3] = -3 * np.eye(3) + 0.05, np.eye(3)
    mass, _ = masses(scene, origins, directions)
    t = (np.arange(20_000) + 0.5) / 20_000 * 6
    x = origins[:, None] + t[None, :, None] * directions[:, None]
    cell = np.floor((x + 1) / 2 * values.shape).astype(int)
    inside = ((cell >= 0) & (cell < values.shape)).all(axis=2)
    there = values[tuple(np.moveaxis(np.clip(cell, 0, np.array(values.shape) - 1), 2, 0))]
    assert mass == pytest.approx((there * inside).mean(axis=1) * 6, abs=4e-3)


def test_where_a_mass_is_reached():
    scene, (origins, directions) = (
        in_box(np.random.default_rng(2).uniform(0.5, 2, (8, 8, 8)), absorption=1),
        rays_through(40),
    )
    whole, _ = masses(scene, origins, directions)
    for share in (0.1, 0.5, 0.9):
        most = share * whole.min()
        mass, distance = masses(scene, origins, directions, most=most)
        assert mass == pytest.approx(np.full(40, most), rel=1e-5) and (distance < INFINITY).all()
        for i in range(0, 40, 8):
            before, _ = masses(scene, origins[[i]], directions[[i]], far=distance[i])
            assert before[0] == pytest.approx(most, rel=1e-3)


def test_a_grid_of_ones_is_no_grid():
    plain, gridded = with_media(plane(0.1, -9), [box(1, False)], [medium(1)]), in_box(np.ones((9, 5, 4)), absorption=1)
    (origins, directions) = rays_through(200)
    assert masses(gridded, origins, directions)[0] == pytest.approx(masses(plain, origins, directions)[0], abs=1e-5)


def test_a_lattice_smaller_than_its_mesh_is_empty_around_it():
    there = replace(medium(1), density=grid_over(np.full(3, -0.5), np.full(3, 0.5), np.full((2, 2, 2), 3.0)))
    scene = with_media(plane(0.1, -9), [box(1, inwards=False)], [there])
    mass, distance = masses(scene, np.float32([(-2, 0.1, 0.2)]), np.float32([(1, 0, 0)]))
    assert mass == pytest.approx([3]) and np.isinf(distance[0])


def test_flights_in_a_ramp():
    """Of a density that rises along the way, against the integral of T σs."""
    n_cells, n = 64, fewer(200_000)
    ramp = np.broadcast_to((np.arange(n_cells) + 0.5)[:, None, None] / n_cells * 3, (n_cells, 1, 1))
    tracer = tracing_of(in_box(ramp, absorption=0.2, scattering=0.8))
    origins = np.tile(np.float32([(-2, 0.1, 0.2)]), (n, 1)) + np.linspace(0, 1e-3, n, dtype=np.float32)[:, None]
    directions = np.tile(np.float32([(1, 0, 0)]), (n, 1))
    volume, distance, weight = np.empty(n, np.int64), np.empty(n, np.float32), np.empty((n, 3), np.float32)
    flights(tracer.arrays, new_ray(), origins, directions, INFINITY, volume, distance, weight)
    t = (np.arange(2000) + 0.5) / 1000  # in [0, 2]: the density is 1.5 t, its integral 0.75 t²
    left = np.exp(-0.75 * t * t)
    passes = weight[:, 0] * (volume < 0)
    assert passes.mean() == pytest.approx(np.exp(-3), abs=4 * passes.std() / np.sqrt(n) + 1e-4)
    edges = np.linspace(0, 2, 9)
    expected = np.histogram(t, edges, weights=0.8 * 1.5 * t * left * 1e-3)[0]
    there = volume == 0
    found = np.histogram(distance[there] - 1, edges, weights=weight[there, 0])[0] / n
    assert found == pytest.approx(expected, abs=5 * np.sqrt(expected.max() / n))


@pytest.mark.parametrize("gather", ["final", "density"])
def test_clouds_that_only_scatter_keep_the_power(gather):
    """All that a lamp emits ends in the walls, Φ = (1−ρ) ∫E dA, whatever the density does on its way."""
    values = np.random.default_rng(7).uniform(0, 1, (6, 6, 6)) ** 3 * 6
    there = replace(medium(0, 1.0), density=grid_over(np.full(3, -0.9), np.full(3, 0.9), values))
    light = lamp(LightKind.POINT, 24 / (4 * np.pi), position=(0.1, 0.2, 0.3))
    scene = with_media(box(), [box(0.9, inwards=False)], [there], lights=light)
    settings = settings_for("draft", n_photons=200_000, n_cache_elements=5_000, n_gather_rays=1024, max_bounces=400)
    settings = replace(settings, gather=gather, add_direct=True, interpolate=False)
    result = bake(scene, grid_on_walls(), settings, EmbreeTracer(scene))
    assert result.value.mean(axis=0) == pytest.approx(24 / (24 * (1 - RHO)), rel=0.03)
