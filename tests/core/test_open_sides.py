"""Receivers that look at the wall: which they are, and the light of their other side."""

from dataclasses import replace

import numpy as np
import pytest
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.gather import OpenBacks
from photon_bake.addon.pipeline.bake import solve
from photon_bake.addon.receivers import AttributeTarget, Receivers
from photon_bake.addon.scene import LightKind, Lights
from photon_bake.addon.settings.bake import settings_for
from photon_bake.addon.tracing.embree import EmbreeTracer

from .scenes import box, lamp, merge, of_objects, plane, scene_of

DRAFT = settings_for("draft", n_photons=20_000, n_threads=1)


def on_quad(scene, first=0, n=40):
    """Receivers all over the square whose halves are two triangles of a scene, for their object."""
    a, b, c = scene.vertices[scene.triangles[first]]
    u = np.random.default_rng(1).uniform(0.05, 0.95, (n, 2)).astype(np.float32)
    normal = np.repeat(scene.normals[first][None], n, axis=0).astype(np.float32)
    position = a + u[:, :1] * (b - a) + u[:, 1:] * (c - b) + np.float32(1e-3) * normal
    name = scene.objects.names[scene.object_of_triangle[first]]
    target = AttributeTarget(name, name, "POINT", np.arange(n, dtype=np.int32))
    return Receivers(position, normal, np.full(n, 0.5, np.float32), (target,))


def turned_away(scene, receivers, every=True):
    return OpenBacks.of(scene, receivers, EmbreeTracer(scene), Workers(0, 1), every)


def warned(scene, receivers):
    solution = solve(scene, receivers, DRAFT, EmbreeTracer(scene))
    return turned_away(scene, receivers, every=False).lit_behind(scene, solution.photons)


def furnace(inwards):
    """A box of emission 1 and albedo ½: inside of it the indirect light is π."""
    return of_objects(scene_of(*box(1.0, inwards), albedo=0.5, emission=1.0), [0] * 12)


def test_walls_that_look_out_of_their_room_take_its_light():
    scene = furnace(inwards=False)
    receivers = on_quad(scene)
    backs = turned_away(scene, receivers)
    assert len(backs.receiver) == len(receivers)
    both = backs.added_to(receivers)
    light = solve(scene, both, replace(DRAFT, n_photons=200_000), EmbreeTracer(scene)).irradiance()
    taken = backs.taken(light)
    assert light.value[: len(receivers)].max() == 0
    np.testing.assert_allclose(taken.value.mean(), np.pi, rtol=0.02)
    assert taken.value.shape == (len(receivers), 3) and taken.counts["receivers"] == len(receivers)
    assert taken.stderr.shape == (len(receivers),) and taken.passes["indirect"].shape == (len(receivers), 3)
    assert warned(scene, receivers) == ["Triangle 0"]


def test_walls_that_look_into_their_room_keep_it():
    scene = furnace(inwards=True)
    receivers = on_quad(scene)
    backs = turned_away(scene, receivers)
    assert len(backs.receiver) == 0 and backs.added_to(receivers) is receivers
    assert warned(scene, receivers) == []


def test_the_inside_of_a_solid_is_dark_and_no_open_side():
    lights = lamp(LightKind.POINT, 10.0, (0, 0, 3))
    scene = of_objects(scene_of(*box(1.0, inwards=False), albedo=0.5, lights=lights), [0] * 12)
    receivers = on_quad(scene)
    backs = turned_away(scene, receivers)
    assert len(backs.receiver)  # it is open, as rays see it
    settings = replace(DRAFT, add_direct=True)
    fronts = solve(scene, receivers, settings, EmbreeTracer(scene)).irradiance()
    both = solve(scene, backs.added_to(receivers), settings, EmbreeTracer(scene)).irradiance()
    np.testing.assert_allclose(backs.taken(both).value, fronts.value, atol=1e-4)
    assert warned(scene, receivers) == []


