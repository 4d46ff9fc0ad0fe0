"""Values of broad lobes and layers at single points against the formulas of their papers, as plain Python."""

import numpy as np
import pytest
from photon_bake.addon.bsdf.broad import absorbing, layers, lobes, rough_diffuse, sheen, toon, velvet
from photon_bake.addon.core.sampling.warps import cosine_hemisphere, cosine_uniform_mixture
from photon_bake.addon.scene import Lobe
from photon_bake.tests.core.bsdf_points import gauss_legendre
from photon_bake.tests.core.values.lobe_formulas import (
    LIGHTS,
    NUMBERS,
    PAIRS,
    VIEWS,
    at,
    closure,
    f,
    numbers,
    triple,
    unit,
)

WEIGHT = np.array([0.9, 0.6, 0.3])


def hemisphere(n=24):
    """Directions of the upper hemisphere and the solid angle that each stands for."""
    (z, of_z), (phi, of_phi) = gauss_legendre(np.array([0, 1]), n), gauss_legendre(np.array([-np.pi, np.pi]), n)
    z, phi = (x.ravel() for x in np.meshgrid(z, phi, indexing="ij"))
    sin = np.sqrt(1 - z * z)
    return np.stack([sin * np.cos(phi), sin * np.sin(phi), z], axis=1), np.outer(of_z, of_phi).ravel()


# Rough diffuse


def rough_f(color, sigma, wo, wi):
    """Fujii's first scattering, and OpenPBR's of what scatters more than once; of directions (…, 3)."""
    a = 1 / (np.pi + sigma * (np.pi / 2 - 2 / 3))
    b, o, i = sigma * a, np.float64(wo), np.float64(wi)
    t = i @ o - o[2] * i[..., 2]
    single = a + b * np.where(t > 0, t / np.maximum(o[2], i[..., 2]), t)

    def albedo(cos):
        sin = np.sqrt(1 - cos * cos)
        rest = sin * (np.arccos(cos) - 2 / 3 - sin * cos) + 2 / 3 * (sin / cos) * (1 - sin**3)
        return np.pi * a + b * rest

    average = np.pi * a + (2 * np.pi - 5.6) / 3 * b
    missing = 1 - average
    lost = (1 - albedo(o[2])) * (1 - albedo(i[..., 2]))
    return single[..., None] + color**2 / np.pi * average * lost[..., None] / (missing * (1 - color * missing))


@pytest.mark.parametrize("sigma", [0.3, 1.0])
def test_rough_diffuse(sigma):
    color = np.array([0.8, 0.5, 0.2])
    one = closure(Lobe.ROUGH_DIFFUSE, weight=WEIGHT, f0=color, roughness=sigma)
    for wo, wi in PAIRS:
        expected = WEIGHT * rough_f(color, sigma, wo, wi)
        assert rough_diffuse.evaluate(one, wo, wi) == pytest.approx(expected, rel=1e-4)
        assert rough_diffuse.evaluate(one, wi, wo) == pytest.approx(expected, rel=1e-4)
    directions, solid_angles = hemisphere()
    for wo in VIEWS:
        expected = WEIGHT * (rough_f(color, sigma, wo, directions) * (directions[:, 2] * solid_angles)[:, None]).sum(
            axis=0
        )
        assert rough_diffuse.albedo(one, wo[2]) == pytest.approx(expected, rel=2e-3)
        for u, v in numbers(NUMBERS):
            wi, weight = rough_diffuse.sample(one, wo, u, v)
            assert wi == cosine_hemisphere(u, v)
            assert weight == pytest.approx(np.pi * WEIGHT * rough_f(color, sigma, wo, wi), rel=1e-4)


