"""How surfaces scatter light: samplers against densities, furnaces, Fresnel's and Snell's laws, photons and paths."""

from dataclasses import dataclass, replace
from hashlib import sha256

import numba
import numpy as np
import pytest
from photon_bake.addon.bsdf import (
    PEAK,
    SMOOTH,
    Lobe,
    Surface,
    albedo_tables,
    base_transmittance,
    diffuse_albedo,
    evaluate_broad,
    evaluate_glossy,
    glass_albedo,
    glossy_albedo,
    is_mirror,
    mixture,
    pdf_glossy,
    reflects_highlights,
    surface_at,
    translucent_albedo,
)
from photon_bake.addon.bsdf import fresnel as fresnel_parts
from photon_bake.addon.bsdf import microfacets as parts
from photon_bake.addon.bsdf.closure import bsdf_of
from photon_bake.addon.core.sampling.sobol import sobol_points, sobol_seeds
from photon_bake.addon.core.sampling.streams import stream
from photon_bake.addon.core.sampling.warps import sample_cosine_hemisphere
from photon_bake.addon.core.vec3 import dot, put, row
from photon_bake.addon.scene import Channel, Closures, Materials
from photon_bake.tests.core.scenes import chi_square, plane, scene_of
from photon_bake.tools.albedo_tables import tables as computed_tables

N = 1 << 16
SCALARS = ("fresnel_ior", "layer_f0", "glass_ior", "preserves_energy", "glass_fresnel")

compiled = numba.njit(error_model="numpy", _nrt=False)


def surface(n=N, back=False, **values) -> Surface:
    """n equal points; what `values` leave out is black, rough and preserves energy."""
    columns = {}
    for name, value in values.items():
        if name in SCALARS:
            columns[name] = np.array([value], bool if isinstance(value, bool) else np.float32)
        else:
            columns[name] = Channel.constant(np.broadcast_to(np.float32(value), (1, 3)))
    return points_of(Materials.of(1, **columns), n, back)


def points_of(materials, n=N, back=False) -> Surface:
    """n equal points of the first of some materials."""
    scene = replace(scene_of(*plane()), materials=materials)
    zero = np.zeros(n, np.float32)
    return surface_at(scene, np.zeros(n, np.int32), zero, zero, np.full(n, back))


def seen_from_behind(s: Surface) -> Surface:
    return replace(s, back=~s.back)


def plastic(n=N, base=0.5, ior=1.5, **values) -> Surface:
    f0 = ((ior - 1) / (ior + 1)) ** 2
    return surface(n, diffuse=base, f0=f0, f90=1, layer_f0=f0, fresnel_ior=ior, **values)


def direction(cos, n=N, phi=0.4):
    sin = np.sqrt(1 - cos * cos)
    return np.tile(np.float32([sin * np.cos(phi), sin * np.sin(phi), cos]), (n, 1))


def numbers(seed=1, n=N, dimensions=3):
    return sobol_points(sobol_seeds(1, seed), 0, 0, n)[:, :dimensions]


@dataclass
class Samples:
    """Scattered directions of n points, see `mixture.Sample`."""

    wi: np.ndarray
    weight: np.ndarray
    lobe: np.ndarray
    specular: np.ndarray
    rough: np.ndarray


def sample_bsdf(s, wo, u, lobes=mixture.ALL_LOBES, from_light=False) -> Samples:
    """One direction for each point, by local wo (n, 3) and numbers (n, 3)."""
    n = len(s)
    found = Samples(*np.empty((2, n, 3), np.float32), np.empty(n, np.uint8), *np.empty((2, n), bool))
    _sample(s.scene, s.triangle, s.u, s.v, s.back, wo, u, lobes, from_light, *vars(found).values())
    return found


