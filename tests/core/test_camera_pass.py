"""The camera's pass from a solve: closed forms, by rays and by photon splatting."""

from types import SimpleNamespace

import numpy as np
import pytest
from photon_bake.addon.core.errors import BakeError
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.pipeline import camera_pass as camera_pass_module
from photon_bake.addon.pipeline.bake import bake, solve
from photon_bake.addon.pipeline.camera_pass import _root_of_squares, camera_pass, light_beside
from photon_bake.addon.scene import Channel, LightKind, Materials
from photon_bake.addon.settings.bake import settings_for
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.core.scenes import box, lamp, merge, plane, receivers_in_box, scene_of
from photon_bake.tests.core.test_camera import AXES
from photon_bake.tests.core.test_camera_points import camera_at, camera_with, points_of

GATHERS = ["final", "photon_volumes"]


def lit_box(**columns):
    """A closed box of 24 m² around a lamp of 24 W, of the material that numbers say."""
    scene = scene_of(*box(), lights=lamp(LightKind.POINT, 24 / (4 * np.pi), position=(0, 0, 0)))
    channels = {name: Channel.constant(np.full((1, 3), value, np.float32)) for name, value in columns.items()}
    object.__setattr__(scene, "materials", Materials.of(1, **channels))
    return scene


def pass_of(scene, camera, gather, n_samples=4, n_threads=0, n_media_rays=16, **settings):
    """The pass of a camera in a scene."""
    tracer, points = points_of(scene, camera, n_samples)
    settings = settings_for(
        "draft", **{"n_photons": 100_000, "max_bounces": 100, "n_threads": n_threads, **settings}, gather=gather
    )
    solution = solve(scene, points.receivers(scene), settings, tracer)
    beside = light_beside(scene, points, solution, 64, n_media_rays, Workers(n_threads=n_threads))
    return camera_pass(points, solution.irradiance(), beside)


def test_furnace_of_photon_splatting():
    """Walls of radiance 1 and albedo ρ = ½ make E/π = ρ/(1 − ρ) = 1 of indirect light, as even as its error says."""
    passes = panorama(scene_of(*box(), albedo=0.5, emission=1.0), "photon_volumes", n_photons=200_000)
    light, said = passes.indirect_diffuse[..., 1], passes.error / passes.albedo[..., 1]
    assert of_walls(passes, light) == pytest.approx(1, rel=0.01)
    off, expected = (np.sqrt(of_walls(passes, one**2)) for one in (light - 1, said))
    assert off == pytest.approx(expected, rel=0.15)
    assert not passes.glossy.any() and not passes.caustics.any()


def test_gloss_by_photons_is_that_by_rays():
    """In the same furnace of walls that are half glossy; by 100,000 photons the mean scatters by 1.4 %."""
    walls = lit_box(diffuse=0.25, f0=0.25, f90=0.25, roughness=0.5)
    rays, volumes = (panorama(walls, gather, n_photons=400_000) for gather in GATHERS)
    for name in ("indirect_diffuse", "glossy"):
        light = [of_walls(passes, getattr(passes, name)) for passes in (rays, volumes)]
        assert light[1] == pytest.approx(light[0], rel=0.02), name


def panorama(scene, gather, **settings):
    """The pass of a camera in the middle that looks in all directions."""
    return pass_of(scene, camera_with("equirectangular", (0, 0, 0), (96, 48)), gather, **settings)


def of_walls(passes, values):
    """Mean over the walls of a box 2 m wide: at distance d and height θ a direction sees d² sin θ/cos, cos = 1/d."""
    weight = passes.depth**3 * np.sin((np.arange(48)[:, None] + 0.5) / 48 * np.pi)
    return np.average(values.reshape(48, 96, -1).mean(axis=2), weights=weight)


def test_errors_of_independent_points_add_up_as_squares(monkeypatch):
    """Of the points of a pixel, and of caustics, gloss and highlights in it."""
    scene = lit_box(diffuse=0.5)
    _, points = points_of(scene, camera_with("equirectangular", (0, 0, 0), (8, 6)), 4)
    n = len(points)
    pixels = np.bincount(points.seen.pixel, minlength=48).reshape(6, 8)
    assert pixels.max() > 1
    np.testing.assert_allclose(_root_of_squares(points, np.full(n, 3, np.float32)), 3 * np.sqrt(pixels), rtol=1e-5)

    nothing, picture = np.zeros((n, 3), np.float32), np.ones((6, 8), np.float32)
    parts = {
        "_gloss": (nothing, 3 * picture),
        "_caustics": (points.picture(nothing), 4 * picture),
        "reflected_direct": np.zeros((n + len(points.through), 3), np.float32),
        "reflected_highlights": (nothing, np.full(n, 12, np.float32)),
    }
    for name, value in parts.items():
        monkeypatch.setattr(camera_pass_module, name, lambda *_, value=value: value)
    beside = light_beside(scene, points, SimpleNamespace(direct=None, tracer=None), 1, 2, Workers())
    np.testing.assert_allclose(beside.error, np.sqrt(9 + 16 + 144 * pixels), rtol=1e-5)


