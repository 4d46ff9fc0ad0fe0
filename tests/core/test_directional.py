"""How light changes with the normal: closed forms, and gathers with turned normals."""

import numpy as np
import pytest
from photon_bake.addon.core.errors import BakeError
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.core.sampling.warps import sample_cosine_hemisphere
from photon_bake.addon.emitters import light_sources, region_of
from photon_bake.addon.gather import DirectLight, direct_irradiance, direct_slope
from photon_bake.addon.gather.normal_gradient import slope_of_light, slope_of_samples
from photon_bake.addon.pipeline.bake import bake
from photon_bake.addon.receivers import Receivers
from photon_bake.addon.scene import LightKind
from photon_bake.addon.settings.bake import settings_for
from photon_bake.addon.tracing import TransparencyTracer
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.core.scenes import box, lamp, merge, plane, receivers_at, receivers_in_box, scene_of

UP = np.array([0, 0, 1], np.float32)


def even_normals(n, around=UP, seed=0):
    """Unit vectors even over a hemisphere, (n, 3)."""
    way = np.random.default_rng(seed).standard_normal((n, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    return (way * np.where(way @ around < 0, -1, 1)[:, None]).astype(np.float32)


def normals_of_half_balls(n, seed=0):
    """Unit vectors around z with density cos θ/π, (n, 3)."""
    return sample_cosine_hemisphere(np.random.default_rng(seed).random((n, 2), np.float32))


def directional(at):
    return Receivers(at.position, at.normal, at.footprint, directional=True)


def baked(scene, at, **changes):
    settings = settings_for("draft", n_photons=200_000, n_cache_elements=5_000, **{"n_gather_rays": 512, **changes})
    return bake(scene, at, settings, EmbreeTracer(scene))


@pytest.mark.parametrize("degrees", [0, 20, 50, 85, 120])
def test_the_slope_of_light_from_one_direction_is_the_best_fit(degrees):
    """g is what its definition says, of a million normals."""
    theta = np.radians(degrees)
    towards = np.array([np.sin(theta) * 0.6, np.sin(theta) * 0.8, np.cos(theta)], np.float32)
    n = normals_of_half_balls(1_000_000)
    change = np.maximum(n @ towards, 0) - max(towards[2], 0)
    g = slope_of_light(towards[None], UP[None])[0]
    if degrees < 90:
        assert g == pytest.approx(
            slope_of_samples(np.repeat(change[None, :, None], 3, 2), n[None], UP[None])[0, :, 0], abs=4e-3
        )
        best = np.linalg.lstsq(n - UP, change, rcond=None)[0]
        assert g == pytest.approx(best, abs=6e-3)
    else:
        assert not g.any()


def test_light_from_above_and_light_from_everywhere_are_exact():
    assert slope_of_light(UP[None], UP[None])[0] == pytest.approx(UP, abs=1e-6)
    everywhere = even_normals(1_000_000)
    g = 2 * np.pi * slope_of_light(everywhere, np.broadcast_to(UP, everywhere.shape)).mean(axis=0, dtype=np.float64)
    assert g == pytest.approx(np.pi / 2 * UP, abs=6e-3)


@pytest.mark.parametrize("gather", ["final", "density"])
def test_even_light_has_half_its_irradiance_as_slope(gather):
    """In a glowing box all directions are alike: E(n') = E (1 + n·n')/2."""
    scene = scene_of(*box(), albedo=0.5, emission=1.0)
    at = receivers_in_box(40)
    on_walls, away_from_corners = at.position * np.abs(at.normal), 0.8 * at.position * (1 - np.abs(at.normal))
    at = directional(receivers_at(on_walls + away_from_corners, at.normal))
    light = baked(scene, at, gather=gather, n_nearest=400)
    wanted = light.value[:, None, :] / 2 * at.normal[:, :, None]
    off = np.sqrt(np.mean((light.slope - wanted) ** 2)) / light.value.mean()
    assert off < (0.02 if gather == "final" else 0.1)
    assert np.abs((light.slope - wanted).mean(axis=(0, 2))).max() < 0.02 * light.value.mean()


def test_a_lamp_has_the_slope_of_its_direction():
    place = np.array([1.0, -0.5, 2.0])
    scene = scene_of(*plane(5.0), lights=lamp(LightKind.POINT, 3.0, place, radius=0.0))
    positions = np.array([(x, 0.5, 1e-3) for x in np.linspace(-3, 3, 20)], np.float32)
    at = directional(receivers_at(positions, UP))
    tracer = TransparencyTracer(scene, EmbreeTracer(scene))
    direct = DirectLight(scene, tracer, light_sources(scene, region_of(at.position)))
    irradiance = direct_irradiance(scene, direct, at, Workers())
    slope = direct_slope(scene, direct, at, irradiance, Workers())
    way = place - positions
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    g = slope_of_light(way.astype(np.float32), at.normal)
    wanted = (irradiance / way[:, 2:])[:, None, :] * g[:, :, None]
    assert np.sqrt(np.mean((slope - wanted) ** 2)) < 0.05 * irradiance.mean()


def room():
    """A block in a room with a red wall; its floor is black, so that nothing shines from below the horizon."""
    lights = lamp(LightKind.RECTANGLE, 3.0, (0, 0, 0.99), size=(0.5, 0.5))
    block = box(0.3, inwards=False)
    vertices, triangles = merge(box(), (block[0] - [0.2, 0.1, 0.7], block[1]))
    corners = vertices[triangles]
    red, floor = (corners[..., 0] == -1).all(axis=1), (corners[..., 2] == -1).all(axis=1)
    albedo = np.array([[0.7, 0.7, 0.7], [0.8, 0.1, 0.1], [0, 0, 0]])
    return scene_of(vertices, triangles, albedo=albedo, lights=lights, material=np.where(floor, 2, red))


def test_slopes_are_those_of_gathers_with_turned_normals():
    """At places of a room's floor: by definition, from gathers whose receivers have turned normals."""
    scene, n = room(), 200
    places = np.array([(0.7, 0.6, -0.999), (-0.8, 0.7, -0.999), (0.5, -0.5, -0.999)], np.float32)
    flat = baked(scene, directional(receivers_at(places, UP)), n_gather_rays=8192)
    turned = np.tile(normals_of_half_balls(n), (len(places), 1))
    light = baked(scene, receivers_at(np.repeat(places, n, 0), turned), interpolate=False, n_gather_rays=2048)
    of_place = light.value.reshape(len(places), n, 3)
    way = turned.reshape(len(places), n, 3) - UP
    change = of_place - flat.value[:, None]
    fit = np.stack([np.linalg.lstsq(w, c, rcond=None)[0] for w, c in zip(way, change, strict=True)])
    assert np.abs(flat.slope - fit).max() < 0.04 * flat.value.mean()
    said = flat.value[:, None] + np.einsum("pna,pac->pnc", way, flat.slope)
    off, unturned = (np.sqrt(np.mean((v - of_place) ** 2)) for v in (said, flat.value[:, None]))
    assert off < 0.03 * flat.value.mean() and off < unturned / 4


def test_interpolated_slopes_are_those_of_all():
    scene, dense = room(), directional(receivers_in_box(3000))
    few = baked(scene, dense, n_gather_rays=128)
    checked = np.arange(0, len(dense), 60)
    all_ = baked(scene, dense.where(checked), interpolate=False, n_gather_rays=2048)
    assert few.counts["gather_points"] < len(dense) / 2
    off = few.slope[checked] - all_.slope
    assert np.sqrt(np.mean(off**2)) < 0.06 * all_.value.mean()
    assert abs(off.mean()) < 0.01 * all_.value.mean()


def test_asking_for_slopes_leaves_the_light_as_it_is():
    scene, at = room(), receivers_in_box(500)
    without, with_ = baked(scene, at), baked(scene, directional(at))
    assert without.slope is None
    noise = np.hypot(without.stderr, with_.stderr)
    off = (without.value - with_.value).mean(axis=1)
    assert np.sqrt(np.mean(off**2)) < 1.3 * np.sqrt(np.mean(noise**2))
    assert abs(off.mean()) < 0.005 * without.value.mean()


def test_slopes_are_the_same_whatever_the_threads():
    scene, at = room(), directional(receivers_in_box(200))
    one, three = (baked(scene, at, n_threads=n, n_gather_rays=32, add_direct=True) for n in (1, 3))
    assert np.array_equal(one.slope, three.slope) and np.array_equal(one.value, three.value)


def test_a_light_volume_says_that_it_tells_no_slopes():
    with pytest.raises(BakeError, match="choose another Gather"):
        baked(room(), directional(receivers_in_box(2)), gather="light_volume")
