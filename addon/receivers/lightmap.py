"""Receivers at the texels of lightmaps."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..parallel import Workers
from ..tracers import Tracer
from .charts import Charts, LightmapMesh
from .receivers import Receivers


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
        Chart of the receiver.
    uv : (n, 2) float32
        Where on the image the receiver lies, in [0, 1].
    charts : Charts
        The triangles that the receivers lie on.
    """

    sizes: tuple[tuple[int, int], ...]
    image: np.ndarray
    row: np.ndarray
    column: np.ndarray
    weight: np.ndarray
    chart: np.ndarray
    uv: np.ndarray
    charts: Charts

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
