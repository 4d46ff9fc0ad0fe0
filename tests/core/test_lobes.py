"""One lobe at a time: Fresnel's and Snell's laws, samplers against densities, furnaces."""

import numpy as np
import pytest
from photon_bake.addon.bsdf import Lobe, albedo_tables, evaluate_glossy, glossy_albedo
from photon_bake.addon.bsdf import fresnel as fresnel_parts
from photon_bake.addon.bsdf import microfacets as parts
from photon_bake.addon.bsdf.facets import metal, thin_film
from photon_bake.addon.core.sampling.streams import stream
from photon_bake.addon.core.sampling.warps import sample_cosine_hemisphere
from photon_bake.addon.core.vec3 import dot, put, row
from photon_bake.addon.scene import Distribution, FresnelCurve
from photon_bake.tests.core.bsdf_points import (
    N,
    albedo_of,
    chi_square_against,
    compiled,
    direction,
    numbers,
    of_closures,
    pdf_glossy,
    sample_bsdf,
    seen_from_behind,
    surface,
)
from photon_bake.tools import thin_film as thin_film_tool
from scipy.interpolate import CubicSpline

# Parts, of numbers and of directions


@compiled
def _fresnel_dielectric(cos, ior):
    return fresnel_parts.fresnel_dielectric(cos, ior)


@compiled
def _grazing_share(cos, ior):
    return fresnel_parts.grazing_share(cos, ior)


@compiled
def _average_grazing_share(ior):
    return fresnel_parts.average_grazing_share(ior)


@compiled
def _density_of_normals(wo, h, distribution, alpha_x, alpha_y):
    """That of facets that reflect wo, from the density of where they send it."""
    facing = max(dot(wo, h), np.float32(0)) * (h[2] > 0)
    return 4 * facing * parts.pdf_reflected(parts.Facets(distribution, alpha_x, alpha_y), wo, h)


@compiled
def _visible_normals(wo, distribution, alpha_x, alpha_y, u, out):
    for i in range(len(u)):
        facets = parts.Facets(distribution, alpha_x, alpha_y)
        put(out, i, parts.visible_normal(facets, wo, u[i, 0], u[i, 1]))


@compiled
def _refract(wo, h, ior, out):
    for i in range(len(wo)):
        put(out, i, parts.refract(row(wo, i), h, dot(row(wo, i), h), ior))


@compiled
def _interpolate_2(table, x, y):
    return albedo_tables.interpolate_2(table, x, y)


def each(function, *arguments):
    """A compiled function of numbers, of arrays."""
    rows = np.broadcast_arrays(*(np.float32(a) for a in arguments))
    return np.array([function(*values) for values in zip(*(r.ravel() for r in rows), strict=True)]).reshape(
        rows[0].shape
    )


def fresnel_dielectric(cos, ior):
    return each(_fresnel_dielectric, cos, ior)


# Fresnel and Snell


@pytest.mark.plain
def test_fresnel_at_normal_brewster_and_critical_angles():
    ior = np.float32(1.5)
    assert fresnel_dielectric(np.float32(1), ior) == pytest.approx(0.04, rel=1e-5)
    brewster = np.cos(np.arctan(1.5))  # half of the light is of the polarisation that is not reflected
    assert fresnel_dielectric(np.float32(brewster), ior) == pytest.approx(0.5 * (5 / 13) ** 2, rel=1e-4)
    critical = np.sqrt(1 - (1 / 1.5) ** 2)
    below, above = fresnel_dielectric(np.float32([critical - 1e-3, critical + 1e-3]), 1 / ior)
    assert below == 1 and above < 0.9
    cos = np.linspace(0.1, 1, 10, dtype=np.float32)
    assert np.allclose(fresnel_dielectric(cos, np.float32(1)), 0, atol=1e-6)
    cos_t = np.sqrt(1 - (1 - cos * cos) / 2.25)
    assert np.allclose(fresnel_dielectric(cos, ior), fresnel_dielectric(cos_t, 1 / ior), atol=1e-4)


@pytest.mark.parametrize("ior", [0.0, 0.7, 1.1, 1.5, 2.5])
def test_grazing_shares_go_from_0_to_1_and_average_as_they_should(ior):
    cos = ((np.arange(4000) + 0.5) / 4000).astype(np.float32)
    share = each(_grazing_share, cos, ior)
    assert share[-1] < 1e-3 and share[0] > 0.98 and (np.diff(share) <= 1e-4).all()
    assert _average_grazing_share(np.float32(ior)) == pytest.approx((2 * share * cos).mean(), abs=0.01)


