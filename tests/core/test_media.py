"""Light in media: lengths inside of volumes, Beer and Lambert's law, phase functions, balances of power, scattering."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from photon_bake.addon.core.compiling import kernel
from photon_bake.addon.core.vec3 import row
from photon_bake.addon.emitters.lamps import lamp_arrays
from photon_bake.addon.gather.direct.ray_directions import gather_directions
from photon_bake.addon.gather.rays.lamp_angles import place_on_ray
from photon_bake.addon.pipeline.bake import bake
from photon_bake.addon.scene import LightKind, Media, World
from photon_bake.addon.settings.bake import settings_for
from photon_bake.addon.tracing.embree import EmbreeTracer, new_ray
from photon_bake.tests.core.media_scenes import RHO, flights, left_of, lengths, medium, tracing_of, with_media
from photon_bake.tests.core.scenes import (
    ball,
    box,
    fewer,
    grid_on_walls,
    lamp,
    plane,
    receivers_at,
    scene_of,
)
from scipy.integrate import trapezoid

POWER = 24.0
INFINITY = np.float32(np.inf)


def test_lengths_inside_of_a_box():
    """From outside, from within, past it, and as far as a wall in it; and where a length is used up."""
    scene = with_media(plane(0.1, -9), [box(1, inwards=False)], [medium(1)])
    tracer = tracing_of(scene)
    origins = np.float32([(-3, 0.1, 0.2), (0.5, 0.1, 0.2), (-3, 2, 0), (3, 0.1, 0.2)])
    directions = np.float32([(1, 0, 0)] * 4)
    length, distance = np.empty((2, 4), np.float32)
    lengths(tracer.arrays, new_ray(), 0, origins, directions, INFINITY, INFINITY, length, distance)
    assert length == pytest.approx([2, 0.5, 0, 0]) and np.isinf(distance).all()
    lengths(tracer.arrays, new_ray(), 0, origins, directions, np.float32(2.5), np.float32(0.4), length, distance)
    assert length == pytest.approx([0.4, 0.4, 0, 0]) and distance[:2] == pytest.approx([2.4, 0.4])
    lengths(tracer.arrays, new_ray(), 0, origins, directions, np.float32(0.25), INFINITY, length, distance)
    assert length == pytest.approx([0, 0.25, 0, 0])


def test_lengths_from_a_face():
    """Of rays that start on a face of a box, into it and out of it."""
    tracer = tracing_of(with_media(plane(0.1, -9), [box(1, inwards=False)], [medium(1)]))
    origins = np.float32([(0.1, 0.2, 1), (0.1, 0.2, 1), (-1, 0.3, 0.1), (-1, 0.3, 0.1)])
    directions = np.float32([(0, 0, -1), (0, 0, 1), (1, 0, 0), (-1, 0, 0)])
    length, distance = np.empty((2, 4), np.float32)
    lengths(tracer.arrays, new_ray(), 0, origins, directions, INFINITY, INFINITY, length, distance)
    assert length == pytest.approx([2, 0, 2, 0])


def test_lengths_inside_of_a_ball():
    """Chords of a ball, of rays through its outline and close to corners of its mesh too."""
    mesh, random = ball(1.0, n=64), np.random.default_rng(1)
    tracer = tracing_of(with_media(plane(0.1, -9), [mesh], [medium(1)]))
    beside = mesh[0] + random.normal(size=mesh[0].shape) * 1e-5
    targets = np.concatenate([beside, random.normal(size=(5000, 3)) / 3]).astype(np.float32)
    origins = np.tile(np.float32([[0.3, -4, 0.2]]), (len(targets), 1))
    directions = targets - origins
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    length, distance = np.empty((2, len(targets)), np.float32)
    lengths(tracer.arrays, new_ray(), 0, origins, directions, INFINITY, INFINITY, length, distance)
    along = -(origins * directions).sum(axis=1)
    chord = 2 * np.sqrt(np.maximum(1 - (origins**2).sum(axis=1) + along**2, 0))
    assert np.abs(length - chord).max() < 0.1 and np.abs(length - chord).mean() < 0.004


def test_beer_and_lambert():
    """Two boxes that overlap, one inside of the other, and a third apart."""
    boxes = [box(1, inwards=False), box(0.5, inwards=False), (box(0.25, inwards=False)[0] + 3, box(1, False)[1])]
    media = [medium([1, 0.5, 0], 0.1), medium(0.7), medium(9)]
    tracer = tracing_of(with_media(plane(0.1, -9), boxes, media))
    origins, directions, left = np.float32([(-2, 0, 0)]), np.float32([(1, 0, 0)]), np.empty((1, 3), np.float32)
    left_of(tracer.arrays, new_ray(), origins, directions, np.full(1, INFINITY), left)
    assert left[0] == pytest.approx(np.exp(-(np.array([1, 0.5, 0]) + 0.1) * 2 - 0.7), rel=1e-5)


def test_objects_of_one_medium_are_volumes_of_their_own():
    """Two boxes of one material, among triangles of others; a third of another medium of the first one's object."""
    boxes = [(box(0.5, False)[0] + np.float32((3 * x, 0, 0)), box(1, False)[1]) for x in range(3)]
    scene = with_media(plane(0.1, -9), boxes, [medium(1), medium(1), medium(0.5)])
    material, object_ = (np.int32(of)[scene.material_of_triangle] for of in ([0, 1, 1, 2], [0, 1, 2, 1]))
    media = Media((None, medium(1), medium(0.5)))
    scene = replace(scene, material_of_triangle=material, object_of_triangle=object_, media=media)
    tracer = tracing_of(scene)
    assert len(tracer.arrays.media.tree) == 3
    origins, directions = np.float32([(-2, 0, 0), (3, 0, 0)]), np.float32([(1, 0, 0)] * 2)
    left = tracer.media_left(origins, directions, np.full(2, INFINITY))
    assert left[:, 0] == pytest.approx(np.exp([-2.5, -1]), rel=1e-5)


