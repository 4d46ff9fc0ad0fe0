"""What becomes of many rays where they meet surfaces: loops over `bsdf.scatter`, one new direction for each ray."""

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from ..bsdf import ALL_LOBES, SPECULAR_LOBES
from ..bsdf import scatter as parts
from ..core.compiling import kernel, kernel_array
from ..core.sampling.path_numbers import PathNumbers
from ..core.sampling.vectors import dot, rows
from ..core.sampling.warps import frame
from ..core.vec3 import put, row
from ..scene import RayKind, Scene
from ..scene.hit import hit_at
from ..tracing import Hits

NARROW_LOBES = SPECULAR_LOBES

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
        Whether those who gather leave to photons what the lobe does to lamplight on this way.
    rough : (n,) bool, optional
        Whether a glossy closure scattered that is no mirror.
    """

    origins: np.ndarray
    directions: np.ndarray
    weight: np.ndarray
    lobe: np.ndarray
    focused: np.ndarray
    rough: np.ndarray | None = None

    def where(self, chosen: np.ndarray) -> "Scattered":
        """The rays that a mask or an index array chooses."""
        columns = (getattr(self, field.name) for field in fields(self))
        chosen_rows: Any = (None if column is None else rows(column, chosen) for column in columns)
        return Scattered(*chosen_rows)

    @property
    def kind(self) -> np.ndarray:
        """Kind of the new rays, (n,) uint8 of `RayKind`."""
        return _KIND_OF_LOBE[self.lobe]

    @staticmethod
    def empty(n: int) -> "Scattered":
        """Room for n rays."""
        f = np.float32
        columns: Any = (*np.empty((3, n, 3), f), np.empty(n, np.uint8), *np.empty((2, n), bool))
        return Scattered(*columns)

    @property
    def _columns(self) -> Any:
        return self.origins, self.directions, self.weight, self.lobe, self.focused, self.rough


def scatter(
    scene: Scene,
    hits: Hits,
    positions: np.ndarray,
    directions: np.ndarray,
    normals: np.ndarray,
    random: np.random.Generator | PathNumbers,
    lobes: int = ALL_LOBES,
    from_light: bool = False,
) -> Scattered:
    """One new direction for each of n rays that met surfaces, by what their materials do.

    Parameters
    ----------
    positions, directions, normals : (n, 3) float32
        Of the hits: `Hits.points` of rays that flew along `directions`.
    lobes : int
        Those that may be chosen, as `ALL_LOBES`.
    from_light : bool
        Whether the rays are photons; otherwise they come from where light is wanted.
    """
    scattered = Scattered.empty(len(positions))
    u = kernel_array(random.random((len(positions), 3), dtype=np.float32), np.float32)
    arguments: Any = (*_at(hits, directions), u, lobes, from_light, *scattered._columns)
    _scatter(scene.arrays, *arguments)
    return scattered


def _at(hits: Hits, directions: np.ndarray) -> Any:
    columns = (hits.triangle, np.int32), (hits.distance, np.float32), (hits.u, np.float32), (hits.v, np.float32)
    return *(kernel_array(*column) for column in columns), kernel_array(directions, np.float32)


@kernel
def _scatter(
    scene, triangle, distance, u, v, directions, random, lobes, from_light, origins, out, weight, lobe, specular, rough
):
    for i in range(len(triangle)):
        direction, (x, y, z) = row(directions, i), row(random, i)
        hit = hit_at(scene, direction, triangle[i], distance[i], u[i], v[i])
        scattered = parts.scatter(scene, hit, direction, x, y, z, lobes, from_light)
        put(origins, i, scattered.origin)
        put(out, i, scattered.direction)
        put(weight, i, scattered.weight)
        lobe[i], specular[i], rough[i] = scattered.lobe, scattered.specular, scattered.rough


def shading_ratio(shading: np.ndarray, normals: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """`bsdf.scatter.shading_normal_correction` of many, (n,) float32."""
    ratio = np.ones(len(normals), np.float32)
    if shading is not normals:
        arguments: Any = (*(kernel_array(a, np.float32) for a in (shading, normals, directions)), ratio)
        _corrections(*arguments)
    return ratio


@kernel
def _corrections(shading, normals, directions, out):
    for i in range(len(out)):
        out[i] = parts.shading_normal_correction(row(shading, i), row(normals, i), row(directions, i))


def facing(shading: np.ndarray, normals: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Shading normals, and geometric ones where those do not face the rays: no lobe is seen from behind."""
    return np.where((dot(shading, directions) < -1e-3)[:, None], shading, normals)


def local_axes(normals: np.ndarray) -> np.ndarray:
    """Local frames with +z along the normals, rows of (n, 3, 3)."""
    tangent, bitangent = frame(normals)
    return np.stack([tangent, bitangent, normals], axis=1)
