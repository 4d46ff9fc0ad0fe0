"""Photon splatting: power, level, sharpness, convergence, and what they leave dark."""

from dataclasses import replace

import numpy as np
import pytest
from photon_bake.addon.bsdf import evaluate_glossy, surface_at
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.core.sampling.octahedral import encode_octahedral
from photon_bake.addon.core.sampling.warps import frame
from photon_bake.addon.gather import splat_gloss, splat_irradiance, splat_photons
from photon_bake.addon.gather.photon_splatting import LitPoints
from photon_bake.addon.gather.photon_splatting.radius import n_in_splat, neighbour_radius
from photon_bake.addon.photons import PathKind, Photons
from photon_bake.addon.receivers import Camera, seen_surface
from photon_bake.addon.scene import Channel, Materials
from photon_bake.addon.tracing import TransparencyTracer
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.core.scenes import box, merge, plane, scene_of
from photon_bake.tests.core.test_light_volume import photons_of_even_light

DOWN = np.array([[1, 0, 0], [0, 1, 0], [0, 0, -1]], np.float32)  # looks along −z, y up
ALONG = np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0]], np.float32)  # looks along +x, z up


def photons_at(places, power=1.0, direction=(0, 0, -1)) -> Photons:
    """Photons on the plane z = 0 at places (n, 2), of `power` watts together."""
    n = len(places)
    position = np.concatenate([places, np.zeros((n, 1))], axis=1).astype(np.float32)
    direction = np.broadcast_to(np.float32(direction), (n, 3))
    return Photons(
        position=position,
        power=np.full((n, 3), power / max(n, 1), np.float32),
        packed_direction=encode_octahedral(direction),
        packed_normal=encode_octahedral(np.tile(np.float32([0, 0, 1]), (n, 1))),
        triangle=np.zeros(n, np.int32),
        path=np.arange(n, dtype=np.int32),
        path_density=np.ones(n, np.float32),
        kind=np.full(n, PathKind.CAUSTIC, np.uint8),
        bounce=np.ones(n, np.uint8),
    )


def seen_from(scene, position=(0, 0, 2), axes=DOWN, angle=0.92730, width=200, height=200):
    """A camera and what it sees; by default two metres above the plane z = 0, one metre to each side."""
    camera = Camera.perspective(np.float32(position), axes, float(angle), width, height)
    return camera, seen_surface(scene, TransparencyTracer(scene, EmbreeTracer(scene)), camera)


def view_of_plane(**camera):
    return seen_from(scene_of(*plane(4.0)), **camera)


def evenly(n, half, seed=0):
    return np.random.default_rng(seed).uniform(-half, half, (n, 2))


def test_kernel_spreads_a_photon_s_power_over_its_disc():
    """Of a single photon: 2/(πr²) in its middle, 0 from r on, its power in all."""
    _, seen = view_of_plane()
    photons, radius = photons_at([(0.1, -0.2)], 3.0), np.float32([0.3])
    found = splat_photons(LitPoints(seen.position, seen.normal), photons, radius, Workers())
    light, stderr = found.light, found.stderr
    away = np.linalg.norm(seen.position[:, :2] - [0.1, -0.2], axis=1)
    expected = 3 * 2 / (np.pi * 0.3**2) * np.maximum(1 - (away / 0.3) ** 2, 0)
    assert light[:, 1] == pytest.approx(expected, abs=1e-3 * expected.max())
    assert stderr == pytest.approx(light[:, 0], rel=1e-5)
    assert (light[:, 0] * seen.area).sum() == pytest.approx(3, rel=2e-3)
    assert found.radius[light[:, 0] > 0] == pytest.approx(0.3, rel=1e-4) and not found.radius[light[:, 0] == 0].any()


def test_even_light_has_its_level_and_its_noise():
    camera, seen = view_of_plane()
    photons = photons_at(evenly(100_000, 2), 16.0)
    irradiance, stderr = splat_irradiance(camera, seen, photons, Workers())
    error = irradiance[:, 0] - 1
    assert irradiance.mean() == pytest.approx(1, abs=0.015)
    assert 0.8 < np.sqrt(np.mean(error**2) / np.mean(stderr**2)) < 1.4


