"""Points on surfaces of one material, their scattering looked at by loops over the parts of `bsdf`."""

from dataclasses import dataclass, replace

import numba
import numpy as np
from photon_bake.addon.bsdf import Surface, albedos, mixture, surface_at
from photon_bake.addon.bsdf.closure import bsdf_of
from photon_bake.addon.core.sampling.sobol import sobol_points, sobol_seeds
from photon_bake.addon.core.vec3 import ONE, ZERO, put, row
from photon_bake.addon.scene import Channel, Closures, Materials
from photon_bake.tests.core.scenes import chi_square, fewer, plane, scene_of

N = fewer(1 << 16)
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


def closures(*several) -> Closures:
    """The closures of one material; what is left out is white, smooth and by Schlick's curve."""
    defaults = {"weight": 1, "roughness": 0, "f0": 1, "f90": 1, "ior": 0, "layer": -1, "curve": 0, "edge": 1}
    defaults |= {"distribution": 0, "preserves_energy": True, "film": 0, "fresnel": True, "stretch": 1}
    given = [defaults | one for one in several]
    channels = {
        name: Channel.constant(np.float32([np.broadcast_to(one[name], 3) for one in given]))
        for name in ("weight", "roughness", "f0", "f90", "edge", "film", "stretch")
    }
    whole = {name: np.int32([one[name] for one in given]) for name in ("layer", "curve", "distribution")}
    return Closures.of(
        np.array([0, len(given)]),
        np.array([one["kind"] for one in given]),
        ior=np.float32([one["ior"] for one in given]),
        preserves_energy=np.array([one["preserves_energy"] for one in given]),
        fresnel=np.array([one["fresnel"] for one in given]),
        **whole,
        **channels,
    )


def of_closures(*several, n=N) -> Surface:
    return points_of(Materials.of(1, closures=closures(*several)), n)


def direction(cos, n=N, phi=0.4):
    sin = np.sqrt(1 - cos * cos)
    return np.tile(np.float32([sin * np.cos(phi), sin * np.sin(phi), cos]), (n, 1))


def numbers(seed=1, n=N, dimensions=3):
    return sobol_points(sobol_seeds(1, seed), 0, 0, n)[:, :dimensions]


def column(n, *values):
    return tuple(np.full(n, value, np.float32) for value in values)


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


def evaluate_glossy_below_peak(s, wo, wi):
    """`mixture.evaluate_glossy_below_peak` of local directions (n, 3), (n, 3)."""
    return s.asked(_evaluate_glossy_below_peak, wo, wi)


@compiled
def _evaluate_glossy_below_peak(scene, triangle, u, v, back, wo, wi, out):
    for i in range(len(triangle)):
        bsdf = bsdf_of(scene, triangle[i], u[i], v[i], back[i])
        put(out, i, mixture.evaluate_glossy_below_peak(scene, bsdf, row(wo, i), row(wi, i)))


def evaluate_direct(s, wo, wi):
    """`mixture.evaluate_direct` of local directions (n, 3), (n, 3)."""
    return s.asked(_evaluate_direct, wo, wi)


@compiled
def _evaluate_direct(scene, triangle, u, v, back, wo, wi, out):
    for i in range(len(triangle)):
        bsdf = bsdf_of(scene, triangle[i], u[i], v[i], back[i])
        put(out, i, mixture.evaluate_direct(scene, bsdf, row(wo, i), row(wi, i)))


def pdf_glossy(s, wo, wi):
    """`mixture.pdf_glossy` of local directions (n, 3), (n,)."""
    return s.asked(_pdf_glossy, wo, wi, columns=())


@compiled
def _pdf_glossy(scene, triangle, u, v, back, wo, wi, out):
    for i in range(len(triangle)):
        bsdf = bsdf_of(scene, triangle[i], u[i], v[i], back[i])
        out[i] = mixture.pdf_glossy(scene, bsdf, row(wo, i), row(wi, i))


def glass_albedo(s):
    """`albedos.glass_albedo`, (n, 3)."""
    return s.asked(_glass_albedo)


@compiled
def _glass_albedo(scene, triangle, u, v, back, out):
    for i in range(len(triangle)):
        put(out, i, albedos.glass_albedo(scene, bsdf_of(scene, triangle[i], u[i], v[i], back[i])))


def base_transmittance(s, cos):
    """`albedos.base_transmittance` at cosines (n,), (n, 3)."""
    return s.asked(_base_transmittance, cos)


@compiled
def _base_transmittance(scene, triangle, u, v, back, cos, out):
    for i in range(len(triangle)):
        wo = np.sqrt(max(ONE - cos[i] * cos[i], ZERO)), ZERO, cos[i]
        put(out, i, albedos.base_transmittance(scene, bsdf_of(scene, triangle[i], u[i], v[i], back[i]), wo))


def is_mirror(s):
    """`albedos.is_mirror`, (n,) bool."""
    return s.asked(_is_mirror, columns=(), dtype=np.bool_)


@compiled
def _is_mirror(scene, triangle, u, v, back, out):
    for i in range(len(triangle)):
        out[i] = albedos.is_mirror(scene, bsdf_of(scene, triangle[i], u[i], v[i], back[i]))


def albedo_of(s, cos, seed=1, **how):
    """What a path finds in a white world, (3,)."""
    return sample_bsdf(s, direction(cos, len(s)), numbers(seed, len(s)), **how).weight.mean(axis=0, dtype=np.float64)


def chi_square_against(sampled, pdf_of, n_z=40, n_phi=20):
    """χ² of directions in cells of z and φ against a density, and what the density adds up to over all directions.

    `pdf_of` is asked for the density of 160 directions in each cell at once, 128,000 in all.
    """
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
