"""Photons in flight: energy, Russian roulette, storage, determinism."""

from dataclasses import replace

import numpy as np
import pytest
from photon_bake.addon.core.errors import Cancelled
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.emitters import light_sources, region_of
from photon_bake.addon.photons import PathKind, trace_photons
from photon_bake.addon.scene import Channel, LightKind, Lights, Materials
from photon_bake.addon.tracing import TransparencyTracer
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.core.scenes import (
    box,
    chi_square_of_directions,
    lamp,
    merge,
    of_objects,
    plane,
    scene_of,
)


def trace(scene, n=100_000, max_bounces=64, seed=1, **workers):
    return trace_photons(
        scene,
        TransparencyTracer(scene, EmbreeTracer(scene)),
        light_sources(scene, region_of(scene.vertices)),
        n,
        max_bounces,
        Workers(seed, **workers),
    )


def box_with_lamp(albedo=0.5):
    return scene_of(*box(), albedo=albedo, lights=lamp(LightKind.POINT, 10 / (4 * np.pi), position=(0, 0.2, 0.1)))


@pytest.mark.parametrize("albedo", [0.2, 0.5, 0.8])
def test_energy_in_a_closed_box(albedo):
    """Φ watts are reflected as Φρ + Φρ² + … = Φρ/(1 − ρ), all of which falls on the walls again."""
    photons = trace(box_with_lamp(albedo), max_bounces=200)
    assert photons.power.sum(0) == pytest.approx(np.full(3, 10 * albedo / (1 - albedo)), rel=0.02)


def test_each_bounce_carries_the_albedo():
    photons = trace(box_with_lamp(0.6))
    for bounce in range(1, 5):
        share = photons.power[photons.bounce == bounce, 0].sum() / 10
        assert share == pytest.approx(0.6**bounce, rel=0.03)


def test_roulette_keeps_colours_and_never_adds_power():
    photons = trace(box_with_lamp([[0.9, 0.45, 0.0]]), n=50_000)
    first = photons.bounce == 1
    assert photons.power[first].sum(0) == pytest.approx([9, 4.5, 0], rel=0.02)
    assert photons.power.max() <= 10 / 50_000 * 1.001
    np.testing.assert_allclose(photons.path_density, 0.9 ** photons.bounce.astype(float), rtol=1e-4)


def test_bounce_limit():
    photons = trace(box_with_lamp(), max_bounces=3)
    assert photons.bounce.max() == 2
    assert len(trace(box_with_lamp(), max_bounces=1)) == 0  # direct hits of lamps are not stored


FLOOR, MIRROR, CEILING = range(3)


def over_a_mirror(glow=0.0, lights=None):
    """A floor, a mirror that stands on it, and a ceiling that may glow, of an object each."""
    wall = plane(1.0)
    upright = wall[0][:, [2, 0, 1]] + np.float32([-1, 0, 1]), wall[1]
    ceiling = wall[0] * np.float32([1, -1, 1]) + np.float32([0, 0, 2]), wall[1]
    which = np.repeat([FLOOR, MIRROR, CEILING], 2)
    matte, shine = (Channel.constant(np.float32([[x] * 3 for x in of])) for of in ((0.5, 0, 0.5), (0, 1, 0)))
    emission = Channel.constant(np.float32([[0] * 3, [0] * 3, [glow] * 3]))
    rough = Channel.constant(np.float32([1, 0, 1]))
    materials = Materials.of(3, diffuse=matte, emission=emission, f0=shine, f90=shine, roughness=rough)
    scene = scene_of(*merge(wall, upright, ceiling), albedo=[0.5] * 3, material=which, lights=lights)
    return of_objects(replace(scene, materials=materials), which)


def arrived(scene, on, bounce):
    """Watts of photons that an object got at a bounce."""
    photons = trace(scene, 30_000, max_bounces=3)
    there = (scene.object_of_triangle[photons.triangle] == on) & (photons.bounce == bounce)
    return float(photons.power[there].sum())


def test_gloss_shows_no_photons_of_objects_that_it_does_not_see():
    """As in Cycles, where a glossy ray passes such an object: neither what it emits nor what it scatters."""
    glowing = over_a_mirror(glow=1.0)
    assert arrived(glowing, FLOOR, 1) > 0.1
    glowing.objects.seen_in_gloss[CEILING] = False
    assert arrived(glowing, FLOOR, 1) == 0

    lit = over_a_mirror(lights=lamp(LightKind.SPOT, 9.0, position=(0, 0, 1), angle=0.5))
    directly = arrived(lit, CEILING, 1)
    assert arrived(lit, CEILING, 2) > 0.1
    lit.objects.seen_in_gloss[FLOOR] = False
    assert arrived(lit, CEILING, 2) == 0 and arrived(lit, CEILING, 1) == pytest.approx(directly, rel=0.05)


