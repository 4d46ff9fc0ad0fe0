"""Live light: what it is where the answer is known, what edits make of it, and its thread."""

from time import perf_counter, sleep

import numpy as np
import pytest
from photon_bake.addon.pipeline.live import LampsChanged, Live, live_surfaces
from photon_bake.addon.scene import LightKind
from photon_bake.addon.settings.live import LiveSettings
from photon_bake.tests.core.scenes import box, lamp, of_objects, plane, scene_of

SMALL = {"n_vertices": 600, "n_elements": 500, "n_links": 64, "n_direct": 4, "n_threads": 1}


def live_of(scene, **settings):
    chosen = LiveSettings(**SMALL | settings)
    return Live(scene, live_surfaces(scene, chosen), chosen)


def converged(live):
    for _ in range(1000):
        if not live.step():
            return live.light
    raise AssertionError("it does not converge")


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


def test_an_edit_of_lamps_equals_a_fresh_start():
    live = live_of(furnace())
    converged(live)
    moved = lamp(LightKind.POINT, 2.0, position=(0.5, 0.2, 0.1))
    live.edit(LampsChanged(lamp(LightKind.POINT, 9.0)), LampsChanged(moved))
    edited, fresh = converged(live), converged(live_of(scene_of_lamp(moved)))
    assert edited.version > 1 and np.array_equal(edited.direct, fresh.direct)


def scene_of_lamp(lights):
    return of_objects(scene_of(*box(), albedo=0.5, lights=lights), np.zeros(12))


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
