"""Caustics in live light: known answers, what edits leave, and that nothing of them is there where they are not."""

import numpy as np
import pytest
from photon_bake.addon.pipeline.bake import bake
from photon_bake.addon.pipeline.live import LampsChanged, ObjectMoved
from photon_bake.addon.pipeline.live.photons.paths import KEPT, differing, no_paths
from photon_bake.addon.scene import Channel, LightKind, Lights, Materials
from photon_bake.addon.settings.bake import BakeSettings
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.core.scenes import ball, lamp, merge, of_objects, plane, scene_of
from photon_bake.tests.core.test_live import converged, furnace, live_of, turned

FINE = {"n_vertices": 5000, "n_links": 16, "n_photons": 150_000}


def with_maker(parts, lights, ior=1.5, albedo=0.5, **lobes):
    """Objects, the first and those after the second matte; the second has `lobes` alone."""
    of = np.repeat(np.arange(len(parts)), [len(triangles) for _, triangles in parts])
    scene = of_objects(scene_of(*merge(*parts), albedo=[0.5, 0.0], lights=lights, material=of == 1), of)

    def of_two(matte, maker):
        return Channel.constant(np.array([[matte] * 3, [maker] * 3], np.float32))

    own = {name: of_two(0, value) for name, value in lobes.items()}
    iors = np.array([1.5, ior], np.float32)
    made = Materials.of(2, diffuse=of_two(albedo, 0), roughness=of_two(1, 0), glass_ior=iors, **own)
    object.__setattr__(scene, "materials", made)
    return scene


def upright(x, half=4.0, top=6.0):
    """A wall at x that faces −x."""
    corners = [(x, -half, 0), (x, half, 0), (x, half, top), (x, -half, top)]
    return np.array(corners, np.float32), np.array([[0, 2, 1], [0, 3, 2]], np.int32)


LAMP = lamp(LightKind.POINT, 3.0, position=(0, 0, 1))
BLOCK = ball(0.1, (-0.5, 0.6, 0.15), 6)


def mirror_room(lights=LAMP):
    """A floor between −1 and 1, a mirror at x = 1 and a matte ball: the lamp's image is at (2, 0, 1)."""
    return with_maker([plane(), upright(1.0), BLOCK], lights, f0=1.0, f90=1.0)


def on_floor(live):
    """Caustic light at the vertices of the floor, E in W/m², and their places."""
    floor = live.light.surfaces.meshes[0]
    return live._solver._caustics.light()[floor.vertices, 0] * np.pi, floor.position


def test_a_mirror_shows_a_lamp_s_image():
    """E = I h / d³ from the image, to the floor's edges and the mirror's foot, where kernels reach beyond the floor."""
    live = live_of(with_maker([plane(), upright(1.0)], LAMP, f0=1.0, f90=1.0), **FINE)
    converged(live)
    light, at = on_floor(live)
    expected = 3 / np.linalg.norm(at - (2, 0, 1), axis=1) ** 3
    inside = np.abs(at[:, :2]).max(axis=1) < 0.7
    assert light[inside].mean() == pytest.approx(expected[inside].mean(), rel=0.01)
    assert np.sqrt(np.mean((light[inside] / expected[inside] - 1) ** 2)) < 0.04
    assert light[~inside].mean() == pytest.approx(expected[~inside].mean(), rel=0.02)
    floor = live.light.surfaces.meshes[0].vertices
    said = np.sqrt(live._solver._caustics.variance()[floor][inside].mean()) * np.pi
    assert 0.4 < said / np.sqrt(np.mean((light - expected)[inside] ** 2)) < 2.5


@pytest.mark.parametrize("height", [1.0, 2.0])
def test_a_lamp_shines_through_a_clear_pane(height):
    """Of the index 1 it bends and mirrors nothing: E = I h / d³, the inverse square times the cosine."""
    lights = lamp(LightKind.POINT, 3.0, position=(0, 0, height))
    pane = plane(0.8, 0.5)
    live = live_of(with_maker([plane(), pane], lights, 1.0, glass_reflection=1.0, glass_transmission=1.0), **FINE)
    light = converged(live)
    caustic, at = on_floor(live)
    expected = 3 * height / np.linalg.norm(at - (0, 0, height), axis=1) ** 3
    inside = np.abs(at[:, :2]).max(axis=1) < 0.8
    assert caustic[inside] / expected[inside] == pytest.approx(1, abs=0.15)
    assert caustic[inside].mean() == pytest.approx(expected[inside].mean(), rel=0.01)
    assert light.direct[light.surfaces.meshes[0].vertices][inside].max() == 0  # shadow rays do not pass glass


def in_map(caustics):
    return caustics._map._sums, caustics._map._of_sides


def all_paths_are_true(caustics):
    """Each photon is where it would be if it were traced now, and the map has no more and no less than these bring."""
    n = caustics._tracing.n
    assert (caustics.paths.state == KEPT).all()
    fresh, differs, every = no_paths(n), np.zeros(n, bool), np.arange(n)
    caustics._tracing.trace(every, every, fresh)
    differing(caustics.paths, every, fresh, every, differs)
    sums = [values.copy() for values in in_map(caustics)]
    caustics._map.clear()
    caustics._map.add(caustics.paths, every)
    exact = all(np.array_equal(a, b) for a, b in zip(sums, in_map(caustics), strict=True))
    return not differs.any() and exact


