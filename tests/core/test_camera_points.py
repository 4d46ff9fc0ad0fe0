"""Pixels as points of surfaces, and the pass that is made of their light."""

import numpy as np
import pytest
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.pipeline.bake import solve
from photon_bake.addon.pipeline.camera_pass import camera_pass, light_beside
from photon_bake.addon.receivers import (
    Camera,
    Equirectangular,
    Fisheye,
    Orthographic,
    Perspective,
    PixelFilter,
    camera_points,
)
from photon_bake.addon.scene import Channel, LightKind, Materials
from photon_bake.addon.settings.bake import settings_for
from photon_bake.addon.tracing import TransparencyTracer
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.core.scenes import box, lamp, merge, plane, scene_of
from photon_bake.tests.core.test_camera import AXES, camera_at

BOX = PixelFilter("box", 1.0)

WINDOWS = {
    "perspective": (Perspective(), (-0.3, 0.9, -0.5, 0.2)),
    "orthographic": (Orthographic(), (-3, 1, -2, 2)),
    "equirectangular": (Equirectangular(), (-np.pi, np.pi, -np.pi / 2, np.pi / 2)),
    "turned panorama": (Equirectangular(2.0), (1.0, 3.0, -0.5, 1.2)),
    "equidistant": (Fisheye(np.pi), (-np.pi / 2, np.pi / 2, -np.pi / 2, np.pi / 2)),
    "equisolid": (Fisheye(2.0, 8.0), (-9, 9, -8, 8)),
}


def camera_with(name, position=(0.1, 0.2, -0.1), size=(40, 30), **more):
    lens, window = WINDOWS[name]
    return Camera(np.array(position, np.float32), AXES, lens, window, *size, **more)


def points_of(scene, camera, n_samples=16, pixel_filter=BOX):
    tracer = EmbreeTracer(scene)
    return tracer, camera_points(scene, TransparencyTracer(scene, tracer), camera, pixel_filter, n_samples, Workers())


@pytest.mark.parametrize("name", WINDOWS)
def test_points_along_a_pixel_s_ray_fall_into_it(name):
    camera = camera_with(name)
    rays = camera.rays(camera.middles)
    k = np.flatnonzero(np.isfinite(rays.directions[:, 0]))
    assert len(k) > 500
    assert np.linalg.norm(rays.directions[k], axis=1) == pytest.approx(np.ones(len(k)), abs=1e-5)
    for distance in (0.3, 7.0):
        assert np.array_equal(camera.pixels(rays.origins[k] + distance * rays.directions[k]), k)


@pytest.mark.parametrize("name", ["perspective", "equirectangular", "equidistant", "equisolid"])
def test_pixels_cover_their_solid_angle(name):
    """Areas over d², summed, are the picture's solid angle: 4π of a whole panorama, 2π of half of one."""
    camera = camera_with(name, size=(400, 300))
    rays = camera.rays(camera.middles)
    k = np.flatnonzero(np.isfinite(rays.directions[:, 0]))
    solid_angle = camera.pixel_area(camera.position + 2 * rays.directions[k]).sum() / 4
    x, y = np.meshgrid(np.linspace(-0.3, 0.9, 2001), np.linspace(-0.5, 0.2, 2001))
    expected = {
        "perspective": ((1 + x**2 + y**2) ** -1.5).mean() * 1.2 * 0.7,
        "equirectangular": 4 * np.pi,
        "equidistant": 2 * np.pi,
        "equisolid": 2 * np.pi * (1 - np.cos(1.0)),
    }[name]
    assert solid_angle == pytest.approx(expected, rel=5e-3)


@pytest.mark.parametrize("name", WINDOWS)
def test_clipping_is_by_depth(name):
    """Rays start and end where the depth is that of the clipping, be the box around the camera nearer or not."""
    camera = camera_with(name, clip=(0.5, 1.5))
    rays = camera.rays(camera.middles)
    k = np.flatnonzero(np.isfinite(rays.directions[:, 0]))
    ends = rays.origins[k] + rays.length[k, None] * rays.directions[k]
    assert camera.depth(rays.origins[k]) == pytest.approx(np.full(len(k), 0.5), rel=1e-4)
    assert camera.depth(ends) == pytest.approx(np.full(len(k), 1.5), rel=1e-4)
    scene = scene_of(*box(1.0))
    _, points = points_of(scene, camera, 1)
    depth = camera.depth(points.seen.position)
    assert depth.min() >= 0.5 - 1e-4 and depth.max() <= 1.5 + 1e-4


