"""Direct light by single candidates and shadow rays against their formulas, as plain Python."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from photon_bake.addon.core.sampling.path_numbers import path_key, two_numbers
from photon_bake.addon.core.sampling.sobol import fixed_points
from photon_bake.addon.core.sampling.warps import sample_cosine_hemisphere
from photon_bake.addon.emitters import Sphere, light_sources
from photon_bake.addon.emitters.lamps import sample_lamp
from photon_bake.addon.emitters.mesh import sample_mesh
from photon_bake.addon.emitters.world import sample_world, world_seen, world_towards
from photon_bake.addon.gather import DirectLight
from photon_bake.addon.gather.direct import direct_irradiance as passes
from photon_bake.addon.gather.direct import direct_light, sampling, visible
from photon_bake.addon.gather.direct.lamp_choice import cell_of, choose_lamp
from photon_bake.addon.scene import Channel, LightKind, Lights, RayKind, World
from photon_bake.addon.scene.scene import EmitterLinks
from photon_bake.addon.tracing import TransparencyTracer
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.core.scenes import lamp, merge, of_objects, plane, scene_of
from photon_bake.tests.core.values.lobe_formulas import f, triple, unit

IMAGE = np.random.default_rng(1).uniform(0.1, 1, (4, 8, 3)).astype(np.float32)
IMAGE[2:, 3:6] *= 30
KEY = path_key(3, 7)
DIFFUSE, GLOSSY = int(RayKind.DIFFUSE), int(RayKind.GLOSSY)
AT, UP = triple((0.2, 0.1, 0.3)), triple((0, 0, 1))
POINT, NORMAL = np.float32([AT]), np.float32([UP])
MESH_LIGHT = np.array([2.0, 1, 3])


def lamps(**columns):
    point = lamp(LightKind.POINT, (3, 2, 1), position=(0.3, 0.2, 2))
    square = lamp(LightKind.RECTANGLE, (1, 2, 5), position=(-0.5, 0.4, 1.5), size=(0.5, 0.4))
    return replace(Lights.join([point, square]), **columns)


def lit(lights=None, glow=True, world=None, links=None, **columns):
    """A floor, and a square over it that may glow, of an object each; direct light, its tracer and the scene."""
    ceiling = plane(0.5, 3.0)[0] * np.float32([1, -1, 1]), plane()[1]
    mesh = merge(plane(3.0), ceiling)
    scene = of_objects(scene_of(*mesh, albedo=[0.5] * 2, material=[0, 0, 1, 1], lights=lights), [0, 0, 1, 1])
    emission = Channel.constant(np.float32([0 * MESH_LIGHT, MESH_LIGHT if glow else 0 * MESH_LIGHT]))
    objects = replace(scene.objects, links=links, **columns)
    scene = replace(scene, materials=replace(scene.materials, emission=emission), objects=objects)
    scene = replace(scene, world=world or scene.world)
    tracer = TransparencyTracer(scene, EmbreeTracer(scene))
    return DirectLight(scene, tracer, light_sources(scene, Sphere(np.zeros(3, np.float32), 2.0))), tracer, scene


PICTURE = World(np.float32([1, 0.5, 2]), IMAGE, frozenset({RayKind.GLOSSY}))


@cache
def everything():
    """Lamps, a square that glows, and a picture around; made in the first test that asks, as mutants need it."""
    return lit(lamps(), world=PICTURE)


SCENES = {
    "everything": everything,
    "lamps": lambda: lit(lamps(), glow=False),
    "hidden lamps": lambda: lit(lamps(position=np.float32([(0.1, 0, 5), (0.3, 0.2, 2)])), glow=False),
    "sky": lambda: lit(lamps(), world=World.constant(0.7)),
    "picture": lambda: lit(None, glow=False, world=PICTURE),
}


# What is sampled


def test_sources_are_sampled_half_by_power_and_half_evenly():
    direct, _, scene = everything()
    sources = light_sources(scene, Sphere(np.zeros(3, np.float32), 2.0))
    power = np.array([source.importance for source in sources])
    chance = power / power.sum() / 2 + 1 / 8
    arrays = direct.arrays
    found = arrays.lamp_chance, arrays.mesh_chance, arrays.world_chance
    assert found == pytest.approx((chance[:2].sum(), chance[2], chance[3]), rel=1e-5)
    assert arrays.n_candidates == 4 and arrays.far == pytest.approx(2 * scene.diagonal)
    assert len(arrays.has_blockers) == 0 and arrays.blockers.shape == (0, 0)
    for of, expected, n in (
        (lit(lamps(), glow=False), (1, 0, 0), 4),
        (lit(lamps().where(np.array([0])), glow=False), (1, 0, 0), 1),
        (lit(None), (0, 1, 0), 4),
        (lit(None, glow=False, world=PICTURE), (0, 0, 1), 4),
        (lit(None, glow=False, world=World.constant(1.0)), (0, 0, 0), 0),
        (lit(None, glow=False), (0, 0, 0), 0),
    ):
        arrays = of[0].arrays
        assert (arrays.lamp_chance, arrays.mesh_chance, arrays.world_chance) == pytest.approx(expected)
        assert arrays.n_candidates == n


def test_what_keeps_which_light_away():
    """Of lamps, then what is not linked, meshes and the world, then groups of emissive objects."""
    shadow = np.array([True, True])
    blocked = lamps(blocked_by=np.array([[True, True], [True, False]]))
    links = EmitterLinks(np.int32([-1, 0]), np.array([[True, True]]), np.array([[False, True]]))
    for of, has, rows in (
        ((blocked, None), [False, True, False, False], [[1, 1], [1, 0], [1, 1], [1, 1]]),
        ((lamps(), links), [False] * 4 + [True], [[1, 1]] * 4 + [[0, 1]]),
        ((blocked, links), [False, True, False, False, True], [[1, 1], [1, 0], [1, 1], [1, 1], [0, 1]]),
    ):
        direct, _, _ = lit(of[0], links=of[1], casts_shadow=shadow)
        assert direct.arrays.has_blockers.tolist() == has
        assert direct.arrays.blockers.astype(int).tolist() == rows
    unshadowing = lit(blocked, casts_shadow=np.array([True, False]))[0]
    assert not unshadowing.arrays.has_blockers.any()


def candidate(of, place, path=5, object_=-1, kind=DIFFUSE, own=True, at=AT, normal=UP):
    direct, _, scene = of
    cell = cell_of(direct.arrays.grid, at)
    return sampling._candidate(
        direct.arrays, scene.arrays, cell, at, normal, object_, kind, own, f(place), KEY, path, 9
    )


@pytest.mark.parametrize("place", [0.02, 0.3, 0.5, 0.62, 0.7, 0.8, 0.97])
@pytest.mark.parametrize("path", range(5, 12))
def test_a_candidate_is_a_point_over_its_chance(place, path):
    """Of a lamp, of the mesh unless a cosine-weighted ray finds it more often, or of the world."""
    direct, _, scene = everything()
    arrays = direct.arrays
    by_lamps, by_mesh = float(arrays.lamp_chance), float(arrays.mesh_chance)
    u, v = two_numbers(KEY, path, 9)
    for own in (True, False):
        target, light, of = candidate(everything(), place, path, own=own)
        if place < by_lamps:
            k, chance = choose_lamp(arrays.grid, cell_of(arrays.grid, AT), f(place / by_lamps))
            point, given = sample_lamp(arrays.lamps, k, AT, UP, u, v, arrays.far)
            assert of == k and target == point
            assert light == pytest.approx(np.float64(given) / (chance * by_lamps), rel=1e-4)
            continue
        if place < by_lamps + by_mesh:
            w, _ = two_numbers(KEY, path, 10)
            point, way, given, density, _ = sample_mesh(scene.arrays, arrays.mesh, AT, w, u, v)
            chance = by_mesh
            assert of == 2
        else:
            way, radiance, density = sample_world(arrays.world, u, v)
            chance, given = float(arrays.world_chance), np.float64(radiance) / density
            assert (radiance, density) == world_towards(arrays.world, way)
            point = np.float64(AT) + float(arrays.far) * np.float64(way)
            assert of == 3
            hidden = candidate(everything(), place, path, kind=GLOSSY)[1]
            assert hidden == (0, 0, 0)
        assert target == pytest.approx(point, rel=1e-5)
        cos = way[2]
        dark = cos <= 0 or (own and cos / np.pi > chance * density)
        assert light == pytest.approx([0] * 3 if dark else np.float64(given) * cos / chance, rel=1e-4)


def test_candidates_are_of_what_there_is():
    for of, expected in ((lit(lamps(), glow=False), 0), (lit(None), 2 - 2), (lit(None, glow=False, world=PICTURE), 1)):
        n = len(of[2].lights)
        for place in (0.01, 0.5, 0.9, float(np.float32(1 - 2**-24))):
            _, _, found = candidate(of, place)
            assert (found < n) if expected == 0 and n else found == n + expected
    no_world = lit(lamps())
    assert candidate(no_world, 1 - 2**-24)[2] == 2
    no_mesh = lit(lamps(), glow=False, world=PICTURE)
    assert candidate(no_mesh, 0.999)[2] == 3


def test_numbers_go_to_lamps_by_their_chances():
    of = direct, _, _ = SCENES["lamps"]()
    found = set()
    for place in np.linspace(0.02, 0.98, 9):
        k, _ = choose_lamp(direct.arrays.grid, cell_of(direct.arrays.grid, AT), f(place))
        assert candidate(of, place)[2] == k
        found.add(int(k))
    assert found == {0, 1}


def test_candidates_of_lamps_and_meshes_that_light_some_objects_alone():
    linked = lit(lamps(illuminates=np.array([[True, False], [True, False]])), glow=False)
    assert candidate(linked, 0.3, object_=1)[1] == (0, 0, 0) != candidate(linked, 0.3, object_=0)[1]
    hidden = lit(lamps(seen_in_gloss=np.array([False, False])), glow=False)
    assert candidate(hidden, 0.3, kind=GLOSSY)[1] == (0, 0, 0) != candidate(hidden, 0.3)[1]
    linked_to_all = lit(lamps(illuminates=np.array([[False, True], [False, True]])), glow=False)[0]
    assert linked_to_all.mean_irradiance(POINT, NORMAL, None, 1, KEY).max() > 0
    three = Lights.join([lamps(), lamp(LightKind.POINT, 1.0, position=(0, 1, 2))])
    lit_up = np.array([[True, True], [True, False]])
    links = EmitterLinks(np.int32([-1, 1]), lit_up, np.array([[True, True], [False, True]]))
    for group, has in ((links, True), (replace(links, blocked_by=np.ones((2, 2), bool)), False)):
        of = lit(three, links=group)
        direct, _, scene = of
        _, light, found = candidate(of, 0.99, object_=0)
        assert found == (6 if has else 3) and light[0] > 0
        assert candidate(of, 0.99, object_=1)[1] == (0, 0, 0)
        assert sampling.has_own_blockers(direct.arrays, scene.arrays, 1) == has
        assert not sampling.has_own_blockers(direct.arrays, scene.arrays, 0)
        close = triple((0.1, 0.1, 2.9))  # where rays find the mesh more often, but for what rays would end on
        assert (candidate(of, 0.99, object_=0, at=close)[1] != (0, 0, 0)) == has
    assert not sampling.has_own_blockers(everything()[0].arrays, everything()[2].arrays, 1)


@pytest.mark.parametrize("name", ["everything", "lamps"])
def test_one_candidate_is_kept_by_what_it_gives(name):
    """Σw/M over its own weight; the choice goes on with what is left of it."""
    direct, _, scene = SCENES[name]()
    kept = set()
    for path in range(12):
        start, choice = two_numbers(KEY, path, 4)
        total, best = 0.0, None
        for j in range(4):
            _, tried, _ = at = sampling._candidate(
                *(direct.arrays, scene.arrays, cell_of(direct.arrays.grid, AT), AT, UP, -1, DIFFUSE, True),
                *(f((j + start) / 4), KEY, path, 5 + 2 * j),
            )
            weight = np.mean(np.abs(tried))
            if weight > 0:
                total += weight
                share = weight / total
                if choice < share:
                    best, choice, own, number = at, choice / share, weight, j
                else:
                    choice = (choice - share) / (1 - share)
        found = sampling.sample_emitters(direct.arrays, scene.arrays, AT, UP, -1, DIFFUSE, True, KEY, path, 4)
        if best is None:
            assert not found[3] and found[1] == (0, 0, 0) and found[2] == 2
            continue
        kept.add(number)
        assert found[3] and found[0] == best[0] and found[2] == best[2]
        assert found[1] == pytest.approx(np.float64(best[1]) * total / (4 * own), rel=1e-3)
    assert len(kept) > 1
    below = sampling.sample_emitters(direct.arrays, scene.arrays, AT, triple((0, 0, -1)), -1, DIFFUSE, True, KEY, 1, 4)
    assert name == "everything" or (not below[3] and below[:3] == (AT, (0, 0, 0), 2))


def test_numbers_next_to_one_are_no_trouble(monkeypatch):
    below_one = f(1 - 2**-24)
    monkeypatch.setattr(sampling, "two_numbers", lambda *_: (below_one, below_one))
    for name in ("everything", "lamps", "picture"):
        direct, _, scene = SCENES[name]()
        found = sampling.sample_emitters(direct.arrays, scene.arrays, AT, UP, -1, DIFFUSE, True, KEY, 1, 0)
        assert np.isfinite(found[1]).all()
        assert direct.arrays.world_chance > 0 or candidate((direct, None, scene), below_one)[2] == 1


def test_numbers_that_direct_light_uses_up():
    assert sampling.N_PAIRS == 9 and visible.N_PAIRS_OF_LIGHT == 10 and sampling.MAX_CANDIDATES == 4
    assert direct_light.MAX_CANDIDATES == 4 and passes.N_SAMPLES == 64


def test_light_that_lamps_take_away_is_sampled_too():
    dark = lamps(emission=-lamps().emission)
    direct, _, scene = lit(dark, glow=False)
    _, light, _, found = sampling.sample_emitters(direct.arrays, scene.arrays, AT, UP, -1, DIFFUSE, True, KEY, 3, 0)
    assert found and max(light) < 0


# What is left to rays


def met(of, triangle, direction, distance=2.0, normal=UP, object_=-1):
    direct, _, scene = of
    return sampling.met_radiance(
        direct.arrays, scene.arrays, triangle, f(distance), f(0.3), f(0.3), direction, normal, object_
    )


def test_rays_have_what_they_find_more_often():
    arrays, n_own = everything()[0].arrays, 0
    for direction in np.float32([*sample_cosine_hemisphere(fixed_points(32)), unit(0.9, 0, 0.1), unit(0.1, 0.2, 0.9)]):
        way = triple(direction)
        own = way[2] / np.pi > float(arrays.world_chance) * float(world_towards(arrays.world, way)[1])
        n_own += own
        assert met(everything(), -1, way) == pytest.approx(world_seen(arrays.world, way, DIFFUSE) if own else [0] * 3)
    assert 3 < n_own < 31
    density = arrays.mesh.density
    for triangle in (2, 3):
        for distance, way in (
            (0.5, unit(0.1, 0.2, 0.9)),
            (3.0, unit(0.1, 0.2, 0.9)),
            (1.2, unit(0.9, 0, 0.3)),
            (1.0, UP),
        ):
            of_mesh = float(arrays.mesh_chance) * density[triangle] * distance**2 / way[2]
            own = way[2] / np.pi > of_mesh
            expected = MESH_LIGHT if own else [0] * 3
            assert met(everything(), triangle, way, distance) == pytest.approx(expected)
    assert met(everything(), 2, UP, 0.3) != (0, 0, 0) == met(everything(), 2, UP, 30.0)
    assert met(everything(), 0, unit(0.1, 0.2, 0.9), 0.1) == (0, 0, 0)
    assert met(lit(lamps(), glow=False), 2, UP, 0.1) == (0, 0, 0)
    constant = lit(lamps(), world=World.constant(0.7))
    assert met(constant, -1, unit(0.9, 0, 0.1)) == pytest.approx([0.7] * 3)
    assert sampling.unsampled_sky(constant[0].arrays, DIFFUSE) == pytest.approx([0.7] * 3)
    assert sampling.unsampled_sky(everything()[0].arrays, DIFFUSE) == (0, 0, 0)
    hidden = lit(lamps(), world=replace(World.constant(0.7), hidden_from=frozenset({RayKind.DIFFUSE})))
    assert sampling.unsampled_sky(hidden[0].arrays, DIFFUSE) == (0, 0, 0)
    assert sampling.unsampled_sky(hidden[0].arrays, GLOSSY) == pytest.approx([0.7] * 3)


def test_rays_find_no_light_of_what_does_not_light_their_object():
    links = EmitterLinks(np.int32([-1, 0]), np.array([[True, False]]), np.array([[True, True]]))
    of = lit(lamps(), links=links)
    assert met(of, 2, UP, 0.3, object_=0) == pytest.approx(MESH_LIGHT) and met(of, 2, UP, 0.3, object_=1) == (0, 0, 0)
    apart = lit(lamps(), links=replace(links, blocked_by=np.array([[False, True]])))
    assert met(apart, 2, UP, 0.3, object_=0) == (0, 0, 0)
