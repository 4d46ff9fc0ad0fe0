"""What GGX lobes reflect in all, tabulated over roughness and cosine.

Cycles tabulates the same quantities at the same nodes and interpolates them linearly as well, so that what it makes of
a material between two nodes is what is made of it here. Tables are computed when first wanted. The index of refraction
η stands in them as z = ±√|(η − 1)/(η + 1)|, which has most nodes where glass is; 1/η is −z.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from .fresnel import fresnel_dielectric, grazing_share
from .microfacets import sample_visible_normals, unshadowed

_N_FINE, _N_COARSE = 32, 16  # nodes along roughness and cosine, without and with an index of refraction
_N_SAMPLES, _STEP = 610, 377  # Fibonacci numbers: a lattice more even than other sequences
_LEAST, _LARGEST_Z = 1e-4, 0.99  # ends of the axes, off the singular values


@dataclass(frozen=True)
class _Grid:
    """Visible facets at every node of roughness (slow) and cosine (fast), `_N_SAMPLES` a node."""

    n_nodes: int
    wo: np.ndarray
    alpha: np.ndarray
    h: np.ndarray
    cos: np.ndarray

    @staticmethod
    def of(n_nodes: int) -> "_Grid":
        nodes = np.clip(np.linspace(0, 1, n_nodes), _LEAST, 1).astype(np.float32)
        roughness, cos = (np.repeat(x.ravel(), _N_SAMPLES) for x in np.meshgrid(nodes, nodes, indexing="ij"))
        i = np.arange(_N_SAMPLES)
        lattice = np.stack([i * _STEP % _N_SAMPLES, i + 0.5], axis=1).astype(np.float32) / np.float32(_N_SAMPLES)
        u = np.tile(lattice, (n_nodes * n_nodes, 1))
        wo = np.stack([np.sqrt(1 - cos * cos), np.zeros_like(cos), cos], axis=1)
        alpha = roughness * roughness
        h = sample_visible_normals(wo, alpha, u)
        return _Grid(n_nodes, wo, alpha, h, np.einsum("ij,ij->i", wo, h))

    def reflected(self) -> np.ndarray:
        """Share of the light that each white facet sends out of the surface after one reflection."""
        cos_i = 2 * self.cos * self.h[:, 2] - self.wo[:, 2]
        return np.where(cos_i > 0, unshadowed(self.wo[:, 2], cos_i, self.alpha), np.float32(0))

    def refracted(self, ior: np.float32) -> np.ndarray:
        """Share of the light that each clear facet refracts, and others do not shadow.

        As Cycles has it, what is refracted to the side it came from is counted as well, so that of the light inside
        rough glass, where this happens, compensation does not make up for all that is lost.
        """
        cos_t = np.sqrt(np.maximum(1 - (1 - self.cos * self.cos) / (ior * ior), 0))
        cos_i = (self.cos / ior - cos_t) * self.h[:, 2] - self.wo[:, 2] / ior
        return unshadowed(self.wo[:, 2], cos_i, self.alpha)

    def mean(self, values: np.ndarray) -> np.ndarray:
        """Mean over the facets of each node, (n_nodes, n_nodes)."""
        return values.reshape(self.n_nodes, self.n_nodes, _N_SAMPLES).mean(axis=2)


@lru_cache(maxsize=1)
def white() -> np.ndarray:
    """Albedo E of single scattering by a white lobe, (roughness, cosine)."""
    grid = _Grid.of(_N_FINE)
    return grid.mean(grid.reflected())


@lru_cache(maxsize=1)
def white_average() -> np.ndarray:
    """Cosine-weighted average of `white` over the hemisphere, (roughness,)."""
    return _cosine_average(white())


@lru_cache(maxsize=1)
def grazing() -> tuple[np.ndarray, np.ndarray]:
    """What a lobe's grazing reflectance adds, (17, roughness, cosine) each; one slice a node of z, then Schlick's.

    Returns
    -------
    albedo
        Albedo of single scattering by a lobe with f0 = 0 and f90 = 1.
    of_facets
        Mean `grazing_share` of the visible facets whose reflection leaves the surface, other facets counting 0. Cycles
        takes it as that albedo over the white lobe's where it weighs a layer against what lies beneath.
    """
    grid = _Grid.of(_N_COARSE)
    reflected = grid.reflected()
    iors = np.append(_ior_nodes(), np.float32(0))
    shares = [grazing_share(grid.cos, ior) for ior in iors]
    albedo = np.stack([grid.mean(reflected * share) for share in shares])
    return albedo, np.stack([grid.mean((reflected > 0) * share) for share in shares])


@lru_cache(maxsize=1)
def glass() -> np.ndarray:
    """Albedo of single scattering by untinted glass, both sides together, (31, roughness, cosine); z is in [−1, 1]."""
    grid = _Grid.of(_N_COARSE)
    reflected, iors = grid.reflected(), _ior_nodes()
    slices = []
    for ior in np.concatenate([1 / iors[:0:-1], iors]):
        fresnel = fresnel_dielectric(grid.cos, ior)
        slices.append(grid.mean(fresnel * reflected + (1 - fresnel) * grid.refracted(ior)))
    return np.stack(slices)


@lru_cache(maxsize=1)
def glass_average() -> np.ndarray:
    """Cosine-weighted average of `glass` over the hemisphere, (31, roughness)."""
    return _cosine_average(glass())


def ior_coordinate(ior: np.ndarray) -> np.ndarray:
    """The z in [−1, 1] that stands for an index of refraction."""
    ratio = (ior - 1) / (ior + 1)
    return np.copysign(np.sqrt(np.abs(ratio)), ratio)


def curve_coordinate(fresnel_ior: np.ndarray) -> np.ndarray:
    """Where a curve stands in `grazing`'s first axis, in [0, 1]: 1 is Schlick's."""
    return np.where(fresnel_ior > 0, np.abs(ior_coordinate(fresnel_ior)) * np.float32(15 / 16), np.float32(1))


def interpolate(table: np.ndarray, *at: np.ndarray) -> np.ndarray:
    """Multilinear interpolation of a table whose nodes are even in [0, 1] along every axis, at (n,) an axis."""
    index, fractions = np.zeros(len(at[0]), np.int32), []
    for size, x in zip(table.shape, at, strict=True):
        x = np.clip(x, 0, 1) * np.float32(size - 1)
        node = np.minimum(x.astype(np.int32), size - 2)
        fractions.append(x - node.astype(np.float32))
        index = index * size + node
    corners = [table.ravel()[k:].take(index, mode="clip") for k in _corner_offsets(table.shape)]
    for fraction in reversed(fractions):  # the last axis is the fastest
        corners = [a + (b - a) * fraction for a, b in zip(corners[::2], corners[1::2], strict=True)]
    return corners[0]


def _corner_offsets(shape: tuple[int, ...]) -> np.ndarray:
    """Flat offsets of a cell's corners from its lowest, the last axis fastest."""
    corners = np.indices((2,) * len(shape)).reshape(len(shape), -1)
    return np.asarray(np.ravel_multi_index(tuple(corners), shape))


def _ior_nodes() -> np.ndarray:
    """Indices of refraction at z = 0, 1/15 … 1, off 1 and ∞; z⁴ is the reflectance at normal incidence."""
    z2 = np.clip(np.linspace(0, 1, _N_COARSE), _LEAST, _LARGEST_Z) ** 2
    return ((1 + z2) / (1 - z2)).astype(np.float32)


def _cosine_average(table: np.ndarray) -> np.ndarray:
    """2 ∫ E cos dcos along the last axis, by the trapezoidal rule."""
    cos = np.linspace(0, 1, table.shape[-1], dtype=np.float32)
    product = table * cos
    return (2 * (product.sum(axis=-1) - product[..., -1] / 2) / (table.shape[-1] - 1)).astype(np.float32)
