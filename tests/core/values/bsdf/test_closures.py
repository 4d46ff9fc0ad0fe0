"""The closures of a point and their albedos at single points, as plain Python."""

from dataclasses import replace

import numpy as np
import pytest
from photon_bake.addon import bsdf as room
from photon_bake.addon.bsdf import SMOOTH, Lobe, albedos, glossy, mixture
from photon_bake.addon.bsdf import closure as parts
from photon_bake.addon.bsdf.broad import lobes as others
from photon_bake.addon.scene import Distribution, Materials, RayKind
from photon_bake.addon.scene.closures import N_ANGLES, AngleCurves, angle_cosines
from photon_bake.addon.scene.hit import hit_at
from photon_bake.tests.core.bsdf_points import closures, plastic, points_of
from photon_bake.tests.core.scenes import plane, scene_of
from photon_bake.tests.core.values.lobe_formulas import (
    LIGHTS,
    VIEWS,
    f,
    unit,
)
from photon_bake.tests.core.values.mixed_closures import (
    CLEAR,
    COAT,
    DOWN,
    HAIR,
    METAL,
    MIRROR,
    MIXED,
    PANE,
    ROUGH,
    SHINY,
    THROUGH,
    TINT,
    WHITE_FLOOR,
    point,
)

# Closures of a point


def test_a_closure_takes_its_values():
    scene, bsdf = point({**COAT, "weight": (0.1, 0.2, 0.3), "curve": 1, "edge": (0.5, 0.6, 0.7), "layer": 1}, METAL)
    one = parts.closure_at(scene, bsdf, 0)
    assert one.weight == pytest.approx((0.1, 0.2, 0.3)) and one.f0 == pytest.approx([0.04] * 3) and one.f90 == (1, 1, 1)
    assert one.edge == pytest.approx((0.5, 0.6, 0.7)) and one.film == (0, 0, 0) and one.stretch == 1
    assert (one.kind, one.layer, one.curve, one.distribution) == (Lobe.GLOSSY, 1, 1, 0)
    assert one.roughness == pytest.approx(0.4) and one.ior == 1.5 and one.fresnel and one.preserves_energy
    assert parts.closure_at(scene, bsdf, 1).edge == (1, 1, 1)
    scene, bsdf = point({**WHITE_FLOOR, "roughness": 0.5, "f0": 0.5})
    assert parts.closure_at(scene, bsdf, 0)[2:5] == (1, (0, 0, 0), (0, 0, 0))


def test_glass_is_seen_from_both_sides():
    filmed = {**CLEAR, "film": (400, 1.3, 1)}
    for back, ior, film in ((False, 1.5, 1.3), (True, 1 / 1.5, 1.3 / 1.5)):
        one = parts.closure_at(*point(filmed, back=back), 0)
        assert one.ior == pytest.approx(ior) and one.film == pytest.approx((400, film, 1))
    assert parts.closure_at(*point(COAT, back=True), 0).ior == 1.5


def test_stretched_facets_keep_their_area_where_they_fit():
    for roughness, stretch in ((0.5, 1.6), (0.5, 0.4), (0.9, 2.0)):
        alpha = roughness**2
        x, y = min(alpha * stretch, 1), min(alpha / stretch, 1)
        scene, bsdf = point({**METAL, "roughness": roughness, "stretch": stretch})
        found = parts.roughness_at(scene, bsdf, 0)
        assert found == pytest.approx(((x * y) ** 0.25, np.sqrt(x / y)), rel=1e-5)
        one = parts.closure_at(scene, bsdf, 0)
        assert parts.facets_of(one)[1:] == pytest.approx((x, y), rel=1e-5)
    assert parts._stretched(f(0), f(2)) == (0, 1)
    assert parts.roughness_at(*point(METAL), 0) == (f(0.6), 1)