@pytest.mark.plain
@pytest.mark.parametrize("ior", [1.5, 1 / 1.5, 1.0])
def test_refraction_obeys_snell(ior):
    wo, h = sample_cosine_hemisphere(numbers(2, 1000)[:, :2]), direction(0.9, 1)[0]
    wo = wo[wo @ h > (0.76 if ior < 1 else 0)]
    wi = np.empty_like(wo)
    _refract(wo, tuple(h), np.float32(ior), wi)
    assert np.allclose(np.linalg.norm(wi, axis=1), 1, atol=1e-5)
    assert np.allclose(np.cross(wo, h) + ior * np.cross(wi, h), 0, atol=1e-5)
    assert (wi @ h < 0).all()


# Samplers and densities


@pytest.mark.parametrize("distribution", Distribution)
@pytest.mark.parametrize(("roughness", "aspect"), [(0.3, 1), (0.6, 1), (1.0, 1), (0.6, 0.4)])
@pytest.mark.parametrize("cos", [1.0, 0.6, 0.1])
def test_normals_of_facets(distribution, roughness, aspect, cos):
    n, wo = 1 << 17, tuple(direction(cos, 1)[0])
    kind = np.int32(distribution), np.float32(roughness**2 / aspect), np.float32(roughness**2 * aspect)
    sampled = np.empty((n, 3), np.float32)
    _visible_normals(wo, *kind, stream(1, 5).random((n, 2), dtype=np.float32), sampled)
    sampled = sampled[sampled @ wo > 0]  # Ashikhmin's and Shirley's are sampled whether they are seen or not

    def pdf(directions):
        return np.array([_density_of_normals(wo, tuple(h), *kind) for h in directions])

    p, total = chi_square_against(sampled, pdf)
    assert p > 1e-3 and total == pytest.approx(len(sampled) / n, abs=5e-3)


@pytest.mark.parametrize("distribution", Distribution)
@pytest.mark.parametrize("roughness", [0.35, 0.6, 1.0])
@pytest.mark.parametrize("cos", [1.0, 0.6, 0.2])
def test_glossy_samples_follow_their_density_and_weigh_what_f_says(distribution, roughness, cos):
    n = 1 << 17
    gloss = {"kind": Lobe.GLOSSY, "f0": 0.3, "f90": 0.9, "roughness": roughness}
    s = of_closures(gloss | {"distribution": distribution, "preserves_energy": distribution == Distribution.GGX}, n=n)
    wo = direction(cos, n)
    sample = sample_bsdf(s, wo, stream(1, 6).random((n, 3), dtype=np.float32), 1 << Lobe.GLOSSY)
    wi, up = sample.wi, sample.wi[:, 2] > 0
    assert (sample.weight[~up] == 0).all()
    p, above = chi_square_against(wi[up], lambda d: pdf_glossy(s.where(np.arange(len(d))), wo[: len(d)], d))
    assert p > 1e-3 and above == pytest.approx(up.mean(), abs=0.01)
    k = np.flatnonzero(up & (wi[:, 2] > 1e-3))
    expected = evaluate_glossy(s.where(k), wo[k], wi[k]) * (wi[k, 2] / pdf_glossy(s.where(k), wo[k], wi[k]))[:, None]
    assert np.allclose(sample.weight[k], expected, rtol=2e-3)


@pytest.mark.parametrize("distribution", Distribution)
@pytest.mark.parametrize("curve", FresnelCurve)
def test_glossy_without_multiple_scattering_is_reciprocal(distribution, curve):
    ior = 1.5 if curve == FresnelCurve.DIELECTRIC else 0
    gloss = {"kind": Lobe.GLOSSY, "f0": 0.1, "ior": ior, "roughness": 0.4, "preserves_energy": False}
    s = of_closures(gloss | {"distribution": distribution, "curve": curve, "edge": 0.7})
    wo, wi = sample_cosine_hemisphere(numbers(3)[:, :2]), sample_cosine_hemisphere(numbers(4)[:, :2])
    assert np.allclose(evaluate_glossy(s, wo, wi), evaluate_glossy(s, wi, wo), rtol=1e-3)


def test_diffuse_and_translucent_directions():
    s = surface(diffuse=0.5, translucent=0.25)
    sample = sample_bsdf(s, direction(0.7), stream(1, 7).random((N, 3), dtype=np.float32))
    up = sample.lobe == Lobe.DIFFUSE
    assert (up == (sample.wi[:, 2] > 0)).all() and up.mean() == pytest.approx(2 / 3, abs=0.01)
    for k in (up, ~up):
        p, _ = chi_square_against(np.abs(sample.wi[k]), _quarter_cosine)
        assert p > 1e-3
    assert np.allclose(sample.weight, 0.75)


def _quarter_cosine(d):
    """Density of the moduli of cosine-weighted directions."""
    return 4 * np.maximum(d[:, 2], 0) / np.pi * (d[:, 0] > 0) * (d[:, 1] > 0)


