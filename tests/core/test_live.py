"""Live light: what it is where the answer is known, what edits make of it, and its thread."""

from dataclasses import replace
from time import perf_counter, sleep

import numpy as np
import pytest
from photon_bake.addon.core.errors import BakeError
from photon_bake.addon.pipeline.bake import bake
from photon_bake.addon.pipeline.live import (
    LampsChanged,
    Live,
    LiveSurfaces,
    MaterialsChanged,
    ObjectMoved,
    WorldChanged,
    live_surfaces,
)
from photon_bake.addon.pipeline.live.transport.links import KEPT, STALE
from photon_bake.addon.scene import LightKind, Materials, World
from photon_bake.addon.settings.bake import BakeSettings
from photon_bake.addon.settings.live import LiveSettings
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.addon.tracing.embree_pair import PairTracer
from photon_bake.tests.core.live_rooms import MOVED, PAINTED, SMALL, converged, elsewhere, live_of, room, turned
from photon_bake.tests.core.scenes import ball, box, lamp, of_objects, plane, scene_of


def furnace(albedo=0.5):
    """A closed box of 24 m² with a lamp of 24 W in it."""
    scene = scene_of(*box(), albedo=albedo, lights=lamp(LightKind.POINT, 24 / (4 * np.pi), position=(0, 0, 0)))
    return of_objects(scene, np.zeros(12))


def test_surfaces_are_the_scenes_refined_without_gaps():
    scene = furnace()
    surfaces = live_surfaces(scene, LiveSettings(**SMALL))
    (mesh,) = surfaces.meshes
    assert 300 < len(surfaces) == len(mesh.position) <= SMALL["n_vertices"]
    corners = mesh.position[mesh.triangles]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.linalg.norm(cross, axis=1).sum() / 2 == pytest.approx(24, rel=1e-5)
    assert (cross * mesh.normal[mesh.triangles[:, 0]]).sum(axis=1).min() > 0  # as the scene's triangles wind
    # Within each wall every edge has two triangles, but for the wall's own border
    ends = np.sort(np.stack([mesh.triangles, mesh.triangles[:, [1, 2, 0]]], axis=2).reshape(-1, 2), axis=1)
    edges, count = np.unique(ends, axis=0, return_counts=True)
    on_border = (np.abs(mesh.position[edges]).min(axis=1) > 1 - 1e-6).sum(axis=1) >= 2
    assert np.array_equal(count == 1, on_border) and count.max() == 2


def test_direct_light_of_a_lamp():
    """A lamp of I W/sr at height h over a plane gives E = I cos³θ / h² where it shines at the angle θ."""
    scene = of_objects(scene_of(*plane(), lights=lamp(LightKind.POINT, 3.0, position=(0, 0, 2))), [0, 0])
    light = converged(live_of(scene))
    (mesh,) = light.surfaces.meshes
    cosine = 2 / np.linalg.norm(mesh.position - (0, 0, 2), axis=1)
    assert light.direct[:, 0] * np.pi == pytest.approx(3 * cosine**3 / 4, rel=0.02)


def of_vertices(light):
    """Area of the surface around each vertex, m², for means over surfaces."""
    areas = np.zeros(len(light.direct))
    for mesh in light.surfaces.meshes:
        corners = mesh.position[mesh.triangles].astype(np.float64)
        area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
        areas[mesh.vertices] += np.bincount(mesh.triangles.ravel(), np.repeat(area / 3, 3), len(mesh.position))
    return areas


def mean_of(values, light):
    return np.average(values.mean(axis=1), weights=of_vertices(light)) * np.pi


@pytest.mark.parametrize("albedo", [0.5, 0.8])
def test_white_furnace(albedo):
    """In a closed box of 24 m² a lamp of 24 W gives a mean irradiance of 1/(1−ρ), of which ρ/(1−ρ) is indirect."""
    light = converged(live_of(furnace(albedo)))
    # Within what light curves over the triangles between vertices
    assert mean_of(light.indirect, light) == pytest.approx(albedo / (1 - albedo), rel=0.025)
    assert mean_of(light.direct, light) == pytest.approx(1, rel=0.03)
    assert 0 < light.error < 0.05


@pytest.mark.parametrize("albedo", [0.5, 0.8])
def test_furnace_of_glowing_walls_is_even(albedo):
    """Walls of radiance L make E/π = L/(1−ρ) everywhere, Lρ/(1−ρ) of it indirect."""
    scene = of_objects(scene_of(*box(), albedo=albedo, emission=1.0), np.zeros(12))
    light = converged(live_of(scene, n_direct=64))
    expected = albedo / (1 - albedo)
    assert light.indirect.mean() == pytest.approx(expected, rel=0.01)
    assert np.abs(light.indirect / expected - 1).max() < 0.15
    assert light.direct.mean() == pytest.approx(1, rel=0.01)