def test_power_of_a_caustic_is_kept():
    """Photons in a narrow ring bring the pixels all of their power, however small their splats are."""
    camera, seen = view_of_plane()
    random = np.random.default_rng(1)
    angle, distance = random.uniform(0, 2 * np.pi, 20_000), random.normal(0.6, 0.01, 20_000)
    photons = photons_at(np.stack([np.cos(angle), np.sin(angle)], axis=1) * distance[:, None], 5.0)
    irradiance, _ = splat_irradiance(camera, seen, photons, Workers())
    assert (irradiance * seen.area[:, None]).sum(axis=0) == pytest.approx(np.full(3, 5.0), rel=0.01)
    assert not irradiance[np.linalg.norm(seen.position[:, :2], axis=1) < 0.5].any()


def test_error_falls_as_the_cube_root_of_the_photons():
    """Noise and blur, both of light that varies smoothly: 32 times the photons, error ∛32 times less."""
    camera, seen = view_of_plane(width=150, height=150)
    x = seen.position[:, 0]
    truth = 0.25 * (1 + np.sin(np.pi * x))
    errors = []
    for n in (20_000, 640_000):
        places = evenly(2 * n, 1.0, seed=n)
        brightness = (1 + np.sin(np.pi * places[:, 0])) / 2
        places = places[np.random.default_rng(n).random(2 * n) < brightness]
        irradiance, _ = splat_irradiance(camera, seen, photons_at(places), Workers())
        inner = (np.abs(seen.position[:, :2]) < 0.7).all(axis=1)
        errors.append(np.sqrt(np.mean((irradiance[:, 0] - truth)[inner] ** 2)))
    assert errors[0] / errors[1] == pytest.approx(32 ** (1 / 3), rel=0.15)


def test_volumes_shrink_with_photons_while_more_are_in_each():
    n = np.array([1e4, 1e5, 1e6, 1e7])
    k = np.array([n_in_splat(one) for one in n])
    assert (np.diff(k) >= 0).all() and (np.diff(k / n) < 0).all()
    radius = [neighbour_radius(photons_at(evenly(m, 1)), np.full(m, 9.0), Workers()) for m in (20_000, 200_000)]
    for m, r in zip((20_000, 200_000), radius, strict=True):
        assert np.mean(r**2) == pytest.approx(n_in_splat(m) * 4 / (np.pi * m), rel=0.15)


def test_caustics_are_as_sharp_as_their_photons():
    """A bright line in even light a hundred times darker: a photon in it lights no pixel ten widths away."""
    photons = Photons.join(
        [
            photons_at(evenly(20_000, 1) * [0.002, 1], 1.0),
            photons_at(evenly(20_000, 1, seed=1), 0.1),
        ]
    )
    radius = neighbour_radius(photons, np.full(len(photons), 9.0), Workers())
    assert np.percentile(radius[:20_000], 99) < 0.02 < np.percentile(radius[20_000:], 50)


def test_pixels_are_never_smaller_than_volumes():
    """Of photons far denser than pixels, those within a pixel's side of its middle light it; the noise is √(4/(3k))."""
    camera, seen = view_of_plane(width=20, height=20)
    photons = photons_at(evenly(200_000, 1), 4.0)
    irradiance, _ = splat_irradiance(camera, seen, photons, Workers())
    inner = irradiance[(np.abs(seen.position[:, :2]) < 0.8).all(axis=1), 0]
    assert inner.mean() == pytest.approx(1, abs=0.01)
    assert inner.std() == pytest.approx(np.sqrt(4 / 3 / (500 * np.pi)), rel=0.15)


def test_photons_light_neither_walls_nor_what_is_before_them():
    plate = plane(0.3)[0][:, [2, 0, 1]], plane(0.3)[1]
    room = scene_of(*merge(box(), plate))
    camera, seen = seen_from(room, (-0.9, 0, 0), ALONG, np.pi / 2, 64, 48)
    irradiance, _ = splat_irradiance(camera, seen, photons_of_even_light(600_000), Workers())
    on_plate = seen.hits.triangle >= 12
    assert on_plate.any() and not irradiance[on_plate].any()
    far_from_edges = ~on_plate & (np.sort(np.abs(seen.position), axis=1)[:, 1] < 0.9)
    assert irradiance[far_from_edges].mean() == pytest.approx(np.pi, rel=0.02)


