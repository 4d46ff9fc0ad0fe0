"""The sum of a point's closures: which scatters, layers over others, photons and paths."""

from dataclasses import replace

import numpy as np
import pytest
from photon_bake.addon.bsdf import (
    PEAK,
    SMOOTH,
    Lobe,
    diffuse_albedo,
    evaluate_glossy,
    glossy_albedo,
    reflects_highlights,
    surface_at,
    translucent_albedo,
)
from photon_bake.addon.core.sampling.streams import stream
from photon_bake.addon.core.sampling.warps import sample_cosine_hemisphere
from photon_bake.addon.scene import Channel, Distribution, FresnelCurve, Materials
from photon_bake.tests.core.bsdf_points import (
    N,
    albedo_of,
    base_transmittance,
    chi_square_against,
    closures,
    column,
    direction,
    evaluate_glossy_below_peak,
    glass_albedo,
    is_mirror,
    numbers,
    of_closures,
    pdf_glossy,
    plastic,
    sample_bsdf,
    seen_from_behind,
    surface,
)
from photon_bake.tests.core.scenes import plane, scene_of

# Which closure scatters, and how much


def test_lobes_are_chosen_by_what_they_scatter():
    s = plastic(roughness=0.5, base=0.6, translucent=0.1, glass_reflection=0.2, glass_transmission=0.2)
    wo = direction(0.5)
    sample = sample_bsdf(s, wo, numbers())
    one, (c,) = s.where(np.arange(1)), column(1, 0.5)
    albedos = diffuse_albedo(one, c), translucent_albedo(one, c), glossy_albedo(one, c)
    expected = np.array([*(albedo[0, 0] for albedo in albedos), 0.2])
    assert np.allclose(np.bincount(sample.lobe, minlength=4) / N, expected / expected.sum(), atol=2e-3)
    for lobe in Lobe:
        only = sample_bsdf(s, wo, numbers(), 1 << lobe)
        assert (only.lobe == lobe).all()
        part = np.where(sample.lobe[:, None] == lobe, sample.weight, 0).mean(axis=0)
        assert np.allclose(only.weight.mean(axis=0), part, rtol=0.01)


@pytest.mark.plain
def test_nothing_is_scattered_by_nothing():
    sample = sample_bsdf(surface(9), direction(0.5, 9), numbers(n=16)[:9])
    assert (sample.weight == 0).all() and np.allclose(np.linalg.norm(sample.wi, axis=1), 1)
    assert len(sample_bsdf(surface(0), direction(0.5, 0), numbers(n=16)[:0]).wi) == 0


@pytest.mark.parametrize("preserves_energy", [True, False])
@pytest.mark.parametrize("roughness", [0.1, 0.5, 1.0])
@pytest.mark.parametrize("cos", [1.0, 0.5, 0.2])
def test_a_layer_takes_its_albedo_from_what_it_covers(roughness, cos, preserves_energy):
    s = plastic(base=0.8, roughness=roughness, preserves_energy=preserves_energy)
    (c,) = column(1, cos)
    one = s.where(np.arange(1))
    estimate = (diffuse_albedo(one, c) + glossy_albedo(one, c))[0, 0]
    assert np.allclose(diffuse_albedo(one, c), 0.8 * base_transmittance(one, c))
    assert albedo_of(s, cos) == pytest.approx(estimate, abs=3e-3)
    white = plastic(base=1.0, roughness=roughness, preserves_energy=preserves_energy)
    assert albedo_of(white, cos).max() < 1.005
    if preserves_energy:
        assert albedo_of(white, cos).min() > 0.99
    assert (base_transmittance(surface(1), c) == 1).all()


# Photons and paths

LOSSY, BECKMANN = {"preserves_energy": False}, {"distribution": Distribution.BECKMANN}
ASHIKHMIN_SHIRLEY = {"distribution": Distribution.ASHIKHMIN_SHIRLEY}
F82, CONDUCTOR = {"curve": FresnelCurve.F82}, {"curve": FresnelCurve.CONDUCTOR}
UNDER = {"kind": Lobe.DIFFUSE, "weight": 0.5, "layer": 0}
TINT = {"kind": Lobe.ABSORBING, "f0": [0.9, 0.5, 0.2], "ior": 1.5, "roughness": 0.7}


