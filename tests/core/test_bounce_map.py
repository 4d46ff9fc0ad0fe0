"""Bounce maps: their power, their light, and that they are what the source sees."""

import numpy as np
import pytest
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.emitters import Sphere, light_sources
from photon_bake.addon.photons import bounce_map, trace_photons
from photon_bake.addon.photons.bounce_map import view_of
from photon_bake.addon.scene import LightKind
from photon_bake.addon.tracing import TransparencyTracer
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.core.scenes import box, chi_square_of_directions, lamp, merge, plane, scene_of

REGION = Sphere(np.zeros(3, np.float32), 1.7)
LAMPS = {
    "point": (lamp(LightKind.POINT, 2.0, position=(0, 0.1, 0.5)), 6),
    "sphere": (lamp(LightKind.POINT, 2.0, position=(0, 0.1, 0.4), radius=0.2, sphere=True), 6),
    "spot": (lamp(LightKind.SPOT, 2.0, position=(0, 0, 0.5), angle=1.0, blend=0.4), 1),
    "stretched spot": (lamp(LightKind.SPOT, 2.0, position=(0, 0, 0.5), angle=0.7, blend=0.4, stretch=(1.5, 0.6)), 1),
    "wide spot": (lamp(LightKind.SPOT, 2.0, position=(0, 0, 0.5), angle=2.9, blend=0.6), 6),
    "area": (lamp(LightKind.RECTANGLE, 2.0, position=(0, 0, 0.5), size=(0.4, 0.2)), 1),
    "sun": (lamp(LightKind.SUN, 2.0, direction=(0.3, 0.1, -1), angle=0.05), 1),
}


def scene_with(lights):
    room = (plane(1.0, -1.0), plane(0.3, 0.0)) if lights.kind[0] == LightKind.SUN else (box(), plane(0.3, -0.5))
    scene = scene_of(*merge(*room), albedo=0.6, lights=lights)
    return scene, TransparencyTracer(scene, EmbreeTracer(scene)), light_sources(scene, REGION)


@pytest.mark.parametrize("name", LAMPS)
def test_pictures_light_the_scene_as_other_photons_do(name):
    """Within the noise the same light on every triangle."""
    lights, n_faces = LAMPS[name]
    scene, tracer, sources = scene_with(lights)
    assert view_of(sources[0]).n_faces == n_faces
    found = [trace_photons(scene, tracer, sources, 120_000, 3, Workers(), in_pictures) for in_pictures in (True, False)]
    light, square = (
        [np.bincount(photons.triangle, photons.power[:, 0].astype(float) ** k, scene.n_triangles) for photons in found]
        for k in (1, 2)
    )
    assert (np.abs(light[0] - light[1]) < 5 * np.sqrt(square[0] + square[1]) + 0.003 * light[1].max()).all()


@pytest.mark.parametrize("name", LAMPS)
def test_a_map_has_the_source_s_power(name):
    """Solid angle and rounding included: 1,001 photons make 6 · 13² or 32² pixels."""
    lights, n_faces = LAMPS[name]
    _, tracer, sources = scene_with(lights)
    made = bounce_map(tracer, sources[0], 1_001)
    assert made.side == {1: 32, 6: 13}[n_faces] and len(made.rays.flux) == n_faces * made.side**2
    if name != "sun":  # which goes by what enters the region
        assert made.rays.flux.mean(axis=0) == pytest.approx(sources[0].power, rel=0.01)


def test_a_sun_s_map_gives_its_irradiance():
    _, tracer, sources = scene_with(LAMPS["sun"][0])
    made = bounce_map(tracer, sources[0], 200_000)
    power = made.rays.flux[made.hits.hit, 0].sum(dtype=float) / len(made.rays.flux)
    assert power == pytest.approx(2 * 4 / np.sqrt(1.1), rel=0.01)  # the plate hides as much of the floor as it gets


def test_a_cube_s_photons_leave_evenly_by_their_power():
    """Each pixel stands for its own solid angle: photons drawn by their power are even over the sphere."""
    _, tracer, sources = scene_with(LAMPS["point"][0])
    rays = bounce_map(tracer, sources[0], 400_000).rays
    assert rays.flux.max() / rays.flux.min() == pytest.approx(3**1.5, rel=0.02)  # a corner lies √3 away
    weight = rays.flux[:, 0].astype(float)
    drawn = np.random.default_rng(1).choice(len(weight), 100_000, p=weight / weight.sum())
    assert chi_square_of_directions(rays.directions[drawn], lambda z: np.full_like(z, 1 / (4 * np.pi))) > 1e-3


def test_a_map_shows_what_the_lamp_sees():
    """A spot straight down at a plate: a square of nearer hits in the middle of its picture."""
    _, tracer, sources = scene_with(LAMPS["spot"][0])
    made = bounce_map(tracer, sources[0], 10_000)
    picture = made.hits.distance.reshape(made.side, made.side) * np.abs(made.rays.directions[:, 2]).reshape(
        made.side, -1
    )
    near = picture < 1.2
    expected = 0.3 / 1.0 / np.tan(0.5)  # the plate's half over the picture's
    assert near.mean() == pytest.approx(expected**2, rel=0.05)
    assert near[made.side // 2, made.side // 2] and not near[0].any()
