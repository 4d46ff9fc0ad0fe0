"""The frames of closures with normals of their own at single points, as plain Python."""

from dataclasses import replace

import numpy as np
import pytest
from photon_bake.addon.bsdf import Lobe, albedos, frames
from photon_bake.addon.bsdf.closure import bsdf_of
from photon_bake.addon.bsdf.frames import Frame
from photon_bake.addon.core.vec3 import to_local, to_world
from photon_bake.addon.scene import NormalSpace
from photon_bake.tests.core.scenes import scene_of
from photon_bake.tests.core.values.lobe_formulas import (
    LIGHTS,
    VIEWS,
    f,
    shadowed,
    triple,
    unit,
)
from photon_bake.tests.core.values.mixed_closures import (
    LEAN,
    METAL,
    SMOOTHED,
    TANGENTS,
    THROUGH,
    WHITE_FLOOR,
    U,
    V,
    floor,
    leaning,
)


def test_directions_in_a_closures_own_frame():
    axis, angle, w = unit(0.3, -0.2, 0.8), 0.7, VIEWS[0]
    frame = Frame(True, axis, (f(np.cos(angle)), f(np.sin(angle))))
    x, y, z = to_local(w, axis)
    expected = x * np.cos(angle) + y * np.sin(angle), y * np.cos(angle) - x * np.sin(angle), z
    assert frames.into(frame, w) == pytest.approx(expected, abs=1e-6)
    assert frames.out_of(frame, frames.into(frame, w)) == pytest.approx(w, abs=1e-6)
    assert frames.into(frames.THE_POINTS, w) == w == frames.out_of(frames.THE_POINTS, w)


def normal_of(one, view=(0, 0, 1), back=False, smooth=None):
    scene = floor(one, smooth=smooth)
    return np.float64(frames.own_normal(scene, bsdf_of(scene, 0, U, V, back), 0, triple(view)))


def between(normal, strength, smooth):
    mixed = strength * np.array(normal) + (1 - strength) * np.array(smooth)
    return mixed / np.linalg.norm(mixed)


@pytest.mark.parametrize("back", [False, True])
def test_own_normals_of_each_space(back):
    side = -1 if back else 1
    assert normal_of(WHITE_FLOOR, back=back, smooth=SMOOTHED) == pytest.approx(side * SMOOTHED, abs=1e-6)
    x, y, z = 0.3, -0.2, 0.9
    tangent = x * TANGENTS[0] + y * TANGENTS[1] + z * SMOOTHED
    found = normal_of(leaning(WHITE_FLOOR, (x, y, z), NormalSpace.TANGENT), back=back, smooth=SMOOTHED)
    assert found == pytest.approx(side * tangent / np.linalg.norm(tangent), abs=1e-6)
    for strength in (0.6, 1.7):
        given = strength * LEAN
        found = normal_of(leaning(WHITE_FLOOR, given), back=back, smooth=SMOOTHED)
        assert found == pytest.approx(between(side * LEAN, strength, side * SMOOTHED), abs=1e-6)
        turned = np.array([[0.2, -1, 0.2], [1, 0.4, 0.1], [0.3, -0.1, 1]]) @ LEAN
        turned /= np.linalg.norm(turned)
        found = normal_of(leaning(WHITE_FLOOR, given, NormalSpace.OBJECT), back=back, smooth=SMOOTHED)
        assert found == pytest.approx(between(side * turned, strength, side * SMOOTHED), abs=1e-6)


@pytest.mark.parametrize("back", [False, True])
def test_heights_lean_the_normal_against_their_slope(back):
    """Texture coordinates are x and y: the slope is (hx, hy, 0), put into the plane of the smooth normal."""
    side, slope, strength = -1 if back else 1, np.array([0.5, -0.3, 0]), 0.8
    shading, geometric = side * SMOOTHED, np.array([0, 0, side])
    in_plane = slope - geometric * (slope @ shading) / (geometric @ shading)
    leaned = shading - in_plane
    given = (0.5, -0.3, strength)
    found = normal_of(leaning(WHITE_FLOOR, given, NormalSpace.HEIGHT), back=back, smooth=SMOOTHED)
    assert found == pytest.approx(between(leaned / np.linalg.norm(leaned), strength, shading), abs=1e-5)


