"""Values of glass at single points against Walter's formulas in double precision, as plain Python."""

import numpy as np
import pytest
from photon_bake.addon.bsdf import albedo_tables as tables
from photon_bake.addon.bsdf import fresnel, glass, microfacets
from photon_bake.addon.bsdf.closure import facets_of, radiance_scale
from photon_bake.addon.scene import Lobe
from photon_bake.tests.core.values.lobe_formulas import (
    ASHIKHMIN_SHIRLEY,
    BECKMANN,
    NUMBERS,
    VIEWS,
    at,
    closure,
    f,
    fresnel_of,
    gained,
    numbers,
    one_plus_lambda,
    slope2,
    triple,
)

CLEAR = {"kind": Lobe.GLASS, "weight": (0.9, 0.8, 0.7), "f0": (0.6, 0.8, 1), "f90": (1, 0.7, 0.5), "ior": 1.5}
GLASSES = [
    CLEAR,
    CLEAR | {"ior": 0.7},
    CLEAR | {"preserves_energy": True, "roughness": 0.7},
    CLEAR | {"fresnel": False, "roughness": 0.3, "preserves_energy": True},
    CLEAR | {"distribution": BECKMANN, "stretch": 1.3},
    CLEAR | {"distribution": ASHIKHMIN_SHIRLEY},
]


def test_radiance_is_scaled_for_photons():
    assert radiance_scale(f(1.5), True) == pytest.approx(1 / 2.25) and radiance_scale(f(1.5), False) == 1


@pytest.mark.parametrize("from_light", [False, True])
def test_albedos_of_glass(from_light):
    """Between what facets at the cosine reflect and transmit, each at least a twentieth."""
    weight, f0, f90 = 0.8, 0.8, (1 + 0.7 + 0.5) / 3
    for ior, cos in ((1.5, 0.2), (1.5, 0.95), (0.7, 0.1), (0.7, 0.8)):
        scale = 1 / ior**2 if from_light else 1
        share = np.clip(fresnel_of(cos, ior), 0.05, 0.95)
        expected = weight * (share * f0 + (1 - share) * f90 * scale)
        assert glass.albedo(closure(**CLEAR | {"ior": ior}), f(cos), from_light) == pytest.approx(expected, rel=1e-3)
        no_fresnel = closure(**CLEAR | {"ior": ior, "fresnel": False})
        assert glass.albedo(no_fresnel, f(cos), from_light) == pytest.approx(weight * f90 * scale, rel=1e-5)


@pytest.mark.parametrize("values", GLASSES)
@pytest.mark.parametrize("from_light", [False, True])
def test_samples_of_glass(values, from_light):
    """T or R of the facet by its colour, G₂/G₁, and the chance that the choice had."""
    one, sides = closure(**values), set()
    x, y, kind = (float(one.roughness) ** 2 * s for s in (one.stretch, 1 / one.stretch)), None, one.distribution
    x, y = x
    ior = float(one.ior)
    for wo in VIEWS:
        for (u, v), choice in zip(numbers(NUMBERS), (0.02, 0.5, 0.9, 0.01, 0.7), strict=True):
            h = np.float64(microfacets.visible_normal(facets_of(one), wo, u, v))
            cos = np.float64(wo) @ h
            share = fresnel_of(cos, ior)
            if not one.fresnel:
                r, t = 0.0, float(share < 1)
            else:
                r, t = share, 1 - share
            scale = 1 / ior**2 if from_light else 1
            up, down = r * np.mean(one.f0), t * np.mean(one.f90) * scale
            reflects = choice * (up + down) < up
            wi, weight = glass.sample(one, wo, f(choice), u, v, from_light)
            if reflects:
                assert np.float64(wi) == pytest.approx(2 * cos * h - wo, abs=1e-5)
            elif t > 0:
                across = -(np.float64(wo) - cos * h) / ior
                assert np.float64(wi) == pytest.approx(across - np.sqrt(1 - across @ across) * h, abs=1e-5)
            if (wi[2] > 0) != reflects or up + down == 0:
                assert weight == (0, 0, 0)
                continue
            sides.add(reflects)
            if kind == ASHIKHMIN_SHIRLEY:
                left = min(abs(wi[2]) / wo[2], 1)
            else:
                seen, lit = (one_plus_lambda(kind, slope2(np.float64(w), x, y)) for w in (wo, wi))
                left = seen / (seen + lit - 1)
            chance = (up if reflects else down) / (up + down)
            color = r * np.float64(one.f0) if reflects else t * np.float64(one.f90) * scale
            view, view_ior = (abs(wi[2]), ior if reflects else 1 / ior) if from_light else (wo[2], ior)
            expected = np.float64(one.weight) * color * left / chance * glass_scale(one, view, view_ior)
            assert weight == pytest.approx(expected, rel=2e-3)
    assert False in sides and (True in sides or not one.fresnel)


def glass_scale(one, cos, ior):
    if not (one.preserves_energy and one.fresnel):
        return 1
    z = (1 + np.copysign(np.sqrt(abs(ior - 1) / (ior + 1)), ior - 1)) / 2
    roughness = float(one.roughness)
    return gained(one.f90, at(tables.GLASS, z, roughness, cos), at(tables.GLASS_AVERAGE, z, roughness))


@pytest.mark.parametrize("table", [0, 1])
def test_photons_see_the_film_of_glass_from_where_they_go(table):
    """Beyond the surface the film has η_film/η, and the glass 1/η."""
    film, ior = triple((420, 1.33, table)), f(1.5)
    one, wo, (u, v) = closure(**CLEAR | {"film": film, "roughness": 0.2}), VIEWS[0], (f(0.3), f(0.6))
    facet = glass.facet_of(one, wo, u, v)
    assert facet.reflected == fresnel.glass_reflectance(film, ior, facet.cos)
    assert np.add(facet.transmitted, facet.reflected) == pytest.approx(1)
    wi, weight = glass.scatter(one, wo, facet, False, True)
    inside = film[0], film[1] / ior, film[2]
    seen = fresnel.glass_reflectance(inside, f(1) / ior, f(abs(np.dot(wi, facet.normal))))
    left = microfacets.g2_over_g1(facets_of(one), wo, wi)
    expected = np.float64(one.weight) * (1 - np.float64(seen)) * np.float64(one.f90) / 2.25 * left
    assert weight == pytest.approx(expected, rel=1e-4)
    wi, weight = glass.scatter(one, wo, facet, False, False)
    expected = np.float64(one.weight) * np.float64(facet.transmitted) * np.float64(one.f90) * left
    assert weight == pytest.approx(expected, rel=1e-4)
