"""Values of lobes at single points against the formulas of their papers in double precision, as plain Python."""

from types import SimpleNamespace

import numpy as np
import pytest
from photon_bake.addon.bsdf import albedo_tables as tables
from photon_bake.addon.bsdf import fresnel, glossy, microfacets
from photon_bake.addon.bsdf.closure import facets_of
from photon_bake.addon.bsdf.facets import ashikhmin_shirley, beckmann, ggx, metal, thin_film
from photon_bake.addon.bsdf.microfacets import Facets
from photon_bake.addon.scene import Distribution, FresnelCurve
from photon_bake.tests.core.values.lobe_formulas import (
    ASHIKHMIN_SHIRLEY,
    BECKMANN,
    GGX,
    IORS,
    LIGHTS,
    NUMBERS,
    PAIRS,
    VIEWS,
    at,
    average_grazing,
    closure,
    density_of,
    f,
    fresnel_of,
    gained,
    grazing,
    numbers,
    one_plus_lambda,
    slope2,
    triple,
    unit,
)

# Fresnel


@pytest.mark.parametrize("ior", IORS)
def test_fresnel(ior):
    for cos in (0.05, 0.3, 0.6, 0.77, 0.95, 1):
        assert fresnel.fresnel_dielectric(f(cos), f(ior)) == pytest.approx(fresnel_of(cos, ior), rel=2e-3, abs=2e-6)
        bare = fresnel.glass_reflectance(triple(0), f(ior), f(cos))
        assert bare == pytest.approx([fresnel_of(cos, ior)] * 3, rel=2e-3, abs=2e-6)
    assert fresnel.normal_reflectance(f(ior)) == pytest.approx(((ior - 1) / (ior + 1)) ** 2, rel=1e-5)


@pytest.mark.parametrize("ior", [0, *IORS])
def test_shares_of_grazing_reflectance(ior):
    for cos in (0.02, 0.2, 0.55, 0.8, 0.99):
        expected = max(grazing(cos, ior), 0)
        assert fresnel.grazing_share(f(cos), f(ior)) == pytest.approx(expected, rel=3e-3, abs=3e-6)
    assert fresnel.average_grazing_share(f(ior)) == pytest.approx(average_grazing(ior), rel=1e-4, abs=1e-7)


def test_averages_of_grazing_shares_stay_between_0_and_1():
    """The fits pass zero near η = 1, where next to nothing is reflected."""
    for ior in (1e-3, 0.05, 0.98, 0.999, 1.0, 1.001, 1.01, 3.5, 100.0):
        share = fresnel.average_grazing_share(f(ior))
        assert 0 <= share <= 1 and share == pytest.approx(average_grazing(ior), rel=1e-3, abs=1e-6)


def test_reflectance_goes_from_f0_to_f90():
    for ior in (0, 1.5):
        one = closure(f0=(0.1, 0.2, 0.4), f90=(0.9, 1, 0.7), ior=ior)
        expected = np.array([0.1, 0.2, 0.4]) + np.array([0.8, 0.8, 0.3]) * grazing(0.3, ior)
        assert fresnel.reflectance(one, f(0.3)) == pytest.approx(expected, rel=1e-3)
        average = np.array([0.1, 0.2, 0.4]) + np.array([0.8, 0.8, 0.3]) * average_grazing(ior)
        assert fresnel.average_reflectance(one) == pytest.approx(average, rel=1e-4)


@pytest.mark.parametrize("curve", [FresnelCurve.F82, FresnelCurve.CONDUCTOR])
def test_metal_has_its_own_curve(curve):
    one = closure(f0=(0.5, 0.6, 0.9), f90=0.1, edge=(0.4, 0.9, 0.7), curve=int(curve))
    assert fresnel.reflectance(one, f(0.4)) == metal.reflectances(int(curve), f(0.4), one.f0, one.edge)
    assert fresnel.average_reflectance(one) == metal.averages(int(curve), one.f0, one.edge)


