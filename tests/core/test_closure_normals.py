"""Closures with normals of their own: what the normals are, and light both ways by them."""

from dataclasses import replace

import numba
import numpy as np
import pytest
from photon_bake.addon.bsdf import Lobe
from photon_bake.addon.bsdf.closure import bsdf_of
from photon_bake.addon.bsdf.frames import bump_shadowing, own_normal
from photon_bake.addon.bsdf.mixture import ALL_LOBES
from photon_bake.addon.bsdf.scatter import scatter
from photon_bake.addon.core.vec3 import ONE, put, row
from photon_bake.addon.receivers import Receivers, on_normal_maps
from photon_bake.addon.scene import Channel, Closures, Materials, NormalSpace, RayKind, ShadingFrames
from photon_bake.addon.scene.hit import hit_at
from photon_bake.addon.tracing import EmbreeTracer
from photon_bake.tests.core.scenes import plane, scene_of

N = 1 << 17
DIFFUSE_RAY = int(RayKind.DIFFUSE)
compiled = numba.njit(error_model="numpy", _nrt=False)


def unit(*vector):
    vector = np.array(vector, np.float32)
    return vector / np.linalg.norm(vector)


def floor(*closures, frames=None, smooth=None):
    """A plane of one material; of each closure its kind, its normal's space and vector, and other columns."""
    channels = {
        name: Channel.constant(np.float32([np.broadcast_to(one.get(name, 1), 3) for one in closures]))
        for name in ("weight", "roughness", "f0", "f90", "normal")
    }
    space = np.int32([one.get("space", -1) for one in closures])
    layer = np.int32([one.get("layer", -1) for one in closures])
    ior = np.float32([one.get("ior", 0) for one in closures])
    of = Closures.of([0, len(closures)], [one["kind"] for one in closures], normal_space=space, ior=ior, **channels)
    scene = scene_of(*plane())
    corner_normals = scene.corner_normals if smooth is None else np.broadcast_to(smooth, (2, 3, 3)).copy()
    return replace(
        scene,
        materials=Materials.of(1, closures=replace(of, layer=layer)),
        frames=frames or ShadingFrames.none(),
        corner_normals=corner_normals,
    )


@compiled
def _own_normal(scene, back, view, out):
    bsdf = bsdf_of(scene, 0, np.float32(0.2), np.float32(0.3), back)
    put(out, 0, own_normal(scene, bsdf, 0, row(view, 0)))


def normal_of(scene, back=False, view=(0, 0, 1)):
    out = np.zeros((1, 3), np.float32)
    _own_normal(scene.arrays, back, np.float32([view]), out)
    return out[0]


def test_a_tangent_normal_is_in_the_frame_of_the_corners():
    tangents = np.broadcast_to(np.float32([[0, 1, 0], [-2, 0, 0], [0, 0, 0]]), (2, 3, 3, 3)).copy()
    frames = ShadingFrames(tangents, np.zeros((0, 3, 3), np.float32))
    one = {"kind": Lobe.DIFFUSE, "space": NormalSpace.TANGENT, "normal": (0.3, 0.1, 0.9)}
    scene = floor(one, frames=frames)
    np.testing.assert_allclose(normal_of(scene), unit(-0.2, 0.3, 0.9), atol=1e-6)
    np.testing.assert_allclose(normal_of(scene, back=True), -unit(-0.2, 0.3, 0.9), atol=1e-6)


@pytest.mark.parametrize("strength", [0.4, 1.0, 1.6])
def test_normals_of_the_object_and_the_world_are_moved_to_by_their_length(strength):
    matrices = np.float32([[[0, -1, 0], [1, 0, 0], [0, 0, 1]]] * 2)
    frames = ShadingFrames(np.zeros((0, 3, 3, 3), np.float32), matrices)
    d, up = unit(0.5, 0.2, 0.6), np.float32([0, 0, 1])
    for space, turned in ((NormalSpace.WORLD, d), (NormalSpace.OBJECT, matrices[0] @ d)):
        scene = floor({"kind": Lobe.DIFFUSE, "space": space, "normal": strength * d}, frames=frames)
        np.testing.assert_allclose(normal_of(scene), unit(*(strength * turned + (1 - strength) * up)), atol=1e-6)