# Albedos


@pytest.mark.parametrize("roughness", [0.0, 0.2, 0.5, 1.0])
@pytest.mark.parametrize("cos", [1.0, 0.6, 0.25, 0.1])
def test_white_glossy_furnace(roughness, cos):
    s = surface(f0=1, f90=1, roughness=roughness)
    assert albedo_of(s, cos) == pytest.approx(1, abs=0.01)
    lossy = surface(f0=1, f90=1, roughness=roughness, preserves_energy=False)
    white = _interpolate_2(albedo_tables.WHITE, np.float32(roughness), np.float32(cos))
    assert albedo_of(lossy, cos) == pytest.approx(white, abs=0.01)


def test_colored_gloss_grows_more_saturated_with_roughness():
    gold = {"f0": [1.0, 0.7, 0.3], "f90": 1.0}
    smooth, rough = (glossy_albedo(surface(1, roughness=r, **gold), np.float32([0.9]))[0] for r in (0.1, 1.0))
    assert rough[0] == pytest.approx(1, abs=5e-3)
    assert rough[2] / rough[0] < 0.9 * smooth[2] / smooth[0]


@pytest.mark.parametrize("ior", [1.5, 1 / 1.5])
@pytest.mark.parametrize("cos", [1.0, 0.5, 0.15])
def test_glass_furnace(ior, cos):
    glass = {"glass_reflection": 1, "glass_transmission": 1, "glass_ior": ior}
    assert albedo_of(surface(roughness=0, **glass), cos) == pytest.approx(1, abs=1e-3)
    rough = surface(roughness=0.7, **glass)
    assert albedo_of(surface(roughness=0.7, preserves_energy=False, **glass), cos).max() < 0.98
    # Inside rough glass some is lost, as in Cycles
    assert albedo_of(rough, cos) == pytest.approx(1 if ior > 1 or cos == 1 else 0.93, abs=0.07 if ior < 1 else 0.01)


def test_smooth_glass_reflects_and_refracts_by_fresnel():
    s = surface(glass_reflection=[1, 0.5, 1], glass_transmission=[0.5, 1, 1], roughness=0)
    wo = direction(0.6)
    sample = sample_bsdf(s, wo, numbers())
    up = sample.wi[:, 2] > 0
    assert np.allclose(sample.wi[up], wo[up] * [-1, -1, 1], atol=1e-5)
    assert np.allclose(sample.wi[~up], np.append(-wo[0, :2] / 1.5, -np.sqrt(1 - 0.64 / 2.25)), atol=1e-5)
    f = fresnel_dielectric(np.float32(0.6), np.float32(1.5))
    assert np.where(up[:, None], sample.weight, 0).mean(0) == pytest.approx(f * np.array([1, 0.5, 1]), rel=5e-3)
    assert np.where(up[:, None], 0, sample.weight).mean(0) == pytest.approx((1 - f) * np.array([0.5, 1, 1]), rel=5e-3)


def test_without_fresnel_all_is_refracted_or_lost():
    s = surface(glass_transmission=0.9, roughness=0, glass_fresnel=False)
    sample = sample_bsdf(s, direction(0.3), numbers())
    assert (sample.wi[:, 2] < 0).all() and np.allclose(sample.weight, 0.9)
    inside = seen_from_behind(s)
    assert (sample_bsdf(inside, direction(0.3), numbers()).weight == 0).all()  # beyond the critical angle
    assert np.allclose(sample_bsdf(inside, direction(0.9), numbers()).weight, 0.9)


def test_smooth_gloss_is_a_mirror():
    wo = direction(0.3)
    for roughness in (0.0, 1e-2):
        sample = sample_bsdf(surface(f0=0.5, f90=0.5, roughness=roughness), wo, numbers())
        off = np.abs(sample.wi - wo * [-1, -1, 1]).max(axis=1)
        assert (np.quantile(off, 0.98) < 2e-3) if roughness else (off.max() < 1e-5)  # GGX has long tails
        assert np.allclose(sample.weight, 0.5, atol=0.01)


# Metals


@pytest.mark.plain
def test_conductors_reflect_by_fresnels_equations():
    """Amplitudes r_s = (cos − q)/(cos + q) and r_p = (N² cos − q)/(N² cos + q) with q = √(N² − sin²), N = n + ik."""
    cos = np.linspace(0.02, 1, 30, dtype=np.float32)
    for n, k in ((0.18, 3.4), (1.5, 0.0), (2.9, 3.1), (0.9, 6.5)):
        f0 = ((n - 1) ** 2 + k * k) / ((n + 1) ** 2 + k * k)
        q = np.sqrt((n + 1j * k) ** 2 - 1 + cos.astype(complex) ** 2)
        r_s, r_p = (cos - q) / (cos + q), ((n + 1j * k) ** 2 * cos - q) / ((n + 1j * k) ** 2 * cos + q)
        expected = (abs(r_s) ** 2 + abs(r_p) ** 2) / 2
        assert each(_of_metal, FresnelCurve.CONDUCTOR, cos, f0, n) == pytest.approx(expected, abs=1e-4)


