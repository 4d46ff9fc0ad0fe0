"""Photons where they meet surfaces, one by one and on all of their ways, as plain Python."""

from dataclasses import replace

import numpy as np
import pytest
from photon_bake.addon.bsdf.mixture import ALL_LOBES
from photon_bake.addon.bsdf.scatter import scatter
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.core.sampling.path_numbers import path_key, two_numbers
from photon_bake.addon.emitters import Sphere, light_sources
from photon_bake.addon.photons import FlightLog, bounces_left, trace_photons, tracing
from photon_bake.addon.photons.emission import Pass
from photon_bake.addon.photons.front import Photon, new_front, put_photon
from photon_bake.addon.photons.photons import PathKind
from photon_bake.addon.photons.region_directed import directed
from photon_bake.addon.photons.store import PhotonStore
from photon_bake.addon.scene import LightKind, Lights, Materials, RayKind, World
from photon_bake.addon.scene.hit import hit_at
from photon_bake.addon.tracing import TransparencyTracer
from photon_bake.addon.tracing.embree import EmbreeTracer, new_ray
from photon_bake.tests.core.bsdf_points import closures
from photon_bake.tests.core.scenes import ball, box, lamp, merge, of_objects, plane, scene_of
from photon_bake.tests.core.values.lobe_formulas import f, triple, unit
from photon_bake.tests.core.values.mixed_closures import CLEAR, METAL, THROUGH, WHITE_FLOOR

INTO = unit(0.4, -0.3, -0.7)
REGION = Sphere(np.float32([2.0, 1, 8]), 0.5)
DIFFUSE, GLOSSY, TRANSMITTED, SHADOW = (
    int(k) for k in (RayKind.DIFFUSE, RayKind.GLOSSY, RayKind.TRANSMITTED, RayKind.SHADOW)
)


def photon(**values):
    given = {"origin": triple((0, 0, 1)), "direction": INTO, "power": triple((0.5, 0.4, 0.3)), "path_density": f(0.7)}
    given |= {"gained": f(1), "specular": True, "came_from": -1, "path": 5, "source": 0, "kind": np.uint8(DIFFUSE)}
    return Photon(**given | values)


# Where they meet surfaces


def lit_floor(*several, lights=None, region=None, max_bounces=8, on_gloss=False, world=None, **seen):
    """A floor of some closures with a lamp, as `scattered` takes it."""
    made = Materials.of(1, closures=closures(*several))
    lights = lights or lamp(LightKind.POINT, 2.0, position=(0, 0, 3))
    scene = replace(of_objects(scene_of(*plane(4.0), lights=lights), [0, 0]), materials=made)
    scene = replace(scene, objects=replace(scene.objects, **seen), world=world or scene.world)
    tracer = TransparencyTracer(scene, EmbreeTracer(scene))
    sources = light_sources(scene, Sphere(np.zeros(3, np.float32), 2.0))
    rules = tracing._rules(scene, sources, max_bounces, path_key(3, 2), region, on_gloss)
    return scene, tracer, sources, rules


def hit_of(scene, direction=INTO):
    return hit_at(scene.arrays, direction, np.int32(0), f(2), f(0.2), f(0.3))


@pytest.mark.parametrize("one", [WHITE_FLOOR, METAL, CLEAR])
@pytest.mark.parametrize("bounce", [0, 2])
def test_a_photon_is_scattered_or_absorbed(one, bounce):
    """By four pairs of numbers a bounce; roulette with the largest channel, by which the power is divided."""
    scene, tracer, _, rules = lit_floor(one)
    fates = set()
    for path in range(8):
        before = photon(path=path, specular=path % 2 == 0, gained=f(1.25))
        choice, u = two_numbers(rules.key, path, 4 * bounce)
        v, fate = two_numbers(rules.key, path, 4 * bounce + 1)
        on = scatter(scene.arrays, hit_of(scene), INTO, choice, u, v, ALL_LOBES, True, DIFFUSE)
        alive, after = tracing.scattered(tracer.arrays, new_ray(), rules, bounce, before, hit_of(scene))
        survival = min(max(on.weight), 1)
        fates.add(alive)
        assert alive == (on.alive and fate < survival)
        if not alive:
            assert after is before
            continue
        assert after.direction == on.direction and after.origin == on.origin
        expected = np.float64(before.power) * np.float64(on.weight) / survival
        assert after.power == pytest.approx(expected, rel=1e-5)
        assert after.path_density == pytest.approx(0.7 * survival, rel=1e-5) and after.gained == f(1.25)
        narrow = one is not WHITE_FLOOR
        assert after.specular == (narrow and (on.specular if bounce == 0 else path % 2 == 0))
        assert (after.came_from, after.path, after.source, after.kind) == (0, path, 0, DIFFUSE)
    assert True in fates and (False in fates or one is CLEAR)


