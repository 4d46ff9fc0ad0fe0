"""Phase functions: they are sampled by their densities, which are those of the formulas, and scatter all light."""

import numpy as np
import pytest
from photon_bake.addon.bsdf.phase import sampling as phase
from photon_bake.addon.bsdf.phase.functions import draine, fournier_forand, mie, rayleigh, rings_of
from photon_bake.addon.core.compiling import kernel
from photon_bake.addon.core.sampling.path_numbers import path_key, two_numbers
from photon_bake.addon.core.vec3 import put
from photon_bake.tests.core.scenes import chi_square_of_directions, fewer
from scipy.integrate import trapezoid

AHEAD = (np.float32(0), np.float32(0), np.float32(1))
FUNCTIONS = {
    "rayleigh": rayleigh(),
    "henyey-greenstein": draine(0.6),
    "draine": draine(0.4, 3.0),
    "draine backwards": draine(-0.5, 0.5),
    "fournier-forand": fournier_forand(1.33, 0.1),
    "mie 0.05": mie(0.05),
    "mie 1": mie(1.0),
    "mie 3": mie(3.0),
    "mie 20": mie(20.0),
}
PEAKED = {"fournier-forand", "mie 3", "mie 20"}
"""Much of their light is within a cell of χ²'s."""


@kernel
def scattered(direction, g, key, out):
    for i in range(len(out)):
        u, v = two_numbers(key, i, 0)
        put(out, i, phase.sample(direction, g, u, v))


@kernel
def densities(cosines, g, out):
    for i in range(len(out)):
        out[i] = phase.density(cosines[i], g)


@kernel
def scattered_by_rings(direction, rings, key, out):
    for i in range(len(out)):
        u, v = two_numbers(key, i, 0)
        put(out, i, phase.sample_rings(direction, rings, 0, u, v))


@kernel
def densities_of_rings(cosines, rings, out):
    for i in range(len(out)):
        out[i] = phase.density_of_rings(cosines[i], rings, 0)


@pytest.mark.parametrize("g", [0.0, 0.6, -0.4])
def test_phase_function_is_sampled_by_its_density(g):
    out = np.empty((fewer(50_000), 3), np.float32)
    scattered(AHEAD, np.float32(g), path_key(5, 0), out)

    def pdf(z):
        found = np.empty(z.size, np.float32)
        densities(z.ravel().astype(np.float32), np.float32(g), found)
        return found.reshape(z.shape)

    assert chi_square_of_directions(out, pdf) > 1e-3


@pytest.mark.parametrize("name", [name for name in FUNCTIONS if name not in PEAKED])
def test_tables_are_sampled_by_the_formulas(name):
    out, rings = np.empty((fewer(50_000), 3), np.float32), rings_of(FUNCTIONS[name])[None]
    scattered_by_rings(AHEAD, rings, path_key(5, 0), out)
    assert chi_square_of_directions(out, lambda z: FUNCTIONS[name](1 - z)) > 1e-3


@pytest.mark.parametrize("name", FUNCTIONS)
def test_tables_have_the_densities_of_the_formulas(name):
    """Within the width of a ring; what they leave between two cosines is exact."""
    rings, cosines = rings_of(FUNCTIONS[name])[None], np.linspace(-0.99, 0.97, 50).astype(np.float32)
    found = np.empty(50, np.float32)
    densities_of_rings(cosines, rings, found)
    assert found == pytest.approx(FUNCTIONS[name](1 - cosines.astype(np.float64)), rel=0.08)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_all_light_is_scattered(name):
    """∫ p dω = 1. What Fournier and Forand's lacks of that is in its peak."""
    versines = np.concatenate([[0], np.geomspace(1e-10, 2, 200_000)])
    whole = 2 * np.pi * trapezoid(FUNCTIONS[name](versines), versines)
    assert whole == pytest.approx(1, abs=0.02 if name == "fournier-forand" else 2e-3)


def test_moments():
    """⟨cos θ⟩ is g of Henyey and Greenstein's and 0 of Rayleigh's, ⟨cos² θ⟩ of that 2/5; a share goes back."""
    for function, mean, square in ((draine(0.6), 0.6, (1 + 2 * 0.36) / 3), (rayleigh(), 0, 0.4)):
        cosines = 1 - np.convolve(rings_of(function), [0.5, 0.5], "valid")
        assert cosines.mean() == pytest.approx(mean, abs=1e-3)
        assert (cosines**2).mean() == pytest.approx(square, abs=1e-3)
    assert (rings_of(fournier_forand(1.2, 0.15)) > 1).mean() == pytest.approx(0.15, abs=0.003)