def test_slopes_of_triangles_of_any_shape():
    """Of a height a x + b y by texture coordinates that are an affine map of the triangle's plane."""
    corners = np.float32([(0, 0, 0), (2, 0.5, 0.3), (0.4, 1.5, -0.6)])
    scene = replace(
        scene_of(corners, [(0, 1, 2)]), corner_uvs=np.float32([[(0.1, 0.2), (0.9, 0.4), (0.3, 1.1)]])
    ).arrays
    found = np.float64(frames._slope(scene, 0, f(0.7), f(-0.4)))
    heights = np.float32([(0.1, 0.2), (0.9, 0.4), (0.3, 1.1)]) @ [0.7, -0.4]
    e1, e2 = corners[1] - corners[0], corners[2] - corners[0]
    assert found @ e1 == pytest.approx(heights[1] - heights[0], rel=1e-4)
    assert found @ e2 == pytest.approx(heights[2] - heights[0], rel=1e-4)
    assert found @ np.cross(e1, e2) == pytest.approx(0, abs=1e-5)


def test_a_normal_of_no_length_is_the_interpolated_one():
    assert normal_of(leaning(WHITE_FLOOR, (0, 0, 0)), smooth=SMOOTHED) == pytest.approx(SMOOTHED, abs=1e-6)
    against = normal_of(leaning(WHITE_FLOOR, 0.5 * np.array([0, 0, -1.0])))
    assert against == pytest.approx([0, 0, 1])


def test_mirroring_normals_turn_until_the_view_is_mirrored_over_the_surface():
    """To a height of 0.01 or nine tenths of the view's, in the plane of both normals; matte ones stay."""
    for kind in Lobe:
        steep, view = unit(-0.7, 0.1, 0.6), unit(0.8, 0.1, 0.35)
        found = normal_of(leaning({"kind": kind, "roughness": 0.5}, steep), view=view)
        mirrored = 2 * (found @ view) * found - view
        glossy = Lobe.GLOSSY, Lobe.GLASS, Lobe.GLOSSY_TOON, Lobe.PANE, Lobe.FIBRE
        if kind in (Lobe.TRANSLUCENT, Lobe.SUBSURFACE, *glossy):
            assert mirrored[2] == pytest.approx(0.01, abs=1e-5) and np.linalg.norm(found) == pytest.approx(1, abs=1e-5)
            assert np.cross(found, [0, 0, 1]) @ np.array(steep) == pytest.approx(0, abs=1e-6)
            assert np.array(steep)[:2] @ found[:2] > 0
        else:
            assert found == pytest.approx(steep, abs=1e-6)
    up = triple((0, 0, 1))
    for view, normal, height in (
        (unit(0.9, -0.3, 0.3), unit(-0.8, 0.4, 0.3), 0.01),
        (unit(0.9, 0, 0.005), unit(-0.5, 0.1, 0.8), 0.01),
        (unit(-0.5, 0.4, 0.5), unit(-0.9, 0.2, 0.2), 0.01),  # beyond the view
    ):
        found = np.float64(frames._valid_normal(up, view, normal))
        vz = np.float64(view) @ [0, 0, 1]
        assert 2 * (found @ np.float64(view)) * found[2] - vz == pytest.approx(min(height, 0.9 * vz), abs=1e-4)
        assert np.linalg.norm(found) == pytest.approx(1, abs=1e-5)
    for view, normal in ((unit(0.3, 0.1, 0.8), unit(-0.1, 0, 1)), (unit(0.3, 0.1, -0.8), unit(-0.7, 0, 0.2))):
        assert frames._valid_normal(up, view, normal) == normal


def test_frames_of_closures_with_tangents():
    """The tangent across the closure's normal, turned about it by its share of a turn."""
    scene = floor({**leaning(METAL), "stretch": (1.5, 0.1, 0)})
    bsdf = bsdf_of(scene, 0, U, V, False)
    frame = frames.frame_of(scene, bsdf, 0, VIEWS[0])
    assert bsdf.perturbed and frame.own
    axis = np.float64(to_world(frame.axis, bsdf.normal))
    assert axis == pytest.approx(LEAN, abs=1e-6)
    tangent = np.float64(to_world(frames.out_of(frame, triple((1, 0, 0))), bsdf.normal))
    across = TANGENTS[2] - (TANGENTS[2] @ axis) * axis
    across /= np.linalg.norm(across)
    turned = across * np.cos(0.2 * np.pi) + np.cross(axis, across) * np.sin(0.2 * np.pi)
    assert tangent == pytest.approx(turned, abs=1e-5)
    plain = frames.frame_of(floor(leaning(METAL)), bsdf, 0, VIEWS[0])
    assert plain.own and plain.turn == (1, 0)
    assert frames.frame_of(floor(METAL), bsdf_of(floor(METAL), 0, U, V, False), 0, VIEWS[0]) == frames.THE_POINTS
    none = np.zeros((0, 3, 3, 3), np.float32)
    assert frames._turn(none, 0, U, V, bsdf.normal, frame.axis, f(0.1)) == (1, 0)
    upright = np.tile(np.float32([0, 0, 1]), (1, 3, 3, 1))
    assert frames._turn(upright, 0, U, V, triple((0, 0, 1)), triple((0, 0, 1)), f(0.1)) == (1, 0)


