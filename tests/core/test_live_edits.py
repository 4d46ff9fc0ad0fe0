"""Edits of live light one after the other, whenever they come: they leave a fresh start's light, and nothing more."""

import gc
import weakref
from dataclasses import replace

import numpy as np
import pytest
from photon_bake.addon.core.errors import Cancelled
from photon_bake.addon.pipeline.live import (
    LampsChanged,
    Live,
    LiveSurfaces,
    MaterialsChanged,
    ObjectMoved,
    ObjectReshaped,
    ObjectShown,
    SceneReplaced,
    WorldChanged,
    live_surfaces,
)
from photon_bake.addon.pipeline.live import solver as solver_module
from photon_bake.addon.pipeline.live.crew import Crew
from photon_bake.addon.scene import Channel, LightKind, Materials, World
from photon_bake.addon.settings.live import LiveSettings
from photon_bake.tests.core.live_rooms import COLORS, MOVED, PAINTED, SMALL, converged, elsewhere, live_of, room, turned
from photon_bake.tests.core.scenes import box, lamp, of_objects, scene_of


def painted(scene, factor):
    closures = scene.materials.closures
    weight = replace(closures.weight, value=(closures.weight.value * factor).astype(np.float32))
    return replace(scene.materials, closures=replace(closures, weight=weight))


def test_random_edits_with_halts_between_leave_the_light_of_a_fresh_start(monkeypatch):
    """A halt comes between any two chunks of work, as it does where an edit comes while the thread works."""
    random, first = np.random.default_rng(5), room(world=0.2)
    scene, transform = first, np.eye(4)
    live, run = live_of(scene, n_links=32), Crew.run

    def halted(crew, task, size, work):
        if not live._responding and random.random() < 0.1:
            raise Cancelled
        run(crew, task, min(size, 200), work)

    monkeypatch.setattr(Crew, "run", halted)
    for _ in range(40):
        kind = random.integers(4)
        if kind == 0:
            position = random.uniform(-0.8, 0.8, (1, 3)).astype(np.float32)
            scene = replace(scene, lights=replace(first.lights, position=position))
            live.edit(LampsChanged(scene.lights))
        elif kind == 1:
            scene = replace(scene, materials=painted(first, random.uniform(0.3, 1, (1, 3))))
            live.edit(MaterialsChanged(scene.materials))
        elif kind == 2:
            scene = replace(scene, world=World.constant(random.uniform(0, 0.5)))
            live.edit(WorldChanged(scene.world))
        else:
            transform = turned(random.uniform(0, 90), random.uniform((-0.4, -0.4, 0), 0.3))
            live.edit(ObjectMoved(1, transform))
        for _ in range(random.integers(4)):
            try:
                live.step()
            except Cancelled:
                break
    monkeypatch.setattr(Crew, "run", run)
    edited, afresh = converged(live), live_of(scene, n_links=32)
    afresh.edit(ObjectMoved(1, transform))
    fresh = converged(afresh)
    for one, other in ((edited.direct, fresh.direct), (edited.indirect, fresh.indirect)):
        assert np.sqrt(np.mean((one - other) ** 2)) < 1e-3 * other.mean()


def test_edits_that_a_halt_keeps_from_being_taken_in_come_again(monkeypatch):
    live, tracer_of, halts = live_of(room()), solver_module.tracer_of, []

    def halted(scene, progress):
        halts.append(scene)
        if len(halts) == 1:
            raise Cancelled
        return tracer_of(scene, progress)

    converged(live)
    monkeypatch.setattr(solver_module, "tracer_of", halted)
    glass = Materials.of(3, diffuse=Channel.constant(np.array(PAINTED)), coverage=Channel.constant(np.full(3, 0.5)))
    for edit in (MaterialsChanged(glass), SceneReplaced(room(), live_surfaces(room(), LiveSettings(**SMALL)))):
        halts.clear()
        live.edit(LampsChanged(MOVED))
        live.edit(edit)
        with pytest.raises(Cancelled):
            live.step()
        light = converged(live)
        assert len(halts) == 2 and light.since == live._came
    assert np.array_equal(light.direct, converged(live_of(room())).direct)


def test_the_first_light_after_an_edit_that_changes_nothing_is_what_it_was():
    """Though it is made of few links and estimates."""
    live = live_of(room(), n_links=256, n_direct=16)
    before = converged(live)
    for edit in (LampsChanged(room().lights), MaterialsChanged(painted(room(), 1.0))):
        live.edit(edit)
        live.step()
        assert np.array_equal(live.light.direct, before.direct) and not live.light.converged
        assert live.light.indirect == pytest.approx(before.indirect, rel=1e-3, abs=1e-4 * before.indirect.mean())