def test_first_light_has_all_bounces():
    """Five bounces and the tail of a geometric series: 1/(1−ρ) from the first step on."""
    live = live_of(furnace(0.8))
    live.step()
    assert mean_of(live.light.indirect, live.light) == pytest.approx(4, rel=0.03) and not live.light.converged


def test_it_agrees_with_a_bake():
    light = converged(live_of(room(), n_vertices=900, n_elements=4000, n_links=256))
    some = np.arange(0, len(light.direct), 3)
    settings = BakeSettings(interpolate=False, n_gather_rays=512, add_direct=True)
    baked = bake(room(), light.surfaces.receivers().where(some), settings, EmbreeTracer(room()))
    for name in ("indirect", "direct"):
        truth = baked.passes[name] / np.pi
        off = getattr(light, name)[some] - truth
        assert off.mean() / truth.mean() == pytest.approx(0, abs=0.01), name
        assert np.sqrt(np.mean(off**2)) / truth.mean() < 0.06, name


def test_light_does_not_depend_on_threads():
    one, two = (converged(live_of(room(), n_threads=n, n_links=32)) for n in (1, 2))
    assert np.array_equal(one.indirect, two.indirect) and np.array_equal(one.direct, two.direct)


@pytest.mark.parametrize(
    ("edit", "fresh"),
    [
        (LampsChanged(MOVED), room(MOVED)),
        (WorldChanged(World.constant(0.5)), room(world=0.5)),
        (MaterialsChanged(Materials.matte_of(PAINTED)), room(colors=PAINTED)),
    ],
    ids=["lamps", "world", "materials"],
)
def test_an_edit_equals_a_fresh_start(edit, fresh):
    live = live_of(room())
    before = converged(live)
    live.edit(LampsChanged(lamp(LightKind.POINT, 9.0)))
    live.step()
    live.edit(LampsChanged(room().lights), edit)
    edited, fresh = converged(live), converged(live_of(fresh))
    assert edited.version > before.version
    assert np.array_equal(edited.direct, fresh.direct)
    assert edited.indirect == pytest.approx(fresh.indirect, rel=1e-3, abs=1e-3 * fresh.indirect.mean())


def test_an_edit_leaves_what_it_does_not_touch_as_well_known_as_it_was():
    """Direct light takes few estimates a step, but paint does not make it noisy again."""
    live = live_of(room(), n_direct=16)
    before = converged(live)
    live.edit(MaterialsChanged(Materials.matte_of(PAINTED)))
    live.step()
    assert np.array_equal(live.light.direct, before.direct) and not np.allclose(live.light.indirect, before.indirect)


def test_the_thread_converges_follows_edits_and_stops():
    live = live_of(furnace())
    live.start()
    wait_for(lambda: live.light and live.light.converged)
    version, came = live.light.version, perf_counter()
    live.edit(LampsChanged(lamp(LightKind.POINT, 2.0, position=(0, 0, 0.5))))
    wait_for(lambda: live.light.converged and live.light.version > version)
    assert live.light.since >= came and live.failure is None
    live.stop()
    version = live.light.version
    live.edit(LampsChanged(lamp(LightKind.POINT, 1.0)))
    sleep(0.05)
    assert live.light.version == version


def wait_for(true, seconds=60):
    end = perf_counter() + seconds
    while not true():
        assert perf_counter() < end, "nothing came of it"
        sleep(0.005)


def test_a_moved_object_equals_a_fresh_start():
    """Also where it moved over other places before, whether all was found there or not."""
    to, settings = turned(30, (-0.5, 0.3, 0.4), 0.8), LiveSettings(**SMALL | {"n_links": 256, "n_elements": 1000})
    live = Live(room(), live_surfaces(room(), settings), settings)
    walls, block = converged(live).surfaces.meshes
    live.edit(ObjectMoved(1, turned(0, (-0.3, 0, 0.2))))
    converged(live)
    live.edit(ObjectMoved(1, turned(0, (0, 0.4, 0))))
    live.step()
    live.edit(ObjectMoved(1, to))
    live.step()
    first, moved = live.light, converged(live)
    position, normal = block.position @ to[:3, :3].T + to[:3, 3], block.normal @ np.linalg.inv(to[:3, :3]) * 0.8
    block = replace(block, position=position.astype(np.float32), normal=normal.astype(np.float32))
    fresh = converged(Live(elsewhere(room(), 1, to), LiveSurfaces((walls, block)), settings))
    assert np.mean(np.abs(moved.direct - fresh.direct)) < 0.01 * fresh.direct.mean()
    off = moved.indirect - fresh.indirect
    assert np.sqrt(np.mean(off**2)) < 0.04 * fresh.indirect.mean()
    assert abs(off.mean()) < 0.005 * fresh.indirect.mean()
    of_first = first.indirect - fresh.indirect
    assert np.sqrt(np.mean(of_first**2)) < 0.2 * fresh.indirect.mean()
    assert moved.surfaces is first.surfaces