@pytest.mark.parametrize("scattering", [(1.5, 1.5, 1.5), (0.5, 1.5, 3.0), (2.0, 0.0, 1.0)])
def test_flights_sum_to_what_passes_and_what_is_scattered(scattering):
    """In a slab of thickness 2 with an absorber in it: T passes, and σs/σt of the rest is scattered without that."""
    media = [medium(0.25, scattering), medium([0.3, 0, 0.1])]
    tracer, n = tracing_of(with_media(plane(0.1, -9), [box(1, False), box(0.5, False)], media)), fewer(200_000)
    random = np.random.default_rng(4)
    origins = np.float32([(-2, 0, 0)]) + random.uniform(-0.4, 0.4, (n, 3)).astype(np.float32) * np.float32((0, 1, 1))
    directions = np.tile(np.float32([(1, 0, 0)]), (n, 1))
    volume, distance, weight = np.empty(n, np.int64), np.empty(n, np.float32), np.empty((n, 3), np.float32)
    flights(tracer.arrays, new_ray(), origins, directions, INFINITY, volume, distance, weight)
    extinction, absorbed = 0.25 + np.array(scattering), np.exp(-np.array([0.3, 0, 0.1]))
    passes = weight * (volume < 0)[:, None]
    error = 4 * passes.std(axis=0) / np.sqrt(n) + 1e-6
    assert np.abs(passes.mean(axis=0) - np.exp(-2 * extinction) * absorbed).max() < error.max()
    t = (np.arange(20_000) + 0.5) / 10_000
    behind = np.exp(-np.outer(np.clip(t - 0.5, 0, 1), [0.3, 0, 0.1]))
    expected = (np.array(scattering) * np.exp(-np.outer(t, extinction)) * behind).mean(axis=0) * 2
    there = weight * (volume == 0)[:, None]
    assert np.abs(there.mean(axis=0) - expected).max() < (5 * there.std(axis=0) / np.sqrt(n)).max()
    assert ((distance > 1) & (distance < 3))[volume == 0].all() and not (volume == 1).any()


@pytest.mark.parametrize("g, scattering", [(0.0, 0.8), (0.5, (0.4, 0.8, 1.6))])
@pytest.mark.parametrize("gather", ["final", "density"])
def test_media_that_only_scatter_keep_the_power(g, scattering, gather):
    """All that a lamp emits ends in the walls, Φ = (1−ρ) ∫E dA, however often it is scattered on its way."""
    light = lamp(LightKind.POINT, POWER / (4 * np.pi), position=(0.1, 0.2, 0.3))
    scene = with_media(box(), [box(0.9, inwards=False)], [medium(0, scattering, g)], lights=light)
    settings = settings_for("draft", n_photons=200_000, n_cache_elements=5_000, n_gather_rays=1024, max_bounces=400)
    settings = replace(settings, gather=gather, add_direct=True)
    result = bake(scene, grid_on_walls(), settings, EmbreeTracer(scene))
    assert result.value.mean(axis=0) == pytest.approx(POWER / (24 * (1 - RHO)), rel=0.03)


