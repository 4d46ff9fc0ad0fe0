"""What happens to light where it meets surfaces: one new direction for each ray."""

from dataclasses import dataclass, fields

import numpy as np

from ..bsdf import Lobe, glass_ways, is_focused, sample_bsdf, surface_at
from ..core.sampling.streams import PathNumbers
from ..core.sampling.vectors import dot, rows
from ..core.sampling.warps import frame, sample_cosine_hemisphere, to_world
from ..scene import RayKind, Scene
from ..tracing import Hits

ALL_LOBES = tuple(Lobe)
NARROW_LOBES = (Lobe.GLOSSY, Lobe.GLASS)
"""Those that a radiance cache, which knows no directions, does not answer for."""

_KIND_OF_LOBE = np.array([RayKind.DIFFUSE, RayKind.DIFFUSE, RayKind.GLOSSY, RayKind.TRANSMITTED], np.uint8)


@dataclass(frozen=True)
class Scattered:
    """Where n rays go on.

    Attributes
    ----------
    origins, directions : (n, 3) float32
        Off the surface, on the side that the direction leaves to.
    weight : (n, 3) float32
        What the surface leaves of the light, over the probability of going on like this.
    lobe : (n,) uint8
        `Lobe`.
    focused : (n,) bool
        Of photons: whether those who gather leave to them what the lobe does to lamplight.
    """

    origins: np.ndarray
    directions: np.ndarray
    weight: np.ndarray
    lobe: np.ndarray
    focused: np.ndarray

    def where(self, chosen: np.ndarray) -> "Scattered":
        """The rays that a mask or an index array chooses."""
        return Scattered(*(rows(getattr(self, field.name), chosen) for field in fields(self)))

    @staticmethod
    def join(parts: "list[Scattered]") -> "Scattered":
        """All rays of several `Scattered`, in order."""
        return Scattered(*(np.concatenate([getattr(p, field.name) for p in parts]) for field in fields(Scattered)))

    @property
    def kind(self) -> np.ndarray:
        """Kind of the new rays, (n,) uint8 of `RayKind`."""
        return _KIND_OF_LOBE[self.lobe]


def scatter(
    scene: Scene,
    hits: Hits,
    positions: np.ndarray,
    directions: np.ndarray,
    normals: np.ndarray,
    random: np.random.Generator | PathNumbers,
    lobes: tuple[Lobe, ...] = ALL_LOBES,
    from_light: bool = False,
) -> Scattered:
    """One new direction for each of n rays that met surfaces, by what their materials do.

    Parameters
    ----------
    positions, directions, normals : (n, 3) float32
        Of the hits: `Hits.points` of rays that flew along `directions`.
    lobes : tuple of Lobe
        Those that may be chosen.
    from_light : bool
        Whether the rays are photons; otherwise they come from where light is wanted.
    """
    u = random.random((len(positions), 3), dtype=np.float32)
    shading = scene.shading_normals(hits.triangle, hits.u, hits.v, normals)
    wi = sample_cosine_hemisphere(u[:, 1:])
    weight = scene.albedo(hits.triangle, hits.u, hits.v)
    lobe, focused = np.zeros(len(u), np.uint8), np.zeros(len(u), bool)
    k = np.flatnonzero(~scene.materials.matte[scene.material_of_triangle[hits.triangle]])
    if len(k):
        met = hits.where(k)
        flown = rows(directions, k)
        surface = surface_at(scene, met.triangle, met.u, met.v, met.back(flown))
        axes = local_axes(facing(rows(shading, k), rows(normals, k), flown))
        wo = np.einsum("nij,nj->ni", axes, -flown)
        sample = sample_bsdf(surface, wo, rows(u, k), lobes, from_light)
        wi[k], weight[k], lobe[k] = sample.wi, sample.weight, sample.lobe
        if from_light:
            focused[k] = is_focused(surface, sample.lobe, sample.wi, wo)
    onward = to_world(wi, normals if from_light else shading)
    if len(k):
        narrow = lobe[k] >= Lobe.GLOSSY
        onward[k[narrow]] = np.einsum("ni,nij->nj", rows(wi, k[narrow]), rows(axes, narrow))

    # A smooth normal may send light to the wrong side of the facet that it stands for
    side = np.sign(dot(onward, normals))
    weight *= (side * wi[:, 2] > 0)[:, None]
    if from_light:
        wide = np.where(lobe < Lobe.GLOSSY, shading_ratio(shading, normals, directions), np.float32(1))
        weight *= wide[:, None]
    origins = positions + scene.ray_offset(hits.triangle, positions) * side[:, None] * normals
    return Scattered(origins, onward, weight, lobe, focused)


def scatter_both_ways(
    scene: Scene,
    hits: Hits,
    positions: np.ndarray,
    directions: np.ndarray,
    normals: np.ndarray,
    random: np.random.Generator,
) -> list[Scattered]:
    """What surfaces of nothing but glass reflect of paths from a view, and what they let through; as `scatter` else."""
    shading = scene.shading_normals(hits.triangle, hits.u, hits.v, normals)
    surface = surface_at(scene, hits.triangle, hits.u, hits.v, hits.back(directions))
    axes = local_axes(facing(shading, normals, directions))
    wo = np.einsum("nij,nj->ni", axes, -directions)
    lobe, focused = np.full(len(wo), Lobe.GLASS, np.uint8), np.zeros(len(wo), bool)
    parts = []
    for wi, weight in glass_ways(surface, wo, random.random((len(wo), 2), dtype=np.float32)):
        onward = np.einsum("ni,nij->nj", wi, axes)
        side = np.sign(dot(onward, normals))
        origins = positions + scene.ray_offset(hits.triangle, positions) * side[:, None] * normals
        parts.append(Scattered(origins, onward, weight * (side * wi[:, 2] > 0)[:, None], lobe, focused))
    return parts


MAX_RATIO = np.float32(16)
"""Bound of `shading_ratio`: beyond it light grazes the facet, where very few photons meet it."""


def shading_ratio(shading: np.ndarray, normals: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """What a photon is worth at a smooth surface, (N·ω)⁺ / |n·ω|, (n,) float32.

    Photons arrive in proportion to the cosine at the geometric normal n, but light is reflected in proportion to that
    at the shading normal N (Veach 1997, 5.3.2).

    Parameters
    ----------
    shading, normals, directions : (n, 3) float32
        N and n of the sides that were met, and the photons' directions.
    """
    if shading is normals:
        return np.ones(len(normals), np.float32)
    cosine = np.abs(dot(normals, directions))
    return np.minimum(np.maximum(-dot(shading, directions), 0) / np.maximum(cosine, np.float32(1e-6)), MAX_RATIO)


def facing(shading: np.ndarray, normals: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Shading normals, and geometric ones where those do not face the rays: no lobe is seen from behind."""
    return np.where((dot(shading, directions) < -1e-3)[:, None], shading, normals)


def local_axes(normals: np.ndarray) -> np.ndarray:
    """Local frames with +z along the normals, rows of (n, 3, 3)."""
    tangent, bitangent = frame(normals)
    return np.stack([tangent, bitangent, normals], axis=1)
