"""Caustics against closed forms, a glass ball and a mirror ring in the sun; and caustics of indirect light."""

import numpy as np
import pytest
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.emitters import Sphere, light_sources
from photon_bake.addon.gather import splat_irradiance
from photon_bake.addon.photons import PathKind, trace_photons
from photon_bake.addon.pipeline.bake import bake
from photon_bake.addon.receivers import Camera, seen_surface
from photon_bake.addon.scene import Channel, LightKind, Materials
from photon_bake.addon.settings.bake import settings_for
from photon_bake.addon.tracing import TransparencyTracer
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.core.scenes import ball, box, lamp, merge, of_objects, plane, receivers_at, scene_of

RADIUS, SUN, IOR = 0.3, 5.0, 1.5
REGION = Sphere(np.zeros(3, np.float32), 1.0)
DOWN = np.array([[1, 0, 0], [0, 1, 0], [0, 0, -1]], np.float32)


def with_lobes(mesh, n_floor, lights, **lobes):
    """A matte floor, and an object that has `lobes` only and is shaded smoothly; one object each."""
    is_maker = np.arange(len(mesh[1])) >= n_floor
    scene = of_objects(scene_of(*mesh, albedo=[0.5, 0.0], lights=lights, material=is_maker), is_maker)
    channels = {name: Channel.constant(np.array([[0] * 3, [value] * 3], np.float32)) for name, value in lobes.items()}
    matte = Channel.constant(np.array([[0.5] * 3, [0] * 3], np.float32))
    rough = Channel.constant(np.array([[1] * 3, [0] * 3], np.float32))
    object.__setattr__(scene, "materials", Materials.of(2, diffuse=matte, roughness=rough, **channels))
    return scene


def smooth(scene, normals):
    """The scene with the shading normals that a function of positions gives to its second object."""
    corners = scene.vertices[scene.triangles]
    chosen = scene.object_of_triangle == 1
    scene.corner_normals[chosen] = normals(corners[chosen])
    return scene


def traced(scene, n=200_000, max_bounces=12):
    tracer = TransparencyTracer(scene, EmbreeTracer(scene))
    photons = trace_photons(scene, tracer, light_sources(scene, REGION), n, max_bounces, Workers(5))
    on_floor = np.abs(photons.position[:, 2]) < 1e-4
    return tracer, photons.where((photons.kind == PathKind.CAUSTIC) & on_floor)


def glass_ball(height=0.5):
    """A ball of glass over a wide floor, the sun straight above."""
    centre = np.float32([0, 0, height])
    mesh = merge(plane(20.0), ball(RADIUS, centre, 80))
    lights = lamp(LightKind.SUN, SUN, direction=(0, 0, -1))
    scene = with_lobes(mesh, 2, lights, glass_reflection=1.0, glass_transmission=1.0)
    return smooth(scene, lambda at: (at - centre) / np.linalg.norm(at - centre, axis=2, keepdims=True))


def ball_power(height, within, n=200_000, n_inside=12):
    """Power that a glass ball sends to the floor within a radius of its foot, W: rays of all impact parameters.

    In a meridian plane, with Fresnel's equations; after k reflections inside, (1 − F)² F^(k−1) leaves.
    """
    b = (np.arange(n) + 0.5) / n * RADIUS
    at = np.stack([b, np.sqrt(RADIUS**2 - b**2)], axis=1)
    normal, way = at / RADIUS, np.tile([0.0, -1.0], (n, 1))
    power = SUN * 2 * np.pi * b * RADIUS / n
    cos_i = -np.einsum("ij,ij->i", way, normal)
    cos_t = np.sqrt(1 - (1 - cos_i**2) / IOR**2)
    s, p = (cos_i - IOR * cos_t) / (cos_i + IOR * cos_t), (IOR * cos_i - cos_t) / (IOR * cos_i + cos_t)
    fresnel = (s**2 + p**2) / 2
    total = landed(at, way + 2 * cos_i[:, None] * normal, power * fresnel, height, within)
    inside, left = way / IOR + (cos_i / IOR - cos_t)[:, None] * normal, power * (1 - fresnel)
    for _ in range(n_inside):
        at = at + 2 * RADIUS * cos_t[:, None] * inside
        normal = at / RADIUS
        out = inside * IOR + (cos_i - IOR * cos_t)[:, None] * normal
        total += landed(at, out, left * (1 - fresnel), height, within)
        left = left * fresnel
        inside = inside - 2 * cos_t[:, None] * normal
    return total


def landed(at, way, power, height, within):
    distance = np.where(way[:, 1] < 0, (at[:, 1] + height) / np.maximum(-way[:, 1], 1e-12), np.inf)
    beside = np.abs(at[:, 0] + np.where(np.isfinite(distance), distance, 1e9) * way[:, 0])
    return power[beside < within].sum()


def test_glass_ball_s_caustic_has_its_power():
    """Of photons and in pixels; flat faces with smooth normals lose a hundredth of what rays at a slant bring."""
    scene = glass_ball()
    tracer, caustic = traced(scene, 2_400_000)  # of which a hundredth meets the ball: a noise of 0.6 %
    from_foot = np.linalg.norm(caustic.position[:, :2], axis=1)
    for within in (0.05, 0.2, 1.0):
        power = caustic.power[from_foot < within, 0].sum()
        assert power == pytest.approx(ball_power(0.5, within), rel=0.02)

    camera = Camera.perspective(np.float32([0, 0, 0.15]), DOWN, 2 * float(np.arctan(0.2 / 0.15)), 160, 160)
    seen = seen_surface(scene, tracer, camera)
    irradiance, _ = splat_irradiance(camera, seen, caustic, Workers())
    near = np.linalg.norm(seen.position[:, :2], axis=1) < 0.15
    power = (irradiance[near, 0] * seen.area[near]).sum(dtype=np.float64)
    assert power == pytest.approx(ball_power(0.5, 0.15), rel=0.03)