def test_edits_leave_what_a_fresh_start_finds_to_the_last_bit():
    """Also where one comes before the light of the one before is there."""
    live = live_of(mirror_room(), n_photons=40_000, n_links=16)
    converged(live)
    caustics = live._solver._caustics
    assert all_paths_are_true(caustics)
    live.edit(ObjectMoved(2, turned(20, (0.3, -0.5, 0.2))))
    live.step()
    assert 0 < caustics.touched.mean() < 0.5
    live.edit(ObjectMoved(2, turned(40, (0.6, -0.2, 0.1))))
    converged(live)
    assert all_paths_are_true(caustics)
    live.edit(ObjectMoved(1, turned(0, (0.3, 0, 0))))
    live.step()
    live.edit(LampsChanged(lamp(LightKind.POINT, 2.0, position=(0.1, 0, 1.1))))
    converged(live)
    assert all_paths_are_true(caustics)
    light, at = on_floor(live)
    expected = 2 * 1.1 / np.linalg.norm(at - (2.5, 0, 1.1), axis=1) ** 3
    inside = np.abs(at[:, :2]).max(axis=1) < 0.7
    assert light[inside].mean() == pytest.approx(expected[inside].mean(), rel=0.05)  # less a small shadow


def test_a_brighter_lamp_traces_no_photon_again():
    live = live_of(mirror_room(), n_photons=20_000, n_links=16)
    converged(live)
    before, _ = on_floor(live)
    live.edit(LampsChanged(lamp(LightKind.POINT, 6.0, position=(0, 0, 1))))
    live.step()
    after, _ = on_floor(live)
    assert not live._solver._caustics.touched.any()
    assert after == pytest.approx(2 * before, rel=1e-4, abs=1e-6)


def test_lamps_go_and_come_back():
    live = live_of(mirror_room(), n_photons=20_000, n_links=16)
    converged(live)
    before, _ = on_floor(live)
    live.edit(LampsChanged(Lights.none()))
    converged(live)
    assert not on_floor(live)[0].any()
    live.edit(LampsChanged(LAMP))
    converged(live)
    assert np.array_equal(on_floor(live)[0], before)


def test_first_light_after_an_edit_is_all_the_light():
    """A few photons stand for all that the moved mirror has changed."""
    live = live_of(mirror_room(), n_photons=150_000, n_links=16, n_vertices=3000)
    converged(live)
    live.edit(ObjectMoved(1, turned(0, (0.3, 0, 0))))
    live.step()
    first, at = on_floor(live)
    assert (live._solver._caustics.paths.state != KEPT).mean() > 0.5
    expected = 3 / np.linalg.norm(at - (2.6, 0, 1), axis=1) ** 3
    inside = np.abs(at[:, :2]).max(axis=1) < 0.7
    assert first[inside].mean() == pytest.approx(expected[inside].mean(), rel=0.05)


def test_one_photon_of_each_group_finds_what_no_box_tells_of():
    live = live_of(mirror_room(), n_photons=40_000, n_links=16)
    converged(live)
    before, caustics = on_floor(live)[0], live._solver._caustics
    paths = caustics.paths
    brings = (paths.n_surfaces == 2) & (paths.triangle[:, 1] >= 0)
    some = np.flatnonzero(brings & (np.random.default_rng(1).random(len(brings)) < 0.5))
    caustics._map.remove(paths, some)
    paths.power[some] *= 0.5  # as if it were of another mirror
    caustics._map.add(paths, some)
    caustics._n_turns = 40
    live._solver.converged = live._solver._planned = False
    converged(live)
    assert np.count_nonzero(caustics.touched) > 10
    assert on_floor(live)[0] == pytest.approx(before, rel=0.02)  # of a group on an edge few photons may have changed


def test_light_does_not_depend_on_threads():
    one, two = (live_of(mirror_room(), n_threads=n, n_photons=30_000, n_links=16) for n in (1, 2))
    for live in (one, two):
        converged(live)
        live.edit(ObjectMoved(2, turned(20, (0.3, -0.5, 0.2))))
        converged(live)
    assert np.array_equal(one.light.indirect, two.light.indirect)


def test_matte_scenes_have_no_photons():
    live = live_of(furnace())
    live.step()
    assert live._solver._caustics is None


def test_caustics_light_others_and_agree_with_a_bake():
    """A spot shines on a mirror alone, whose light the floor sends to a wall that the lamp does not see."""
    lights = lamp(LightKind.SPOT, 8.0, (0.2, 0, 1.2), (1, 0, -0.3), angle=np.radians(50))
    wall = upright(-1.0, 1.0, 1.5)
    wall = wall[0], wall[1][:, ::-1]
    scene = with_maker([plane(), upright(1.0, 1.0, 1.5), wall], lights, f0=1.0, f90=1.0, albedo=0.7)
    light = converged(live_of(scene, n_vertices=3000, n_links=128, n_photons=150_000, n_elements=2000))
    some = np.arange(0, len(light.direct), 5)
    settings = BakeSettings(interpolate=False, n_gather_rays=256)
    baked = (
        bake(scene, light.surfaces.receivers().where(some), settings, EmbreeTracer(scene)).passes["indirect"] / np.pi
    )
    for mesh in (light.surfaces.meshes[0], light.surfaces.meshes[2]):
        rows = (some >= mesh.vertices.start) & (some < mesh.vertices.stop)
        off = light.indirect[some[rows]] - baked[rows]
        assert off.mean() / baked[rows].mean() == pytest.approx(0, abs=0.03)
        assert np.median(np.abs(off)) / baked[rows].mean() < 0.06  # the image of the spot's cone has sharp edges