def test_rough_diffuse_at_the_ends():
    """White reflects all, smooth is Lambertian, and grazing directions are no trouble."""
    white = closure(Lobe.ROUGH_DIFFUSE, roughness=1.0)
    for cos in (0, 1e-7, 1e-3, 0.5, 1):
        assert rough_diffuse.albedo(white, f(cos)) == pytest.approx([1] * 3, abs=1e-5)
    smooth = closure(Lobe.ROUGH_DIFFUSE, weight=WEIGHT, f0=0.5, roughness=0)
    assert rough_diffuse.evaluate(smooth, *PAIRS[3]) == pytest.approx(WEIGHT / np.pi, rel=1e-4)
    level = rough_diffuse.evaluate(white, unit(1, 0, 0), unit(1, 0, 0))
    assert np.isfinite(level).all()
    below = rough_diffuse.evaluate(white, unit(1, 0, -0.1), unit(1, 0, 0.2))
    assert np.isfinite(below).all() and min(below) > 0


# Sheen


def transform(roughness, cos):
    """The transform of Zeltner, Burley and Chiang, by the fits of MaterialX's form."""
    x, y = cos, roughness
    a = (3.025949 * x + 0.79633 * y) * y / (1 + 0.337281 * x * x + 3.12349 * x * y)
    return a, np.sqrt(1 - x) * (y - 1) * y**3 / (2.54053e-5 + 1.71228 * x - 1.71506 * x * y + 1.34174 * y * y)


def sheen_share(roughness, cos):
    x, y = cos, roughness
    width = y * (0.131132 + 1.364419 * y) / (0.190538 + 0.954527 * y + y * y)
    center = y * (-0.087371 - 1.68095 * y + 2.537091 * y**2 - 1.257748 * y**4) / (0.03 + y)
    offset = y * (0.003814 - 0.028188 * y + 0.094058 * y**2) / (1.291162 - 2.045005 * y + y * y)
    return np.exp(-(((x - center) / width) ** 2) / 2) / (np.sqrt(2 * np.pi) * width) + offset


def tangent_frame(view):
    """The view's tangent and the direction across, as rows."""
    x, y = view[0], view[1]
    r = np.hypot(x, y)
    return np.array([[x / r, y / r, 0], [-y / r, x / r, 0], [0, 0, 1]])


def sheen_f(color, roughness, view, light):
    a, b = transform(roughness, view[2])
    x, y, z = tangent_frame(np.float64(view)) @ np.float64(light)
    l2 = (a * x + b * z) ** 2 + (a * y) ** 2 + z**2
    return color * sheen_share(roughness, view[2]) * (a / l2) ** 2 / np.pi


@pytest.mark.parametrize("roughness", [0.2, 0.5, 1.0])
def test_sheen(roughness):
    color = np.array([0.7, 0.4, 0.9])
    one = closure(Lobe.SHEEN, weight=WEIGHT, f0=color, roughness=roughness)
    for wo, wi in PAIRS:
        assert sheen.evaluate(one, wo, wi) == pytest.approx(WEIGHT * sheen_f(color, roughness, wo, wi), rel=2e-3)
    for wo in VIEWS:
        share = sheen_share(roughness, float(wo[2]))
        assert sheen.share(one.roughness, wo[2]) == pytest.approx(share, rel=1e-3, abs=1e-6)
        assert sheen.albedo(one, wo[2]) == pytest.approx(WEIGHT * color * share, rel=1e-3, abs=1e-6)
        assert sheen.transmittance(one, wo[2]) == pytest.approx(1 - 0.9 * share, rel=1e-3)
        a, b = transform(roughness, float(wo[2]))
        for u, v in numbers(NUMBERS):
            wi, weight = sheen.sample(one, wo, u, v, False)
            x, y, z = tangent_frame(np.float64(wo)) @ np.float64(wi)
            cosine = np.array([a * x + b * z, a * y, z])  # what was sampled before the transform
            assert cosine / np.linalg.norm(cosine) == pytest.approx(np.float64(cosine_hemisphere(u, v)), abs=2e-4)
            assert np.linalg.norm(wi) == pytest.approx(1, abs=1e-5) and weight == sheen.albedo(one, wo[2])
            to, carried = sheen.sample(one, wo, u, v, True)
            assert to == cosine_uniform_mixture(u, v)
            density = (to[2] + 0.5) / (2 * np.pi)
            expected = WEIGHT * sheen_f(color, roughness, to, wo) * to[2] / density
            assert carried == pytest.approx(expected, rel=2e-3)


