"""What becomes of a ray at a surface, at single points as plain Python."""

import numpy as np
import pytest
from photon_bake.addon.bsdf import Lobe, frames, glass, mixture, scatter
from photon_bake.addon.bsdf.closure import bsdf_at, bsdf_of, closure_at
from photon_bake.addon.core.vec3 import to_local, to_world
from photon_bake.addon.scene import RayKind
from photon_bake.addon.scene.hit import hit_at, off_surface, shading_normal
from photon_bake.tests.core.values.lobe_formulas import LIGHTS, VIEWS, f, shadowed, triple, unit
from photon_bake.tests.core.values.mixed_closures import (
    CLEAR,
    COAT,
    DIFFUSE,
    HAIR,
    LEAN,
    METAL,
    PANE,
    ROUGH,
    SHEEN,
    SHINY,
    SKIN,
    SMOOTHED,
    THROUGH,
    VELVET,
    WHITE_FLOOR,
    U,
    V,
    floor,
    leaning,
)


def hit_of(scene, direction):
    return hit_at(scene, direction, np.int32(0), f(1), U, V)


def scattered(scene, direction, choice=0.3, from_light=False, lobes=mixture.ALL_LOBES):
    hit = hit_of(scene, direction)
    found = scatter.scatter(scene, hit, direction, f(choice), f(0.37), f(0.81), lobes, from_light, DIFFUSE)
    return hit, found


def sampled(scene, hit, axis, direction, from_light, choice=0.3):
    """The sample of the mixture around an axis: with it, the local direction that the light came from."""
    bsdf, wo = bsdf_at(scene, hit, DIFFUSE), to_local(triple(-np.array(direction)), axis)
    found = mixture.sample_bsdf(scene, bsdf, wo, f(choice), f(0.37), f(0.81), mixture.ALL_LOBES, from_light)
    return found, wo, bsdf


INTO = unit(0.4, -0.3, -0.7)


@pytest.mark.parametrize("one", [WHITE_FLOOR, THROUGH, METAL, CLEAR, ROUGH, SHEEN, VELVET, SHINY, PANE, SKIN, HAIR])
@pytest.mark.parametrize("from_light", [False, True])
@pytest.mark.parametrize("direction", [INTO, unit(0.4, -0.3, 0.7)])
def test_rays_go_on_by_the_mixture(one, from_light, direction):
    """Around the interpolated normal; photons by the cosine go around the geometric one, and carry (N·ω)⁺/|n·ω|."""
    scene = floor(one, smooth=SMOOTHED)
    hit, on = scattered(scene, direction, from_light=from_light)
    side = np.sign(np.array(hit.normal)[2])
    axis = tuple(shading_normal(scene, hit))
    assert np.array(axis) == pytest.approx(side * SMOOTHED, abs=1e-6)
    sample, _, _ = sampled(scene, hit, axis, direction, from_light)
    weight, kind = np.float64(sample.weight), one["kind"]
    correction = max(-np.dot(axis, direction), 0) / abs(np.dot(hit.normal, direction))
    lambertian = kind in (Lobe.DIFFUSE, Lobe.TRANSLUCENT, Lobe.SUBSURFACE)
    if from_light and lambertian:
        weight, axis = weight * correction, hit.normal
    onward = np.float64(to_world(sample.wi, axis))
    if from_light and kind in (Lobe.ROUGH_DIFFUSE, Lobe.SHEEN, Lobe.VELVET):
        weight = weight * correction * abs(onward[2]) / sample.wi[2]
    assert np.float64(on.direction) == pytest.approx(onward, abs=1e-5)
    goes_up = onward @ np.array(hit.normal) > 0
    alive = (goes_up == (sample.wi[2] > 0) or kind == Lobe.FIBRE) and weight.any()
    assert on.alive == alive
    assert on.weight == pytest.approx(weight if alive else [0, 0, 0], rel=1e-4)
    assert on.lobe == kind and on.specular == sample.specular and on.rough == sample.rough
    assert on.lamplight == sample.lamplight
    assert on.origin == off_surface(scene, hit, 1 if goes_up else -1)
    expected = RayKind.DIFFUSE
    if kind in (Lobe.GLOSSY, Lobe.GLOSSY_TOON):
        expected = RayKind.GLOSSY
    elif kind in (Lobe.GLASS, Lobe.PANE, Lobe.FIBRE):
        expected = RayKind.GLOSSY if goes_up else RayKind.TRANSMITTED
    assert on.kind == expected