def test_curves_over_the_angle():
    curves = np.float32([np.linspace(1, 0.2, N_ANGLES), np.linspace(0, 1, N_ANGLES) ** 2])
    scene, bsdf = point(WHITE_FLOOR, THROUGH, by_angle=AngleCurves(np.int32([1, -1]), curves))
    for cos in (0.0, 0.03, 0.37, 0.9, 1.0):
        expected = np.interp(np.sqrt(cos), np.sqrt(angle_cosines()), curves[1])
        assert parts.angle_weight(scene, 0, f(cos)) == pytest.approx(expected, abs=1e-5)
        assert parts.angle_weight(scene, 1, f(cos)) == 1
    assert parts.angle_weight(scene, 0, f(-0.5)) == 0
    view = unit(0.4, 0.1, -0.5)
    expected = np.interp(np.sqrt(-view[2]), np.sqrt(angle_cosines()), curves[1])
    assert mixture.transmittance_to(scene, bsdf, 0, view) == pytest.approx([expected] * 3, abs=1e-5)


def test_sides_and_kinds_of_rays_see_their_own_closures():
    """The front is material 0, the back 1, and cameras see 2 from both sides."""
    of = replace(closures(WHITE_FLOOR, METAL, CLEAR, THROUGH), start=np.int32([0, 1, 3, 4]))
    seen_as = np.tile(np.int32([0, 1]), (3, 6))
    seen_as[:, 2 * RayKind.CAMERA : 2 * RayKind.CAMERA + 2] = 2
    scene = points_of(Materials.of(3, closures=of, seen_as=seen_as), 1).scene
    at = 0, f(0.2), f(0.3)
    front, back = parts.bsdf_of(scene, *at, False), parts.bsdf_of(scene, *at, True)
    assert front[:2] == (0, 1) and back[:2] == (1, 3) and not front.back and back.back
    assert front.normal == (0, 0, 1) and back.normal == (0, 0, -1) and front[2:5] == at and not front.perturbed
    camera = parts.seen_by_camera(scene, *at, True)
    assert camera[:2] == (3, 4) and camera.back
    behind = parts.seen_from_behind(scene, front, RayKind.DIFFUSE)
    assert behind[:2] == (1, 3) and behind.normal == (0, 0, 1) and not behind.back
    for direction, expected in (((0, 0, -1), (0, 1)), ((0, 0, 1), (1, 3))):
        hit = hit_at(scene, tuple(map(f, direction)), 0, f(1), *at[1:])
        assert parts.bsdf_at(scene, hit, RayKind.GLOSSY)[:2] == expected
        assert parts.bsdf_at(scene, hit, RayKind.CAMERA)[:2] == (3, 4)
        assert parts.seen_otherwise(scene, hit.triangle, hit.back, RayKind.CAMERA)
        assert not parts.seen_otherwise(scene, hit.triangle, hit.back, RayKind.GLOSSY)
    assert parts.has_lobes(scene, back, 1 << Lobe.GLASS) and parts.has_lobes(scene, back, 1 << Lobe.GLOSSY)
    assert not parts.has_lobes(scene, back, 1 << Lobe.DIFFUSE) and not parts.has_lobes(scene, front, 1 << Lobe.GLASS)
    assert parts.has_lobes(scene, front, parts.TRANSMITTING_LOBES | 1)
    assert not parts.has_lobes(scene, front, parts.TRANSMITTING_LOBES)