@pytest.mark.parametrize(("kind", "width"), [("box", 1.0), ("gaussian", 2.0), ("blackman_harris", 1.5)])
def test_samples_are_distributed_by_the_filter(kind, width):
    """Their variance is that of the filter, and they stay within it."""
    x = PixelFilter(kind, width).offsets((np.arange(100_000) + 0.5) / 100_000)
    assert np.abs(x).max() <= width / 2 and x.mean() == pytest.approx(0, abs=1e-4)
    t = np.linspace(-0.5, 0.5, 100_001)
    turn = 2 * np.pi * (t + 0.5)
    f = {
        "box": np.ones_like(t),
        "gaussian": np.exp(-2 * (6 * t) ** 2),
        "blackman_harris": 0.35875 - 0.48829 * np.cos(turn) + 0.14128 * np.cos(2 * turn) - 0.01168 * np.cos(3 * turn),
    }[kind]
    assert x.std() == pytest.approx(width * np.sqrt((t**2 * f).sum() / f.sum()), rel=2e-3)


def test_shares_are_what_surfaces_cover_of_pixels():
    """A square of 1/4 of the picture's width and height, off the pixels' grid: its points' shares are its area."""
    scene = scene_of(plane(0.5)[0][:, [2, 0, 1]], plane(0.5)[1])
    camera = Camera(np.array([-2, 0.031, 0.017], np.float32), AXES, Orthographic(), (-2, 2, -2, 2), 30, 30)
    _, points = points_of(scene, camera, 64)
    assert points.share.sum() / camera.n_pixels == pytest.approx(1 / 16, rel=5e-3)
    assert points.seen.area.sum() == pytest.approx(1, rel=5e-3)


def test_a_pixel_on_an_edge_has_a_point_on_each_side():
    scene = scene_of(*box(1.0))
    object.__setattr__(scene, "object_of_triangle", np.zeros(12, np.int32))
    _, points = points_of(scene, camera_with("equirectangular", size=(60, 40)))
    share = np.bincount(points.seen.pixel, points.share)
    assert share == pytest.approx(np.ones(60 * 40), abs=1e-5)
    per_pixel = np.bincount(points.seen.pixel)
    assert per_pixel.min() == 1 and 2 <= per_pixel.max() <= 3
    assert (per_pixel > 1).mean() < 0.2


def mirror_box(albedo, mirror):
    """A closed box whose side behind a plate of glass or a mirror has another albedo."""
    vertices, triangles = merge(box(1.0), plane(0.5))
    vertices = vertices.copy()
    vertices[8:] = vertices[8:][:, [2, 0, 1]] + np.float32([0.5, 0, 0])
    scene = scene_of(vertices, triangles, material=np.repeat([0, 1], [12, 2]), lights=lamp(LightKind.POINT))
    white = np.ones((2, 3), np.float32)
    on = Channel.constant(white * np.float32([[0], [1]]))
    lobes = {"f0": on, "f90": on} if mirror else {"glass_transmission": on, "glass_ior": np.ones(2, np.float32)}
    diffuse = Channel.constant(np.float32([[albedo] * 3, [0] * 3]))
    materials = Materials.of(2, diffuse=diffuse, roughness=Channel.constant(np.zeros(2, np.float32)), **lobes)
    object.__setattr__(scene, "materials", materials)
    return scene


@pytest.mark.parametrize("mirror", [False, True])
def test_mirrors_and_clear_glass_are_followed(mirror):
    """Behind the plate all is as without it; in the mirror the wall behind the camera is seen."""
    scene = mirror_box(0.5, mirror)
    camera = camera_at((-0.5, 0.1, 0.05), 24, 16, angle=1.0)
    _, points = points_of(scene, camera, 4)
    followed = points.n_followed > 0
    assert followed.any() and (points.n_followed <= 1).all()
    wall = -1 if mirror else 1
    middle = np.abs(points.seen.position[followed][:, 1:]).max(axis=1) < 0.9
    assert points.seen.position[followed][middle][:, 0] == pytest.approx(np.full(middle.sum(), wall), abs=1e-4)
    assert points.front / points.share[:, None] == pytest.approx(np.full((len(points), 3), 0.5), abs=0.02)
    assert points.depth[8, 12] == pytest.approx(1.0, abs=0.01)  # of the plate itself


