"""What a camera sees, and the light of photons in its pixels."""

import numpy as np
import pytest
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.core.sampling.spherical_harmonics import sh_basis
from photon_bake.addon.gather import Cascade, glossy_radiance, screen_irradiance
from photon_bake.addon.gather.light_volume.glossy_light import nowhere_negative
from photon_bake.addon.gather.screen_volume.screen_volume import gather_once
from photon_bake.addon.photons import Photons
from photon_bake.addon.receivers import Camera, seen_surface
from photon_bake.addon.scene import Channel, LightKind, Materials
from photon_bake.addon.settings.bake import settings_for
from photon_bake.addon.tracing import TransparencyTracer
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.camera_bake import bake_camera
from photon_bake.tests.core.scenes import box, lamp, merge, plane, scene_of
from photon_bake.tests.core.test_light_volume import photons_of_even_light

AXES = np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0]], np.float32)  # looks along +x, z up


def camera_at(position, width=64, height=48, angle=np.pi / 2, axes=AXES):
    return Camera.perspective(np.array(position, np.float32), axes, angle, width, height)


def seen_by(camera, scene):
    tracer = TransparencyTracer(scene, EmbreeTracer(scene))
    return tracer, seen_surface(scene, tracer, camera)


def test_points_along_a_pixel_s_ray_fall_into_it():
    camera = camera_at((1, 2, 3))
    directions = camera.rays(camera.middles).directions
    assert np.linalg.norm(directions, axis=1) == pytest.approx(np.ones(camera.n_pixels), abs=1e-6)
    for distance in (0.1, 7.0):
        assert np.array_equal(camera.pixels(camera.position + distance * directions), np.arange(camera.n_pixels))
    assert (camera.pixels(camera.position - directions) == -1).all()
    assert camera.pixels(camera.position + np.float32([[1, -2, 0], [1, 0, 2]])).tolist() == [-1, -1]
    # The first pixel is at the top left: up is +z, and right of forward x is y here
    assert directions[0, 2] > 0 > directions[0, 1]


def test_pixels_cover_the_surface_that_is_seen():
    """A square that fills the middle of the picture at a slant: the pixels' areas add up to its own."""
    vertices, triangles = plane(0.5)
    slanted = vertices @ np.array([[0.6, 0, -0.8], [0, 1, 0], [0.8, 0, 0.6]], np.float32)
    camera, scene = camera_at((-2, 0, 0), 400, 300), scene_of(slanted, triangles)
    _, seen = seen_by(camera, scene)
    assert seen.area.sum() == pytest.approx(1, rel=0.02)
    assert (np.einsum("ij,ij->i", seen.normal, seen.direction) < 0).all()


def test_exchange_keeps_the_light():
    random = np.random.default_rng(0)
    fields = random.random((12, 9, 4)).astype(np.float32)
    pixels = np.pad(np.arange(12, dtype=np.int32).reshape(3, 4), 1, constant_values=-1)
    sides = pixels[1:-1, :-2], pixels[1:-1, 2:], pixels[:-2, 1:-1], pixels[2:, 1:-1]
    neighbours = np.stack([side.ravel() for side in sides], axis=1)
    gathered = fields
    for _ in range(200):
        gathered = gather_once(gathered, neighbours, Workers())
    assert gathered.sum(axis=0) == pytest.approx(fields.sum(axis=0), rel=1e-5)
    assert gathered == pytest.approx(np.broadcast_to(fields.mean(axis=0), fields.shape), rel=1e-3)


def test_even_light_in_pixels_has_its_absolute_level():
    """In a closed box in light of radiance 1 each pixel reads E = π.

    In the pixels that an edge runs through, photons of one of the two walls are lost.
    """
    camera, scene = camera_at((-0.9, 0.1, 0.2), 160, 120), scene_of(*box())
    _, seen = seen_by(camera, scene)
    irradiance, stderr = screen_irradiance(camera, seen, photons_of_even_light(1_200_000), Workers())
    assert irradiance.mean() == pytest.approx(np.pi, rel=0.015)
    error = irradiance[:, 0] - np.pi
    assert 0.7 < np.sqrt(np.mean(error**2) / np.mean(stderr**2)) < 1.4