def test_sheen_at_the_ends():
    one = closure(Lobe.SHEEN)
    down = unit(0.2, 0.1, -0.5)
    assert sheen.evaluate(one, VIEWS[0], down) == (0, 0, 0) == sheen.evaluate(one, down, VIEWS[0])
    assert sheen.evaluate(one, unit(1, 0, 0), VIEWS[0]) == (0, 0, 0) == sheen.evaluate(one, VIEWS[0], unit(1, 0, 0))
    for roughness, as_if in ((0, 0.07), (0.07, 0.07)):  # below it there is next to none
        assert sheen.share(f(roughness), f(0.3)) == sheen.share(f(as_if), f(0.3))
        assert sheen._transform(closure(roughness=roughness), f(0.3)) == pytest.approx(transform(as_if, 0.3), rel=1e-3)
    for cos, as_if in ((-0.2, 0), (1.2, 1)):
        assert sheen.share(f(0.5), f(cos)) == sheen.share(f(0.5), f(as_if))
    a, b = sheen._transform(one, f(1.0))
    assert b == 0 and a > 0
    straight = sheen.evaluate(one, unit(0, 0, 1), VIEWS[1])
    assert straight == pytest.approx(sheen.evaluate(one, unit(1e-4, 0, 1), VIEWS[1]), rel=1e-2)
    assert sheen.transmittance(closure(f0=50, roughness=0.5), f(0.05)) == 0


# Velvet


def velvet_f(sigma, wo, wi):
    o, i = np.float64(wo), np.float64(wi)
    h = (o + i) / np.linalg.norm(o + i)
    sin2 = 1 - h[2] ** 2
    d = np.exp(-(h[2] ** 2) / sin2 / sigma**2) / (np.pi * sigma**2 * sin2**2)
    g = min(1, 2 * h[2] * o[2] / (o @ h), 2 * h[2] * i[2] / (o @ h))
    return d * g / (4 * o[2] * i[2])


@pytest.mark.parametrize("sigma", [0.4, 0.9])
def test_velvet(sigma):
    one = closure(Lobe.VELVET, weight=WEIGHT, roughness=sigma)
    for wo, wi in PAIRS:
        expected = WEIGHT * velvet_f(sigma, wo, wi)
        assert velvet.evaluate(one, wo, wi) == pytest.approx(expected, rel=2e-3, abs=1e-6)
    for wo in VIEWS:
        expected = WEIGHT * at(velvet.ALBEDO, sigma, float(wo[2]))
        assert velvet.albedo(one, wo[2]) == pytest.approx(expected, rel=1e-4)
        for u, v in numbers(NUMBERS):
            wi, weight = velvet.sample(one, wo, u, v)
            assert wi == cosine_uniform_mixture(u, v)
            expected = WEIGHT * velvet_f(sigma, wo, wi) * wi[2] * 2 * np.pi / (wi[2] + 0.5)
            assert weight == pytest.approx(expected, rel=2e-3, abs=1e-6)


def test_velvet_at_the_ends():
    one, up, down = closure(Lobe.VELVET), VIEWS[0], unit(0.2, 0.1, -0.5)
    assert velvet.evaluate(one, up, down) == (0, 0, 0) == velvet.evaluate(one, down, up)
    assert velvet.evaluate(one, unit(1, 0, 0), up) == (0, 0, 0) == velvet.evaluate(one, up, unit(0, 1, 0))
    assert velvet.evaluate(one, unit(0, 0, 1), unit(0, 0, 1)) == (0, 0, 0)  # facets stand upright
    across = unit(1, 0, 1e-3), unit(1, 0, 1e-3)  # grazing light that is thrown back
    assert np.isfinite(velvet.evaluate(one, *across)).all() and velvet.evaluate(one, *across)[0] > 0
    narrow, least = closure(Lobe.VELVET, roughness=0), closure(Lobe.VELVET, roughness=0.01)
    assert velvet.evaluate(narrow, *across) == velvet.evaluate(least, *across)