def test_black_box_scatters_nothing():
    assert len(trace(box_with_lamp(0.0))) == 0


def test_only_the_world_stores_direct_photons():
    lit_by_lamp = trace(scene_of(*plane(), lights=lamp(LightKind.POINT)))
    lit_by_world = trace(scene_of(*plane(), world=1.0))
    assert len(lit_by_lamp) == 0
    assert (lit_by_world.kind == PathKind.DIRECT).all() and (lit_by_world.bounce == 0).all()
    # On both sides of the plane: 2 · π L A
    assert lit_by_world.power[:, 0].sum() == pytest.approx(2 * np.pi * 4, rel=0.02)


def test_scattered_directions_are_cosine_weighted():
    """Photons that hit the ceiling first arrive below as if the ceiling were a diffuse lamp."""
    scene = scene_of(*box(), albedo=0.99, lights=lamp(LightKind.SPOT, 1.0, (0, 0, 0), (0, 0, 1), angle=0.1))
    second = trace(scene, 200_000, max_bounces=2)
    # Turned around, flight directions are cosine-weighted around the ceiling's normal
    assert chi_square_of_directions(-second.direction, lambda z: np.maximum(z, 0) / np.pi) > 1e-3


def test_stored_photons_lie_on_their_triangles():
    scene = box_with_lamp()
    photons = trace(scene, 20_000)
    assert np.abs(np.abs(photons.position).max(axis=1) - 1).max() < 1e-5
    normals = photons.normal
    assert np.allclose(normals, scene.normals[photons.triangle], atol=1e-4)  # the walls face inwards
    assert (np.einsum("ij,ij->i", normals, photons.direction) < 0).all()
    u, v = scene.barycentrics(photons.triangle, photons.position)
    assert np.allclose(scene.points(photons.triangle, u, v), photons.position, atol=1e-5)


@pytest.mark.parametrize("height", [1.0, 1e-3, 1e-5])
def test_barycentrics_of_slivers(height):
    """Points on a triangle a hundred thousand times as long as it is high are found again."""
    scene = scene_of([(0, 0, 0), (1, 0, 0), (0.3, height, 0)], [0, 1, 2])
    u, v = np.random.default_rng(2).random((2, 100), np.float32) / 2
    found_u, found_v = scene.barycentrics(np.zeros(100, np.int32), scene.points(np.zeros(100, np.int32), u, v))
    assert found_u == pytest.approx(u, abs=1e-5) and found_v == pytest.approx(v, abs=1e-5)


def test_back_faces_reflect_too():
    inside_out = scene_of(*box(inwards=False), lights=lamp(LightKind.POINT, 10 / (4 * np.pi), position=(0, 0, 0)))
    photons = trace(inside_out)
    assert photons.power[:, 0].sum() == pytest.approx(10, rel=0.02)
    assert np.allclose(photons.normal, -inside_out.normals[photons.triangle], atol=1e-4)


def test_a_photon_takes_at_most_48_bytes():
    assert 0 < trace(box_with_lamp(), 1000).bytes_per_photon <= 48


def test_same_seed_same_photons_whatever_the_threads():
    lights = Lights.join([lamp(LightKind.POINT, 1.0, (0, 0, 0)), lamp(LightKind.RECTANGLE, 2.0, size=(1, 1))])
    scene = scene_of(*box(), lights=lights, world=0.5)
    one, three = trace(scene, n_threads=1), trace(scene, n_threads=3)
    for name in ("position", "power", "packed_direction", "triangle", "path", "kind", "bounce"):
        assert np.array_equal(getattr(one, name), getattr(three, name)), name
    other = trace(scene, seed=2)
    assert not np.array_equal(one.position[:100], other.position[:100])


def test_paths_are_numbered_throughout():
    photons = trace(box_with_lamp(0.9), 70_000)
    assert photons.path.min() >= 0 and photons.path.max() < 70_000
    assert len(np.unique(photons.path)) == pytest.approx(0.9 * 70_000, rel=0.01)


def test_cancel_stops_the_trace():
    progress = Progress()
    progress.cancel()
    with pytest.raises(Cancelled):
        trace(box_with_lamp(), progress=progress)