def test_photons_before_and_behind_a_surface_do_not_light_it():
    """A plate stands before a wall; photons lie on the wall, also where the plate hides it."""
    plate = plane(0.3)[0][:, [2, 0, 1]], plane(0.3)[1]
    camera, scene = camera_at((-0.9, 0, 0)), scene_of(*merge(box(), plate))
    _, seen = seen_by(camera, scene)
    irradiance, _ = screen_irradiance(camera, seen, photons_of_even_light(600_000), Workers())
    on_plate = seen.hits.triangle >= 12
    assert on_plate.any() and not irradiance[on_plate].any()
    assert irradiance[~on_plate].mean() == pytest.approx(np.pi, rel=0.03)


@pytest.mark.parametrize("roughness", [0.0, 0.5])
def test_lossless_gloss_reflects_even_light_as_it_is(roughness):
    white = Channel.constant(np.ones((1, 3), np.float32))
    rough, gray = (Channel.constant(np.full((1, 3), value, np.float32)) for value in (roughness, 0.5))
    glossy = Materials.of(1, diffuse=gray, f0=white, f90=white, roughness=rough)
    camera, scene = camera_at((-0.9, 0.1, 0.2)), scene_of(*box())
    object.__setattr__(scene, "materials", glossy)
    tracer, seen = seen_by(camera, scene)
    volumes = Cascade.of_photons(scene, tracer, photons_of_even_light(600_000), seen.position, 12, Workers())
    reflected = glossy_radiance(scene, seen, volumes, Workers())
    assert reflected.mean() == pytest.approx(1, rel=0.03)
    assert np.abs(reflected - 1).mean() < 0.2


def test_light_is_nowhere_negative():
    """Coefficients whose linear band is too long are cut to 0 in one direction; others stay as they are."""
    radiance = np.array([[[1, 0, 0, 3], [2, 0.1, 0.2, 0.3], [-1, 0, 1, 0]]], np.float32)
    positive = nowhere_negative(radiance)
    assert positive[0, 0] @ sh_basis(np.array([[0, 0, -1.0]]))[0] == pytest.approx(0, abs=1e-6)
    assert np.array_equal(positive[0, 1], radiance[0, 1]) and not positive[0, 2].any()


def test_camera_sees_the_light_of_a_furnace():
    """In a closed box of 24 m² with a lamp of 24 W the mean indirect irradiance is ρ/(1−ρ)."""
    light = lamp(LightKind.POINT, 24 / (4 * np.pi), position=(0, 0, 0))
    scene = scene_of(*box(), albedo=0.5, lights=light)
    settings = settings_for("draft", max_bounces=200)
    pictures = []
    for side in (1, -1):
        camera = camera_at((0, 0, 0), 128, 128, axes=AXES * np.float32([[side], [1], [side]]))
        pictures.append(bake_camera(scene, camera, settings, EmbreeTracer(scene)))
    walls = np.concatenate([picture.indirect for picture in pictures])
    assert walls.mean() == pytest.approx(1, rel=0.05)  # two of the six walls
    assert np.array_equal(pictures[0].radiance, pictures[0].albedo * pictures[0].indirect / np.float32(np.pi))
    again = bake_camera(scene, camera, settings_for("draft", max_bounces=200, n_threads=1), EmbreeTracer(scene))
    assert np.array_equal(again.indirect, pictures[1].indirect)


def test_camera_that_sees_nothing_gets_nothing():
    scene = scene_of(*plane(1.0), lights=lamp(LightKind.POINT))
    picture = bake_camera(scene, camera_at((2, 0, 1)), settings_for("draft"), EmbreeTracer(scene))
    assert picture.radiance.shape == (48, 64, 3) and not picture.radiance.any()
    camera = camera_at((-2, 0, 1))
    _, seen = seen_by(camera, scene)
    light, stderr = screen_irradiance(camera, seen, Photons.none(), Workers())
    assert len(seen) and not light.any() and not stderr.any()
