"""Lobes that are broad and not Lambertian, and layers: samplers against densities, furnaces, reciprocity."""

from hashlib import sha256

import numpy as np
import pytest
from photon_bake.addon.bsdf import Lobe, diffuse_albedo, glossy_albedo
from photon_bake.addon.bsdf.broad import velvet
from photon_bake.addon.core.sampling.streams import stream
from photon_bake.addon.core.sampling.warps import sample_cosine_hemisphere
from photon_bake.tests.core.bsdf_points import (
    N,
    albedo_of,
    chi_square_against,
    column,
    direction,
    evaluate_direct,
    gauss_legendre,
    numbers,
    of_closures,
    pdf_glossy,
    sample_bsdf,
)
from photon_bake.tools.velvet_table import table

ROUGH = {"kind": Lobe.ROUGH_DIFFUSE, "weight": [0.9, 0.5, 0.1], "f0": [0.9, 0.5, 0.1], "roughness": 0.8}
SHEEN = {"kind": Lobe.SHEEN, "f0": [0.9, 0.8, 0.7], "roughness": 0.4}
VELVET = {"kind": Lobe.VELVET, "weight": [0.9, 0.8, 0.7], "roughness": 0.6}
TOON = {"kind": Lobe.TOON, "weight": [0.9, 0.8, 0.7], "roughness": 0.4, "f90": 0.3}
SHINY = {**TOON, "kind": Lobe.GLOSSY_TOON, "roughness": 0.3, "f90": 0.1}
ALL = {"rough": ROUGH, "sheen": SHEEN, "velvet": VELVET, "toon": TOON, "glossy toon": SHINY}


@pytest.fixture(params=ALL.values(), ids=ALL)
def lobe(request):
    return request.param


def density(lobe, cos, d):
    """By which directions are sampled from a view at `cos`."""
    z, up = d[:, 2], d[:, 2] > 0
    if lobe is ROUGH:
        return np.maximum(z, 0) / np.pi
    if lobe is VELVET:
        return (z + 0.5) * up / (2 * np.pi)
    s, wo = of_closures(lobe, n=len(d)), direction(cos, len(d))
    if lobe is SHINY:
        return pdf_glossy(s, wo, d)
    if lobe is TOON:
        return (z > np.cos(0.7 * np.pi / 2)) / (2 * np.pi * (1 - np.cos(0.7 * np.pi / 2)))
    return evaluate_direct(s, wo, d)[:, 0] * np.maximum(z, 0) / diffuse_albedo(s, wo[:, 2])[:, 0]


@pytest.mark.parametrize("cos", [1.0, 0.6, 0.15])
def test_samples_follow_their_density_and_weigh_what_f_says(lobe, cos):
    n = 1 << 13 if lobe is SHINY else 1 << 16  # whose density ends within cells
    s, wo = of_closures(lobe, n=n), direction(cos, n)
    sample = sample_bsdf(s, wo, stream(1, 6).random((n, 3), dtype=np.float32))
    wi, up = sample.wi, sample.wi[:, 2] > 0
    assert (sample.weight[~up] == 0).all() and np.allclose(np.linalg.norm(wi, axis=1), 1, atol=1e-5)
    p, above = chi_square_against(wi[up], lambda d: density(lobe, cos, d))
    assert p > 1e-3 and above == pytest.approx(up.mean(), abs=0.02)
    k = np.flatnonzero(up & (wi[:, 2] > 0.01))
    if lobe is TOON:  # off the end of its edge
        k = k[wi[k, 2] > np.cos(0.69 * np.pi / 2)]
    f = evaluate_direct(s.where(k), wo[k], wi[k])
    left_to_photons = sample.specular[k]  # gloss where it peaks
    assert (f[left_to_photons] == 0).all() and (lobe is SHINY or not left_to_photons.any())
    expected = f * (wi[k, 2] / density(lobe, cos, wi[k]))[:, None]
    kept = ~left_to_photons
    np.testing.assert_allclose(sample.weight[k][kept], expected[kept], rtol=0.01, atol=2e-4)


@pytest.mark.parametrize("cos", [1.0, 0.5, 0.2])
def test_albedos_are_what_paths_find_in_a_white_world(lobe, cos):
    s, (c,) = of_closures(lobe), column(1, cos)
    if lobe is SHINY:
        assert (albedo_of(s, cos) <= glossy_albedo(s.where(np.arange(1)), c)[0] + 1e-3).all()
    else:
        expected = diffuse_albedo(s.where(np.arange(1)), c)[0]
        np.testing.assert_allclose(albedo_of(s, cos), expected, rtol=0.01, atol=2e-3)