def test_a_height_leans_the_normal_against_its_slope_on_both_sides():
    """The plane's texture coordinates are its x and y; from behind the same hill leans the other way."""
    scene = floor({"kind": Lobe.DIFFUSE, "space": NormalSpace.HEIGHT, "normal": (0.5, -0.25, 1)})
    np.testing.assert_allclose(normal_of(scene), unit(-0.5, 0.25, 1), atol=1e-6)
    np.testing.assert_allclose(normal_of(scene, back=True), unit(-0.5, 0.25, -1), atol=1e-6)
    scene = floor({"kind": Lobe.DIFFUSE, "space": NormalSpace.HEIGHT, "normal": (0.5, -0.25, 0)})
    np.testing.assert_allclose(normal_of(scene), (0, 0, 1), atol=1e-6)


def test_gloss_is_turned_until_it_reflects_the_view_over_the_surface():
    view = unit(0.8, 0.1, 0.3)
    scene = floor({"kind": Lobe.GLOSSY, "space": NormalSpace.WORLD, "normal": unit(-0.5, 0, 0.8), "roughness": 0.3})
    normal = normal_of(scene, view=view)
    reflected = 2 * (normal @ view) * normal - view
    assert reflected[2] == pytest.approx(0.01, abs=1e-4)
    diffuse = floor({"kind": Lobe.DIFFUSE, "space": NormalSpace.WORLD, "normal": unit(-0.5, 0, 0.8)})
    np.testing.assert_allclose(normal_of(diffuse, view=view), unit(-0.5, 0, 0.8), atol=1e-6)


@compiled
def _scatter(scene, directions, numbers, from_light, onward, weight):
    for i in range(len(directions)):
        hit = hit_at(scene, row(directions, i), np.int32(0), ONE, np.float32(0.2), np.float32(0.3))
        a, b, c = row(numbers, i)
        on = scatter(scene, hit, row(directions, i), a, b, c, ALL_LOBES, from_light, DIFFUSE_RAY)
        put(onward, i, on.direction)
        put(weight, i, on.weight)


def scattered(scene, towards, from_light):
    """Directions and weights of rays that come from directions (n, 3) to the plane."""
    numbers = np.random.default_rng(5).random((len(towards), 3), np.float32)
    onward, weight = np.empty((2, len(towards), 3), np.float32)
    _scatter(scene.arrays, -towards, numbers, from_light, onward, weight)
    return onward, weight


@compiled
def _shadowing(shading, normal, light, out):
    for i in range(len(light)):
        out[i] = bump_shadowing(row(shading, 0), row(normal, 0), row(light, i))


LEAN = {"space": NormalSpace.WORLD, "normal": unit(0.55, 0.2, 0.8)}
LITTLE = {"space": NormalSpace.WORLD, "normal": unit(0.2, 0.1, 0.9)}
"""So little that gloss mirrors no view of the test into the surface, where its normal would depend on the view."""
MATERIALS = {
    "diffuse": [{"kind": Lobe.DIFFUSE, "weight": 0.8, **LEAN}],
    "translucent": [{"kind": Lobe.TRANSLUCENT, "weight": 0.8, **LEAN}],
    "rough metal": [{"kind": Lobe.GLOSSY, "roughness": 0.6, **LITTLE}],
    "a coat over a bumped base": [
        {"kind": Lobe.DIFFUSE, "weight": 0.8, "layer": 1, **LEAN},
        {"kind": Lobe.GLOSSY, "roughness": 0.5, "f0": 0.3, "f90": 1},
    ],
    "a bumped coat": [
        {"kind": Lobe.DIFFUSE, "weight": 0.8, "layer": 1},
        {"kind": Lobe.GLOSSY, "roughness": 0.5, "f0": 0.3, "f90": 1, **LITTLE},
    ],
}