def test_sets_of_lobes():
    def bits(*kinds):
        return sum(1 << kind for kind in kinds)

    assert bits(Lobe.TRANSLUCENT, Lobe.GLASS, Lobe.PANE, Lobe.FIBRE) == parts.TRANSMITTING_LOBES
    assert bits(*Lobe) == mixture.ALL_LOBES and bits(Lobe.GLOSSY, Lobe.GLOSSY_TOON) == mixture.GLOSSY_LOBES
    assert bits(Lobe.ROUGH_DIFFUSE, Lobe.SHEEN, Lobe.VELVET, Lobe.TOON) == mixture.BROAD_LOBES
    assert bits(Lobe.ROUGH_DIFFUSE, Lobe.SHEEN, Lobe.TOON) == mixture.BUMPED_LOBES
    assert bits(Lobe.SHEEN, Lobe.VELVET, Lobe.TOON) == mixture.DIRECTED_LOBES
    assert bits(Lobe.GLOSSY, Lobe.GLASS, Lobe.GLOSSY_TOON, Lobe.PANE, Lobe.FIBRE) == mixture.NARROW_LOBES
    assert bits(Lobe.DIFFUSE, Lobe.TRANSLUCENT) == mixture._LAMBERTIAN_LOBES
    assert [kind for kind in Lobe if mixture.is_cosine_lobe(kind)] == [Lobe.DIFFUSE, Lobe.TRANSLUCENT, Lobe.SUBSURFACE]


# Albedos


def test_albedos_add_up_over_closures_and_layers():
    scene, bsdf = point(*MIXED)
    for wo in VIEWS:
        cos, left = wo[2], np.float64(mixture.transmittance_to(scene, bsdf, 0, wo))
        of = {one["kind"]: parts.closure_at(scene, bsdf, k) for k, one in enumerate(MIXED)}
        broad = sum(np.float64(others.albedo(of[kind], cos)) for kind in (Lobe.SHEEN, Lobe.VELVET, Lobe.TOON))
        broad = broad + left * others.albedo(of[Lobe.ROUGH_DIFFUSE], cos)
        matte = left * of[Lobe.DIFFUSE].weight + of[Lobe.SUBSURFACE].weight
        gloss = sum(np.float64(glossy.albedo(parts.closure_at(scene, bsdf, k), cos)) for k in (2, 3))
        gloss = gloss + others.albedo(of[Lobe.GLOSSY_TOON], cos)
        assert albedos.diffuse_albedo(scene, bsdf, wo) == pytest.approx(matte + broad, rel=1e-5)
        assert albedos.broad_albedo(scene, bsdf, wo, mixture.ALL_LOBES) == pytest.approx(broad, rel=1e-5)
        only = albedos.broad_albedo(scene, bsdf, wo, 1 << Lobe.VELVET | 1 << Lobe.GLOSSY)
        assert only == pytest.approx(others.albedo(of[Lobe.VELVET], cos), rel=1e-6)
        assert albedos.translucent_albedo(scene, bsdf, wo) == pytest.approx(of[Lobe.TRANSLUCENT].weight)
        assert albedos.glossy_albedo(scene, bsdf, wo) == pytest.approx(gloss, rel=1e-5)
    behind = albedos.glossy_albedo(scene, bsdf, DOWN)
    assert behind == pytest.approx(albedos.glossy_albedo(scene, bsdf, unit(1, 0, 0)))
    assert albedos.diffuse_albedo(scene, bsdf, DOWN)[0] > 0


def test_weights_of_a_kind_and_what_glass_does_at_most():
    scene, bsdf = point(WHITE_FLOOR, {**WHITE_FLOOR, "weight": 0.25}, THROUGH)
    expected = np.array([0.6, 0.4, 0.2]) + 0.25
    assert albedos.total_weight(scene, bsdf, Lobe.DIFFUSE) == pytest.approx(expected)
    assert albedos.weight_received(scene, bsdf, Lobe.DIFFUSE, LIGHTS[0]) == pytest.approx(expected)
    tinted = {**CLEAR, "weight": (0.5, 0.6, 0.7)}
    scene, bsdf = point(tinted, HAIR, WHITE_FLOOR, PANE)
    expected = np.array([0.5 * 0.9, 0.6 * 0.8, 0.7 * 0.95]) + [0.2, 0.3, 0.4] + 0.4
    assert albedos.glass_albedo(scene, bsdf) == pytest.approx(expected)