@pytest.mark.parametrize("roughness", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("cos", [1.0, 0.4, 0.05])
def test_white_rough_diffuse_reflects_all(roughness, cos):
    s = of_closures({**ROUGH, "weight": 1, "f0": 1, "roughness": roughness})
    assert albedo_of(s, cos) == pytest.approx(1, abs=5e-3)
    if roughness == 0:
        wi = sample_cosine_hemisphere(numbers(4)[:, :2])
        np.testing.assert_allclose(evaluate_direct(s, direction(cos), wi), 1 / np.pi, rtol=1e-3)


def test_rough_diffuse_throws_light_back():
    s, grazing, other = of_closures(ROUGH, n=1), direction(0.2, 1), direction(0.2, 1, 0.4 + np.pi)
    assert evaluate_direct(s, grazing, grazing)[0, 0] > 1.5 * evaluate_direct(s, grazing, other)[0, 0]


@pytest.mark.parametrize("lobe", [ROUGH, VELVET], ids=["rough", "velvet"])
def test_reciprocity(lobe):
    s = of_closures(lobe)
    wo, wi = sample_cosine_hemisphere(numbers(3)[:, :2]), sample_cosine_hemisphere(numbers(4)[:, :2])
    np.testing.assert_allclose(evaluate_direct(s, wo, wi), evaluate_direct(s, wi, wo), rtol=2e-3, atol=1e-5)


@pytest.mark.parametrize("roughness", [0.2, 0.5, 1.0])
def test_sheen_loses_nothing_over_white(roughness):
    """What sheen takes from the base is its own albedo."""
    base = {"kind": Lobe.DIFFUSE, "weight": 1, "layer": 0}
    s = of_closures({**SHEEN, "f0": 1, "roughness": roughness}, base)
    for cos in (0.9, 0.3, 0.05):
        assert albedo_of(s, cos) == pytest.approx(1, abs=5e-3)


def test_coats_tint_by_the_way_through_them():
    """Sheen over a coat over what the coat absorbs, over a base: each takes its share."""
    coat = {"kind": Lobe.GLOSSY, "f0": 0.04 * 0.5, "f90": 0.5, "ior": 1.5, "roughness": 0.1, "layer": 0}
    tint = {"kind": Lobe.ABSORBING, "f0": [0.9, 0.5, 0.2], "roughness": 0.5, "ior": 1.5, "layer": 1}
    base = {"kind": Lobe.DIFFUSE, "weight": 0.8}
    (cos,) = column(1, 0.6)

    def passed(*layers):
        last = {**base, "weight": 1, "layer": len(layers) - 1}
        one = of_closures(*({**layer, "layer": i - 1} for i, layer in enumerate(layers)), last, n=1)
        (found,) = diffuse_albedo(one, cos)
        for layer in layers:  # but for what layers reflect themselves
            if layer["kind"] == Lobe.SHEEN:
                found = found - diffuse_albedo(of_closures({**layer, "layer": -1}, n=1), cos)[0]
        return found

    way = 1 / np.sqrt(1 - (1 - 0.36) / 2.25)
    np.testing.assert_allclose(passed(tint), 0.5 + 0.5 * np.array([0.9, 0.5, 0.2]) ** way, rtol=1e-5)
    together = passed(SHEEN) * passed(coat) * passed(tint)
    np.testing.assert_allclose(passed(SHEEN, coat, tint), together, rtol=1e-5)
    alone = of_closures({**tint, "layer": -1})
    assert (sample_bsdf(alone, direction(0.5), numbers()).weight == 0).all()


def test_velvet_table_is_what_the_formula_says():
    np.testing.assert_allclose(velvet.ALBEDO, table(128), atol=2e-3)
    assert sha256(velvet.FILE.read_bytes()).hexdigest() == velvet.FILE_DIGEST


def test_photons_of_toon_bring_what_views_see():
    """A photon's mean weight is ∫ f(view, light) cos over views."""
    wo, n = direction(0.9), 64
    (z, weight), (phi, per_phi) = gauss_legendre(np.array([0, 1]), n), gauss_legendre(np.array([-np.pi, np.pi]), n)
    z, phi = (x.ravel() for x in np.meshgrid(z, phi, indexing="ij"))
    sin = np.sqrt(1 - z * z)
    views = np.stack([sin * np.cos(phi), sin * np.sin(phi), z], axis=1).astype(np.float32)
    f = evaluate_direct(of_closures(TOON, n=len(views)), views, direction(0.9, len(views)))
    expected = (f * (z * np.outer(weight, per_phi).ravel())[:, None]).sum(axis=0)
    found = sample_bsdf(of_closures(TOON), wo, numbers(), from_light=True).weight.mean(axis=0, dtype=np.float64)
    np.testing.assert_allclose(found, expected, rtol=0.01)
    assert len(wo) == N