@compiled
def _sample(scene, triangle, u, v, back, wo, numbers, lobes, from_light, wi, weight, lobe, specular, rough):
    for i in range(len(triangle)):
        bsdf, (a, b, c) = bsdf_of(scene, triangle[i], u[i], v[i], back[i]), row(numbers, i)
        sample = mixture.sample_bsdf(scene, bsdf, row(wo, i), a, b, c, lobes, from_light)
        put(wi, i, sample.wi)
        put(weight, i, sample.weight)
        lobe[i], specular[i], rough[i] = sample.lobe, sample.specular, sample.rough


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
def _distribution(wo, h, alpha):
    """The density of visible normals."""
    facing = max(dot(wo, h), np.float32(0)) * (h[2] > 0)
    return facing * parts.distribution(h, alpha) / wo[2] / parts.masked(wo[2], alpha)


@compiled
def _visible_normals(wo, alpha, u, out):
    for i in range(len(u)):
        put(out, i, parts.visible_normal(wo, alpha, u[i, 0], u[i, 1]))


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


def column(n, *values):
    return tuple(np.full(n, value, np.float32) for value in values)


def albedo_of(s, cos, seed=1, **how):
    """What a path finds in a white world, (3,)."""
    return sample_bsdf(s, direction(cos, len(s)), numbers(seed, len(s)), **how).weight.mean(axis=0, dtype=np.float64)


def chi_square_against(sampled, pdf_of, n_z=40, n_phi=20):
    """χ² of directions in cells of z and φ against the density `pdf_of` directions, and the share that these hold."""
    z_edges, phi_edges = np.linspace(-1, 1, n_z + 1), np.linspace(-np.pi, np.pi, n_phi + 1)
    counts, _, _ = np.histogram2d(sampled[:, 2], np.arctan2(sampled[:, 1], sampled[:, 0]), [z_edges, phi_edges])
    (z, z_weight), (phi, phi_weight) = gauss_legendre(z_edges, 20), gauss_legendre(phi_edges, 8)
    z, phi = (x.ravel() for x in np.meshgrid(z, phi, indexing="ij"))
    sin = np.sqrt(1 - z * z)
    density = pdf_of(np.stack([sin * np.cos(phi), sin * np.sin(phi), z], axis=1).astype(np.float32))
    mass = density.reshape(len(z_weight), len(phi_weight)) * z_weight[:, None] * phi_weight
    mass = mass.reshape(n_z, 20, n_phi, 8).sum(axis=(1, 3))
    return chi_square(counts, mass / mass.sum() * counts.sum()), mass.sum()


def gauss_legendre(edges, n):
    """Nodes and weights of n points between each two edges."""
    nodes, weights = np.polynomial.legendre.leggauss(n)
    half = np.diff(edges)[:, None] / 2
    return (edges[:-1, None] + half * (1 + nodes)).ravel(), (half * weights).ravel()


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


@pytest.mark.parametrize("roughness", [0.3, 0.6, 1.0])
@pytest.mark.parametrize("cos", [1.0, 0.6, 0.1])
def test_visible_normals(roughness, cos):
    n = 1 << 17
    wo, alpha, sampled = tuple(direction(cos, 1)[0]), np.float32(roughness**2), np.empty((n, 3), np.float32)
    _visible_normals(wo, alpha, stream(1, 5).random((n, 2), dtype=np.float32), sampled)

    def pdf(directions):
        return np.array([_distribution(wo, tuple(h), alpha) for h in directions])

    p, total = chi_square_against(sampled, pdf)
    assert p > 1e-3 and total == pytest.approx(1, abs=5e-3)