def test_furnace_of_glowing_walls_around_a_medium():
    """A medium that only scatters changes nothing where light is the same everywhere: E = π L / (1−ρ)."""
    scene = with_media(box(), [box(0.8, inwards=False)], [medium(0, 1.0, 0.3)], emission=[1.0, 0.0])
    settings = settings_for("draft", n_photons=200_000, n_cache_elements=5_000, add_direct=True, max_bounces=400)
    result = bake(scene, grid_on_walls(), settings, EmbreeTracer(scene))
    assert result.value.mean() == pytest.approx(np.pi / (1 - RHO), rel=0.02)
    assert result.value.std() / result.value.mean() < 0.08


def test_a_constant_sky_through_a_medium():
    """The same under a sky of radiance 1 over a plane in a ball of fog: what leaves the ball, enters it elsewhere."""
    scene = with_media(plane(0.1, -30), [ball(2.0)], [medium(0, 0.7)], world=1.0)
    at = receivers_at([(0.1, 0.2, 0.3), (1, 0, 0)], (0, 0, 1))
    settings = settings_for("high", n_photons=100_000, add_direct=True)
    assert bake(scene, at, settings, EmbreeTracer(scene)).value == pytest.approx(np.pi, rel=0.03)


@pytest.mark.parametrize("gather", ["final", "density"])
def test_a_constant_sky_through_an_absorber(gather):
    """Light that a floor reflects: E = ρ ∫ E(x)/π (ω·n) dω, with that of the floor, ∫ exp(−σ l) (ω·n) dω, by rays."""
    scene = with_media(plane(3, -1.5), [box(1.0, inwards=False)], [medium(1.0)], world=1.0)
    tracer, at, n, m = tracing_of(scene), np.float32((0.2, 0.1, -1.2)), 256, 1024
    ways = cosine_directions(n, -1)
    points = at + 0.299 / -ways[:, 2:] * ways
    origins, directions = np.repeat(points, m, axis=0).astype(np.float32), np.tile(cosine_directions(m, 1), (n, 1))
    left = tracer.media_left(origins, directions, np.full(n * m, INFINITY))
    there = np.abs(points[:, :2]).max(axis=1) < 3
    expected = RHO * np.pi * (left[:, 0].reshape(n, m).mean(axis=1) * there).mean()
    settings = replace(settings_for("high", n_photons=400_000), gather=gather)
    found = bake(scene, receivers_at(np.tile(at, (4, 1)), (0, 0, -1)), settings, EmbreeTracer(scene)).value.mean()
    assert found == pytest.approx(expected, rel=0.05)


def cosine_directions(n, side):
    """Cosine-weighted directions to a side of z, (n, 3) float32."""
    normals = np.tile(np.float32([(0, 0, side)]), (n, 1))
    return gather_directions(normals, n, np.random.default_rng(1))


@kernel
def places(media, lamps, origin, direction, end, numbers, out):
    for i in range(len(numbers)):
        at = row(origin, 0), row(direction, 0), np.float32(0), end, numbers[i]
        out[i, 0], out[i, 1] = place_on_ray(media, lamps, 0, *at)


def places_on_ray(scene, origin, direction, end, numbers):
    """Distances and their densities, (n, 2)."""
    tracer, out = tracing_of(scene), np.empty((len(numbers), 2), np.float32)
    ray = np.float32([origin]), np.float32([direction])
    places(tracer.arrays.media, lamp_arrays(scene.lights), *ray, np.float32(end), np.float32(numbers), out)
    return out


def test_a_ray_that_starts_at_a_lamp_finds_a_finite_place():
    scene = with_media(plane(0.1, -9), [box(1, False)], [medium(0, 1)], lights=lamp(LightKind.POINT, 1.0))
    ((distance, density),) = places_on_ray(scene, scene.lights.position[0], (0, 0, 1), 2, [0.5])
    assert 0 <= distance <= 2 and np.isfinite(density)


