"""Facets stretched along tangents: how they are sampled, and which way they lie."""

from dataclasses import replace

import numpy as np
import pytest
from photon_bake.addon.bsdf import Lobe, evaluate_glossy
from photon_bake.addon.core.sampling.streams import stream
from photon_bake.addon.core.sampling.warps import sample_cosine_hemisphere
from photon_bake.addon.scene import Distribution
from photon_bake.tests.core.bsdf_points import (
    albedo_of,
    chi_square_against,
    direction,
    numbers,
    of_closures,
    pdf_glossy,
    sample_bsdf,
)

STRETCH = 1.7


def brushed(n, turns=0.0, tangent=(1, 0, 0), **values):
    """Points of a surface brushed along a tangent, which is turned by some turns."""
    gloss = {"kind": Lobe.GLOSSY, "roughness": 0.5, "stretch": (STRETCH, turns, turns), "preserves_energy": False}
    s = of_closures(gloss | values, n=n)
    tangents = np.zeros((len(s.scene.triangles), 3, 3, 3), np.float32)
    tangents[:, :, 2] = tangent
    return replace(s, scene=s.scene._replace(corner_tangents=tangents))


@pytest.mark.parametrize("distribution", Distribution)
@pytest.mark.parametrize("cos", [1.0, 0.6])
def test_samples_follow_their_density_and_weigh_what_f_says(distribution, cos):
    n = 1 << 17
    s, wo = brushed(n, 0.1, distribution=distribution), direction(cos, n)
    sample = sample_bsdf(s, wo, stream(1, 6).random((n, 3), dtype=np.float32))
    wi, up = sample.wi, sample.wi[:, 2] > 0
    p, above = chi_square_against(wi[up], lambda d: pdf_glossy(s.where(np.arange(len(d))), wo[: len(d)], d))
    assert p > 1e-3 and above == pytest.approx(up.mean(), abs=0.01)
    k = np.flatnonzero(up & (wi[:, 2] > 1e-3))
    expected = evaluate_glossy(s.where(k), wo[k], wi[k]) * (wi[k, 2] / pdf_glossy(s.where(k), wo[k], wi[k]))[:, None]
    assert np.allclose(sample.weight[k], expected, rtol=5e-3)


@pytest.mark.parametrize("distribution", Distribution)
def test_brushed_metal_is_reciprocal(distribution):
    wo, wi = (sample_cosine_hemisphere(numbers(seed, 1 << 12)[:, :2]) for seed in (3, 4))
    s = brushed(len(wo), 0.2, distribution=distribution)
    assert np.allclose(evaluate_glossy(s, wo, wi), evaluate_glossy(s, wi, wo), rtol=2e-3)


@pytest.mark.plain
@pytest.mark.parametrize("turns", [0.0, 0.125, 0.25])
@pytest.mark.parametrize("back", [False, True])
def test_facets_lean_the_most_along_the_turned_tangent(turns, back):
    """Seen from above the variances of slopes along the tangent and across it are as α_x² to α_y².

    About the normal of the side that is seen the tangent is turned to the left; the frame of the back has the same x.
    """
    s = brushed(512, turns, tangent=(0, 2, 0.5), roughness=0.3, distribution=Distribution.BECKMANN)
    s = replace(s, back=np.full(len(s), back))
    wi = sample_bsdf(s, direction(1.0, len(s)), numbers(5, len(s))).wi.astype(np.float64)
    slopes = (wi / (1 + wi[:, 2:]))[:, :2]
    values, axes = np.linalg.eigh(slopes.T @ slopes)
    assert (values[1] / values[0]) ** 0.5 == pytest.approx(STRETCH**2, rel=0.1)
    angle = 2 * np.pi * turns + np.pi / 2 * (-1 if back else 1)
    assert abs(axes[:, 1] @ [np.cos(angle), np.sin(angle)]) > 0.99


@pytest.mark.parametrize("cos", [1.0, 0.5])
def test_energy_of_brushed_metal_is_made_up_for_as_if_it_were_round(cos):
    """As in Cycles, by the albedo of round facets with the same √(α_x α_y)."""
    kept, lossy = (albedo_of(brushed(1 << 14, preserves_energy=keeps), cos) for keeps in (True, False))
    round_ = albedo_of(of_closures({"kind": Lobe.GLOSSY, "roughness": 0.5, "preserves_energy": False}, n=1 << 14), cos)
    assert kept == pytest.approx(lossy / round_, rel=0.01)
