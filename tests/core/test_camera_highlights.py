"""Highlights on gloss that is seen in a mirror, against plain averages over the lobe, and closed forms."""

import numpy as np
import pytest
from photon_bake.addon.bsdf import NARROW_LOBES, evaluate_glossy, surface_at
from photon_bake.addon.bsdf.scatter import scatter
from photon_bake.addon.core.compiling import kernel
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.core.sampling.streams import stream
from photon_bake.addon.core.vec3 import put, row
from photon_bake.addon.emitters import light_sources, region_of
from photon_bake.addon.emitters.mesh import radiance_of
from photon_bake.addon.gather import DirectLight, reflected_highlights
from photon_bake.addon.receivers import Camera, PixelFilter, camera_points
from photon_bake.addon.scene import Channel, LightKind, Lights, Materials, RayKind
from photon_bake.addon.scene.hit import hit_at
from photon_bake.addon.tracing import TransparencyTracer
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.core.lamp_loops import lamps_along
from photon_bake.tests.core.scenes import lamp, merge, plane, scene_of
from photon_bake.tests.core.test_camera import AXES
from photon_bake.tests.core.world_loops import radiance_along

CAMERA_RAY = int(RayKind.CAMERA)
BALL = lamp(LightKind.POINT, 5, position=(0, 0.3, 0.5), radius=0.3, sphere=True)
AREA = lamp(LightKind.RECTANGLE, 20, position=(0, -0.2, -0.5), direction=(-1, 0, 0), size=(0.4, 0.4))
SUN = lamp(LightKind.SUN, 1, direction=(-1, 0.9, 0.9), angle=0.5)


def metal_in_a_mirror(roughness, lights, world=0.0, glow=0.0):
    """A mirror before the camera, metal of 90 % and a glowing square behind it; and what the camera sees."""
    vertices, triangles = merge(plane(0.5, 1), plane(3, -1), plane(0.2, -0.4))
    vertices[-4:, 1] -= 1.2
    scene = scene_of(vertices[:, [2, 0, 1]], triangles, material=np.repeat([0, 1, 2], 2), lights=lights, world=world)
    f = Channel.constant(np.repeat(np.float32([[1], [0.9], [0]]), 3, axis=1))
    materials = Materials.of(
        3,
        f0=f,
        f90=f,
        roughness=Channel.constant(np.float32([0, roughness, 1])),
        emission=Channel.constant(np.repeat(np.float32([[0], [0], [glow]]), 3, axis=1)),
    )
    object.__setattr__(scene, "materials", materials)
    tracer = TransparencyTracer(scene, EmbreeTracer(scene))
    camera = Camera.perspective(np.zeros(3, np.float32), AXES, 0.8, 6, 4)
    return scene, tracer, camera_points(scene, tracer, camera, PixelFilter("box", 1.0), 1, Workers())


def found(scene, tracer, points, n_rays):
    direct = DirectLight(scene, tracer, light_sources(scene, region_of(points.seen.position)))
    return reflected_highlights(scene, points, direct, tracer, n_rays, Workers())


@kernel
def reflect(scene, triangle, distance, u, v, directions, random, origins, out, weight, kind):
    """One new ray for each that met gloss or glass."""
    for i in range(len(triangle)):
        direction, (x, y, z) = row(directions, i), row(random, i)
        hit = hit_at(scene, direction, triangle[i], distance[i], u[i], v[i])
        on = scatter(scene, hit, direction, x, y, z, NARROW_LOBES, False, CAMERA_RAY)
        put(origins, i, on.origin)
        put(out, i, on.direction)
        put(weight, i, on.weight)
        kind[i] = on.kind


def by_the_lobe(scene, tracer, points, n):
    """The mean of all that rays by the lobe meet, and its standard error."""
    at = points.seen.where(np.repeat(np.arange(len(points)), n))
    origins, directions, weight = np.empty((3, len(at), 3), np.float32)
    kind, random = np.empty(len(at), np.uint8), stream(5).random((len(at), 3), np.float32)
    met = at.hits.triangle, at.hits.distance, at.hits.u, at.hits.v
    reflect(scene.arrays, *met, at.direction, random, origins, directions, weight, kind)
    hits = tracer.closest_hit(origins, directions)
    objects = scene.object_of_triangle[at.hits.triangle]
    light = lamps_along(scene.lights, origins, directions, hits.distance, kind, objects)
    light += np.where(hits.hit[:, None], 0, radiance_along(scene.world, directions))
    light += radiance_of(scene.arrays, hits.triangle, hits.u, hits.v) * hits.hit[:, None]
    light = (weight * light).reshape(-1, n, 3)
    return light.mean(axis=1), light.mean(axis=2).std(axis=1) / np.sqrt(n)


@pytest.mark.parametrize("roughness", [0.15, 0.3, 0.6])
def test_all_light_is_found_once(roughness):
    """Lamps, glow and world, whoever finds them, are what the lobe alone finds in the end."""
    made = metal_in_a_mirror(roughness, Lights.join([BALL, AREA, SUN]), world=0.1, glow=3.0)
    points = made[2]
    metal = points.seen.position[:, 0] < 0
    assert (points.n_followed == 1).all() and metal.sum() > 15
    radiance, stderr = found(*made, 4000)
    expected, noise = by_the_lobe(*made, 20_000)
    off = np.abs(radiance - expected).mean(axis=1)
    assert radiance.sum() == pytest.approx(expected.sum(), rel=0.02)
    assert (off[metal] < 4 * np.hypot(stderr, noise)[metal]).all()
    assert 0 < stderr.mean() < 0.03 * expected.mean()


def test_a_lamp_without_a_size():
    """f I cos θ / d² at each point, by the lobe as it is tested elsewhere."""
    bulb = np.float32([0, 0.3, 0.5])
    scene, tracer, points = metal_in_a_mirror(0.3, lamp(LightKind.POINT, 5, position=bulb))
    k = np.flatnonzero(points.seen.position[:, 0] < -0.9)
    seen = points.seen.where(k)
    way = bulb - seen.position
    distance = np.linalg.norm(way, axis=1, keepdims=True)
    wo, wi = (directions[:, [1, 2, 0]] for directions in (-seen.direction, way / distance))
    surface = surface_at(scene, seen.hits.triangle, seen.hits.u, seen.hits.v, np.zeros(len(k), bool))
    expected = evaluate_glossy(surface, wo, wi) * 5 * wi[:, 2:] / distance**2
    assert found(scene, tracer, points, 8)[0][k] == pytest.approx(expected, rel=1e-3) and expected.max() > 1


def test_what_the_camera_itself_sees_has_none():
    scene, tracer, points = metal_in_a_mirror(0.3, AREA)
    object.__setattr__(points, "n_followed", np.zeros_like(points.n_followed))
    radiance, stderr = found(scene, tracer, points, 8)
    assert not radiance.any() and not stderr.any()