def test_films_change_what_facets_reflect():
    """By their own file; next to nothing where they are thin, and glass has its bare reflectance under them."""
    film, cos, ior = triple((400, 1.3, 1)), f(0.6), f(1.5)
    bare = triple(fresnel.normal_reflectance(ior))
    assert fresnel.glass_reflectance(film, ior, cos) == thin_film.reflectances(film, 0, cos, bare, bare, ior)
    one = closure(film=film, f0=0.06, edge=0.5, ior=1.5)
    assert fresnel.reflectance(one, cos) == thin_film.reflectances(film, 0, cos, one.f0, one.edge, ior)
    thin = fresnel.glass_reflectance(triple((0.5, 1.3, 1)), ior, cos)
    assert thin == pytest.approx([fresnel_of(0.6, 1.5)] * 3, rel=0.03)


# Facets


@pytest.mark.parametrize("distribution", Distribution)
def test_facets_mask_each_other(distribution):
    x, y = 0.5, 0.3
    facets = Facets(distribution, f(x), f(y))
    for wo, wi in PAIRS:
        if distribution == ASHIKHMIN_SHIRLEY:
            expected = min(wi[2] / wo[2], 1)
        else:
            seen, lit = (one_plus_lambda(distribution, slope2(np.float64(w), x, y)) for w in (wo, wi))
            assert microfacets.one_plus_lambda(facets, wo) == pytest.approx(seen, rel=1e-5)
            expected = seen / (seen + lit - 1)
        for side in (1, -1):
            assert microfacets.g2_over_g1(facets, wo, (*wi[:2], f(side) * wi[2])) == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("distribution", Distribution)
def test_densities_of_reflected_directions(distribution):
    """Of visible normals D G₁/(4 cos); of those that are sampled whether they are seen or not D/(4 o·h)."""
    x, y = 0.5, 0.3
    for wo, wi in PAIRS:
        o, h = np.float64(wo), np.float64(wo) + np.float64(wi)
        h /= np.linalg.norm(h)
        facing = o[2] * one_plus_lambda(distribution, slope2(o, x, y)) if distribution != ASHIKHMIN_SHIRLEY else o @ h
        expected = density_of(distribution, h, x, y) / (4 * facing)
        facets = Facets(distribution, f(x), f(y))
        assert microfacets.pdf_reflected(facets, wo, triple(h)) == pytest.approx(expected, rel=2e-4, abs=1e-6)


def test_each_distribution_samples_its_own_normals():
    wo, (u, v), x, y = VIEWS[0], (f(0.3), f(0.6)), f(0.5), f(0.3)
    expected = ggx.visible_normal(wo, x, y, u, v), beckmann.visible_normal(wo, x, y, u, v)
    expected = *expected, ashikhmin_shirley.normal(x, y, u, v)
    for distribution, normal in zip(Distribution, expected, strict=True):
        assert microfacets.visible_normal(Facets(distribution, x, y), wo, u, v) == pytest.approx(normal)
    level = microfacets.visible_normal(Facets(GGX, x, y), unit(1, 0, 0), u, v)
    assert np.linalg.norm(level) == pytest.approx(1, abs=1e-5) and level[0] > 0


def test_widths_of_facets():
    """α is the square of the roughness, times the stretch along the tangent."""
    assert facets_of(closure(roughness=0.5, stretch=1.6, distribution=BECKMANN)) == (
        BECKMANN,
        pytest.approx(0.4),
        pytest.approx(0.15625),
    )


@pytest.mark.parametrize("ior", [1.5, 0.8])
def test_mirrored_and_refracted_directions(ior):
    h, wo = unit(0.2, -0.1, 0.9), VIEWS[0]
    cos = f(np.dot(h, wo))
    mirrored = microfacets.reflect(wo, h, cos)
    assert np.add(mirrored, wo) == pytest.approx(2 * cos * np.array(h), abs=1e-6)
    refracted = np.float64(microfacets.refract(wo, h, cos, f(ior)))
    across, o = np.float64(h), np.float64(wo)
    sin_t = (o - (o @ across) * across) / ior
    expected = -sin_t - np.sqrt(1 - sin_t @ sin_t) * across
    assert refracted == pytest.approx(expected, abs=1e-6)


# Tables


