"""Receivers at the texels of lightmaps."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..parallel import Workers
from ..tracers import Tracer
from .receivers import Receivers


@dataclass(frozen=True)
class LightmapMesh:
    """An object that has a place in a lightmap: t triangles.

    Attributes
    ----------
    object_name : str
        For messages.
    image : int
        Which image its light goes to.
    positions : (t, 3, 3) float32, m
        Of the triangles' corners, world space.
    normals : (t, 3, 3) float32
        Unit shading normals of the corners, world space.
    uv : (t, 3, 2) float32
        Of the corners in that image, each in [0, 1]: already moved to the object's place in the atlas.
    """

    object_name: str
    image: int
    positions: np.ndarray
    normals: np.ndarray
    uv: np.ndarray


@dataclass(frozen=True)
class Texels:
    """Where the values of n receivers go: row `i` of everything belongs to receiver `i`.

    Rows count from v = 0, columns from u = 0, as Blender's pixels and OpenGL's textures do: texel (row, column) of an
    image of height h and width w covers u from column/w to (column + 1)/w and v from row/h to (row + 1)/h.

    Attributes
    ----------
    sizes : tuple of (height, width)
        Of the images.
    image, row, column : (n,) int32
    weight : (n,) float32
        Share of the texel's area that the receiver stands for; a texel that is covered whole by one chart has 1.
    chart : (n,) int32
        Chart of the receiver, counted over all meshes: a set of triangles that share edges in space and in UV.
    uv : (n, 2) float32
        Where on the image the receiver lies, in [0, 1].
    """

    sizes: tuple[tuple[int, int], ...]
    image: np.ndarray
    row: np.ndarray
    column: np.ndarray
    weight: np.ndarray
    chart: np.ndarray
    uv: np.ndarray

    def __len__(self) -> int:
        return len(self.image)


def texel_receivers(
    meshes: Sequence[LightmapMesh],
    sizes: Sequence[tuple[int, int]],
    tracer: Tracer | None = None,
    workers: Workers | None = None,
) -> tuple[Receivers, Texels]:
    """Receivers for every texel that a chart touches, and where their values go.

    Parameters
    ----------
    sizes : sequence of (height, width)
        Of each image that the meshes name.
    tracer : Tracer, optional
        With it, receivers that would start inside other geometry are pushed out of it or left out, and texels close
        to other surfaces get several receivers.
    """
    raise NotImplementedError
