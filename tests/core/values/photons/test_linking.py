"""Photons on their way to the first surface: who is lit, who stands in the way, how light falls off; plain Python."""

from dataclasses import replace

import numpy as np
import pytest
from photon_bake.addon.core.sampling.path_numbers import PathNumbers
from photon_bake.addon.emitters import Sphere, light_sources
from photon_bake.addon.photons.emission_segment import LightLinking, emission_segment
from photon_bake.addon.photons.front import new_front
from photon_bake.addon.scene import Channel, LightKind, Lights
from photon_bake.addon.scene.scene import EmitterLinks
from photon_bake.addon.tracing import TransparencyTracer
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.core.scenes import lamp, merge, of_objects, plane, scene_of

HEIGHTS = (0.0, 1.0, 2.0)
REGION = Sphere(np.zeros(3, np.float32), 2.0)
ALL = np.ones(3, bool)


def layers(lights=None, coverage=1.0, emission=(0.0, 0, 0), **columns):
    """Three squares over each other, of an object and a material each; the middle one may be see-through."""
    mesh = merge(*(plane(1.0, z) for z in HEIGHTS))
    which = [0, 0, 1, 1, 2, 2]
    scene = of_objects(scene_of(*mesh, albedo=[0.5] * 3, emission=emission, material=which, lights=lights), which)
    covered = Channel.constant(np.float32([1, coverage, 1]))
    tint = Channel.constant(np.float32([[1, 1, 1], [0.5, 1, 0.25], [1, 1, 1]]))
    materials = replace(scene.materials, coverage=covered, tint=tint)
    return replace(scene, materials=materials, objects=replace(scene.objects, **columns))


def two_lamps(illuminates=None, blocked_by=None, **columns):
    above = lamp(LightKind.POINT, 1.0, position=(0, 0, 5))
    lights = Lights.join([above, above])
    return replace(lights, illuminates=illuminates, blocked_by=blocked_by, **columns)


def sent_down(scene, source, n=64, came_from=-1):
    """Hits and power of photons that fly down from above all squares, all of one watt."""
    sources = light_sources(scene, REGION)
    linking = LightLinking.of(scene, sources)
    front = new_front(n)
    at = np.random.default_rng(1).uniform(-0.9, 0.9, (n, 2))
    front.origin[:] = np.column_stack([at, np.full(n, 3.0)])
    front.direction[:], front.power[:] = (0, 0, -1), 1
    front.path[:], front.source[:], front.came_from[:] = np.arange(n), source, came_from
    tracer = TransparencyTracer(scene, EmbreeTracer(scene))
    return emission_segment(scene, tracer, linking, front, PathNumbers(3, 2, 1)), front.power


def test_groups_of_sources_that_are_linked_alike():
    """Those that light all and are blocked by all are one group with what is not linked."""
    scene = layers(two_lamps(np.array([[1, 0, 1], [1, 1, 1]], bool), np.array([[1, 1, 0], [1, 1, 1]], bool)))
    shadowless = replace(scene, objects=replace(scene.objects, casts_shadow=np.array([True, True, False])))
    linking = LightLinking.of(scene, light_sources(scene, REGION))
    assert linking.group.tolist() == [0, 1] and len(linking.group_of_object) == 0
    assert linking.lit.tolist() == [[True, False, True], [True] * 3]
    assert linking.blocks.tolist() == [[True, True, False], [True] * 3]
    assert linking.falls_off.tolist() == [-1, -1] and linking.met.all() and not linking.stops_all
    linking = LightLinking.of(shadowless, light_sources(shadowless, REGION))
    assert linking.blocks.tolist() == [[True, True, False]] * 2
    alike = layers(two_lamps())
    linking = LightLinking.of(alike, light_sources(alike, REGION))
    assert linking.group.tolist() == [0, 0] and linking.lit.shape == (1, 3) and linking.stops_all
    unmet = replace(linking, met=np.array([True, True, False]), lit=np.array([[True, True, False]]))
    assert unmet.stops_all


def test_groups_of_photons_of_linked_objects():
    links = EmitterLinks(np.int32([0, -1, 1]), np.array([[0, 1, 1], [1, 1, 0]], bool), np.array([ALL, [1, 0, 1]], bool))
    scene = layers(two_lamps(), emission=(1.0, 1, 1), links=links)
    linking = LightLinking.of(scene, light_sources(scene, REGION))
    assert linking.group.tolist() == [0, 0, 0] and linking.group_of_object.tolist() == [1, 0, 2]
    assert linking.lit.tolist() == [[True] * 3, [False, True, True], [True, True, False]]
    assert linking.blocks.tolist() == [[True] * 3, [True] * 3, [True, False, True]]
    front = new_front(4)
    front.source[:], front.came_from[:] = 0, [-1, 0, 1, 2]
    assert linking.group_of(front, np.arange(4)).tolist() == [0, 1, 0, 2]
    assert linking.group_of(front, np.array([3, 1])).tolist() == [2, 1]