@pytest.mark.parametrize(("n_vertices", "all_find"), [(1500, True), (300, False)])
def test_of_more_vertices_each_has_fewer_links_and_of_too_many_some_find_light_for_all(n_vertices, all_find):
    scene = scene_of(*ball(1.0, n=24)[:2], lights=lamp(LightKind.POINT, 3.0, position=(0, 0, 3)))
    live = live_of(of_objects(scene, np.zeros(scene.n_triangles)), n_vertices=n_vertices)
    light = converged(live)
    (mesh,) = light.surfaces.meshes
    n, links = len(mesh.position), live._solver._linking.vertices
    assert 1500 < n < 7500
    assert len(links.end) == n if all_find else len(links.end) <= 1500
    assert links.n_most == max(SMALL["n_links"] * n_vertices // len(links.end), 16)
    way = np.array([0, 0, 3]) - mesh.position
    distance = np.linalg.norm(way, axis=1)
    expected = 3 * np.maximum((mesh.normal * way).sum(axis=1), 0) / distance**3
    assert np.sqrt(np.mean((light.direct[:, 0] * np.pi - expected) ** 2)) < 0.1 * expected.max()


def test_links_that_an_edit_does_not_cross_stay():
    """Those that it does are found exactly: they and no others end elsewhere."""
    live = live_of(room(), n_links=64)
    converged(live)
    links = live._solver._linking.vertices
    before = links.arrays.end.copy()
    live.edit(ObjectMoved(1, turned(20, (-0.2, 0.1, 0.3))))
    live.step()  # the first links of each row are marked
    live.step()  # and the rest
    stale = links.arrays.state != KEPT
    assert 0 < stale[live.light.surfaces.object_of_vertex == 0].mean() < 0.5
    converged(live)
    assert np.array_equal(links.end[~stale], before[~stale])
    after = links.end.copy()
    links.arrays.state[:], links.arrays.split[:], links.n_renewed = STALE, True, 0
    live._solver._planned = live._solver.converged = False
    converged(live)
    assert np.mean(links.end != after) < 1e-4  # where a ray meets an edge, either triangle may be the first


def test_pair_tracer_sees_what_a_tracer_of_all_sees():
    scene, to = room(), turned(30, (-0.5, 0.3, 0.4))
    moved = elsewhere(scene, 1, to)
    pair = PairTracer(scene, np.array([False, True]))
    pair.update(moved)
    random = np.random.default_rng(1)
    origins = random.uniform(-0.9, 0.9, (2000, 3)).astype(np.float32)
    directions = random.normal(size=(2000, 3))
    directions = (directions / np.linalg.norm(directions, axis=1, keepdims=True)).astype(np.float32)
    one, other = (tracer.closest_hit(origins, directions) for tracer in (pair, EmbreeTracer(moved)))
    assert np.array_equal(one.triangle, other.triangle) and (one.triangle >= 12).any()
    assert one.distance == pytest.approx(other.distance, rel=1e-5)
    assert np.array_equal(pair.occluded(origins, origins[::-1]), EmbreeTracer(moved).occluded(origins, origins[::-1]))


def test_too_little_memory_is_said_with_the_numbers():
    live = live_of(room(), memory=50, n_elements=20_000, n_element_links=1024)
    live.start()
    wait_for(lambda: live.failure)
    assert isinstance(live.failure, BakeError) and "MB at least, and may take 50" in str(live.failure)


def test_it_stops_within_50_ms():
    live = live_of(room(), n_vertices=20_000, n_links=1024)
    live.start()
    wait_for(lambda: live.light)
    for _ in range(5):
        sleep(0.1)
        start = perf_counter()
        live.stop()
        assert perf_counter() - start < 0.05
        live.start()
    live.stop()