def test_tables_are_interpolated_along_each_axis():
    for table, places in (
        (tables.WHITE_AVERAGE, (0.37,)),
        (tables.WHITE, (0.37, 0.61)),
        (tables.GLASS, (0.7, 0.3, 0.2)),
    ):
        look_up = (tables.interpolate_1, tables.interpolate_2, tables.interpolate_3)[len(places) - 1]
        assert look_up(table, *map(f, places)) == pytest.approx(at(table, *places), rel=1e-5)
        for end in (-0.5, 0.0, 1.0, 1.5):
            assert look_up(table, *[f(end)] * len(places)) == pytest.approx(at(table, *[end] * len(places)), rel=1e-6)


def test_coordinates_of_indices_of_refraction():
    for ior in (1.1, 1.5, 1 / 1.5, 3):
        z = np.sqrt(abs(ior - 1) / (ior + 1))
        assert tables.curve_coordinate(f(ior)) == pytest.approx(z * 15 / 16, rel=1e-5)
        assert tables.glass_coordinate(f(ior)) == pytest.approx((1 + np.copysign(z, ior - 1)) / 2, rel=1e-5)
    assert tables.curve_coordinate(f(0)) == 1 and tables.curve_coordinate(f(1)) == 0


def test_what_scatters_more_than_once_takes_the_colour_each_time():
    color = triple((0.2, 0.6, 1))
    found = tables.multiple_scattering_of(color, f(0.7), f(0.8))
    assert found == pytest.approx(gained(color, 0.7, 0.8), rel=1e-5)
    assert found[2] == pytest.approx(1 / 0.7) and tables.multiple_scattering(f(0), f(0.7), f(0.8)) == 1


# Gloss

METAL = {"weight": (0.9, 0.8, 0.7), "f0": (0.3, 0.5, 0.8), "f90": (0.9, 1, 0.6), "roughness": 0.62}
GLOSSES = [
    METAL,
    METAL | {"ior": 1.5},
    METAL | {"ior": 1.5, "preserves_energy": True, "stretch": 1.4},
    METAL | {"preserves_energy": True},
    METAL | {"distribution": BECKMANN, "stretch": 0.8},
    METAL | {"distribution": ASHIKHMIN_SHIRLEY},
]


def scale_of(one, cos):
    """What multiple scattering multiplies a glossy lobe by that is seen at a cosine."""
    if not one.preserves_energy:
        return np.ones(3)
    f0, f90 = np.float64(one.f0), np.float64(one.f90)
    average = f0 + (f90 - f0) * average_grazing(one.ior)
    roughness = float(one.roughness)
    return gained(average, at(tables.WHITE, roughness, cos), at(tables.WHITE_AVERAGE, roughness))


def reflected_by(one, cos):
    f0, f90 = np.float64(one.f0), np.float64(one.f90)
    return f0 + (f90 - f0) * grazing(float(cos), float(one.ior))


def shape_of(one, wo, wi):
    """D G₂/(4 cos cos) of a glossy lobe, its density and its f without colours, and the cosine to the facet."""
    facets = SimpleNamespace(**facets_of(one)._asdict())
    x, y, kind = float(facets.alpha_x), float(facets.alpha_y), facets.distribution
    o, i = np.float64(wo), np.float64(wi)
    h = (o + i) / np.linalg.norm(o + i)
    d = density_of(kind, h, x, y)
    if kind == ASHIKHMIN_SHIRLEY:
        return d / (4 * (o @ h)), d / (4 * (o @ h) * max(o[2], i[2])), o @ h
    seen, lit = (one_plus_lambda(kind, slope2(w, x, y)) for w in (o, i))
    return d / (4 * o[2] * seen), d / (4 * o[2] * i[2] * (seen + lit - 1)), o @ h


@pytest.mark.parametrize("values", GLOSSES)
def test_f_of_gloss(values):
    one = closure(**values)
    for wo, wi in PAIRS:
        density, shape, cos = shape_of(one, wo, wi)
        expected = np.float64(one.weight) * reflected_by(one, cos) * scale_of(one, wo[2]) * shape
        value = glossy.evaluate(one, wo, wi)
        assert value == pytest.approx(expected, rel=3e-4, abs=1e-7)
        assert glossy.pdf(one, wo, wi) == pytest.approx(density, rel=3e-4, abs=1e-7)
        assert glossy.is_specular(one, wo, wi) == (expected.max() >= 1)