@pytest.mark.parametrize(
    "s",
    [
        plastic(roughness=0.4),
        plastic(roughness=1.0, base=0.9),
        surface(f0=0.8, f90=1.0, roughness=1.0),
        surface(diffuse=0.3, translucent=0.4),
        surface(glass_reflection=0.9, glass_transmission=0.7, roughness=0.8, glass_ior=1.5),
        surface(glass_reflection=0.9, glass_transmission=0.7, roughness=0.5, glass_ior=1.5, preserves_energy=False),
        surface(glass_transmission=0.7, roughness=0.6, glass_ior=1 / 1.4, glass_fresnel=False),
        of_closures({"kind": Lobe.GLOSSY, "f0": 0.6, "roughness": 0.6, "edge": 0.3} | LOSSY | F82 | BECKMANN),
        of_closures({"kind": Lobe.GLOSSY, "f0": 0.6, "roughness": 0.8, "edge": 1.2} | CONDUCTOR),
        of_closures({"kind": Lobe.GLOSSY, "f0": 0.9, "f90": 0.9, "roughness": 0.7} | LOSSY | ASHIKHMIN_SHIRLEY),
        of_closures({"kind": Lobe.GLASS, "f0": 0.9, "f90": 0.7, "roughness": 0.6, "ior": 1.5} | LOSSY | BECKMANN),
        of_closures({"kind": Lobe.GLASS, "f0": 0.9, "f90": 0.7, "roughness": 0.5, "ior": 1.5, "film": (420, 2, 1)}),
        of_closures({"kind": Lobe.ROUGH_DIFFUSE, "weight": 0.8, "f0": 0.8, "roughness": 0.9}),
        of_closures({"kind": Lobe.SHEEN, "f0": 0.7, "roughness": 0.4}, UNDER),
        of_closures({"kind": Lobe.VELVET, "weight": 0.8, "roughness": 0.5}),
        of_closures({"kind": Lobe.TOON, "weight": 0.8, "roughness": 0.5, "f90": 0.2}),
        of_closures({"kind": Lobe.GLOSSY_TOON, "weight": 0.8, "roughness": 0.4, "f90": 0.1}),
        of_closures(TINT, UNDER),
        of_closures({"kind": Lobe.PANE, "weight": 0.7, "roughness": 0.5}),
    ],
    ids=lambda s: "+".join(Lobe(kind).name for kind in s.scene.materials.closures.kind),
)
def test_photons_and_paths_solve_the_same_transport(s):
    """∫∫ light(i) f(o, i) view(o) |cos i| |cos o|, the view above, sampled from either end."""

    def light(d):
        return 1 + d[:, 0] + 0.5 * d[:, 1] * d[:, 2] + 0.7 * (d[:, 2] > 0.5) + 0.4 * (d[:, 2] < -0.7)

    def view(d):
        return 1 - 0.8 * d[:, 0] + 0.5 * d[:, 1] + (d[:, 2] > 0.6)

    u = numbers(9, dimensions=5)
    wo = sample_cosine_hemisphere(u[:, :2])
    path = sample_bsdf(s, wo, u[:, 2:])
    from_view = np.pi * (path.weight * (view(wo) * light(path.wi))[:, None]).mean(axis=0, dtype=np.float64)

    # Photons come from above, and from below, where the surface is seen from its other side
    above = sample_bsdf(s, wo, u[:, 2:], from_light=True)
    seen = np.where(above.wi[:, 2] > 0, light(wo) * view(above.wi), 0)
    from_light = np.pi * (above.weight * seen[:, None]).mean(axis=0, dtype=np.float64)
    below = sample_bsdf(seen_from_behind(s), wo, u[:, 2:], from_light=True)
    seen = np.where(below.wi[:, 2] < 0, light(-_flip(wo)) * view(-_flip(below.wi)), 0)
    from_light += np.pi * (below.weight * seen[:, None]).mean(axis=0, dtype=np.float64)
    assert from_light == pytest.approx(from_view, rel=0.01)


def _flip(d):
    """Frames of the two sides share x up to a turn: −z up, and y with it."""
    return d * np.float32([-1, 1, 1])


@pytest.mark.parametrize("cos", [0.05, 0.4, 1.0])
def test_the_layer_takes_from_the_side_that_views(cos):
    """A path views from where it is, a photon from where it goes: what the layer leaves is taken there.

    A photon's weight then does not depend on where its light comes from, and its mean is Σ ρ s(θ) over cosine-weighted
    directions.
    """
    s, wo, u = plastic(roughness=0.2), direction(cos), numbers()
    photons, paths = (sample_bsdf(s, wo, u, 1 << Lobe.DIFFUSE, from_light=light) for light in (True, False))
    np.testing.assert_allclose(photons.weight[:, 0], diffuse_albedo(s, photons.wi[:, 2])[:, 0], rtol=1e-5)
    np.testing.assert_allclose(paths.weight[:, 0], diffuse_albedo(s, wo[:, 2])[:, 0], rtol=1e-5)
    over_views = diffuse_albedo(s, np.sqrt((np.arange(N) + 0.5) / N).astype(np.float32))[:, 0].mean(dtype=np.float64)
    assert photons.weight.mean(dtype=np.float64) == pytest.approx(over_views, rel=1e-3)


