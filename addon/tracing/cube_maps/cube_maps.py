"""Cube maps: what some points of a scene see in every direction."""

from dataclasses import dataclass, fields
from functools import cached_property
from time import perf_counter

import numpy as np

from ...core.compiling import kernel_array
from ...core.parallel import Workers
from ...core.sampling.octahedral import decode_octahedral, encode_octahedral
from ...core.sampling.vectors import dot
from ...scene import RayKind, Scene
from ..protocol import Tracer
from .stage import each
from .texels import MapArrays, planes_of, texels_at

_TURNED = np.array([[0, 1, 2], [1, 2, 0], [2, 0, 1]])  # axes, starting from each


@dataclass(frozen=True)
class CubeMaps:
    """m cube maps with six faces of size × size texels (the paper's distance impostors).

    Face 2a looks along axis a and face 2a + 1 against it; its rows follow axis a + 1 and its columns axis a + 2 (mod
    3). Depth z is measured along the face's axis: straight lines stay straight on a face, and along them z is linear
    in the distance. Texels, and likewise the coarser cells of a mip level, are numbered through as
    ``((map · 6 + face) · size + row) · size + column``.

    A texel's surface is the plane through what its middle sees: ``n · p = h`` for points p from the map's centre V.
    Planes make walls exact whatever the size of the texels.

    Attributes
    ----------
    centres : (m, 3) float32, m
        V, in world space.
    size : int
        A power of two.
    distance : (k,) float32, m
        From V to what each of the k = 6 m size² texels sees through its middle; infinite: nothing.
    packed_normal : (k, 2) int16
        Octahedral code of the surface's geometric normal, on the side that V sees.
    triangle, material : (k,) int32
        −1: none.
    albedo : (k, 3) uint8
        Diffuse albedo in 255ths.
    nearest, farthest : (k + k/4 + k/16 + …,) float32, m
        Mip chain of the depths z between which a cell's planes lie, finest level first.
    seconds : float
        How long it took to take the pictures.
    """

    centres: np.ndarray
    size: int
    distance: np.ndarray
    packed_normal: np.ndarray
    triangle: np.ndarray
    material: np.ndarray
    albedo: np.ndarray
    nearest: np.ndarray
    farthest: np.ndarray
    seconds: float

    @staticmethod
    def taken_from(
        centres: np.ndarray, size: int, scene: Scene, tracer: Tracer, kind: RayKind, workers: Workers
    ) -> "CubeMaps":
        """The maps that `tracer` sees from centres (m, 3), with rays of a kind."""
        start = perf_counter()
        directions = _texel_directions(size)
        ways = directions / np.linalg.norm(directions, axis=1, keepdims=True)

        def look(centre: np.ndarray) -> tuple[np.ndarray, ...]:
            hits = tracer.closest_hit(np.tile(centre, (len(ways), 1)), ways, kind=kind)
            back = hits.back(ways)
            normal = np.where(back[:, None], -hits.normal, hits.normal)
            albedo = scene.albedo(hits.triangle, hits.u, hits.v, back) if scene.n_triangles else np.zeros_like(ways)
            normal[~hits.hit], albedo[~hits.hit] = -ways[~hits.hit], 0
            packed = encode_octahedral(normal)
            depths = _depth_ranges(hits.distance, decode_octahedral(packed), directions)
            return hits.distance, packed, hits.triangle, np.rint(255 * np.minimum(albedo, 1)).astype(np.uint8), *depths

        columns = zip(*each(workers, look, list(centres)), strict=True)
        distance, packed_normal, triangle, albedo, nearest, farthest = (np.concatenate(parts) for parts in columns)
        return CubeMaps(
            centres=centres,
            size=size,
            distance=distance,
            packed_normal=packed_normal,
            triangle=triangle,
            material=np.append(scene.material_of_triangle, np.int32(-1))[triangle],
            albedo=albedo,
            nearest=_mip_chain(nearest, np.minimum, size),
            farthest=_mip_chain(farthest, np.maximum, size),
            seconds=perf_counter() - start,
        )

    def __len__(self) -> int:
        return len(self.centres)

    @property
    def n_bytes(self) -> int:
        """Memory of the texels and their mip chain."""
        arrays = [getattr(self, field.name) for field in fields(self)]
        return sum(array.nbytes for array in arrays if isinstance(array, np.ndarray))

    @property
    def n_levels(self) -> int:
        """Levels of the mip chain, from single texels to a whole face."""
        return self.size.bit_length()

    @cached_property
    def level_start(self) -> np.ndarray:
        """Where each level begins in the mip chain, (levels,) int64."""
        sides = self.size >> np.arange(self.n_levels)
        return np.cumsum(6 * len(self) * sides**2) - 6 * len(self) * sides**2

    @cached_property
    def arrays(self) -> MapArrays:
        """What kernels read."""
        return MapArrays(
            kernel_array(self.centres, np.float32),
            self.size,
            self.n_levels,
            self.level_start,
            kernel_array(self.distance, np.float32),
            kernel_array(self.packed_normal, np.int16),
            kernel_array(self.nearest, np.float32),
            kernel_array(self.farthest, np.float32),
        )

    def texel(self, which: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Texels of maps (n,) that points p (n, 3) from their centres are seen in, (n,), and their depths z (n,)."""
        texel, z = np.empty(len(p), np.int64), np.empty(len(p), np.float32)
        texels_at(self.arrays, kernel_array(which, np.int64), kernel_array(p, np.float32), texel, z)
        return texel, z

    def plane(self, texel: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Plane n · p = h of texels (n,): normals (n, 3) and h (n,) < 0; h is −∞ where a texel sees nothing."""
        normal, h = np.empty((len(texel), 3), np.float32), np.empty(len(texel), np.float32)
        planes_of(self.arrays, kernel_array(texel, np.int64), normal, h)
        return normal, h

    def goes_through(self, texel: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Whether the planes of texels (n,) go through points (n, 3), to a quarter of a texel, (n,) bool."""
        n, h = self.plane(texel)
        off = dot(n, points - self.centres[texel // (6 * self.size**2)]) - h
        return np.abs(off) < self.distance[texel] / (2 * self.size)


def _texel_directions(size: int) -> np.ndarray:
    """Directions through the middles of one map's texels, 1 long along their face's axis, (6 size², 3) float32."""
    slope = ((np.arange(size) + 0.5) * (2 / size) - 1).astype(np.float32)
    directions = np.empty((3, 2, size, size, 3), np.float32)
    for axis, (along, row, column) in enumerate(_TURNED):
        directions[axis, :, :, :, along] = np.array([1, -1])[:, None, None]
        directions[axis, :, :, :, row], directions[axis, :, :, :, column] = slope[:, None], slope
    return directions.reshape(-1, 3)


def _depth_ranges(distance: np.ndarray, normals: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest depth z of the planes over the texels of one map, (6 size²,) float32 each.

    On a plane n · p = h, 1/z = n · q / h is linear in the direction q (1 long along the face's axis), hence extreme in
    the texel's corners, half a texel from the middle q₀ along rows and columns. There h = z₀ n · q₀.
    """
    half = 1 / np.sqrt(np.float32(len(directions) / 6))
    axis = np.repeat(np.arange(6) // 2, len(directions) // 6)[:, None]
    across = np.abs(normals).sum(axis=1) - np.take_along_axis(np.abs(normals), axis, axis=1)[:, 0]
    middle = np.sqrt(dot(directions, directions)) / np.maximum(distance, np.float32(1e-20))  # a map may touch a surface
    spread = middle * across * half / np.maximum(np.abs(dot(normals, directions)), np.float32(1e-30))
    with np.errstate(divide="ignore"):
        return 1 / (middle + spread), 1 / np.maximum(middle - spread, 0)


def _mip_chain(depth: np.ndarray, pool: np.ufunc, size: int) -> np.ndarray:
    """Pool finest cells (k,) four by four up to whole faces, all levels one after the other."""
    levels = [depth.reshape(-1, size, size)]
    while levels[-1].shape[1] > 1:
        rows = pool(levels[-1][:, ::2], levels[-1][:, 1::2])
        levels.append(pool(rows[:, :, ::2], rows[:, :, 1::2]))
    return np.concatenate([level.ravel() for level in levels])