# Toon

TOONS = [(0.2, 0.6), (0.4, 0.2), (0.5, 0.0), (0.8, 0.5), (1.0, 0.0)]


def toon_angles(size, edge):
    size, edge = size * np.pi / 2, edge * np.pi / 2
    return size, edge, min(size + edge, np.pi / 2)


def toon_intensity(size, edge, angle):
    size, edge, _ = toon_angles(size, edge)
    if angle < size:
        return 1.0
    return max(1 - (angle - size) / edge, 0) if edge > 0 else 0.0


@pytest.mark.parametrize(("size", "edge"), TOONS)
@pytest.mark.parametrize("kind", [Lobe.TOON, Lobe.GLOSSY_TOON])
def test_toon(size, edge, kind):
    one, (*_, end) = closure(kind, weight=WEIGHT, roughness=size, f90=(edge, 0.9, 0.9)), toon_angles(size, edge)
    solid_angle = 2 * np.pi * (1 - np.cos(end))

    def angle(view, light):
        axis = np.array([0, 0, 1]) if kind == Lobe.TOON else np.float64(view) * [-1, -1, 1]
        return np.arccos(np.clip(axis @ np.float64(light), 0, 1))

    for wo, wi in [*PAIRS, *((wo, unit(*np.float64(wo) * [-1, -1, 1] + [0.1, 0.2, 0])) for wo in VIEWS)]:
        theta = angle(wo, wi)
        expected = WEIGHT * toon_intensity(size, edge, theta) / solid_angle / wi[2]
        assert toon.evaluate(one, wo, wi) == pytest.approx(expected, rel=1e-3, abs=1e-6)
        assert toon.pdf(one, wo, wi) == pytest.approx((theta < end) / solid_angle, rel=1e-4)
    for wo in VIEWS:
        for u, v in numbers(NUMBERS):
            wi, weight = toon.sample(one, wo, u, v, False)
            theta = np.arccos(1 - u * (1 - np.cos(end)))
            assert np.linalg.norm(wi) == pytest.approx(1, abs=1e-5)
            if wi[2] > 0:
                assert angle(wo, wi) == pytest.approx(theta, abs=1e-3)
                assert weight == pytest.approx(WEIGHT * toon_intensity(size, edge, theta), rel=3e-3, abs=1e-5)
            else:
                assert weight == (0, 0, 0) and kind == Lobe.GLOSSY_TOON
            to, carried = toon.sample(one, wo, u, v, True)
            if kind == Lobe.TOON:
                assert to == cosine_hemisphere(u, v)
                expected = WEIGHT * toon_intensity(size, edge, angle(to, wo)) / solid_angle / wo[2] * np.pi
                assert carried == pytest.approx(expected, rel=3e-3, abs=1e-5)
            elif to[2] > 0:
                assert to == pytest.approx(wi)
                assert carried == pytest.approx(np.multiply(weight, to[2] / wo[2]), rel=1e-4)
    theta = (np.arange(20_000) + 0.5) / 20_000 * end
    whole = np.mean([toon_intensity(size, edge, x) * np.sin(x) for x in theta[::10]]) * end
    assert toon.albedo(one) == pytest.approx(WEIGHT * whole / (1 - np.cos(end)), rel=2e-3)


