"""The sum of a point's closures at single points: what each of its parts says against the lobes alone, plain Python."""

import numpy as np
import pytest
from photon_bake.addon.bsdf import PEAK, SMOOTH, Lobe, glass, glossy, mixture
from photon_bake.addon.bsdf import closure as parts
from photon_bake.addon.bsdf.broad import lobes as others
from photon_bake.addon.bsdf.broad import toon
from photon_bake.addon.bsdf.fibres import fibre
from photon_bake.addon.bsdf.lambertian import diffuse, translucent
from photon_bake.tests.core.values.lobe_formulas import (
    PAIRS,
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
    SHEEN,
    SHINY,
    THROUGH,
    TINT,
    TOON,
    VELVET,
    WHITE_FLOOR,
    point,
)


def alone(scene, bsdf, k, cos, from_light):
    """What the k-th closure scatters, about, without layers over it."""
    one = parts.closure_at(scene, bsdf, k)
    if one.kind in (Lobe.DIFFUSE, Lobe.TRANSLUCENT, Lobe.SUBSURFACE, Lobe.FIBRE):
        return np.mean(one.weight)
    if one.kind == Lobe.GLASS:
        return float(glass.albedo(one, cos, from_light))
    if one.kind in (Lobe.GLOSSY, Lobe.PANE):
        return np.mean(glossy.albedo(one, min(cos, f(0.2)) if from_light and one.kind == Lobe.PANE else cos))
    return np.mean(others.albedo(one, min(cos, f(0.2)) if from_light else cos))


@pytest.mark.parametrize("from_light", [False, True])
@pytest.mark.parametrize("lobes", [mixture.ALL_LOBES, mixture.GLOSSY_LOBES | 1 << Lobe.GLASS])
def test_closures_are_chosen_by_what_they_scatter(from_light, lobes):
    scene, bsdf = point(*MIXED)
    wo = VIEWS[0]
    expected = np.zeros(len(MIXED))
    for k, one in enumerate(MIXED):
        if lobes >> one["kind"] & 1:
            left = 1 if from_light else np.mean(mixture.transmittance_to(scene, bsdf, k, wo))
            expected[k] = alone(scene, bsdf, k, wo[2], from_light) * left
            assert mixture._expected(scene, bsdf, k, wo, from_light) == pytest.approx(expected[k], rel=1e-4)
    for choice in (np.arange(30) + 0.37) / 30:
        k, inverse, fresh = mixture.choose_closure(scene, bsdf, wo, f(choice), lobes, from_light)
        total, chosen = 0.0, -1
        for i, share in enumerate(expected):  # each takes its share of what those before it have together
            total += share
            if share > 0:
                bound = share / total
                taken = choice < bound
                chosen, choice = (i, choice / bound) if taken else (chosen, (choice - bound) / (1 - bound))
        assert k == chosen and fresh == pytest.approx(choice, abs=1e-3)
        assert inverse == pytest.approx(expected.sum() / expected[k], rel=1e-3)


def test_some_closures_need_no_choice():
    scene, bsdf = point(WHITE_FLOOR)
    assert mixture.choose_closure(scene, bsdf, VIEWS[0], f(0.3), mixture.ALL_LOBES, False) == (0, 1, f(0.3))
    assert mixture.choose_closure(scene, bsdf, VIEWS[0], f(0.3), 1 << Lobe.GLOSSY, False)[0] == -1
    scene, bsdf = point(METAL)
    k, inverse, choice = mixture.choose_closure(scene, bsdf, VIEWS[0], f(0.3), mixture.ALL_LOBES, False)
    assert k == 0 and inverse == 1 and choice == pytest.approx(0.3)
    assert mixture.choose_closure(scene, bsdf, VIEWS[0], f(1 - 2**-24), mixture.ALL_LOBES, False)[2] < 1
    assert mixture.choose_closure(scene, bsdf, DOWN, f(0.3), mixture.ALL_LOBES, False)[0] == -1
    assert mixture.choose_closure(scene, bsdf, DOWN, f(0.3), 1 << Lobe.GLOSSY, False)[0] == -1
    scene, bsdf = point(METAL, THROUGH)
    black, dark = point({**WHITE_FLOOR, "weight": 0}, {**METAL, "weight": (0, 0, 0)})
    assert mixture.choose_closure(black, dark, VIEWS[0], f(0.3), mixture.ALL_LOBES, False)[0] == -1
    sample = mixture.sample_bsdf(black, dark, VIEWS[0], f(0.3), f(0.4), f(0.5), 1 << Lobe.GLOSSY, False)
    assert sample.weight == (0, 0, 0) and sample.lobe == Lobe.GLOSSY and sample.wi == (0, 0, 1)
    assert not sample.specular and not sample.rough and not sample.frame.own
    assert mixture._first_of(1 << Lobe.FIBRE | 1 << Lobe.PANE) == Lobe.PANE and mixture._first_of(0) == 0
    for color, nothing in (((0, 0, 0), True), ((1, 0, 0), False), ((0, 1, 0), False), ((0, 0, 1), False)):
        assert parts.is_nothing(tuple(map(f, color))) == nothing
    assert mixture._expected(scene, bsdf, 0, DOWN, False) == 0  # a lobe that is seen from behind
    assert mixture._expected(scene, bsdf, 0, unit(1, 0, 0), False) == 0
    assert mixture._expected(scene, bsdf, 1, DOWN, False) == pytest.approx(0.2)