def test_what_is_scattered_goes_on_as_seen_by_its_objects_and_sources():
    scene, tracer, _, rules = lit_floor({**METAL, "f0": 1, "weight": 1}, seen_in_gloss=np.array([False]))
    room = new_ray()

    def alive(rules, **of):
        return any(
            tracing.scattered(tracer.arrays, room, rules, 1, photon(path=k, **of), hit_of(scene))[0] for k in range(6)
        )

    assert alive(rules) and not alive(rules, came_from=0)
    assert rules.seen[GLOSSY].tolist() == [False] and rules.seen[DIFFUSE].tolist() == [True]
    hidden = replace(scene.lights, seen_in_gloss=np.array([False]))
    _, tracer, _, rules = lit_floor({**METAL, "f0": 1, "weight": 1}, lights=hidden)
    assert not rules.source_seen[GLOSSY, 0] and rules.source_seen[DIFFUSE, 0]
    assert not alive(rules) and alive(rules, came_from=0)


def test_broadly_scattered_photons_are_directed_to_the_region():
    white = {**WHITE_FLOOR, "weight": 1}
    scene, tracer, _, rules = lit_floor(white, region=REGION)
    _, _, _, plain = lit_floor(white)
    ratios = []
    for path in range(10):
        before = photon(path=path)
        choice, u = two_numbers(rules.key, path, 4 + 2)
        v, _ = two_numbers(rules.key, path, 4 + 3)
        _, undirected = tracing.scattered(tracer.arrays, new_ray(), plain, 1, before, hit_of(scene))
        alive, after = tracing.scattered(tracer.arrays, new_ray(), rules, 1, before, hit_of(scene))
        to, ratio = directed(
            rules.region, hit_of(scene).position, triple((0, 0, 1)), undirected.direction, choice, u, v
        )
        assert alive == (ratio > 0) and after.direction == to
        assert after.power == pytest.approx(np.multiply(undirected.power, ratio), rel=1e-5)
        assert after.gained == pytest.approx(ratio, rel=1e-6)
        ratios.append(float(ratio))
        _, gained = tracing.scattered(tracer.arrays, new_ray(), rules, 1, photon(path=path, gained=f(2)), hit_of(scene))
        assert gained.direction == undirected.direction
    assert min(ratios) < 0.1 < 1.5 < max(ratios)
    through = {**THROUGH, "weight": 1}
    scene, tracer, _, rules = lit_floor(through, region=Sphere(np.float32([2, 1, -8]), 0.5))
    below = [tracing.scattered(tracer.arrays, new_ray(), rules, 1, photon(path=k), hit_of(scene))[1] for k in range(8)]
    assert all(one.direction[2] < 0 for one in below) and max(one.gained for one in below) > 1


def test_lamplight_scatters_as_its_viewers_see_it():
    """Of what shadow rays see otherwise, the photon's way at its first surface is that of lamplight or none."""
    scene, tracer, _, rules = lit_floor({**WHITE_FLOOR, "weight": 1})
    rules = rules._replace(viewers=rules.viewers._replace(in_shadow=True))
    room = new_ray()

    def alive(bounce, kind, sampled=True):
        of = rules._replace(sampled_directly=np.array([sampled]))
        return tracing.scattered(tracer.arrays, room, of, bounce, photon(kind=np.uint8(kind)), hit_of(scene))[0]

    assert alive(0, SHADOW) and not alive(0, TRANSMITTED) and alive(1, TRANSMITTED) and alive(0, TRANSMITTED, False)