def room_with_box(inwards, lamp_at):
    """A room of 2 m, the normals of whose walls look into it, with a closed box of 0.6 m in its middle."""
    lights = lamp(LightKind.POINT, 10.0, lamp_at)
    scene = scene_of(*merge(box(0.3, inwards), box(1.0)), albedo=0.5, lights=lights)
    return of_objects(scene, [0] * 12 + [1] * 12)


def test_closed_bodies_that_are_inside_out_take_the_light_around_them():
    """As much as if their normals looked outwards; without the option a bake names them."""
    light = []
    for inwards in (False, True):
        scene = room_with_box(inwards, lamp_at=(0.6, 0.5, 0.7))
        receivers = on_quad(scene)
        backs = turned_away(scene, receivers)
        assert backs.inside_out == {"Triangle 0"} & {"Triangle 0" if inwards else ""}
        assert len(backs.receiver) == (len(receivers) if inwards else 0)
        both = backs.added_to(receivers)
        light.append(backs.taken(solve(scene, both, DRAFT, EmbreeTracer(scene)).irradiance()).value.mean())
        solution = solve(scene, receivers, DRAFT, EmbreeTracer(scene))
        few = turned_away(scene, receivers, every=False)
        assert few.lit_outside(scene, solution.photons) == ["Triangle 0"] * inwards
        assert few.lit_behind(scene, solution.photons) == []
    assert light[1] == pytest.approx(light[0], rel=0.05) and light[0] > 0.1


def test_rooms_whose_walls_look_into_them_are_not_inside_out():
    """Such as one that stands in another: it keeps the light within, though there is more around it."""
    scene = room_with_box(inwards=True, lamp_at=(0, 0, 0))
    lights = [lamp(LightKind.POINT, 0.01, (0, 0, 0)), lamp(LightKind.POINT, 10.0, (0.6, 0.5, 0.7))]
    scene = replace(scene, lights=Lights.join(lights))
    receivers = on_quad(scene)
    backs = turned_away(scene, receivers)
    assert len(backs.receiver) == len(receivers) and backs.only_if_dark.all()
    fronts = solve(scene, receivers, DRAFT, EmbreeTracer(scene)).irradiance()
    both = solve(scene, backs.added_to(receivers), DRAFT, EmbreeTracer(scene))
    light = backs.taken(both.irradiance())
    assert light.value.mean() == pytest.approx(fronts.value.mean(), rel=0.1)
    assert backs.lit_outside(scene, both.photons) == []


@pytest.mark.parametrize(("gap", "faces_floor", "found"), [(0.01, True, 1), (0.01, False, 0), (0.5, True, 0)])
def test_a_picture_that_looks_at_its_wall(gap, faces_floor, found):
    vertices, triangles = plane(0.5, gap - 1)
    if faces_floor:
        triangles = triangles[:, ::-1]
    mesh = merge((vertices, triangles), box(1.0))
    scene = scene_of(*mesh, albedo=0.5, lights=lamp(LightKind.POINT, 1.0, (0, 0, 0.5)))
    receivers = on_picture(of_objects(scene, [0, 0] + [1] * 12), faces_floor)
    backs = turned_away(scene, receivers)
    assert len(backs.receiver) == pytest.approx(found * len(receivers), abs=2)
    assert warned(of_objects(scene, [0, 0] + [1] * 12), receivers) == ["Triangle 0"] * found


def on_picture(scene, faces_floor):
    """Receivers on the square around the origin."""
    receivers = on_quad(scene)
    z = scene.vertices[0, 2] + np.float32(-1e-3 if faces_floor else 1e-3)
    xy = np.random.default_rng(2).uniform(-0.45, 0.45, (len(receivers), 2))
    return replace(receivers, position=np.column_stack([xy, np.full(len(xy), z)]).astype(np.float32))


def test_the_answer_is_the_same_for_any_number_of_threads():
    scene = furnace(inwards=False)
    receivers = on_quad(scene, n=5000)
    one, two = (OpenBacks.of(scene, receivers, EmbreeTracer(scene), Workers(3, n), True) for n in (1, 2))
    np.testing.assert_array_equal(one.receiver, two.receiver)
    np.testing.assert_array_equal(one.back, two.back)