@pytest.mark.plain
def test_f82_tints_the_edge():
    cos, f0, tint = np.float32([1, 1 / 7, 0]), 0.6, 0.3
    schlick = f0 + (1 - f0) * (6 / 7) ** 5
    assert each(_of_metal, FresnelCurve.F82, cos, f0, tint) == pytest.approx([f0, tint * schlick, 1], abs=1e-5)
    middles = ((np.arange(4000) + 0.5) / 4000).astype(np.float32)
    mean = (2 * middles * each(_of_metal, FresnelCurve.F82, middles, f0, tint)).mean()
    assert each(_average_of_metal, FresnelCurve.F82, f0, tint) == pytest.approx(mean, abs=1e-3)


@compiled
def _of_metal(curve, cos, f0, edge):
    return metal.reflectance(curve, cos, f0, edge)


@compiled
def _average_of_metal(curve, f0, edge):
    return metal.average(curve, f0, edge)


# Thin films


@compiled
def _of_film(film, curve, cos, f0, edge, ior, out):
    for i in range(len(cos)):
        put(out, i, thin_film.reflectances(film, curve, cos[i], f0, edge, ior))


def of_film(thickness, ior, cos, curve=FresnelCurve.DIELECTRIC, f0=0.0, edge=1.0, under=1.0):
    """Reflectances of a film at cosines (n,), (n, 3)."""
    out = np.empty((len(cos), 3), np.float32)
    film, three = tuple(np.float32([thickness, ior, 1])), lambda x: tuple(np.full(3, x, np.float32))
    _of_film(film, np.int32(curve), cos, three(f0), three(edge), np.float32(under), out)
    return out


def of_film_by_wavelengths(thickness, ior, cos, index):
    """The same by Airy's formula at each wavelength, for a film on what has a complex index."""
    table = np.loadtxt(thin_film_tool.CURVES, delimiter=",")
    wavelength = np.arange(365, 826)
    curves = CubicSpline(table[:, 0], table[:, 1:])(wavelength) @ thin_film_tool.TO_REC_709.T
    cos = cos[:, None].astype(complex)
    cos2 = np.sqrt(1 - (1 - cos**2) / ior**2)
    cos3 = np.sqrt(1 - (1 - cos**2) / index**2)
    turn = np.exp(4j * np.pi * ior * thickness * cos2 / wavelength)
    reflected = 0
    for first, second in (
        ((cos - ior * cos2) / (cos + ior * cos2), (ior * cos2 - index * cos3) / (ior * cos2 + index * cos3)),
        ((ior * cos - cos2) / (ior * cos + cos2), (index * cos2 - ior * cos3) / (index * cos2 + ior * cos3)),
    ):
        reflected = reflected + abs((first + second * turn) / (1 + first * second * turn)) ** 2 / 2
    return np.clip(reflected @ curves / curves.sum(axis=0), 0, 1)


@pytest.mark.plain
@pytest.mark.parametrize("thickness", [120, 330, 600, 1500])
@pytest.mark.parametrize(("ior", "under"), [(1.33, 1.0), (1.4, 1.9), (2.0, 1.5)])
def test_films_on_dielectrics_interfere(thickness, ior, under):
    cos = np.float32([1, 0.8, 0.5, 0.2])
    f0 = ((under - 1) / (under + 1)) ** 2
    found = of_film(thickness, ior, cos, f0=f0, under=under)
    assert found == pytest.approx(of_film_by_wavelengths(thickness, ior, cos, under), abs=0.02)


@pytest.mark.plain
@pytest.mark.parametrize("thickness", [120, 400, 1500])
def test_films_on_metal_interfere(thickness):
    cos, n, k = np.float32([1, 0.8, 0.5, 0.35]), 2.9, 3.1
    f0 = ((n - 1) ** 2 + k * k) / ((n + 1) ** 2 + k * k)
    found = of_film(thickness, 1.5, cos, FresnelCurve.CONDUCTOR, f0, n)
    assert found == pytest.approx(of_film_by_wavelengths(thickness, 1.5, cos, n + 1j * k), abs=0.03)


@pytest.mark.plain
def test_no_more_than_a_trace_of_a_film_changes_nothing():
    cos = np.float32([1, 0.7, 0.3])
    assert of_film(1e-3, 1.4, cos, f0=0.04, under=1.5)[:, 0] == pytest.approx(fresnel_dielectric(cos, 1.5), abs=2e-3)