def test_where_all_block_photons_end_at_the_first_surface():
    hits, power = sent_down(layers(two_lamps()), 0)
    assert (hits.triangle // 2 == 2).all() and hits.distance == pytest.approx(1.0) and (power == 1).all()


def test_what_is_not_lit_but_blocks_takes_the_light():
    hits, power = sent_down(layers(two_lamps(np.array([[1, 1, 0], [1, 1, 1]], bool), np.array([ALL, ALL]))), 0)
    assert (hits.triangle // 2 == 2).all() and (power == 0).all()
    hits, power = sent_down(layers(two_lamps(np.array([[1, 1, 0], [1, 1, 1]], bool), np.array([ALL, ALL]))), 1)
    assert (power == 1).all()


def test_what_neither_is_lit_nor_blocks_is_passed():
    lights = two_lamps(np.array([[1, 1, 0], [1, 1, 1]], bool), np.array([[1, 1, 0], [1, 1, 1]], bool))
    hits, power = sent_down(layers(lights), 0)
    assert (hits.triangle // 2 == 1).all() and hits.distance == pytest.approx(2.0) and (power == 1).all()


def test_half_of_the_photons_stop_at_what_is_lit_but_does_not_block():
    """Each with twice the power; the rest end on what blocks."""
    lights = two_lamps(None, np.array([[1, 1, 0], [1, 1, 1]], bool))
    hits, power = sent_down(layers(lights), 0, n=200)
    stopped = hits.triangle // 2 == 2
    assert stopped.mean() == pytest.approx(0.5, abs=0.12) and (hits.triangle[~stopped] // 2 == 1).all()
    assert power == pytest.approx(2) and hits.distance == pytest.approx(np.where(stopped, 1, 2))
    by_both = two_lamps(None, np.array([[1, 0, 0], [1, 1, 1]], bool))
    hits, power = sent_down(layers(by_both), 0, n=300)
    on = np.bincount(hits.triangle // 2, minlength=3) / 300
    assert on == pytest.approx([0.25, 0.25, 0.5], abs=0.1)
    assert power[:, 0] == pytest.approx(np.array([4, 4, 2])[hits.triangle // 2])
    beyond_all = two_lamps(None, np.array([[0, 0, 0], [1, 1, 1]], bool))
    hits, power = sent_down(layers(beyond_all), 0, n=300)
    assert (hits.triangle < 0).mean() == pytest.approx(1 / 8, abs=0.06)


def test_see_through_surfaces_tint_what_passes():
    """The middle square lets all through: on the way past the upper one, which is neither lit nor blocks."""
    lights = two_lamps(np.array([[1, 1, 0], [1, 1, 1]], bool), np.array([[1, 1, 0], [1, 1, 1]], bool))
    hits, power = sent_down(layers(lights, coverage=0.0), 0)
    assert (hits.triangle // 2 == 0).all() and hits.distance == pytest.approx(3.0)
    assert power == pytest.approx(np.float32([[0.5, 1, 0.25]] * 64))
    up_is_seen = sent_down(layers(two_lamps(), coverage=0.0), 0)[1]
    assert (up_is_seen == 1).all()
    seen = np.array([True, True, False])
    hidden = layers(two_lamps(), coverage=0.0, scatters=seen, casts_shadow=seen)
    hits, power = sent_down(hidden, 0)
    assert (hits.triangle // 2 == 0).all() and power == pytest.approx(np.float32([[0.5, 1, 0.25]] * 64))


def test_what_photons_do_not_meet_may_cast_shadows():
    """A square that diffuse rays do not see keeps the light away if its source is blocked by it."""
    unseen = {"scatters": np.array([True, True, False])}
    hits, power = sent_down(layers(two_lamps(), **unseen), 0)
    assert (hits.triangle // 2 == 1).all() and (power == 0).all()
    lights = two_lamps(None, np.array([[1, 1, 0], [1, 1, 1]], bool))
    hits, power = sent_down(layers(lights, **unseen), 0)
    assert (hits.triangle // 2 == 1).all() and (power == 1).all()
    hits, power = sent_down(layers(two_lamps(), scatters=np.array([False, True, True])), 0)  # behind what is met
    assert (hits.triangle // 2 == 2).all() and (power == 1).all()
    assert (sent_down(layers(lights, **unseen), 1)[1] == 0).all()


def test_light_falls_off_by_its_way():
    """Of lamps with a fall-off of their own alone; what misses all surfaces keeps its power."""
    lights = two_lamps(None, None, distance_power=np.int32([0, 1]), smoothing=np.float32([0, 0]))
    scene = layers(lights, emission=(0.5, 0, 0))
    linking = LightLinking.of(scene, light_sources(scene, REGION))
    assert linking.falls_off.tolist() == [-1, 1, -1]
    assert (sent_down(scene, 0)[1] == 1).all() and sent_down(scene, 1)[1] == pytest.approx(1.0)
    lowest = dict.fromkeys(("scatters", "casts_shadow"), np.array([True, False, False]))
    lower = layers(lights, emission=(0.5, 0, 0), **lowest)
    nothing = layers(lights, emission=(0.5, 0, 0), **dict.fromkeys(lowest, np.zeros(3, bool)))
    for source in (0, 1):
        hits, power = sent_down(nothing, source)
        assert (hits.triangle < 0).all() and (power == 1).all()
    assert sent_down(lower, 1)[1] == pytest.approx(3.0) and (sent_down(lower, 2)[1] == 1).all()
    smooth = two_lamps(None, None, smoothing=np.float32([7, 0]))
    lower = layers(smooth, **lowest)
    assert sent_down(lower, 0)[1] == pytest.approx(9 / 16, rel=1e-4) and (sent_down(lower, 1)[1] == 1).all()
    assert LightLinking.of(lower, light_sources(lower, REGION)).falls_off.tolist() == [0, -1]