@pytest.mark.plain
def test_what_is_left_to_photons():
    kinds = {"diffuse": False, "translucent": False, "f0": True, "glass_transmission": True}
    for name, expected in kinds.items():
        s = surface(16, roughness=SMOOTH / 2, **{name: 0.5})
        assert (sample_bsdf(s, direction(0.9, 16), numbers(n=16)).specular == expected).all()
    assert (evaluate_glossy(surface(3, f0=1, roughness=SMOOTH / 2), direction(0.5, 3), direction(0.5, 3)) == 0).all()


@pytest.mark.parametrize("from_light", [False, True])
def test_shadow_rays_and_photons_share_gloss_by_its_value(from_light):
    """What one of them leaves out the other finds: the peak is the photons', the tail the shadow rays'."""
    s = surface(f0=1, f90=1, roughness=0.25)
    wo = direction(0.8)
    sample = sample_bsdf(s, wo, numbers(), from_light=from_light)
    up = np.flatnonzero(sample.wi[:, 2] > 1e-3)
    view, light = (sample.wi[up], wo[up]) if from_light else (wo[up], sample.wi[up])
    s, specular = s.where(up), sample.specular[up]
    f, below = evaluate_glossy(s, view, light), evaluate_glossy_below_peak(s, view, light)
    assert 0 < specular.sum() < len(up) and f[specular].min() >= PEAK > f[~specular].max()
    assert (below[specular] == 0).all() and np.array_equal(below[~specular], f[~specular])
    assert sample.rough.all()


# Surfaces of a scene


@pytest.mark.plain
def test_surface_at_reads_the_materials():
    colors = np.array([[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]], np.float32)
    materials = Materials.of(
        2,
        diffuse=Channel.constant(colors),
        glass_transmission=Channel.constant(colors[::-1]),
        roughness=Channel.constant(np.array([0.25, 0.75])),
        glass_ior=np.array([1.5, 2.0], np.float32),
    )
    scene = replace(scene_of(*plane(), material=[1, 0]), materials=materials)
    zero = np.zeros(3, np.float32)
    s = surface_at(scene, np.array([0, 1, 1]), zero, zero, np.array([False, False, True]))
    up = np.ones(3, np.float32)
    assert np.array_equal(diffuse_albedo(s, up), colors[[1, 0, 0]]) and np.array_equal(
        glass_albedo(s), colors[[0, 1, 1]]
    )
    assert not glossy_albedo(s, up).any() and not translucent_albedo(s, up).any()
    assert len(s) == 3 and len(s.where(s.back)) == 1
    # Straight through, the weight says on which side the glass was met: radiance is scaled for photons
    closures = replace(materials.closures, roughness=Channel.constant(np.zeros(len(materials.closures))))
    smooth = surface_at(replace(scene, materials=replace(materials, closures=closures)), *s._at)
    sample = sample_bsdf(smooth, direction(1.0, 3), np.full((3, 3), 0.5, np.float32), 1 << Lobe.GLASS, from_light=True)
    ior = np.array([2, 1.5, 1 / 1.5])
    share = (1 - ((ior - 1) / (ior + 1)) ** 2) / ior**2
    assert np.allclose(sample.weight, colors[[0, 1, 1]] * share[:, None], rtol=1e-4)


# Several closures


SHARP = {"kind": Lobe.GLOSSY, "weight": [0.5, 0.4, 0.3], "roughness": 0.2, "f0": 0.9, "f90": 1}
DULL = {"kind": Lobe.GLOSSY, "weight": [0.2, 0.3, 0.5], "roughness": 0.8, "f0": [0.3, 0.6, 0.9], "f90": 1}