def test_even_light_is_even_to_the_edge():
    """In a box, and on a plate: at most a few hundredths too dark or too bright within a volume's radius of an edge."""
    plate = plane(0.5)
    camera, seen = seen_from(scene_of(*plate), width=120, height=120)
    tracer = EmbreeTracer(scene_of(*plate))
    photons = photons_at(evenly(100_000, 0.5), 1.0)
    plain, _ = splat_irradiance(camera, seen, photons, Workers())
    even, _ = splat_irradiance(camera, seen, photons, Workers(), tracer=tracer)
    close = np.abs(seen.position[:, :2]).max(axis=1) > 0.48
    assert plain[close].mean() < 0.92 and even[close].mean() == pytest.approx(1, abs=0.04)
    assert even[~close].mean() == pytest.approx(1, abs=0.01)

    room = scene_of(*box())
    camera, seen = seen_from(room, (-0.9, 0.1, 0.2), ALONG, np.pi / 2, 160, 120)
    irradiance, _ = splat_irradiance(camera, seen, photons_of_even_light(600_000), Workers(), tracer=EmbreeTracer(room))
    assert irradiance.mean() == pytest.approx(np.pi, rel=0.01)
    close = np.sort(np.abs(seen.position), axis=1)[:, 1] > 0.98
    assert irradiance[close].mean() == pytest.approx(np.pi, rel=0.04)


def test_smooth_normals_reflect_by_their_own_cosine():
    """Photons from straight above, on a plane shaded by a normal at 60° to its own: half of the light."""
    vertices, triangles = plane(4.0)
    flat = scene_of(vertices, triangles)
    tilted = np.tile(np.float32([np.sqrt(3) / 2, 0, 0.5]), (2, 3, 1))
    scene = replace(flat, corner_normals=tilted)
    camera, seen = seen_from(scene, width=60, height=60)
    irradiance, _ = splat_irradiance(camera, seen, photons_at(evenly(50_000, 2), 16.0), Workers())
    assert irradiance.mean() == pytest.approx(0.5, rel=0.02)


def test_gloss_reflects_photons_by_its_lobe():
    """Even parallel light on rough metal: L = f(ω, ω_o) E in every pixel, of E on the surface; none on smooth metal."""
    flat = scene_of(*plane(4.0))
    towards = np.float32([0.48, 0.36, 0.8])
    for roughness, reflects in ((0.5, True), (0.0, False)):
        columns = {"f0": 0.9, "f90": 1.0, "roughness": roughness}
        metal = Materials.of(
            1, **{name: Channel.constant(np.full((1, 3), v, np.float32)) for name, v in columns.items()}
        )
        scene = replace(flat, materials=metal)
        camera, seen = seen_from(scene, width=60, height=60)
        photons = photons_at(evenly(60_000, 2), 16 * 3.0, -towards)
        radiance, stderr = splat_gloss(scene, camera, seen, photons, Workers())
        hits = seen.hits
        surface = surface_at(scene, hits.triangle, hits.u, hits.v, hits.back(seen.direction))
        axes = np.stack([*frame(seen.normal), seen.normal], axis=1)
        wo, wi = (np.einsum("nij,nj->ni", axes, d) for d in (-seen.direction, np.tile(towards, (len(seen), 1))))
        expected = 3.0 * evaluate_glossy(surface, wo, wi)
        assert radiance.any() == reflects == stderr.any()
        assert radiance.mean() == pytest.approx(expected.mean(), rel=0.02)
        assert np.sqrt(np.mean((radiance - expected) ** 2)) < 0.35 * max(expected.max(), 1e-9)


def test_light_is_the_same_for_any_number_of_threads():
    camera, seen = view_of_plane()
    photons = photons_at(evenly(60_000, 1))
    one, four = (splat_irradiance(camera, seen, photons, Workers(n_threads=n)) for n in (1, 4))
    assert np.array_equal(one[0], four[0]) and np.array_equal(one[1], four[1])


@pytest.mark.parametrize("n", [0, 1, 5])
def test_few_photons(n):
    camera, seen = view_of_plane()
    irradiance, stderr = splat_irradiance(camera, seen, photons_at(evenly(n, 0.5)[:n]), Workers())
    assert np.isfinite(irradiance).all() and bool(irradiance.any()) == bool(n) == bool(stderr.any())


def test_photons_in_one_place():
    """In sight and out of it: a hundred splats of one pixel's size."""
    camera, seen = view_of_plane()
    photons = photons_at(np.repeat([[0.3, 0.1], [9.0, 0.0]], 100, axis=0), 2.0)
    irradiance, _ = splat_irradiance(camera, seen, photons, Workers())
    assert (irradiance[:, 0] * seen.area).sum() == pytest.approx(1, rel=0.4)  # a pixel's middle is not its mean
    assert 0 < np.count_nonzero(irradiance[:, 0]) < 10