def test_grazing_corrections_are_bounded():
    up, graze = triple((0, 0, 1)), unit(1, 0, -1e-3)
    assert scatter.shading_normal_correction(unit(-1, 0, 0.1), up, graze) == 16
    assert scatter.shading_normal_correction(up, up, unit(0.3, 0.1, 0.5)) == 0
    assert scatter.shading_normal_correction(triple(SMOOTHED), up, INTO) == pytest.approx(
        -np.dot(SMOOTHED, INTO) / -INTO[2], rel=1e-5
    )
    assert scatter.facing(triple(SMOOTHED), up, INTO) == triple(SMOOTHED)
    assert scatter.facing(triple(SMOOTHED), up, unit(-0.3, 0.2, 0.05)) == up
    assert scatter.facing(unit(-1, 0, 0.1), up, unit(0, 0, -1)) == unit(-1, 0, 0.1)
    assert scatter.facing(unit(1, 0, 0.0005), up, unit(0, 0, -1)) == up


@pytest.mark.parametrize("one", [WHITE_FLOOR, THROUGH, METAL, ROUGH, SHEEN, VELVET, SHINY, PANE, SKIN, HAIR])
@pytest.mark.parametrize("from_light", [False, True])
def test_rays_at_closures_that_lean(one, from_light):
    """Bumps shadow diffuse and some broad lobes; photons come and go by cosines at the geometric normal."""
    scene = floor(leaning(one))
    hit, on = scattered(scene, INTO, from_light=from_light)
    up = tuple(hit.normal)
    sample, wo, _ = sampled(scene, hit, up, INTO, from_light)
    wi, kind, axis = np.float64(sample.wi), one["kind"], np.float64(sample.frame.axis)
    expected = 1.0
    enters = from_light and kind == Lobe.SUBSURFACE
    if enters or kind in (Lobe.DIFFUSE, Lobe.ROUGH_DIFFUSE, Lobe.SHEEN, Lobe.TOON):
        local = np.float64(to_local(triple(up), up))
        expected = shadowed(local, axis, np.float64(wo) if from_light else wi)
    if from_light and kind in (Lobe.DIFFUSE, Lobe.TRANSLUCENT, Lobe.SUBSURFACE):
        expected *= min(max(axis @ np.float64(wo), 0) / wo[2], 16)
    elif from_light and kind != Lobe.FIBRE:
        own_wo, own_wi = (np.float64(frames.into(sample.frame, w)) for w in (wo, sample.wi))
        expected *= min(own_wo[2] / wo[2] * abs(wi[2] / own_wi[2]), 16)
    weight = np.float64(sample.weight) * expected
    assert np.float64(on.direction) == pytest.approx(np.float64(to_world(sample.wi, up)), abs=1e-5)
    assert on.alive and on.weight == pytest.approx(weight, rel=1e-3)


def two_faced():
    """A front of one diffuse closure, and a back of diffuse and translucent ones."""
    several = [WHITE_FLOOR, {**WHITE_FLOOR, "weight": 0.5}, {**THROUGH, "weight": (0.2, 0.4, 0.1)}]
    return floor(*several, seen_as=[[0, 1] * 6, [1] * 12], start=[0, 1, 3])