def cosine_hemisphere(n, seed):
    u, v = np.random.default_rng(seed).random((2, n))
    r, phi = np.sqrt(u), 2 * np.pi * v
    return np.stack([r * np.cos(phi), r * np.sin(phi), np.sqrt(np.maximum(1 - u, 1e-9))], axis=1).astype(np.float32)


@pytest.mark.parametrize("name", MATERIALS)
@pytest.mark.parametrize("smooth", [None, unit(-0.2, 0.1, 1)], ids=["flat", "smooth"])
def test_photons_carry_what_paths_find(name, smooth):
    """From a cone of light to a cone of views: by either way it is the same part of the light."""
    scene = floor(*MATERIALS[name], smooth=smooth)
    light_axis, view_axis = unit(0.3, 0.4, 0.7), unit(-0.1, -0.4, 0.7)
    if name == "translucent":
        view_axis = -view_axis
    wide = np.cos(0.6)
    towards_light, towards_view = cosine_hemisphere(N, 3), cosine_hemisphere(N, 4)
    if name == "translucent":
        towards_view = -towards_view
    onward, weight = scattered(scene, towards_view, False)
    seen = (towards_view @ view_axis > wide) & (onward @ light_axis > wide)
    by_paths = np.where(seen, weight[:, 0], 0)
    onward, weight = scattered(scene, towards_light, True)
    seen = (towards_light @ light_axis > wide) & (onward @ view_axis > wide)
    by_photons = np.where(seen, weight[:, 0], 0)
    noise = np.hypot(by_paths.std(), by_photons.std()) / N**0.5
    assert by_paths.mean() > 0.01
    assert by_paths.mean() == pytest.approx(by_photons.mean(), abs=4 * noise)


def test_a_leaning_diffuse_floor_reflects_by_its_own_cosine():
    """∫ ρ/π (N·ω)⁺ G(s·ω) dω over what is above the plane, by a sum over directions."""
    scene, normal = floor(*MATERIALS["diffuse"]), LEAN["normal"]
    light = cosine_hemisphere(N, 7)
    shadow = np.empty(N, np.float32)
    _shadowing(np.float32([[0, 0, 1]]), np.float32([normal]), light, shadow)
    cosine = np.maximum(light @ normal, 0)
    expected = (0.8 * cosine / light[:, 2] * shadow).mean(dtype=np.float64)
    _, weight = scattered(scene, np.broadcast_to(unit(0, 0.1, 1), (N, 3)).copy(), False)
    assert weight[:, 0].mean(dtype=np.float64) == pytest.approx(expected, rel=3e-3)
    assert 0.6 < expected < 0.8


def test_light_from_behind_the_interpolated_surface_is_no_light():
    out = np.empty(3, np.float32)
    light = np.float32([unit(0.9, 0, -0.1), unit(0.9, 0, 0.1), (0, 0, 1)])
    _shadowing(np.float32([[0, 0, 1]]), np.float32([unit(0.7, 0, 0.7)]), light, out)
    assert out[0] == 0 and 0 < out[1] < 1 and out[2] == 1


def test_receivers_over_a_normal_map_take_its_normal():
    scene = floor({"kind": Lobe.DIFFUSE, **LITTLE})
    position = np.float32([[0.1, 0.2, 0.001], [0.3, -0.2, 0.5]])
    up = np.tile(np.float32([0, 0, 1]), (2, 1))
    receivers = Receivers(position, up, np.full(2, 0.1, np.float32))
    found = on_normal_maps(receivers, scene, EmbreeTracer(scene))
    np.testing.assert_allclose(found.normal, [LITTLE["normal"], (0, 0, 1)], atol=1e-6)
    assert found.base_normal is receivers.normal
    plain = scene_of(*plane())
    assert on_normal_maps(receivers, plain, EmbreeTracer(plain)) is receivers