@pytest.mark.parametrize("from_light", [False, True])
def test_closures_of_one_kind_add_up(from_light):
    """Two glossy closures of different roughness give the sum of what each gives alone."""
    both, sharp, dull = of_closures(SHARP, DULL), of_closures(SHARP), of_closures(DULL)
    wo, wi = direction(0.7), sample_cosine_hemisphere(numbers(3)[:, :2])
    cos = wo[:, 2]
    for of in (lambda s: evaluate_glossy(s, wo, wi), lambda s: glossy_albedo(s, cos)):
        np.testing.assert_allclose(of(both), of(sharp) + of(dull), rtol=1e-4)
    shares = [glossy_albedo(s, cos).mean(axis=1) for s in (sharp, dull)]
    mixed = sum(share * pdf_glossy(s, wo, wi) for share, s in zip(shares, (sharp, dull), strict=True)) / sum(shares)
    np.testing.assert_allclose(pdf_glossy(both, wo, wi), mixed, rtol=1e-4)

    def moments(s):
        sample = sample_bsdf(s, wo, numbers(), from_light=from_light)
        seen = np.stack([np.ones(N), sample.wi[:, 0], sample.wi[:, 2], sample.wi[:, 0] < -0.6])
        return seen @ sample.weight.astype(np.float64) / N

    np.testing.assert_allclose(moments(both), moments(sharp) + moments(dull), atol=2e-3)
    if not from_light:
        both, wo = of_closures(SHARP, DULL, n=1 << 17), direction(0.7, 1 << 17)
        samples = sample_bsdf(both, wo, stream(1, 8).random((1 << 17, 3), dtype=np.float32)).wi
        up = samples[:, 2] > 0
        p, _ = chi_square_against(samples[up], lambda d: pdf_glossy(both.where(np.arange(len(d))), wo[: len(d)], d))
        assert p > 1e-3


def test_a_mirror_and_gloss_are_told_from_each_other():
    s = of_closures({**SHARP, "roughness": SMOOTH / 2}, DULL)
    sample = sample_bsdf(s, direction(0.8), numbers())
    assert 0.2 < sample.rough.mean() < 0.8 and sample.specular[~sample.rough].all()
    wi = sample.wi[sample.rough & ~sample.specular]
    view = direction(0.8, len(wi))
    of_dull = evaluate_glossy_below_peak(of_closures(DULL, n=len(wi)), view, wi)
    np.testing.assert_array_equal(evaluate_glossy_below_peak(s.where(np.arange(len(wi))), view, wi), of_dull)
    assert bool(reflects_highlights(s)[0]) and not is_mirror(s)[0]


def test_layers_lie_over_layers_and_over_what_they_cover_alone():
    """Gloss over metal over a base: each takes from what is below; a closure beside them keeps all."""
    coat = {"kind": Lobe.GLOSSY, "roughness": 0.3, "f0": 0.04, "f90": 1, "ior": 1.5}
    metal = {"kind": Lobe.GLOSSY, "roughness": 0.5, "f0": 0.4, "f90": 1, "layer": 0}
    base, beside = {"kind": Lobe.DIFFUSE, "weight": 0.5, "layer": 1}, {"kind": Lobe.DIFFUSE, "weight": 0.25}
    (cos,) = column(1, 0.6)

    def passed(layer):
        under = of_closures({**layer, "layer": -1}, {"kind": Lobe.DIFFUSE, "weight": 1, "layer": 0}, n=1)
        return diffuse_albedo(under, cos)

    s = of_closures(coat, metal, base, beside, n=1)
    np.testing.assert_allclose(diffuse_albedo(s, cos), 0.5 * passed(coat) * passed(metal) + 0.25, rtol=1e-5)
    alone = [of_closures({**one, "layer": -1}, n=1) for one in (coat, metal)]
    gloss = glossy_albedo(alone[0], cos) + passed(coat) * glossy_albedo(alone[1], cos)
    np.testing.assert_allclose(glossy_albedo(s, cos), gloss, rtol=1e-5)
    many = of_closures(coat, metal, base, beside)
    np.testing.assert_allclose(albedo_of(many, 0.6), (diffuse_albedo(s, cos) + gloss)[0], atol=3e-3)


@pytest.mark.plain
def test_closures_that_are_chosen_keep_their_layers():
    several = closures(SHARP, {"kind": Lobe.DIFFUSE, "layer": 2}, DULL, {"kind": Lobe.DIFFUSE, "layer": 0})
    some = several.where(np.array([False, True, True, True]))
    assert some.kind.tolist() == [Lobe.DIFFUSE, Lobe.GLOSSY, Lobe.DIFFUSE] and some.layer.tolist() == [1, -1, -1]
    assert some.start.tolist() == [0, 3] and some.count(Lobe.DIFFUSE).tolist() == [2]


@pytest.mark.plain
def test_mirrors_and_highlights():
    kinds = [surface(1, roughness=r, **c) for r in (0.05, 0.5) for c in ({"f0": 0.5}, {"glass_transmission": 0.5})]
    kinds += [surface(1, roughness=0.05, f0=0.5, diffuse=0.5), surface(1)]
    assert [bool(is_mirror(s)[0]) for s in kinds] == [True, True, False, False, False, False]
    assert [bool(reflects_highlights(s)[0]) for s in kinds] == [False, False, True, False, False, False]
