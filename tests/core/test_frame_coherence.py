"""Animations do not flicker: what has not moved keeps its photons."""

import numpy as np
import pytest
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.core.sampling.path_numbers import PathNumbers
from photon_bake.addon.emitters import Sphere, light_sources
from photon_bake.addon.photons import emitted_rays, trace_photons
from photon_bake.addon.scene import LightKind
from photon_bake.addon.tracing import TransparencyTracer
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.core.scenes import box, lamp, merge, plane, scene_of
from scipy import stats

PLATE = 12  # the first of its two triangles


def frame(x, n=60_000):
    """Photons in a box in which a plate has moved to x, and the paths (n,) bool that meet it."""
    vertices, triangles = plane(0.3)
    room = merge(box(), (vertices + np.float32([x, 0.2, -0.4]), triangles))
    scene = scene_of(*room, albedo=0.7, lights=lamp(LightKind.POINT, 2.0, position=(0, 0, 0.5)))
    sources, tracer = (
        light_sources(scene, Sphere(np.zeros(3, np.float32), 1.0)),
        TransparencyTracer(scene, EmbreeTracer(scene)),
    )
    (rays,) = emitted_rays(sources, n, 0)
    meets = tracer.closest_hit(rays.origins, rays.directions).triangle >= PLATE
    photons = trace_photons(scene, tracer, sources, n, 32, Workers())
    meets[photons.path[photons.triangle >= PLATE]] = True
    return photons, meets


def test_paths_that_meet_nothing_that_moved_are_the_same():
    """Bit for bit, though others of their batch end elsewhere."""
    (first, met), (second, met_then) = frame(-0.3), frame(0.2)
    kept = [photons.where(~(met | met_then)[photons.path]) for photons in (first, second)]
    assert len(kept[0]) > 0.5 * len(first)
    for name in ("position", "power", "packed_direction", "path", "bounce", "path_density"):
        assert np.array_equal(getattr(kept[0], name), getattr(kept[1], name)), name


def test_numbers_of_paths_are_even_and_independent():
    """χ² of pairs of consecutive numbers of a path, and of one number of consecutive paths."""
    numbers = PathNumbers(3, 2)
    path = np.arange(200_000)
    a, b = numbers.of(path).random((len(path), 3)), numbers.random(len(path))
    for x, y in ((a[:, 0], a[:, 1]), (a[:, 1], a[:, 2]), (a[:, 2], b), (a[:-1, 0], a[1:, 0])):
        counts, _, _ = np.histogram2d(x, y, 32, [[0, 1], [0, 1]])
        assert stats.chisquare(counts.ravel()).pvalue > 1e-4
    assert a.min() >= 0 and a.max() < 1


def test_a_path_s_numbers_do_not_depend_on_the_others():
    few, many = PathNumbers(3, 2), PathNumbers(3, 2)
    path = np.arange(1000)
    some = np.array([3, 500, 999])
    for size in (3, 1, 4):
        all_of_them = many.of(path).random((len(path), size))
        assert np.array_equal(few.of(some).random((3, size)), all_of_them[some])
    assert not np.array_equal(PathNumbers(4, 2).of(path).random(1000), PathNumbers(3, 2).of(path).random(1000))


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_numbers_have_their_type(dtype):
    assert PathNumbers(0).of(np.arange(5)).random((5, 2), dtype=dtype).dtype == dtype