@pytest.mark.parametrize("values", GLOSSES)
@pytest.mark.parametrize("from_light", [False, True])
def test_samples_of_gloss_weigh_f_over_their_density(values, from_light):
    one, n_black = closure(**values), 0
    for wo in VIEWS:
        for u, v in numbers(NUMBERS):
            wi, weight = glossy.sample(one, wo, u, v, from_light)
            if wi[2] <= 0:
                assert weight == (0, 0, 0)
                n_black += 1
                continue
            h = microfacets.visible_normal(facets_of(one), wo, u, v)
            assert np.cross(np.add(wo, wi), h) == pytest.approx(0, abs=1e-5)
            density, shape, cos = shape_of(one, wo, wi)
            scale = scale_of(one, wi[2] if from_light else wo[2])
            expected = np.float64(one.weight) * reflected_by(one, cos) * scale * shape * wi[2] / density
            assert weight == pytest.approx(expected, rel=1e-3)
    assert n_black < 12


def test_nothing_is_reflected_below_the_horizon_or_by_smooth_gloss():
    up, down = VIEWS[0], unit(0.3, 0.2, -0.5)
    for one, wo, wi in (
        (closure(), up, down),
        (closure(), down, up),
        (closure(roughness=0.09), up, LIGHTS[0]),
        (closure(), unit(1, 0, 0), up),
        (closure(), up, unit(0, 1, 0)),
    ):
        assert glossy.evaluate(one, wo, wi) == (0, 0, 0) and glossy.pdf(one, wo, wi) == 0
    assert glossy.pdf(closure(roughness=glossy.SMOOTH), up, LIGHTS[0]) >= 0
    assert glossy.is_specular(closure(roughness=0.09), up, up)
    assert not glossy.is_specular(closure(f0=0.02, f90=0.02), up, LIGHTS[0])
    edge = closure(roughness=glossy.SMOOTH)
    mirrored = (-up[0], -up[1], up[2])
    assert glossy.evaluate(edge, up, mirrored)[0] > 1 and glossy.pdf(edge, up, mirrored) > 1


@pytest.mark.parametrize("values", GLOSSES)
def test_albedos_of_gloss(values):
    one = closure(**values)
    f0, f90, roughness = np.float64(one.f0), np.float64(one.f90), float(one.roughness)
    curve = 1.0 if one.ior == 0 else np.sqrt((one.ior - 1) / (one.ior + 1)) * 15 / 16
    for cos in (0.15, 0.6, 0.95):
        white, rest = at(tables.WHITE, roughness, cos), at(tables.GRAZING, curve, roughness, cos)
        expected = np.float64(one.weight) * (f0 * (white - rest) + f90 * rest) * scale_of(one, cos)
        assert glossy.albedo(one, f(cos)) == pytest.approx(expected, rel=1e-4)
        reflected = f0.max() + (f90.max() - f0.max()) * at(tables.GRAZING_OF_FACETS, curve, roughness, cos)
        if one.preserves_energy:
            average = f0.max() + (f90.max() - f0.max()) * average_grazing(one.ior)
            reflected *= white * gained(average, white, at(tables.WHITE_AVERAGE, roughness))
        assert glossy.transmittance(one, f(cos)) == pytest.approx(min(max(1 - reflected, 0), 1), rel=1e-4, abs=1e-6)


def test_what_layers_leave_at_their_ends():
    assert glossy.transmittance(closure(f0=0, f90=0), f(0.4)) == 1
    assert glossy.transmittance(closure(f0=0, f90=0, film=(400, 1.3, 1), ior=1.5), f(0.4)) == 1
    assert 0 <= glossy.transmittance(closure(f0=1, f90=1, preserves_energy=True), f(0.4)) < 1e-5


def test_films_on_gloss():
    """The albedo is that of level facets, and so is what they leave to what they cover."""
    one = closure(film=(400, 1.3, 1), f0=(0.04, 0.05, 0.06), f90=1, ior=1.5, weight=0.9)
    level, white = np.float64(fresnel.reflectance(one, f(0.6))), at(tables.WHITE, 0.6, 0.6)
    assert glossy.albedo(one, f(0.6)) == pytest.approx(0.9 * level * white, rel=1e-4)
    assert glossy.transmittance(one, f(0.6)) == pytest.approx(1 - level.max(), rel=1e-4)
