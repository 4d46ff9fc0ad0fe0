"""Rays into a radiance cache whose light is known."""

from dataclasses import replace

import numpy as np
import pytest
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.gather import DirectLight, GatherRays
from photon_bake.addon.gather.radiance_cache.build import gather_at_sides
from photon_bake.addon.gather.radiance_cache.elements import SurfaceCells, SurfaceElements
from photon_bake.addon.gather.radiance_cache.hidden_sides import HiddenSides
from photon_bake.addon.gather.radiance_cache.radiance_cache import RadianceCache
from photon_bake.addon.scene import Channel, Materials, RayKind
from photon_bake.addon.tracing import TransparencyTracer
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.core.scenes import box, merge, plane, scene_of
from photon_bake.tests.core.warp_loops import sample_uniform_sphere

N = 2000
RANDOM = np.random.default_rng(6)
AROUND = sample_uniform_sphere(RANDOM.random((N, 2), np.float32))


def rays_into(scene, n_elements, radiance, caustic=0.0):
    """Rays into a cache of so much radiance everywhere, and of what of it is caustics; and its elements."""
    tracer, visits = TransparencyTracer(scene, EmbreeTracer(scene)), np.ones(scene.n_triangles, int)
    cells = SurfaceCells.by_visits(scene, visits, n_elements)
    elements = SurfaceElements.by_visits(scene, cells, (visits / cells.cuts**2)[cells.triangle], n_elements)
    sides = np.ones((2 * len(elements), 3), np.float32)
    cache = RadianceCache(elements, np.float32(radiance) * sides, np.float32(caustic) * sides)
    return GatherRays(scene, tracer, DirectLight(scene, tracer, []), cache), elements


def in_the_middle(directions):
    return np.zeros_like(directions), directions, np.random.default_rng(1)


@pytest.mark.parametrize("around", ["surfaces", "sky"])
def test_no_light_comes_from_behind_facets(around):
    """A smooth normal's hemisphere reaches behind its facet: what is there, surfaces or the sky, does not shine.

    With the angle α between the two normals (1 + cos α)/2 of the cosine-weighted hemisphere is above the facet.
    """
    mesh = merge(plane(0.1), box()) if around == "surfaces" else plane(0.1)
    scene = scene_of(*mesh, world=2.0)
    scene.corner_normals[:2] = [0.6, 0, 0.8]
    rays, elements = rays_into(scene, 5000, radiance=2.0)
    side = 2 * elements.find(np.zeros(1, np.int32), *np.full((2, 1), np.float32(0.3)))
    none = HiddenSides(np.zeros(2 * scene.n_triangles, bool))
    light = gather_at_sides(scene, rays, elements, none, np.repeat(side, 50), 64, Workers())
    assert light.mean() == pytest.approx(2 * 0.9, rel=0.01)


def test_near_hits_find_caustics_in_the_cache():
    """Rays that end too near to ask the cache for the rest: no ray of their own would find light over mirrors."""
    black, _ = rays_into(scene_of(*box(), albedo=1e-7), 12, radiance=5.0, caustic=1.5)
    met = black.radiance_along(*in_the_middle(AROUND))
    near = met.hits.distance < np.sqrt(2)  # of elements of 2 m²
    assert 0.5 < near.mean() < 1
    np.testing.assert_allclose(met.reflected[near], 1.5, rtol=1e-5)
    np.testing.assert_allclose(met.reflected[~near], 5, rtol=1e-5)


def test_a_lamp_that_only_mirrors_show():
    """No source has the light: E/π of a square that the mirror shows at three times its distance."""
    made_of = Materials.of(
        3,
        emission=Channel.constant(np.float32([0, 0, 2])),
        f0=Channel.constant(np.float32([1, 0, 0])),
        f90=Channel.constant(np.float32([1, 0, 0])),
        roughness=Channel.constant(np.zeros(3, np.float32)),
    )
    made_of.seen_as[1, 2 * RayKind.GLOSSY : 2 * RayKind.GLOSSY + 2] = 2
    np.testing.assert_array_equal(made_of.emits_unsampled[:2], [False, True])
    scene = scene_of(*merge(plane(20, z=-1), plane(1.5, z=1)), material=[0, 0, 1, 1])
    rays, _ = rays_into(replace(scene, materials=made_of), 100, radiance=0.0)
    sin, turn = np.sqrt(RANDOM.random(200_000)), 2 * np.pi * RANDOM.random(200_000)
    down = np.stack([sin * np.cos(turn), sin * np.sin(turn), -np.sqrt(1 - sin**2)], axis=1).astype(np.float32)
    share = 0.5 / np.hypot(1, 0.5)
    expected = 2 * 4 / np.pi * share * np.arctan(share)
    assert rays.radiance_along(*in_the_middle(down)).reflected.mean() == pytest.approx(expected, rel=0.02)
