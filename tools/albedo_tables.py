"""Compute what GGX lobes reflect in all, and write it to addon/bsdf/albedo_tables.npz: `python tools/albedo_tables.py`.

Print its digest, which addon/bsdf/albedo_tables.py has to say.
"""

import hashlib

import numba
import numpy as np
from photon_bake.addon.bsdf import albedo_tables
from photon_bake.addon.bsdf.fresnel import fresnel_dielectric, grazing_share
from photon_bake.addon.bsdf.microfacets import Facets, g2_over_g1, reflect, refract, visible_normal
from photon_bake.addon.core.vec3 import ONE, ZERO, dot
from photon_bake.addon.scene import Distribution

_N_FINE, _N_COARSE = 32, 16  # nodes along roughness and cosine, without and with an index of refraction
_N_SAMPLES, _STEP = 610, 377  # Fibonacci numbers: a lattice more even than other sequences
_LEAST, _LARGEST_Z = 1e-4, 0.99  # ends of the axes, off the singular values

_GGX = np.int32(Distribution.GGX)

compiled = numba.njit(error_model="numpy")


def tables(n_samples: int = _N_SAMPLES, step: int = _STEP) -> dict[str, np.ndarray]:
    """All tables by their names in lower case; a lattice of `n_samples` points at each node, a Fibonacci number."""
    fine, coarse, ior = nodes(_N_FINE), nodes(_N_COARSE), ior_nodes()
    white = np.empty((_N_FINE, _N_FINE), np.float32)
    tabulate_white(fine, n_samples, step, white)
    curves = np.append(ior, np.float32(0))
    grazing, of_facets = np.empty((2, len(curves), _N_COARSE, _N_COARSE), np.float32)
    tabulate_grazing(coarse, curves, n_samples, step, grazing, of_facets)
    both_ways = np.concatenate([1 / ior[:0:-1], ior])
    glass = np.empty((len(both_ways), _N_COARSE, _N_COARSE), np.float32)
    tabulate_glass(coarse, both_ways, n_samples, step, glass)
    return {
        "white": white,
        "white_average": cosine_average(white),
        "grazing": grazing,
        "grazing_of_facets": of_facets,
        "glass": glass,
        "glass_average": cosine_average(glass),
    }


def nodes(n: int) -> np.ndarray:
    """Roughnesses or cosines, (n,) float32."""
    return np.clip(np.linspace(0, 1, n), _LEAST, 1).astype(np.float32)


def ior_nodes() -> np.ndarray:
    """Indices of refraction at z = 0, 1/15 … 1, off 1 and ∞; z⁴ is the reflectance at normal incidence."""
    z2 = np.clip(np.linspace(0, 1, _N_COARSE), _LEAST, _LARGEST_Z) ** 2
    return ((1 + z2) / (1 - z2)).astype(np.float32)


@compiled
def facet(wo, alpha, i, n, step):
    """The i-th of n facets that are seen from wo: the cosine to wo, its normal, and what it sends back if white.

    That is the share of the light that leaves the surface after one reflection.
    """
    facets = Facets(_GGX, alpha, alpha)
    h = visible_normal(facets, wo, np.float32(i * step % n) / np.float32(n), np.float32(i + 0.5) / np.float32(n))
    cos = dot(wo, h)
    wi = reflect(wo, h, cos)
    return cos, h, g2_over_g1(facets, wo, wi) if wi[2] > ZERO else ZERO


@compiled
def refracted(wo, cos, h, ior, alpha):
    """Share of the light that a clear facet refracts, and others do not shadow.

    As Cycles has it, what is refracted to the side it came from is counted as well, so that of the light inside rough
    glass, where this happens, compensation does not make up for all that is lost.
    """
    return g2_over_g1(Facets(_GGX, alpha, alpha), wo, refract(wo, h, cos, ior))


@compiled
def viewed_from(cos):
    """A direction at a cosine to the normal."""
    return np.sqrt(ONE - cos * cos), ZERO, cos


@compiled
def tabulate_white(nodes, n, step, white):
    for r, roughness in enumerate(nodes):
        for c, cosine in enumerate(nodes):
            total, wo, alpha = 0.0, viewed_from(cosine), roughness * roughness
            for i in range(n):
                total += facet(wo, alpha, i, n, step)[2]
            white[r, c] = total / n


@compiled
def tabulate_grazing(nodes, curves, n, step, albedo, of_facets):
    for k, ior in enumerate(curves):
        for r, roughness in enumerate(nodes):
            for c, cosine in enumerate(nodes):
                total, facets, wo, alpha = 0.0, 0.0, viewed_from(cosine), roughness * roughness
                for i in range(n):
                    cos, _, reflected = facet(wo, alpha, i, n, step)
                    if reflected > ZERO:
                        share = grazing_share(cos, ior)
                        total, facets = total + reflected * share, facets + share
                albedo[k, r, c], of_facets[k, r, c] = total / n, facets / n


@compiled
def tabulate_glass(nodes, iors, n, step, glass):
    for k, ior in enumerate(iors):
        for r, roughness in enumerate(nodes):
            for c, cosine in enumerate(nodes):
                total, wo, alpha = 0.0, viewed_from(cosine), roughness * roughness
                for i in range(n):
                    cos, h, reflected = facet(wo, alpha, i, n, step)
                    fresnel = fresnel_dielectric(cos, ior)
                    total += fresnel * reflected + (ONE - fresnel) * refracted(wo, cos, h, ior, alpha)
                glass[k, r, c] = total / n


def cosine_average(table: np.ndarray) -> np.ndarray:
    """2 ∫ E cos dcos along the last axis, by the trapezoidal rule."""
    cos = np.linspace(0, 1, table.shape[-1], dtype=np.float32)
    product = table * cos
    return (2 * (product.sum(axis=-1) - product[..., -1] / 2) / (table.shape[-1] - 1)).astype(np.float32)


if __name__ == "__main__":
    np.savez(albedo_tables.FILE, **tables())
    print(hashlib.sha256(albedo_tables.FILE.read_bytes()).hexdigest())