@pytest.mark.parametrize("roughness", [0.35, 0.6, 1.0])
@pytest.mark.parametrize("cos", [1.0, 0.6, 0.2])
def test_glossy_samples_follow_their_density_and_weigh_what_f_says(roughness, cos):
    n = 1 << 17
    s = surface(n, f0=0.3, f90=0.9, roughness=roughness)
    wo = direction(cos, n)
    sample = sample_bsdf(s, wo, stream(1, 6).random((n, 3), dtype=np.float32), 1 << Lobe.GLOSSY)
    wi, up = sample.wi, sample.wi[:, 2] > 0
    assert (sample.weight[~up] == 0).all()
    p, above = chi_square_against(wi[up], lambda d: pdf_glossy(s.where(np.arange(len(d))), wo[: len(d)], d))
    assert p > 1e-3 and above == pytest.approx(up.mean(), abs=0.01)
    k = np.flatnonzero(up & (wi[:, 2] > 1e-3))
    expected = evaluate_glossy(s.where(k), wo[k], wi[k]) * (wi[k, 2] / pdf_glossy(s.where(k), wo[k], wi[k]))[:, None]
    assert np.allclose(sample.weight[k], expected, rtol=2e-3)


def test_glossy_without_multiple_scattering_is_reciprocal():
    s = surface(f0=0.1, f90=1, fresnel_ior=1.5, roughness=0.4, preserves_energy=False)
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


# Albedos


def test_tables_are_what_the_formulas_say():
    stored = np.load(albedo_tables.FILE)
    for name, table in computed_tables().items():
        np.testing.assert_allclose(stored[name], table, rtol=1e-4, atol=1e-6)
    assert sha256(albedo_tables.FILE.read_bytes()).hexdigest() == albedo_tables.FILE_DIGEST


def test_tables_have_converged():
    stored, fine = np.load(albedo_tables.FILE), computed_tables(1597, 987)
    for name, table in fine.items():
        off = np.abs(stored[name] - table)
        assert off.max() < 5e-3 and off.mean() < 5e-4


@pytest.mark.parametrize("roughness", [0.0, 0.2, 0.5, 1.0])
@pytest.mark.parametrize("cos", [1.0, 0.6, 0.25, 0.1])
def test_white_glossy_furnace(roughness, cos):
    s = surface(f0=1, f90=1, roughness=roughness)
    assert albedo_of(s, cos) == pytest.approx(1, abs=0.01)
    lossy = surface(f0=1, f90=1, roughness=roughness, preserves_energy=False)
    white = _interpolate_2(albedo_tables.WHITE, np.float32(roughness), np.float32(cos))
    assert albedo_of(lossy, cos) == pytest.approx(white, abs=0.01)


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


# Photons and paths


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
    ],
    ids=["plastic", "rough plastic", "metal", "leaf", "glass", "lossy glass", "refraction"],
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
    f, broad = evaluate_glossy(s, view, light), evaluate_broad(s, view, light)
    assert 0 < specular.sum() < len(up) and f[specular].min() >= PEAK > f[~specular].max()
    assert (broad[specular] == 0).all() and np.array_equal(broad[~specular], f[~specular])
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


def closures(*several) -> Closures:
    """The closures of one material; what is left out is white, smooth and by Schlick's curve."""
    given = [{"weight": 1, "roughness": 0, "f0": 1, "f90": 1, "ior": 0, "layer": -1} | one for one in several]
    channels = {
        name: Channel.constant(np.float32([np.broadcast_to(one[name], 3) for one in given]))
        for name in ("weight", "roughness", "f0", "f90")
    }
    whole, flags = np.array([[one["kind"], one["layer"]] for one in given], np.int32).T, np.ones(len(given), bool)
    return Closures(
        start=np.array([0, len(given)], np.int32),
        kind=whole[0].copy(),
        ior=np.array([one["ior"] for one in given], np.float32),
        fresnel=flags,
        preserves_energy=flags,
        layer=whole[1].copy(),
        **channels,
    )


def of_closures(*several, n=N) -> Surface:
    return points_of(Materials.of(1, closures=closures(*several)), n)


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
    of_dull = evaluate_broad(of_closures(DULL, n=len(wi)), view, wi)
    np.testing.assert_array_equal(evaluate_broad(s.where(np.arange(len(wi))), view, wi), of_dull)
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