def test_pixels_between_those_that_are_lit_are_as_bright():
    """Every fourth pixel of every fourth row, or all: the same light but for a little of its noise, in edges too."""
    block = box(0.3, inwards=False)
    mesh = merge(box(), (block[0] + [0.2, 0.3, -0.7], block[1]))
    scene = scene_of(*mesh, lights=lit_box().lights)
    camera = camera_at((-0.9, -0.2, 0.1), 160, 120, angle=1.2)
    every, fourth = (pass_of(scene, camera, "photon_volumes", 2, subsample=n) for n in (1, 4))
    off = np.abs(fourth.indirect - every.indirect).mean(axis=2)
    assert fourth.indirect.mean() == pytest.approx(every.indirect.mean(), rel=0.01)
    assert np.sqrt(np.mean(off**2)) < 0.8 * np.sqrt(np.mean(every.error**2))
    assert np.sqrt(np.mean((fourth.error - every.error) ** 2)) < 0.2 * every.error.mean()


def test_mirrors_show_what_splats_light():
    """A wall seen in a mirror is as bright as the same wall seen straight; caustics on it are there, too."""
    plate = plane(0.5)[0][:, [2, 0, 1]] + [0.5, 0, 0], plane(0.5)[1]
    scene = scene_of(*merge(box(), plate), material=[0] * 12 + [1] * 2, lights=lit_box().lights)
    diffuse, shine = (Channel.constant(np.float32([[v] * 3 for v in column])) for column in ((0.5, 0), (0, 1)))
    rough = Channel.constant(np.zeros(2, np.float32))
    object.__setattr__(scene, "materials", Materials.of(2, diffuse=diffuse, f0=shine, f90=shine, roughness=rough))
    straight = pass_of(
        scene, camera_at((0.4, 0, 0), 48, 32, angle=0.3, axes=AXES * np.float32([[-1], [1], [-1]])), GATHERS[1]
    )
    mirrored = pass_of(scene, camera_at((0.3, 0, 0), 48, 32, angle=0.3), GATHERS[1])
    seen = [(p.indirect_diffuse * p.albedo + p.caustics).mean() for p in (straight, mirrored)]
    assert seen[1] == pytest.approx(seen[0], rel=0.1) and straight.caustics.any() and not mirrored.caustics.any()


def test_same_seed_same_pass_whatever_the_threads():
    scene = lit_box(diffuse=0.4, f0=0.1, f90=0.1, roughness=0.5)
    camera = camera_at((-0.9, 0.1, 0.2), 48, 32)
    one, three = (pass_of(scene, camera, "photon_volumes", n_threads=n, n_photons=20_000) for n in (1, 3))
    for name in ("indirect_diffuse", "glossy", "error"):
        assert np.array_equal(getattr(one, name), getattr(three, name)), name


def test_photon_splatting_is_refused_without_a_camera():
    scene = lit_box(diffuse=0.5)
    with pytest.raises(BakeError, match="bake to Camera alone, or choose another Gather"):
        bake(scene, receivers_in_box(2), settings_for("draft", gather="photon_volumes"), EmbreeTracer(scene))


def test_leaves_are_lit_from_both_sides():
    """A plate across the box that lets half of the light through: by rays and by photon splatting alike."""
    plate = plane(0.3)[0][:, [2, 0, 1]] + [0.5, 0, 0], plane(0.3)[1]
    scene = scene_of(*merge(box(), plate), material=[0] * 12 + [1] * 2, lights=lit_box().lights)
    diffuse, translucent = (Channel.constant(np.float32([[v] * 3 for v in column])) for column in ((0.5, 0), (0, 0.5)))
    object.__setattr__(scene, "materials", Materials.of(2, diffuse=diffuse, translucent=translucent))
    light = []
    for gather in GATHERS:
        passes = pass_of(scene, camera_at((-0.5, 0, 0), 48, 32, angle=1.0), gather, subsample=2, n_photons=400_000)
        light.append(passes.indirect_diffuse[12:20, 20:28].mean())
        assert passes.error[12:20, 20:28].all()
    assert light[1] == pytest.approx(light[0], rel=0.07)