def test_photons_are_stored_where_surfaces_spread_light():
    """But for direct hits of what is sampled; caustics are on all surfaces."""
    floor = WHITE_FLOOR, METAL
    for several, bounce, specular, n in (
        (floor, 0, False, 0),
        (floor, 1, False, 4),
        ((METAL,), 1, False, 0),
        ((METAL,), 1, True, 4),
    ):
        _, tracer, _, rules = lit_floor(*several)
        front = new_front(4)
        for k in range(4):
            put_photon(front, k, photon(path=k, specular=specular))
        hits = tracing.HitArrays(np.zeros(4, np.int32), *np.float32([[2] * 4, [0.2] * 4, [0.3] * 4]))
        store = PhotonStore()
        args = tracer.arrays, new_ray(), rules, bounce, front, 4, hits, store.rows(4), 0
        _, stored = tracing.meet_surfaces(*args)
        assert stored == n
    _, _, _, rules = lit_floor(METAL, on_gloss=True)
    assert rules.keeps.all() and not lit_floor(METAL)[3].keeps.any() and lit_floor(THROUGH)[3].keeps.all()


def test_photons_that_miss_or_carry_nothing_end():
    _, tracer, _, rules = lit_floor({**WHITE_FLOOR, "weight": 1}, max_bounces=3)
    front, store = new_front(5), PhotonStore()
    for k in range(5):
        put_photon(front, k, photon(path=k, power=triple(0) if k == 1 else triple((0.5, 0.4, 0.3))))
    triangle = np.int32([-1, 0, 0, 1, 0])
    hits = tracing.HitArrays(triangle, *np.float32([[2] * 5, [0.2] * 5, [0.3] * 5]))
    args = tracer.arrays, new_ray(), rules
    n, stored = tracing.meet_surfaces(*args, 1, front, 4, hits, store.rows(5), 0)
    assert (n, stored) == (2, 2) and front.path[:2].tolist() == [2, 3]
    store.n = stored
    n, stored = tracing.meet_surfaces(*args, 2, front, 2, hits, store.rows(5), store.n)
    assert n == 0 and stored == 3  # the first misses, and at the last bounce none goes on
    assert rules.last_bounce.tolist() == [2]


# All of their ways


def traced(scene, n=60, max_bounces=4, **more):
    tracer = TransparencyTracer(scene, EmbreeTracer(scene))
    sources = light_sources(scene, Sphere(np.zeros(3, np.float32), 1.7))
    return sources, trace_photons(scene, tracer, sources, n, max_bounces, Workers(1), **more)


def test_grey_photons_carry_what_they_were_emitted_with():
    """In a closed box each bounce is survived with the albedo, and the power stays."""
    scene = scene_of(*box(), albedo=0.6, lights=lamp(LightKind.POINT, 1.0, position=(0.1, 0.2, 0.3)))
    _, photons = traced(scene)
    assert photons.power == pytest.approx(np.full((len(photons), 3), 4 * np.pi / 60), rel=1e-4)
    assert photons.path_density == pytest.approx(0.6 ** photons.bounce.astype(float), rel=1e-4)
    assert set(photons.bounce) == {1, 2, 3} and (photons.kind == PathKind.INDIRECT).all()
    assert len(set(photons.path)) == pytest.approx(36, abs=9) and photons.path.max() < 60
    again = traced(scene)[1]
    assert np.array_equal(again.position, photons.position)
    other = traced(scene, of=Pass.PILOTS)[1]
    assert len(other) != len(photons) or not np.array_equal(other.position, photons.position)
    assert len(traced(scene, max_bounces=1)[1]) == 0
    assert len(trace_photons(scene, None, [], 60, 4, Workers(1))) == 0


def test_photons_of_worlds_are_stored_where_they_hit():
    scene = replace(scene_of(*plane()), world=World.constant(0.5))
    sources, photons = traced(scene, n=40, max_bounces=1)
    assert len(photons) > 5 and (photons.kind == PathKind.DIRECT).all() and not sources[0].sampled_directly


def test_photons_through_pictures_start_at_the_pixels():
    lights = Lights.join(
        [lamp(LightKind.POINT, 1.0, position=(0.1, 0.2, 0.3)), lamp(LightKind.RECTANGLE, 1, size=(1, 1))]
    )
    scene = scene_of(*box(), albedo=0.9, lights=lights)
    _, photons = traced(scene, n=40, max_bounces=2, in_pictures=True)
    assert len(photons) > 20 and photons.path.max() < 6 * 9 + 7 * 7 + 1


