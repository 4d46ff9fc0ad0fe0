"""What media do between a camera and surfaces: closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from photon_bake.addon.core.compiling import kernel
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.core.vec3 import put, row
from photon_bake.addon.emitters import Sphere, light_sources
from photon_bake.addon.gather import caustic_points, volume_caustics
from photon_bake.addon.scene import Channel, LightKind, Materials
from photon_bake.addon.tracing.embree import new_ray
from photon_bake.addon.tracing.media.forced import forced_scattering
from photon_bake.tests.core.media_scenes import RHO, medium, tracing_of, with_media
from photon_bake.tests.core.scenes import box, fewer, lamp, plane
from photon_bake.tests.core.test_camera_pass import pass_of
from photon_bake.tests.core.test_camera_points import camera_at, camera_with, points_of
from scipy.integrate import trapezoid

POWER = 24.0


@kernel
def scatterings(tracing, room, origin, direction, far, places, choices, volume, distance, weight):
    for i in range(len(places)):
        at = forced_scattering(tracing, room, row(origin, 0), row(direction, 0), far, places[i], choices[i])
        volume[i], distance[i] = at.volume, at.distance
        put(weight, i, at.weight)


@pytest.mark.parametrize("scattering", [(1.5, 1.5, 1.5), (0.5, 1.5, 3.0), (2.0, 0.0, 1.0)])
def test_forced_scattering_is_all_that_is_scattered(scattering):
    """In a slab of thickness 2, a thinner one within and an absorber before it: ∫ T σs by quadrature, of each."""
    media = [medium(0.25, scattering), medium(0.1, 0.7), medium([0.3, 0, 0.1])]
    filled = [box(1, False), box(0.5, False), (box(0.25, False)[0] + np.float32([-2, 0, 0]), box(1, False)[1])]
    tracer, n = tracing_of(with_media(plane(0.1, -9), filled, media)), fewer(20_000)
    ray = np.float32([(-4, 0.1, 0.2)]), np.float32([(1, 0, 0)])
    places, choices = (np.arange(n) + np.float32(0.5)) / n, np.random.default_rng(1).random(n)
    volume, distance, weight = np.empty(n, np.int64), np.empty(n, np.float32), np.empty((n, 3), np.float32)
    numbers = places.astype(np.float32), choices.astype(np.float32)
    scatterings(tracer.arrays, new_ray(), *ray, np.float32(np.inf), *numbers, volume, distance, weight)
    t = (np.arange(20_000) + 0.5) / 10_000
    within, outer, inner = np.clip(t - 0.5, 0, 1), 0.25 + np.array(scattering), 0.8
    left = np.exp(-np.outer(t, outer) - within[:, None] * inner - 0.5 * np.array([0.3, 0, 0.1]))
    expected = (left * scattering).mean(axis=0) * 2, (left * 0.7)[np.abs(t - 1) < 0.5].sum(axis=0) / 10_000
    for k, light in enumerate(expected):
        there = weight * (volume == k)[:, None]
        assert np.abs(there.mean(axis=0) - light).max() < 5 * (there.std(axis=0) / np.sqrt(n)).max() + 1e-3
    assert ((distance > 3) & (distance < 5))[volume == 0].all() and not (volume == 2).any()
    assert (volume >= 0).mean() > 0.999


def test_a_medium_without_color_has_one_weight():
    """The albedo times 1 − T, wherever on the ray."""
    tracer, n = tracing_of(with_media(plane(0.1, -9), [box(1, False)], [medium(0.3, 0.6)])), 64
    ray = np.float32([(-4, 0.1, 0.2)]), np.float32([(1, 0, 0)])
    numbers = ((np.arange(n) + np.float32(0.5)) / n).astype(np.float32), np.full(n, 0.5, np.float32)
    volume, distance, weight = np.empty(n, np.int64), np.empty(n, np.float32), np.empty((n, 3), np.float32)
    scatterings(tracer.arrays, new_ray(), *ray, np.float32(np.inf), *numbers, volume, distance, weight)
    assert weight == pytest.approx(2 / 3 * (1 - np.exp(-1.8)), rel=1e-4)
    assert (np.diff(distance) > 0).all()


def test_transmittance_of_a_slab():
    """e^(−σt d) along each ray, from a camera outside of it; what surfaces reflect has it once."""
    absorption = np.float32([0.2, 0.5, 1.0])
    light = lamp(LightKind.POINT, 100.0, position=(0, 0, 3))
    slab = box(1, inwards=False)[0] * np.float32([40, 40, 0.5]), box(1)[1][:, ::-1]
    fog = with_media(plane(20, -2), [slab], [medium(absorption)], lights=light)
    camera = camera_at((0, 0, 2), 24, 16, angle=0.8, axes=np.float32([(1, 0, 0), (0, 1, 0), (0, 0, -1)]))
    points = points_of(fog, camera, 32)[1]
    cos = -camera.rays(camera.middles).directions[:, 2].reshape(16, 24, 1)
    assert points.transmittance == pytest.approx(np.exp(-absorption / cos), rel=0.003)
    passes = pass_of(fog, camera, "final")
    assert passes.albedo == pytest.approx(RHO * passes.transmittance, rel=1e-4)
    assert not passes.volume.any()


def test_a_scene_without_media_has_no_such_layers():
    passes = pass_of(with_media(box(), [], []), camera_at((0, 0, 0), 12, 8), "final")
    assert passes.volume is None and passes.transmittance is None
    assert passes.indirect == pytest.approx(passes.indirect_diffuse * passes.albedo + passes.caustics + passes.glossy)


def test_furnace_of_glowing_walls_around_a_medium():
    """A medium that only scatters: all radiance is 1/(1−ρ), of which direct light in the fog is found by quadrature."""
    sigma = 0.4
    scene = with_media(box(), [box(0.8, inwards=False)], [medium(0, sigma, 0.3)], emission=[1.0, 0.0])
    camera = camera_with("equirectangular", (0.1, 0.2, -0.1), (24, 12))
    passes = pass_of(scene, camera, "final", n_photons=300_000, n_cache_elements=5_000, n_media_rays=256)
    random, n = np.random.default_rng(2), fewer(4000)
    ways = random.normal(size=(2, n, 3))
    ways /= np.linalg.norm(ways, axis=2, keepdims=True)

    def length(x, way):
        return ((0.8 - np.sign(way) * x) / np.abs(way)).min(axis=-1)

    far = length(camera.position, ways[0])
    t = random.random((n, 1)) * far[:, None]
    cos, phi = _henyey_greenstein(0.3, random.random(n)), random.random(n) * 2 * np.pi
    on = _turned(ways[0], cos, phi)
    direct = sigma * far * np.exp(-sigma * (t[:, 0] + length(camera.position + t * ways[0], on)))
    weight = np.sin((np.arange(12) + 0.5) / 12 * np.pi)[:, None, None] * np.ones((12, 24, 3))
    of_all = 1 / (1 - RHO)
    scattered = of_all * (1 - np.exp(-sigma * far).mean()) - direct.mean()
    assert np.average(passes.transmittance, weights=weight) == pytest.approx(np.exp(-sigma * far).mean(), rel=0.01)
    assert np.average(passes.volume, weights=weight) == pytest.approx(scattered, rel=0.02)


def _henyey_greenstein(g, u):
    return (1 + g * g - ((1 - g * g) / (1 - g + 2 * g * u)) ** 2) / (2 * g)


def _turned(ways, cos, phi):
    """Directions at angles to others."""
    aside = np.cross(ways, np.where(np.abs(ways[:, :1]) > 0.9, [[0, 1, 0]], [[1, 0, 0]]))
    aside /= np.linalg.norm(aside, axis=1, keepdims=True)
    sin = np.sqrt(1 - cos**2)[:, None]
    around = np.cos(phi)[:, None] * aside + np.sin(phi)[:, None] * np.cross(ways, aside)
    return cos[:, None] * ways + sin * around


@pytest.mark.parametrize("g", [0.0, 0.6])
def test_a_lamp_in_a_mirror_lights_fog(g):
    """As the lamp behind the mirror would, at first: ∫ T σs p I e^(−σt r)/r² dt along each ray, by quadrature."""
    sigma, absorbed, place = np.float32([0.1, 0.2, 0.4]), 0.05, np.array([0.3, 0.5, 1.0])
    light = lamp(LightKind.POINT, POWER / (4 * np.pi), position=place)
    scene = mirror_in_fog(medium(absorbed, sigma, g), light)
    camera = camera_at((-6, 0, 1.4), 24, 16, angle=0.6)
    points = points_of(scene, camera, 2)[1]
    tracer = tracing_of(scene)
    sources = light_sources(scene, Sphere(np.zeros(3), 4.0))
    found = caustic_points(scene, tracer, sources, fewer(400_000), 8, Workers())
    once = np.unique(found.path, return_index=True)[1]
    assert len(once) < len(found)
    seen, said = volume_caustics(points, found.where(once), tracer, Workers())
    rays = camera.rays(camera.middles)
    t = np.linspace(3, 12, 4000)[:, None]
    total = np.zeros((len(rays.directions), 3))
    for i, way in enumerate(rays.directions.astype(np.float64)):
        x = camera.position + t * way
        from_lamp = x - place * [1, 1, -1]
        r = np.linalg.norm(from_lamp, axis=1, keepdims=True)
        cos = -(from_lamp / r) @ way
        phase = (1 - g * g) / (4 * np.pi * (1 + g * g - 2 * g * cos) ** 1.5)
        within = (np.abs(x - [0, 0, 1.5]) < [2, 2, 1.5]).all(axis=1)
        left = np.exp(-(sigma + absorbed) * (t - t[np.argmax(within)] + r))
        bright = left * sigma * phase[:, None] * POWER / (4 * np.pi) / r**2
        total[i] = trapezoid(np.where(within[:, None], bright, 0), t, axis=0)
    expected = total.reshape(16, 24, 3)
    assert seen.mean(axis=(0, 1)) == pytest.approx(expected.mean(axis=(0, 1)), rel=0.02)
    off = (seen - expected).mean(axis=2)
    assert np.sqrt(np.mean(off**2)) < 0.1 * expected.mean() and said.mean() < 0.1 * expected.mean()


def mirror_in_fog(fog, light):
    """A block of fog, 4 m wide and 3 m high, over a mirror."""
    block = box(1, inwards=False)
    block = block[0] * np.float32([2, 2, 1.5]) + np.float32([0, 0, 1.5001]), block[1]
    scene = with_media(plane(60, 0), [block], [fog], lights=light)
    shine, dark = (Channel.constant(np.float32([[value] * 3, [0] * 3])) for value in (1, 0))
    rough, coverage = Channel.constant(np.zeros(2, np.float32)), Channel.constant(np.float32([1, 0]))
    materials = Materials.of(2, diffuse=dark, f0=shine, f90=shine, roughness=rough, coverage=coverage)
    return replace(scene, materials=materials)