@pytest.mark.parametrize("from_light", [False, True])
@pytest.mark.parametrize("choice", [0.02, 0.31, 0.52, 0.66, 0.78, 0.9, 0.98])
def test_a_sample_is_that_of_its_closure(choice, from_light):
    """Its weight over the chance of the closure, and what layers leave on the side that views."""
    for several in (MIXED, MIXED[::-1]):
        several = [{**one, "layer": -1 if "layer" not in one else several.index(COAT)} for one in several]
        scene, bsdf = point(*several)
        for wo in VIEWS[:2]:
            numbers = f(0.37), f(0.81)
            k, inverse, fresh = mixture.choose_closure(scene, bsdf, wo, f(choice), mixture.ALL_LOBES, from_light)
            one = parts.closure_at(scene, bsdf, k)
            if one.kind in (Lobe.DIFFUSE, Lobe.SUBSURFACE):
                wi, weight = diffuse.sample(one, *numbers)
            elif one.kind == Lobe.TRANSLUCENT:
                wi, weight = translucent.sample(one, *numbers)
            elif one.kind == Lobe.GLASS:
                wi, weight = glass.sample(one, wo, fresh, *numbers, from_light)
            elif one.kind == Lobe.FIBRE:
                wi, weight = fibre.sample(one, wo, fresh, *numbers, from_light)
            elif one.kind in (Lobe.GLOSSY, Lobe.PANE):
                wi, weight = glossy.sample(one, wo, *numbers, from_light)
                wi = (*wi[:2], -wi[2]) if one.kind == Lobe.PANE else wi
            else:
                wi, weight = others.sample(one, wo, *numbers, from_light)
            sample = mixture.sample_bsdf(scene, bsdf, wo, f(choice), *numbers, mixture.ALL_LOBES, from_light)
            left = mixture.transmittance_to(scene, bsdf, k, wi if from_light else wo)
            assert sample.wi == wi and sample.lobe == one.kind and not sample.frame.own
            assert sample.weight == pytest.approx(np.float64(weight) * left * inverse, rel=1e-5)
            view, light = (wi, wo) if from_light else (wo, wi)
            if one.kind == Lobe.GLOSSY:
                specular = max(glossy.evaluate(one, view, light)) >= PEAK
            elif one.kind == Lobe.GLOSSY_TOON:
                specular = max(toon.evaluate(one, view, light)) >= PEAK
            else:
                specular = one.kind in (Lobe.GLASS, Lobe.PANE, Lobe.FIBRE)
            assert sample.specular == specular
            lamplight = fibre.lamplight_share(one, view, light) if one.kind == Lobe.FIBRE else 1
            assert sample.lamplight == lamplight
            assert sample.rough == (one.kind in (Lobe.GLOSSY, Lobe.GLOSSY_TOON))


