"""Formulas of lobes in double precision, from their papers, and points at which tests look at the lobes' own."""

import numpy as np
from photon_bake.addon.bsdf.closure import Closure
from photon_bake.addon.bsdf.facets import ashikhmin_shirley, beckmann
from photon_bake.addon.scene import Distribution, Lobe
from scipy.interpolate import RegularGridInterpolator

f = np.float32
GGX, BECKMANN, ASHIKHMIN_SHIRLEY = Distribution
IORS = (1.5, 1 / 1.5, 1.15, 2.4)


def triple(x):
    return tuple(f(value) for value in np.broadcast_to(x, 3))


def unit(*w):
    return triple(np.array(w) / np.linalg.norm(w))


VIEWS = [unit(0.3, -0.5, 0.7), unit(-0.9, 0.2, 0.3), unit(0.1, 0.05, 1), unit(0.6, 0.7, 0.15)]
LIGHTS = [unit(-0.2, 0.6, 0.5), unit(0.5, 0.4, 0.9), unit(-0.8, 0.1, 0.25), unit(0.2, -0.9, 0.6)]
PAIRS = [(a, b) for a in VIEWS for b in LIGHTS]
NUMBERS = [(0.13, 0.71), (0.46, 0.22), (0.83, 0.94), (0.64, 0.38), (0.31, 0.05)]


def closure(kind=Lobe.GLOSSY, **values):
    """A closure; what is left out is white, rough and loses what scatters twice."""
    given = {"weight": 1, "roughness": 0.6, "f0": 1, "f90": 1, "ior": 0, "fresnel": True, "preserves_energy": False}
    given |= {"layer": -1, "distribution": GGX, "curve": 0, "edge": 1, "film": 0, "stretch": 1} | values
    for name in ("weight", "f0", "f90", "edge", "film"):
        given[name] = triple(given[name])
    for name in ("roughness", "ior", "stretch"):
        given[name] = f(given[name])
    return Closure(kind=kind, **given)


def numbers(values):
    return [(f(u), f(v)) for u, v in values]


def at(table, *places):
    """A table whose nodes are even in [0, 1], interpolated linearly in double precision."""
    grid = RegularGridInterpolator([np.linspace(0, 1, n) for n in table.shape], table.astype(np.float64))
    return float(grid(np.clip(places, 0, 1))[0])


def fresnel_of(cos, ior):
    """Share that a dielectric reflects, by the amplitudes of both polarisations."""
    sin2 = (1 - cos**2) / ior**2
    if sin2 >= 1:
        return 1.0
    cos_t = np.sqrt(1 - sin2)
    s, p = (cos - ior * cos_t) / (cos + ior * cos_t), (ior * cos - cos_t) / (ior * cos + cos_t)
    return (s**2 + p**2) / 2


def grazing(cos, ior):
    if ior == 0:
        return (1 - cos) ** 5
    f0 = ((ior - 1) / (ior + 1)) ** 2
    return (fresnel_of(cos, ior) - f0) / (1 - f0)


def average_grazing(ior):
    """By the fit of Kulla and Conty; Schlick's curve exactly."""
    if ior == 0:
        return 1 / 21
    average = (ior - 1) / (4.08567 + 1.00071 * ior)
    if ior < 1:
        average = 0.997118 + 0.1014 * ior - 0.965241 * ior**2 - 0.130607 * ior**3
    f0 = ((ior - 1) / (ior + 1)) ** 2
    return min(max((average - f0) / (1 - f0), 0), 1)


def gained(color, white, average):
    """What light gains that scatters more than once between facets: Kulla and Conty."""
    color = np.array(color, np.float64)
    return 1 + color * average / (1 - color * (1 - average)) * (1 - white) / white


def slope2(w, x, y):
    return ((x * w[0]) ** 2 + (y * w[1]) ** 2) / w[2] ** 2


def one_plus_lambda(distribution, s2):
    return (1 + np.sqrt(1 + s2)) / 2 if distribution == GGX else float(beckmann.one_plus_lambda(f(s2)))


def density_of(distribution, h, x, y):
    """D(h): Walter et al. 2007, equations 33 and 25, stretched; Ashikhmin and Shirley's power of the cosine."""
    s = (h[0] / x) ** 2 + (h[1] / y) ** 2
    if distribution == GGX:
        return 1 / (np.pi * x * y * (s + h[2] ** 2) ** 2)
    if distribution == BECKMANN:
        return np.exp(-s / h[2] ** 2) / (np.pi * x * y * h[2] ** 4)
    return float(ashikhmin_shirley.distribution(triple(h), f(x), f(y)))


def shadowed(shading, normal, light):
    """Share of light that a bump leaves: Conty Estevez, Lecocq and Stein."""
    cos_light, cos_normal = np.dot(shading, light), np.dot(shading, normal)
    if cos_light * cos_normal * np.dot(normal, light) < 0:
        return 0.0
    tan2 = 1 / cos_light**2 - 1
    alpha2 = min((1 / cos_normal**2 - 1) / 8, 1)
    return 2 / (1 + np.sqrt(1 + alpha2 * tan2))