def test_what_is_replaced_is_let_go_at_once():
    """Also what the engine was started with: large arrays must not wait until Python looks for cycles."""
    gc.collect()
    gc.disable()
    try:
        scenes = [room(), elsewhere(room(), 1, turned(20)), room(MOVED)]
        live = live_of(scenes[0])
        live.step()
        for scene in scenes[1:]:
            live.edit(ObjectMoved(1, turned(30)), LampsChanged(lamp(LightKind.POINT, 2.0)))
            live.step()
            live.edit(SceneReplaced(scene, live_surfaces(scene, LiveSettings(**SMALL))))
            live.step()
        linking, old = weakref.ref(live._solver._linking.vertices), [weakref.ref(scene) for scene in scenes]
        del scenes, scene
        assert [ref() is None for ref in old] == [True, True, False]
        del live
        assert old[2]() is None and linking() is None
    finally:
        gc.enable()


def tapered(scene, number, by):
    """A scene in which an object is narrower the higher up, and its triangles' corners and normals."""
    k = scene.object_of_triangle == number
    used, vertices = np.unique(scene.triangles[k]), scene.vertices.copy()
    low, high = vertices[used, 2].min(), vertices[used, 2].max()
    middle = vertices[used, :2].mean(axis=0)
    narrower = 1 - by * (vertices[used, 2:] - low) / (high - low)
    vertices[used, :2] = middle + (vertices[used, :2] - middle) * narrower
    corners = vertices[scene.triangles[k]]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    flat = (cross / np.linalg.norm(cross, axis=1, keepdims=True)).astype(np.float32)
    normals = scene.corner_normals.copy()
    normals[k] = flat[:, None]
    return replace(scene, vertices=vertices, corner_normals=normals), corners, normals[k]


MORE = {"n_links": 256, "n_elements": 1000}


def assert_alike(edited, fresh, rows=slice(None)):
    """The same direct light, and the same indirect light within its noise."""
    (direct, indirect), (other, truth) = ((one.direct[rows], one.indirect[rows]) for one in (edited, fresh))
    assert np.mean(np.abs(direct - other)) < 0.01 * other.mean()
    assert np.sqrt(np.mean((indirect - truth) ** 2)) < 0.04 * truth.mean()
    assert abs((indirect - truth).mean()) < 0.007 * truth.mean()


def test_a_reshaped_object_equals_a_fresh_start():
    live, settings = live_of(room(), **MORE), LiveSettings(**SMALL | MORE)
    surfaces = converged(live).surfaces
    scene, corners, normals = tapered(room(), 1, 0.6)
    other = surfaces.reshaped(1, corners, normals)
    height = other.meshes[1].position[:, 2]
    assert np.array_equal(height, surfaces.meshes[1].position[:, 2]) and other.meshes[0] is surfaces.meshes[0]
    live.edit(
        ObjectMoved(1, turned(40)), ObjectReshaped(1, corners, normals, np.zeros((0, 3, 3, 3), np.float32), other)
    )
    live.step()
    assert live.light.surfaces is other
    assert_alike(converged(live), converged(Live(scene, other, settings)))
    to = turned(30, (-0.4, 0.2, 0.3))
    live.edit(ObjectMoved(1, to))
    moved = elsewhere(scene, 1, to)
    k = moved.object_of_triangle == 1
    there = other.reshaped(1, moved.vertices[moved.triangles[k]], moved.corner_normals[k])
    assert_alike(converged(live), converged(Live(moved, there, settings)))


def test_an_object_that_is_hidden_and_shown_again_equals_a_fresh_start():
    live, settings = live_of(room(), **MORE), LiveSettings(**SMALL | MORE)
    before = converged(live)
    walls, _ = before.surfaces.meshes
    live.edit(ObjectShown(1, False))
    live.step()
    assert np.abs(live.light.indirect - before.indirect)[walls.vertices].max() > 0
    without = of_objects(
        scene_of(*box(), albedo=COLORS, lights=room().lights, material=[0, 1, 2, 0, 0, 0] * 2), [0] * 12
    )
    assert_alike(converged(live), converged(Live(without, LiveSurfaces((walls,)), settings)), walls.vertices)
    live.edit(ObjectShown(1, True))
    after = converged(live)
    assert np.array_equal(after.direct, before.direct)
    assert after.indirect == pytest.approx(before.indirect, rel=1e-3, abs=1e-3 * before.indirect.mean())