def test_what_is_specular_and_what_is_rough():
    def of(**one):
        scene, bsdf = point(one)
        return parts.closure_at(scene, bsdf, 0)

    up, mirrored = unit(0.3, 0.1, 0.8), unit(-0.3, -0.1, 0.8)
    for one, specular, rough in (
        (MIRROR, True, False),
        ({**METAL, "roughness": 0.9, "f0": 0.02, "f90": 0.02}, False, True),
        ({**METAL, "roughness": float(SMOOTH), "f0": 1}, True, True),
        ({**SHINY, "weight": 1, "roughness": 0.05}, True, True),
        ({**SHINY, "weight": 0.1}, False, True),
        (CLEAR, True, False),
        (PANE, True, False),
        (HAIR, True, False),
        (WHITE_FLOOR, False, False),
        (VELVET, False, False),
    ):
        assert mixture._is_specular(of(**one), up, mirrored) == specular, one
        assert mixture._is_rough(of(**one)) == rough, one


def test_layers_leave_the_product_of_what_each_leaves():
    layered = [{**COAT, "layer": 1}, {**SHEEN, "layer": 2}, TINT, {**WHITE_FLOOR, "layer": 0}, {**METAL, "layer": -1}]
    scene, bsdf = point(*layered)
    for view in (VIEWS[0], DOWN):
        cos = f(abs(view[2]))
        coat, sheen, tint = (parts.closure_at(scene, bsdf, k) for k in range(3))
        over = np.float64(others.transmittance(tint, cos)) * np.float64(others.transmittance(sheen, cos))
        expected = over * float(glossy.transmittance(coat, cos))
        assert mixture.transmittance_to(scene, bsdf, 3, view) == pytest.approx(expected, rel=1e-5)
        assert mixture.transmittance_to(scene, bsdf, 0, view) == pytest.approx(over, rel=1e-5)
        assert mixture.transmittance_to(scene, bsdf, 4, view) == (1, 1, 1)


# f and densities


def f_alone(scene, bsdf, k, wo, wi):
    one = parts.closure_at(scene, bsdf, k)
    file = glossy if one.kind == Lobe.GLOSSY else others
    return np.float64(file.evaluate(one, wo, wi))


def test_f_is_the_sum_of_lobes_below_their_peak():
    sharp = {**METAL, "roughness": 0.3, "layer": 1, "weight": 1}
    several = [sharp, COAT, METAL, SHINY, {**VELVET, "layer": 1}, ROUGH, TOON, SHEEN, WHITE_FLOOR, CLEAR, MIRROR]
    scene, bsdf = point(*several)
    near = [(wo, unit(-wo[0] + 0.1, -wo[1], wo[2])) for wo in VIEWS]
    n_peaks = 0
    for wo, wi in (*PAIRS, *near):
        glossy_f = direct = broad = np.zeros(3)
        for k, one in enumerate(several):
            if one["kind"] in (Lobe.DIFFUSE, Lobe.GLASS):
                continue
            of = f_alone(scene, bsdf, k, wo, wi)
            seen = of * mixture.transmittance_to(scene, bsdf, k, wo)
            if one["kind"] in (Lobe.GLOSSY, Lobe.GLOSSY_TOON):
                glossy_f = glossy_f + seen
                n_peaks += max(of) >= 1
                broad = broad + seen * (max(of) < 1)
            else:
                direct = direct + seen
        assert mixture.evaluate_glossy(scene, bsdf, wo, wi) == pytest.approx(glossy_f, rel=1e-5)
        assert mixture.evaluate_glossy_below_peak(scene, bsdf, wo, wi) == pytest.approx(broad, rel=1e-5)
        assert mixture.evaluate_direct(scene, bsdf, wo, wi) == pytest.approx(broad + direct, rel=1e-5)
    assert 2 < n_peaks < 40


def test_densities_of_gloss_add_up_by_their_shares():
    several = [{**METAL, "layer": 1}, COAT, SHINY, MIRROR, VELVET, {**METAL, "weight": 0}]
    scene, bsdf = point(*several)
    for wo, wi in PAIRS:
        shares = [alone(scene, bsdf, k, wo[2], False) for k in range(3)]
        shares[0] *= np.mean(mixture.transmittance_to(scene, bsdf, 0, wo))
        of = [parts.closure_at(scene, bsdf, k) for k in range(3)]
        densities = glossy.pdf(of[0], wo, wi), glossy.pdf(of[1], wo, wi), toon.pdf(of[2], wo, wi)
        expected = np.dot(shares, np.float64(densities)) / sum(shares)
        assert mixture.pdf_glossy(scene, bsdf, wo, wi) == pytest.approx(expected, rel=1e-4)
    assert mixture.pdf_glossy(*point(MIRROR, VELVET), *PAIRS[0]) == 0