@pytest.mark.parametrize("g", [0.0, 0.8, -0.5])
def test_places_on_a_ray_are_drawn_by_their_density(g):
    """As many are in each part of a ray as their density says, which nearly follows p/d²."""
    light = lamp(LightKind.POINT, 1.0, position=(0.3, 0.2, 0.5))
    scene = with_media(plane(0.1, -9), [box(1, False)], [medium(0, 1, g)], lights=light)
    ray = (-0.9, 0, 0.1), np.array((1, 0.1, 0.3)) / np.linalg.norm((1, 0.1, 0.3))
    numbers = (np.arange(20_000) + np.random.default_rng(1).uniform(size=20_000)) / 20_000
    distance, density = places_on_ray(scene, *ray, 1.8, numbers).T.astype(np.float64)
    order = np.argsort(distance)
    assert (np.diff(distance) >= 0).all()  # the numbers rise
    edges = np.linspace(0, 1.8, 30)
    expected = np.array([trapezoid(density[order][i], distance[order][i]) for i in _within(distance[order], edges)])
    assert np.histogram(distance, edges)[0] / 20_000 == pytest.approx(expected, abs=2e-3)
    x = np.array(ray[0]) + distance[:, None] * ray[1]
    to_lamp = scene.lights.position[0] - x
    d = np.linalg.norm(to_lamp, axis=1)
    p = (1 - g * g) / (1 + g * g - 2 * g * (to_lamp @ ray[1]) / d) ** 1.5
    ratio = p / d**2 / density
    assert ratio.std() / ratio.mean() < 0.1


def _within(values, edges):
    """Where sorted values are between each two edges."""
    return [np.flatnonzero((values >= a) & (values <= b)) for a, b in pairwise(edges)]


def test_single_scattering_of_a_lamp():
    """A thin medium above a black floor: E = ∫ σs I T(d₁) T(d₂) cos θ / (4π d₁² d₂²) dV, by quadrature."""
    light, sigma, half = lamp(LightKind.POINT, 5.0, position=(0.3, 0.1, 1.5)), 0.02, 1.0
    scene = with_media(plane(0.1, -9), [box(half, inwards=False)], [medium(0.01, sigma)], lights=light)
    at = np.float32((0.1, -0.2, -1.5))
    settings = settings_for("high", n_photons=1000, n_gather_rays=8192)
    value = bake(scene, receivers_at(np.tile(at, (8, 1)), (0, 0, 1)), settings, EmbreeTracer(scene)).value.mean(axis=0)
    n = 100
    axis = half * ((np.arange(n) + 0.5) / n * 2 - 1)
    x = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    to_lamp, to_point = np.float64((0.3, 0.1, 1.5)) - x, at - x
    d1, d2 = np.linalg.norm(to_lamp, axis=1), np.linalg.norm(to_point, axis=1)
    inside = 1 - np.maximum((1.5 - half) / np.abs(to_lamp[:, 2]), 0), 1 - np.maximum(0.5 / np.abs(to_point[:, 2]), 0)
    fades = np.exp(-(0.01 + sigma) * (d1 * inside[0] + d2 * inside[1]))
    integrand = sigma * 5.0 * fades * (-to_point[:, 2] / d2).clip(0) / (4 * np.pi * d1**2 * d2**2)
    assert value == pytest.approx(integrand.mean() * (2 * half) ** 3, rel=0.03)


def test_lamp_through_an_absorbing_slab():
    """Direct light by Beer and Lambert's law, in each channel."""
    light, sigma = lamp(LightKind.POINT, 5.0, position=(0, 0, 2)), np.array([0.2, 1.0, 3.0])
    scene = with_media(plane(0.1, -9), [box(0.5, inwards=False)], [medium(sigma)], lights=light)
    at = receivers_at([(0, 0, -1)], (0, 0, 1))
    settings = settings_for("draft", n_photons=1000, add_direct=True)
    value = bake(scene, at, settings, EmbreeTracer(scene)).value
    assert value[0] == pytest.approx(5 / 9 * np.exp(-sigma), rel=1e-4)


def test_a_medium_everywhere():
    light = lamp(LightKind.POINT, POWER / (4 * np.pi), position=(0.1, 0.2, 0.3))
    scene = scene_of(*box(), albedo=RHO, lights=light)
    scene = replace(scene, media=Media(of_world=medium(0, 0.8)), world=World.constant(0))
    settings = settings_for("draft", n_photons=200_000, n_cache_elements=5_000, add_direct=True, max_bounces=400)
    result = bake(scene, grid_on_walls(), settings, EmbreeTracer(scene))
    assert result.value.mean() == pytest.approx(POWER / (24 * (1 - RHO)), rel=0.02)