def test_toon_at_the_ends():
    one, up, down = closure(Lobe.TOON, f90=0.2), VIEWS[0], unit(0.2, 0.1, -0.5)
    for view, light in ((up, down), (down, up), (unit(1, 0, 0), up), (up, unit(1, 0, 0))):
        assert toon.evaluate(one, view, light) == (0, 0, 0) and toon.pdf(one, view, light) == 0
    wide = closure(Lobe.TOON, roughness=2, f90=3)
    assert toon._angles(wide) == pytest.approx([np.pi / 2] * 3)
    narrow = toon._angles(closure(Lobe.TOON, roughness=-1, f90=-1))
    assert 0 < narrow[0] < 1e-4 and narrow[1] == 0 and narrow[2] == narrow[0]
    assert toon._versine(f(0.3)) == pytest.approx(1 - np.cos(0.3), rel=1e-5)
    assert toon._angle_of(f(1 - np.cos(0.3))) == pytest.approx(0.3, rel=1e-4)


# Layers and dispatch


def test_coats_absorb_along_the_refracted_way():
    tint, share = np.array([0.9, 0.5, 0.2]), 0.7
    for ior, cos in ((1.5, 0.3), (1.2, 1.0), (0.8, 0.4)):
        one = closure(Lobe.ABSORBING, f0=tint, roughness=share, ior=ior)
        sin_t = np.sqrt(1 - cos**2) / max(ior, 1)
        way = 1 / np.sqrt(1 - sin_t**2)
        assert absorbing.along_way(one.f0, one.ior, f(cos)) == pytest.approx(tint**way, rel=1e-4)
        assert absorbing.transmittance(one, f(cos)) == pytest.approx(1 - share + share * tint**way, rel=1e-4)
    assert absorbing.along_way(triple((-0.1, 0, 1)), f(1.5), f(0.5)) == (0, 0, 1)
    assert absorbing.along_way(triple(0.999), f(1), f(0)) == pytest.approx([0.999**1000] * 3, rel=1e-3)


def test_means_of_layers_over_directions():
    cosines = np.sqrt((np.arange(2000) + 0.5) / 2000)
    expected = np.mean([sheen_share(0.5, cos) for cos in cosines])
    assert layers.mean_sheen_albedo(0.5) == pytest.approx(expected, rel=2e-3)
    tint = np.float32([[[0.9, 0.5, 0.2], [0.3, 0.6, 1]]])
    ways = 1 / np.sqrt(1 - (1 - cosines**2) / 1.4**2)
    expected = np.mean(tint[0][:, :, None] ** ways, axis=2)
    found = layers.mean_tint(tint, 1.4)
    assert found.shape == tint.shape
    np.testing.assert_allclose(found[0], expected, rtol=1e-3)


def test_each_kind_has_its_own_file():
    view, light, (u, v), cos = VIEWS[0], LIGHTS[1], (f(0.3), f(0.6)), f(0.4)
    of = {kind: closure(kind, f90=0.2, ior=1.3, f0=0.5) for kind in Lobe}
    files = {Lobe.ROUGH_DIFFUSE: rough_diffuse, Lobe.SHEEN: sheen, Lobe.VELVET: velvet, Lobe.TOON: toon}
    for kind, file in (files | {Lobe.GLOSSY_TOON: toon}).items():
        one = of[kind]
        assert lobes.evaluate(one, view, light) == file.evaluate(one, view, light)
        for from_light in (False, True):
            more = (from_light,) if file in (sheen, toon) else ()
            assert lobes.sample(one, view, u, v, from_light) == file.sample(one, view, u, v, *more)
        expected = toon.albedo(one) if file is toon else file.albedo(one, cos)
        assert lobes.albedo(one, cos) == expected
    assert lobes.albedo(of[Lobe.ABSORBING], cos) == (0, 0, 0)
    assert lobes.transmittance(of[Lobe.SHEEN], cos) == (sheen.transmittance(of[Lobe.SHEEN], cos),) * 3
    assert lobes.transmittance(of[Lobe.ABSORBING], cos) == absorbing.transmittance(of[Lobe.ABSORBING], cos)