HEIGHT, TILT = 0.2, np.radians(50)


def ring(n=256):
    """A mirror ring on the floor, open above and below, the sun 50° off the zenith."""
    angle = np.arange(n) * 2 * np.pi / n
    around = np.stack([np.cos(angle), np.sin(angle)], axis=1) * RADIUS
    vertices = np.concatenate([np.c_[around, np.zeros(n)], np.c_[around, np.full(n, HEIGHT)]]).astype(np.float32)
    i, j = np.arange(n), (np.arange(n) + 1) % n
    triangles = np.concatenate([np.stack([i, j, j + n], axis=1), np.stack([i, j + n, i + n], axis=1)])
    lights = lamp(LightKind.SUN, SUN, direction=(np.sin(TILT), 0, -np.cos(TILT)))
    scene = with_lobes(merge(plane(20.0), (vertices, triangles)), 2, lights, f0=1.0, f90=1.0)
    flat = np.float32([1, 1, 0])
    return smooth(scene, lambda at: at * flat / np.linalg.norm(at * flat, axis=2, keepdims=True))


def test_ring_s_cardioid_has_its_power():
    """The sun falls on the far half of the inner wall over the near half's rim.

    At the azimuth φ the wall is lit down from its rim as far as the chord 2R cos φ lets light fall, or to the floor:
    Φ = E sin θ ∫ R cos φ min(h, 2R cos φ / tan θ) dφ. All of it is reflected, in the end to the floor inside.
    """
    _, caustic = traced(ring())
    inside = np.linalg.norm(caustic.position[:, :2], axis=1) < RADIUS * 0.999
    phi = (np.arange(20_000) + 0.5) / 20_000 * np.pi - np.pi / 2
    lit = RADIUS * np.cos(phi) * np.minimum(HEIGHT, 2 * RADIUS * np.cos(phi) / np.tan(TILT))
    expected = SUN * np.sin(TILT) * lit.mean() * np.pi
    assert caustic.power[inside, 0].sum() == pytest.approx(expected, rel=0.01)


def test_cardioid_is_sharp():
    """Along the axis light ends at the cusp, at half the radius, where rays close to the axis meet (paraxially)."""
    scene = ring()
    tracer, caustic = traced(scene, 400_000)
    camera = Camera.perspective(np.float32([0, 0, 2]), DOWN, 2 * float(np.arctan(RADIUS / 2)), 200, 200)
    seen = seen_surface(scene, tracer, camera)
    irradiance, _ = splat_irradiance(camera, seen, caustic, Workers())
    x, y = seen.position[:, 0], seen.position[:, 1]
    inside = (np.abs(y) < 0.006) & (np.abs(x) < RADIUS * 0.95)
    order = np.argsort(x[inside])
    along, profile = x[inside][order], irradiance[inside, 0][order]
    peak = along[np.argmax(profile)]
    assert peak == pytest.approx(RADIUS / 2, abs=0.02)
    assert profile.max() > 3 * np.median(profile[(along > 0.2) & (along < 0.27)])
    assert profile[along < peak - 0.05].max() < 0.25 * profile.max()


def test_light_that_walls_send_through_glass_is_indirect_and_counted_once():
    """A spot lights a ceiling, whose light falls through a ball of glass onto the floor.

    Its photons are indirect, not caustics. Gather rays find the light that they bring, through the glass, at what
    photons and lamps lit.
    """
    mesh = merge(box(), ball(0.35, (0, 0, -0.5), 32))
    lights = lamp(LightKind.SPOT, 20.0, (0, 0, 0), (0, 0, 1), angle=np.radians(80))
    scene = with_lobes(mesh, 12, lights, glass_reflection=1.0, glass_transmission=1.0)
    scene = smooth(scene, lambda at: (at - [0, 0, -0.5]) / np.linalg.norm(at - [0, 0, -0.5], axis=2, keepdims=True))
    tracer = TransparencyTracer(scene, EmbreeTracer(scene))
    photons = trace_photons(scene, tracer, light_sources(scene, REGION), 600_000, 32, Workers())
    assert (photons.kind == PathKind.INDIRECT).all()
    beneath = (np.abs(photons.position[:, :2]) < 0.2).all(axis=1) & (photons.position[:, 2] < -0.99)
    brought = photons.power[beneath, 0].sum() / 0.4**2
    middles = (np.arange(14) + 0.5) / 14 * 0.4 - 0.2
    at = np.stack([*np.meshgrid(middles, middles), np.full((14, 14), -0.999)], axis=2).reshape(-1, 3)
    gathered = bake(scene, receivers_at(at, (0, 0, 1)), settings_for("draft"), EmbreeTracer(scene)).value.mean()
    assert gathered == pytest.approx(brought, rel=0.06)  # of 2,600 photons the noise is 2 %, and smooth faces lose 1 %
    without = scene_of(*box(), albedo=0.5, lights=lights)
    shaded = bake(without, receivers_at(at, (0, 0, 1)), settings_for("draft"), EmbreeTracer(without))
    assert gathered > 1.1 * shaded.value.mean()  # the ball focuses the ceiling's light