def test_lamps_that_count_for_few_bounces():
    lights = Lights.join([lamp(LightKind.POINT, 1.0), lamp(LightKind.POINT, 1.0)])
    lights = replace(lights, max_bounces=np.int32([1, 4]), position=np.float32([(0, 0, 0.1), (0, 0.1, 0)]))
    scene = scene_of(*box(), albedo=0.9, lights=lights)
    sources, photons = traced(scene, n=40)
    of_first = photons.path < 20
    assert photons.bounce[of_first].max() == 1 and photons.bounce[~of_first].max() >= 2
    left = bounces_left(sources, 40, photons)
    assert np.array_equal(left, np.where(of_first, 1, 4) - photons.bounce)
    unlimited = replace(scene, lights=replace(lights, max_bounces=np.int32([1024, 1024])))
    assert bounces_left(light_sources(unlimited, REGION), 40, photons) is None


def test_photons_of_a_floor_fly_to_the_ceiling():
    floor, ceiling = plane(1.0), (plane(1.0, 2.0)[0] * np.float32([1, -1, 1]), plane()[1])
    lights = lamp(LightKind.SPOT, 1, position=(0, 0, 1), angle=0.5)
    scene = of_objects(scene_of(*merge(floor, ceiling), albedo=1.0, lights=lights), [0, 0, 1, 1])
    _, photons = traced(scene, n=40, max_bounces=2)
    assert (photons.triangle >= 2).all() and len(photons) > 5


def test_flights_are_taken_down_from_the_first_surface_on():
    scene = scene_of(*box(), albedo=1.0, lights=lamp(LightKind.POINT, 1.0, position=(0.1, 0.2, 0.3)))
    log = FlightLog(Sphere(np.zeros(3, np.float32), 9.0), True)
    _, photons = traced(scene, n=20, max_bounces=3, log=log)
    flights = log.flights()
    assert len(photons) == len(flights) == 40 and not flights.specular.any()
    assert np.abs(flights.origin).max(axis=1) == pytest.approx(1, abs=1e-3)
    ends = flights.origin + flights.length[:, None] * flights.direction
    assert ends == pytest.approx(photons.position, abs=1e-3) and flights.power == pytest.approx(photons.power)


def test_light_falls_off_on_its_first_way_alone():
    """By d of a lamp whose light is linear: on the walls of a ball around it of radius r r times as strong."""
    corners, triangles = ball(2.0, n=6)
    lights = lamp(LightKind.POINT, 1.0, position=(0, 0, 0), distance_power=1)
    _, photons = traced(scene_of(corners, triangles[:, ::-1], albedo=1.0, lights=lights), n=20, max_bounces=3)
    assert len(photons) == 40
    first, second = (photons.power[photons.bounce == k, 0] / (4 * np.pi / 20) for k in (1, 2))
    assert first == pytest.approx(second, rel=1e-4) and first == pytest.approx(np.full(20, 1.9), abs=0.11)


def test_a_single_photon_flies_on_as_one_of_many(monkeypatch):
    """However photons are cut into batches, down to one each."""
    scene = scene_of(*box(), albedo=1.0, lights=lamp(LightKind.POINT, 1.0, position=(0.1, 0.2, 0.3)))
    _, together = traced(scene, n=7)
    assert len(together) == 21
    for chunk in (1, 3):
        monkeypatch.setattr(tracing, "CHUNK", chunk)
        _, found = traced(scene, n=7)
        of = np.lexsort((found.bounce, found.path)), np.lexsort((together.bounce, together.path))
        assert np.array_equal(found.position[of[0]], together.position[of[1]])


def test_photons_of_glass_and_gloss_are_not_directed():
    for one in (CLEAR, METAL):
        _, tracer, _, rules = lit_floor(one, region=REGION)
        scene, _, _, plain = lit_floor(one)
        for path in range(6):
            at = photon(path=path), hit_of(scene)
            assert tracing.scattered(tracer.arrays, new_ray(), rules, 1, *at) == tracing.scattered(
                tracer.arrays, new_ray(), plain, 1, *at
            )
