"""Light groups: one solve gives each group's light, as if it were alone, and all together are the scene's."""

from dataclasses import replace

import numpy as np
import pytest
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.pipeline.bake import bake, solve_apart
from photon_bake.addon.pipeline.gathers import irradiances
from photon_bake.addon.scene import OTHER, LightGroups, LightKind, Lights
from photon_bake.addon.settings.bake import settings_for
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.core.scenes import box, lamp, receivers_in_box, scene_of

GROUPS = LightGroups(("Key", "Fill", "Empty"), np.array([0, 1, -1], np.int32), np.full(12, -1, np.int32), -1)
POWER = {"Key": (3, 1, 0.5), "Fill": (0.05, 0.1, 0.2), OTHER: (1, 1, 1)}


def room(hole=True):
    """A box with a lamp of each of `POWER`; the third group's shines from a corner, and so does the world by a hole."""
    places = ((0.5, 0, 0), (-0.8, 0.8, 0.8), (0, -0.6, 0.3))
    lamps = zip(POWER.values(), places, strict=True)
    lights = Lights.join([lamp(LightKind.POINT, np.float32(e), position=p) for e, p in lamps])
    vertices, triangles = box()
    return scene_of(vertices, triangles[: 12 - hole], albedo=0.6, lights=lights, world=0.1 if hole else 0.0)


def apart(scene, groups, receivers, **settings):
    """The light of each group by one solve."""
    scenes = groups.apart(scene)
    settings = settings_for("draft", **{"n_photons": 60_000, "n_cache_elements": 3_000, **settings})
    solutions = solve_apart(scene, list(scenes.values()), receivers, settings, EmbreeTracer(scene))
    return dict(zip(scenes, irradiances(solutions, Workers()), strict=True))


@pytest.mark.parametrize("gather", ["final", "density", "light_volume"])
def test_each_group_is_as_baked_alone_and_all_are_the_bake_of_all(gather):
    scene, at = room(), receivers_in_box(100)
    groups = replace(GROUPS, of_object=GROUPS.of_object[:11])
    options = {"gather": gather, "n_photons": 60_000, "n_cache_elements": 3_000, "n_grid_cells": 16}
    together = apart(scene, groups, at, **options, add_direct=True)
    assert list(together) == ["Key", "Fill", OTHER]  # no lamp is in the fourth
    settings = settings_for("draft", **options, add_direct=True)
    alone = {name: bake(one, at, settings, EmbreeTracer(scene)) for name, one in groups.apart(scene).items()}
    for name, light in together.items():
        assert light.value.mean() == pytest.approx(alone[name].value.mean(), rel=0.01)
        assert np.abs(light.value - alone[name].value).mean() < 3 * np.hypot(light.stderr, alone[name].stderr).mean()
    total = sum(light.value for light in together.values())
    whole = bake(scene, at, settings, EmbreeTracer(scene))
    assert total.mean() == pytest.approx(whole.value.mean(), rel=0.01)
    stderr = np.sqrt(sum(light.stderr**2 for light in together.values()) + whole.stderr**2)
    assert np.abs(total - whole.value).mean() < 3 * stderr.mean()


def test_furnace_of_each_group():
    """In a closed box of 24 m² a lamp of Φ watts gives a mean indirect irradiance of Φ/24 · ρ/(1−ρ)."""
    scene = room(hole=False)
    for name, light in apart(scene, GROUPS, receivers_in_box(300), max_bounces=200).items():
        expected = np.array(POWER[name]) * 4 * np.pi / 24 * 0.6 / 0.4
        assert light.passes["indirect"].mean(axis=0) == pytest.approx(expected, rel=0.02)


def test_emission_and_the_world_have_groups_too():
    vertices, triangles = box()
    material = np.where(np.arange(11) < 2, 1, 0)
    scene = scene_of(vertices, triangles[:11], albedo=[0.5, 0.5], emission=[0, 1], world=0.2, material=material)
    groups = LightGroups(("Panels", "Sky"), np.zeros(0, np.int32), np.array([0, -1] + [-1] * 9, np.int32), 1)
    scenes = groups.apart(scene)
    assert list(scenes) == ["Panels", "Sky", OTHER]
    assert [one.shines.sum() for one in scenes.values()] == [1, 0, 1]
    assert [one.world.black for one in scenes.values()] == [True, False, True]
    assert scenes["Sky"].areas is scene.areas
    at = receivers_in_box(60)
    lights = apart(scene, groups, at, add_direct=True)
    settings = settings_for("draft", n_photons=60_000, n_cache_elements=3_000, add_direct=True)
    whole = bake(scene, at, settings, EmbreeTracer(scene)).value.mean()
    assert sum(light.value.mean() for light in lights.values()) == pytest.approx(whole, rel=0.02)


def test_a_dark_scene_has_one_dark_group():
    scene = scene_of(*box())
    assert list(LightGroups((), np.zeros(0, np.int32), np.full(12, -1, np.int32), -1).apart(scene)) == [OTHER]