# Bumps


def test_bumps_shadow_grazing_light():
    for normal in (LEAN, np.array(unit(0.95, 0, 0.2)), np.array(unit(0.2, 0.3, -0.5))):
        for light in (*LIGHTS, unit(0.9, 0, -0.1), unit(0.2, 0.1, -0.8)):
            found = frames.bump_shadowing(triple(SMOOTHED), triple(normal), light)
            assert found == pytest.approx(shadowed(SMOOTHED, normal, np.float64(light)), rel=1e-4, abs=1e-6)
    up = triple((0, 0, 1))
    assert frames.bump_shadowing(up, triple(LEAN), unit(1, 0, 1e-7)) == 0
    assert frames.bump_shadowing(up, triple(LEAN), up) == 1


def test_what_closures_take_of_light():
    """(N·ω)⁺/|n·ω| and what bumps shadow; of a translucent one the mean over views that turn its normal."""
    scene = floor(leaning(WHITE_FLOOR), leaning({**WHITE_FLOOR, "kind": Lobe.TRANSLUCENT}), smooth=SMOOTHED)
    bsdf = bsdf_of(scene, 0, U, V, False)
    for light in (*LIGHTS, unit(0.3, 0.1, 0.2), unit(-0.9, -0.1, 0.02), unit(0.99, 0.1, 0.01), unit(0.1, 0.2, -0.8)):
        w = np.float64(to_world(light, bsdf.normal))
        expected = min(max(LEAN @ w, 0) / abs(w[2]), 16) * shadowed(SMOOTHED, LEAN, w)
        assert frames.received(scene, bsdf, 0, light) == pytest.approx(expected, rel=1e-3, abs=1e-6)
        expected = min(max(LEAN @ w, 0) / abs(w[2]), 16)
        assert frames.received(scene, bsdf, 1, light) == pytest.approx(expected, rel=1e-3, abs=1e-6)
        assert albedos.weight_received(scene, bsdf, Lobe.DIFFUSE, triple(w)) == pytest.approx(
            np.multiply(frames.received(scene, bsdf, 0, light), (0.6, 0.4, 0.2)), rel=1e-4, abs=1e-6
        )
    plain = floor(WHITE_FLOOR)
    assert frames.received(plain, bsdf_of(plain, 0, U, V, False), 0, LIGHTS[0]) == 1


@pytest.mark.parametrize("kind", [Lobe.TRANSLUCENT, Lobe.SUBSURFACE])
def test_normals_of_what_shines_through_are_turned_by_four_views(kind):
    """And light that enters a body is shadowed by bumps."""
    steep = np.array(unit(-0.8, 0.5, 0.3))
    scene = floor(leaning({**THROUGH, "kind": kind, "weight": 1}, steep))
    bsdf = bsdf_of(scene, 0, U, V, False)
    around = np.sqrt(0.5) * np.array([(1, 0), (-1, 0), (0, 1), (0, -1)])
    views = [to_world(triple((x, y, np.sqrt(0.5))), bsdf.normal) for x, y in around]
    normals = [np.float64(frames.own_normal(scene, bsdf, 0, view)) for view in views]
    assert len({tuple(n.round(4)) for n in normals}) > 1
    for light in (unit(-0.5, 0.5, 0.6), unit(0.5, 0.4, 0.3)):
        w = np.float64(to_world(light, bsdf.normal))
        shares = [shadowed(np.array([0, 0, 1]), n, w) if kind == Lobe.SUBSURFACE else 1 for n in normals]
        expected = np.mean([max(n @ w, 0) * share for n, share in zip(normals, shares, strict=True)])
        found = frames.received(scene, bsdf, 0, light)
        assert found == pytest.approx(min(expected / abs(light[2]), 16), rel=1e-4)


def test_photons_cosines_at_leaning_closures():
    wo, wi, own_wo, own_wi = unit(0.2, 0.1, 0.5), unit(0.4, 0.2, 0.8), unit(0, 0.3, 0.7), unit(0.5, 0.1, -0.6)
    expected = abs(own_wo[2] / wo[2] * wi[2] / own_wi[2])
    assert frames.adjoint(wo, wi, own_wo, own_wi) == pytest.approx(expected, rel=1e-5)
    assert frames.adjoint(unit(1, 0, 0), wi, own_wo, own_wi) == 16 == frames.adjoint(wo, wi, own_wo, unit(1, 0, 0))