def test_glass_shows_both_ways_in_every_pixel():
    """A plate of glass one surface thick: Fresnel's share of each pixel is mirrored, the rest is seen through it."""
    scene = mirror_box(0.5, False)
    white = np.float32([[0] * 3, [1] * 3])
    clear = {"glass_transmission": Channel.constant(white), "glass_reflection": Channel.constant(white)}
    smooth = {"roughness": Channel.constant(np.zeros(2, np.float32)), "glass_ior": np.full(2, 1.5, np.float32)}
    diffuse = Channel.constant(np.float32([[0.5] * 3, [0] * 3]))
    object.__setattr__(scene, "materials", Materials.of(2, diffuse=diffuse, **clear, **smooth))
    camera = camera_at((-0.5, 0.1, 0.05), 24, 16, angle=0.4)
    _, points = points_of(scene, camera, 4)
    assert (points.n_followed == 1).all()
    mirrored = (points.seen.position[:, 0] < 0.5 - 1e-3)[:, None]
    tints = points.picture(points.tint)
    assert tints == pytest.approx(np.ones_like(tints), rel=1e-5)
    cosine = camera.rays(camera.middles).directions[:, 0]
    inside = np.sqrt(1 - (1 - cosine**2) / 1.5**2)
    across, along = (cosine - 1.5 * inside) / (cosine + 1.5 * inside), (1.5 * cosine - inside) / (1.5 * cosine + inside)
    expected = ((across**2 + along**2) / 2).reshape(16, 24)
    assert points.picture(points.tint * mirrored)[..., 0] == pytest.approx(expected, rel=0.01)
    assert points.picture(points.share[:, None])[..., 0] == pytest.approx(np.ones((16, 24)), rel=1e-5)


def test_receivers_of_what_shines_through_are_on_both_sides():
    leaf = Channel.constant(np.full((1, 3), 0.25, np.float32))
    scene = scene_of(plane(0.5)[0][:, [2, 0, 1]], plane(0.5)[1])
    object.__setattr__(scene, "materials", Materials.of(1, diffuse=leaf, translucent=leaf))
    _, points = points_of(scene, camera_at((-1, 0, 0), 8, 6), 4)
    at = points.receivers(scene)
    n = len(points)
    assert len(at) == 2 * n and (at.position[:n, 0] < 0).all() and (at.position[n:, 0] > 0).all()
    assert np.array_equal(at.normal[n:], -at.normal[:n])


@pytest.mark.parametrize("glossy", [0.0, 0.25])
def test_furnace(glossy):
    """In a closed box of albedo ρ = ½, 24 m² lit by 24 W, E = 1/(1 − ρ) − 1 = 1 is indirect, caustics among it.

    With gloss it is the same, but diffuse surfaces show less of it.
    """
    scene = scene_of(*box(1.0), lights=lamp(LightKind.POINT, 24 / (4 * np.pi), position=(0, 0, 0)))
    diffuse, gloss = (Channel.constant(np.full((1, 3), value, np.float32)) for value in (0.5 - glossy, glossy))
    rough = Channel.constant(np.full(1, 0.2, np.float32))
    materials = Materials.of(1, diffuse=diffuse, f0=gloss, f90=gloss, roughness=rough)
    object.__setattr__(scene, "materials", materials)
    tracer, points = points_of(scene, camera_with("equirectangular", (0, 0, 0), (24, 16)), 4)
    settings = settings_for("draft", n_photons=100_000, max_bounces=100)
    solution = solve(scene, points.receivers(scene), settings, tracer)
    passes = camera_pass(points, solution.irradiance(), light_beside(scene, points, solution, 64, 2, Workers()))
    level = np.sin((np.arange(16) + 0.5) / 16 * np.pi)  # solid angle of each row
    seen = (passes.indirect_diffuse * passes.albedo + passes.caustics).mean(axis=(1, 2))
    assert np.average(seen, weights=level) == pytest.approx((0.5 - glossy) / np.pi, rel=0.04)
    assert passes.caustics.any() == passes.glossy.any() == (glossy > 0)
    assert 0 < passes.error.mean() < 0.1 * passes.indirect.mean()
