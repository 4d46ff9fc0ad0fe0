"""What fibres do to light: energy, directions and their distribution."""

import numpy as np
import pytest
from photon_bake.addon.bsdf.closure import Closure
from photon_bake.addon.bsdf.fibres import fibre
from photon_bake.addon.core.compiling import kernel, kernel_array
from photon_bake.addon.core.vec3 import row
from photon_bake.addon.scene import FibreModel, Lobe

N = 20_000


@kernel
def _samples(closure, wo, numbers, from_light, wi, weight):
    for k in range(len(numbers)):
        choice, u, v = numbers[k, 0], numbers[k, 1], numbers[k, 2]
        direction, color = fibre.sample(closure, wo, choice, u, v, from_light)
        for i in range(3):
            wi[k, i], weight[k, i] = direction[i], color[i]


@kernel
def _lamplight(closure, view, lights, share):
    for k in range(len(lights)):
        share[k] = fibre.lamplight_share(closure, view, row(lights, k))


def closure_of(model, absorption=(0.0, 0.0, 0.0), roughness=0.1, f90=(0.3, 0.03, 0.1)):
    triple, f = lambda values: tuple(np.float32(x) for x in values), np.float32
    look = np.bool_(True), np.bool_(True), np.int32(-1), np.int32(model), np.int32(0)
    colors = triple((1, 1, 1)), f(roughness), triple(absorption), triple(f90), f(1.55)
    return Closure(np.int32(Lobe.FIBRE), *colors, *look, triple((1, 1, 1)), triple((0, 0, 0)), f(1))


def samples(closure, wo, from_light=False, n=N):
    numbers = kernel_array(np.random.default_rng(1).random((n, 3)), np.float32)
    wi, weight = np.empty((2, n, 3), np.float32)
    wo = np.asarray(wo, np.float32) / np.linalg.norm(wo)
    _samples(closure, tuple(wo), numbers, from_light, wi, weight)
    return wi.astype(np.float64), weight.astype(np.float64)


WAYS = [(0, 0, 1), (0.5, 0.2, 0.7), (-0.9, 0.3, 0.1)]


@pytest.mark.plain
@pytest.mark.parametrize("model", list(FibreModel))
def test_clear_fibres_lose_nothing(model):
    wi, weight = samples(closure_of(model), WAYS[1], n=2_000)
    np.testing.assert_allclose(np.linalg.norm(wi, axis=1), 1, atol=1e-4)
    np.testing.assert_allclose(weight[weight[:, 0] > 0], 1, atol=1e-4)
    assert (weight[:, 0] > 0).mean() > 0.99


@pytest.mark.parametrize("wo", WAYS)
def test_light_that_passes_once_has_crossed_the_fibre(wo):
    """Against the integral over h of (1 − F)² T and the other ways' sums, by a fine quadrature."""
    absorption = np.array([0.1, 0.5, 2.0])
    _, weight = samples(closure_of(FibreModel.CHIANG, absorption), wo, n=200_000)
    sin_o = wo[0] / np.linalg.norm(wo)
    cos_o, ior = np.sqrt(1 - sin_o**2), 1.55
    h = (np.arange(4_000) + 0.5) / 2_000 - 1
    bent = np.sqrt(ior**2 - sin_o**2) / cos_o
    way = 2 * np.sqrt(1 - (h / bent) ** 2) / np.sqrt(1 - (sin_o / ior) ** 2)
    cos = cos_o * np.sqrt(1 - h**2)
    inside = np.sqrt(1 - (1 - cos**2) / ior**2)
    f = (((ior * cos - inside) / (ior * cos + inside)) ** 2 + ((cos - ior * inside) / (cos + ior * inside)) ** 2) / 2
    passes = np.exp(-absorption * way[:, None])
    f = f[:, None]
    albedo = (f + (1 - f) ** 2 * passes / (1 - f * passes)).mean(axis=0)
    np.testing.assert_allclose(weight.mean(axis=0), albedo, rtol=0.01)


def test_light_is_mirrored_along_the_strand():
    """Without a tilt and with little spread the angle to the plane across is that of the other side."""
    wi, _ = samples(closure_of(FibreModel.CHIANG, roughness=1e-4, f90=(0.1, 0, 1e-4)), WAYS[1])
    assert np.median(wi[:, 0]) == pytest.approx(-WAYS[1][0] / np.linalg.norm(WAYS[1]), abs=0.01)


def test_translucent_fibres_send_light_to_the_other_side():
    wi, _ = samples(closure_of(FibreModel.TRANSLUCENT), WAYS[1])
    assert (wi[:, 2] <= 0).all()
    assert wi[:, 2].mean() == pytest.approx(-2 / 3, abs=0.01)


def test_reflecting_and_transmitting_fibres_part_light():
    back, weight = samples(closure_of(FibreModel.REFLECTION, f90=(0.5, 0, 0)), WAYS[0])
    on, _ = samples(closure_of(FibreModel.TRANSMISSION, f90=(0.5, 0, 0)), WAYS[0])
    assert (weight > 0).all() and (back[:, 2] >= 0).all() and (on[:, 2] <= 0).all()


@pytest.mark.plain
@pytest.mark.parametrize(
    ("model", "spread", "expected"),
    [
        (FibreModel.REFLECTION, 1.0, 5 * np.sqrt(2) / 12),  # ∫ cos(φ/2)/4 (1 + cos φ)/2 dφ from −π/2 to π/2
        (FibreModel.TRANSMISSION, 1e-3, 1.0),
        (FibreModel.CHIANG, 0.3, 1.0),
        (FibreModel.TRANSLUCENT, 1.0, 1.0),
    ],
)
def test_shadow_rays_find_a_share_of_lamplight(model, spread, expected):
    """Where the normal across a strand faces the light: a mean over its width and over what is sampled."""
    closure, view = closure_of(model, roughness=1e-3, f90=(spread, 0, 0.1)), np.array(WAYS[1], np.float32)
    lights, _ = samples(closure, view, n=4_000)
    share = np.empty(len(lights), np.float32)
    _lamplight(closure, tuple(view / np.linalg.norm(view)), kernel_array(lights, np.float32), share)
    assert share.mean() == pytest.approx(expected, abs=0.02)


@pytest.mark.parametrize("model", [FibreModel.CHIANG, FibreModel.REFLECTION, FibreModel.TRANSMISSION])
def test_photons_and_paths_scatter_alike(model):
    """⟨cos θ_o f(o, i) g(o, i)⟩ over all pairs of directions, by paths and by photons, for some g."""
    closure, rng = closure_of(model, (0.1, 0.4, 1.0), 0.3, (0.5, 0.1, 0.2)), np.random.default_rng(2)
    totals = np.zeros((2, 3))
    for a in rng.normal(size=(6_000, 3)):
        a = a / np.linalg.norm(a)
        for from_light in (False, True):
            b, weight = samples(closure, a, from_light, 200)
            view, light = (b, a) if from_light else (a, b)
            g = 1 + np.sum(view * (0.3, 0.5, 0.8), axis=-1) + np.sum(light * (-0.9, 0.1, 0.4), axis=-1) ** 2
            totals[int(from_light)] += np.sqrt(1 - a[0] ** 2) * (weight * g[..., None]).mean(axis=0)
    np.testing.assert_allclose(totals[1], totals[0], rtol=0.04)