def test_what_layers_leave_to_all_lambertian_lobes():
    wo = VIEWS[0]
    scene, bsdf = point({**WHITE_FLOOR, "layer": 1}, COAT)
    left = float(glossy.transmittance(parts.closure_at(scene, bsdf, 1), wo[2]))
    assert albedos.base_transmittance(scene, bsdf, wo) == pytest.approx([left] * 3, rel=1e-5)
    scene, bsdf = point({**WHITE_FLOOR, "weight": 0, "layer": 1}, COAT)
    assert albedos.base_transmittance(scene, bsdf, wo) == pytest.approx([left] * 3, rel=1e-5)
    scene, bsdf = point({**WHITE_FLOOR, "layer": 1}, COAT, {**THROUGH, "weight": (0, 0.3, 0.2)}, METAL, ROUGH)
    weights = np.array([[0.6, 0.4, 0.2], [0, 0.3, 0.2]])
    expected = (weights[0] * left + weights[1]) / weights.sum(axis=0)
    assert albedos.base_transmittance(scene, bsdf, wo) == pytest.approx(expected, rel=1e-5)
    scene, bsdf = point({**WHITE_FLOOR, "weight": (0, 0, 0.5)}, {**THROUGH, "weight": 0})
    assert albedos.base_transmittance(scene, bsdf, wo) == (1, 1, 1)
    assert albedos.base_transmittance(*point(METAL), wo) == (1, 1, 1)


def test_highlights_and_mirrors():
    edge = {**METAL, "roughness": float(SMOOTH)}
    for several, highlights, mirror in (
        ((METAL,), True, False),
        ((edge,), True, False),
        ((MIRROR,), False, True),
        ((MIRROR, TINT), False, True),
        ((TINT,), False, False),
        ((MIRROR, METAL), True, False),
        ((MIRROR, WHITE_FLOOR), False, False),
        ((SHINY,), True, False),
        (({**CLEAR, "roughness": 0},), False, True),
        (({**PANE, "roughness": 0},), False, True),
        ((CLEAR,), False, False),
        ((HAIR,), False, False),
    ):
        at = point(*several)
        assert albedos.reflects_highlights(*at) == highlights and albedos.is_mirror(*at) == mirror, several


def test_loops_over_points_ask_the_same():
    """What a camera sees of a row of points, some chosen."""
    s = plastic(4, base=(0.2, 0.4, 0.6), roughness=0.5, translucent=0.1)
    wo, wi = (np.tile(w, (4, 1)).astype(np.float32) for w in (VIEWS[0], LIGHTS[0]))
    bsdf = parts.seen_by_camera(s.scene, 0, f(0), f(0), False)
    cos = np.float32([0.2, 0.5, 0.8, 1.0])

    np.testing.assert_allclose(
        room.evaluate_glossy(s, wo, wi)[2], mixture.evaluate_glossy(s.scene, bsdf, VIEWS[0], LIGHTS[0])
    )
    for name in ("diffuse_albedo", "translucent_albedo", "glossy_albedo"):
        found = getattr(room, name)(s, cos)
        for k in range(4):
            view = f(np.sqrt(1 - cos[k] * cos[k])), f(0), cos[k]
            np.testing.assert_allclose(found[k], getattr(albedos, name)(s.scene, bsdf, view), rtol=1e-6)
    assert room.reflects_highlights(s).tolist() == [True] * 4
    some = s.where(np.array([True, False, False, True]))
    assert len(some) == 2 and len(s.where(np.array([1]))) == 1
    normals = np.float32([[0, 0, 1], [0, 0, -1]])
    scene = scene_of(*plane())
    zero = np.zeros(2, np.float32)
    assert np.array_equal(room.lambertian_normals(scene, np.zeros(2, np.int32), zero, zero, normals), normals)


def test_closures_of_distributions():
    scene, bsdf = point({**METAL, "distribution": Distribution.BECKMANN})
    assert parts.facets_of(parts.closure_at(scene, bsdf, 0)).distribution == Distribution.BECKMANN