def test_photons_choose_their_way_where_sides_differ():
    """Back by what the front reflects, through by what those behind see transmitted: half of them each."""
    scene = two_faced()
    _, back = scattered(scene, INTO, 0.3, from_light=True)
    assert back.alive and back.direction[2] > 0 and back.weight == pytest.approx((1.2, 0.8, 0.4), rel=1e-5)
    _, through = scattered(scene, INTO, 0.7, from_light=True)
    assert through.alive and through.direction[2] < 0 and through.lobe == Lobe.TRANSLUCENT
    assert through.weight == pytest.approx((0.4, 0.8, 0.2), rel=1e-5)
    below = unit(0.4, -0.3, 0.7)  # the front does not transmit: all go back, by the back's reflection alone
    for choice in (0.1, 0.9):
        _, on = scattered(scene, below, choice, from_light=True)
        assert on.direction[2] < 0 and on.weight == pytest.approx([0.5] * 3, rel=1e-5) and on.lobe == Lobe.DIFFUSE
    _, path = scattered(scene, INTO, 0.7)
    assert path.weight == pytest.approx((0.6, 0.4, 0.2), rel=1e-5)


def test_ways_of_photons():
    scene = two_faced()
    bsdf = bsdf_of(scene, 0, U, V, False)
    lobes = mixture.ALL_LOBES
    way, of, choice, left, inverse = scatter._way_of_photon(scene, bsdf, f(0.2), lobes, DIFFUSE)
    assert (way, of, inverse) == (1, bsdf, 2) and choice == pytest.approx(0.4)
    through = 1 << Lobe.TRANSLUCENT | 1 << Lobe.PANE | 1 << Lobe.FIBRE
    assert left == lobes & ~through
    way, of, choice, left, inverse = scatter._way_of_photon(scene, bsdf, f(0.8), lobes, DIFFUSE)
    assert way == -1 and of[:2] == (1, 3) and inverse == 2 and choice == pytest.approx(0.6)
    assert left == through | 1 << Lobe.GLASS
    way, of, choice, left, inverse = scatter._way_of_photon(scene, bsdf, f(0.8), 1 << Lobe.DIFFUSE, DIFFUSE)
    assert (way, of, choice, left, inverse) == (1, bsdf, f(0.8), 1, 1)
    behind = bsdf_of(scene, 0, U, V, True)
    assert scatter._way_of_photon(scene, behind, f(0.8), lobes, DIFFUSE)[4] == 1


def test_glass_sends_photons_one_way_where_sides_differ():
    """What a closure of the chosen way sends the other way is none of its light."""
    scene = floor(CLEAR, {**CLEAR, "ior": 1.3}, seen_as=[[0, 1] * 6, [1] * 12], start=[0, 1, 2])
    for choice in np.linspace(0.02, 0.98, 13):
        _, on = scattered(scene, INTO, choice, from_light=True)
        if on.alive:
            assert (on.direction[2] > 0) == (choice < 0.5)


@pytest.mark.parametrize("several", [(CLEAR,), (WHITE_FLOOR, {**CLEAR, "layer": 2}, COAT), (leaning(CLEAR),)])
def test_glass_sends_a_path_both_ways(several):
    scene = floor(*several, smooth=SMOOTHED if len(several) > 1 else None)
    hit = hit_of(scene, INTO)
    axis = tuple(scatter.axis_at(scene, hit, INTO))
    bsdf, wo = bsdf_at(scene, hit, DIFFUSE), to_local(triple(-np.array(INTO)), axis)
    k = len(several) // 2
    one, frame = closure_at(scene, bsdf, k), frames.frame_of(scene, bsdf, k, wo)
    facet = glass.facet_of(one, frames.into(frame, wo), f(0.37), f(0.81))
    left = np.float64(mixture.transmittance_to(scene, bsdf, k, wo))
    both = scatter.scatter_both_ways(scene, hit, INTO, f(0.3), f(0.37), f(0.81), DIFFUSE)
    for on, reflects in zip(both, (True, False), strict=True):
        wi, weight = glass.scatter(one, frames.into(frame, wo), facet, reflects, False)
        onward = np.float64(to_world(frames.out_of(frame, wi), axis))
        assert np.float64(on.direction) == pytest.approx(onward, abs=1e-5)
        assert on.alive and on.weight == pytest.approx(np.float64(weight) * left, rel=1e-4)
        assert on.lobe == Lobe.GLASS and on.specular and not on.rough
        assert on.kind == (RayKind.GLOSSY if reflects else RayKind.TRANSMITTED)
        assert on.origin == off_surface(scene, hit, 1 if reflects else -1)
    for on in scatter.scatter_both_ways(floor(WHITE_FLOOR), hit, INTO, f(0.3), f(0.37), f(0.81), DIFFUSE):
        assert not on.alive and on.weight == (0, 0, 0) and on.lobe == Lobe.GLASS


def test_axes_and_normals_by_what_they_are_for():
    smooth, bumped = floor(WHITE_FLOOR, smooth=SMOOTHED), floor(leaning(WHITE_FLOOR), smooth=SMOOTHED)
    hit = hit_of(smooth, INTO)
    up = tuple(hit.normal)
    assert scatter.axis_at(smooth, hit, INTO) == pytest.approx(SMOOTHED, abs=1e-6)
    assert scatter.axis_at(bumped, hit, INTO) == up == scatter.lit_normal(bumped, hit)
    assert scatter.axis_at(smooth, hit, unit(-0.9, 0.6, -0.05)) == up
    assert scatter.lit_normal(smooth, hit) == pytest.approx(SMOOTHED, abs=1e-6)
    assert scatter.lambertian_normal(smooth, hit) == pytest.approx(SMOOTHED, abs=1e-6)
    other = np.array(unit(-0.4, 0.1, 0.8), np.float64)
    several = [
        leaning({**WHITE_FLOOR, "weight": 0.6}),
        leaning({**ROUGH, "weight": 0.3}, other),
        leaning(METAL, (1, 0, 0)),
    ]
    mixed = floor(*several, leaning({**SKIN, "weight": 0.2}, other), leaning({**THROUGH, "weight": 0.1}, other))
    expected = 0.6 * LEAN + 0.6 * other
    found = scatter.lambertian_normal(mixed, hit)
    assert found == pytest.approx(expected / np.linalg.norm(expected), abs=1e-5)
    assert scatter.lambertian_normal(floor(leaning(METAL), smooth=SMOOTHED), hit) == pytest.approx(SMOOTHED, abs=1e-6)


def test_f_of_closures_that_lean():
    """Their cosine over the point's, and what bumps shadow of broad lobes."""
    several = [leaning({**METAL, "layer": 3}), leaning(ROUGH), leaning(VELVET), COAT]
    scene = floor(*several, smooth=SMOOTHED)
    bsdf, wo = bsdf_of(scene, 0, U, V, False), VIEWS[0]
    for wi in LIGHTS:
        expected = np.zeros(3)
        for k, bumps in ((0, False), (1, True), (2, False), (3, False)):
            one, frame = closure_at(scene, bsdf, k), frames.frame_of(scene, bsdf, k, wo)
            own = frames.into(frame, wo), frames.into(frame, wi)
            file = mixture.glossy if one.kind == Lobe.GLOSSY else mixture.broad
            value = np.float64(file.evaluate(one, *own)) * max(own[1][2], 0) / wi[2]
            value = value * mixture.transmittance_to(scene, bsdf, k, wo)
            if bumps:
                local = to_local(triple(SMOOTHED), bsdf.normal)
                value = value * shadowed(np.float64(local), np.float64(frame.axis), np.float64(wi))
            expected += value * (max(file.evaluate(one, *own)) < 1 or one.kind != Lobe.GLOSSY)
        assert mixture.evaluate_direct(scene, bsdf, wo, wi) == pytest.approx(expected, rel=1e-4)
