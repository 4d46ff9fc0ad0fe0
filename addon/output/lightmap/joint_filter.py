"""Our own filter against noise, which knows where texels lie and which way they face.

The edge-avoiding à-trous wavelet transform (Dammertz et al. 2010) with the variance of the values in its weights, as
in spatiotemporal variance-guided filtering (Schied et al. 2017): 5 × 5 texels that lie farther apart from step to step
are averaged with the weights

    w = h · max(0, n·n')^128 · exp(−|n·(p' − p)| / d) · exp(−|l − l'| / (3 √(σ² + σ'²)))

h is the B3 spline, d the distance between the texels along the surface, l the mean over the colours and σ its
standard error. Where there is no noise, only texels alike are averaged.
"""

from typing import NamedTuple

import numpy as np

from ...core.compiling import kernel, kernel_array, part
from ...core.parallel import Workers, slices
from ...core.vec3 import ZERO, dot, length, mean, minus, row
from .texel_images import TexelImage

_SPLINE = np.array([1, 4, 6, 4, 1], np.float32) / 16
_LEVELS = 4
_REACH = np.float32(3)  # standard errors
_SQUARINGS = 7  # 128 is 2⁷
_TINY = np.float32(1e-20)
_ROWS = 16  # in a strip of work


class Guides(NamedTuple):
    """What kernels know of the texels of an image: chart (h, w), −1 for none; others (h, w, …) as in `TexelImage`."""

    chart: np.ndarray
    position: np.ndarray
    normal: np.ndarray
    value: np.ndarray
    variance: np.ndarray


def denoised_by_joint_filter(image: TexelImage, workers: Workers, stage: str) -> np.ndarray:
    """The image's values without most of their noise, (h, w, c) float32."""
    columns = image.position, image.normal, image.value, image.smooth_variance()
    texels = Guides(kernel_array(image.chart, np.int32), *(kernel_array(column, np.float32) for column in columns))
    for level in range(_LEVELS):
        workers.progress.update(stage, level / _LEVELS)
        texels = _filtered(texels, 1 << level, workers)
    return texels.value


def _filtered(texels: Guides, step: int, workers: Workers) -> Guides:
    """The texels after one level of the transform."""
    value, variance = np.empty_like(texels.value), np.empty_like(texels.variance)

    def strip(rows: slice) -> None:
        filter_rows(texels, step, rows.start, rows.stop, value, variance)

    for _ in workers.map(strip, slices(len(value), _ROWS)):
        workers.progress.check()
    return texels._replace(value=value, variance=variance)


@kernel
def filter_rows(texels, step, start, stop, value, variance):
    """One level of the transform on some rows of texels: those `step` apart are averaged, into (h, w, c) and (h, w)."""
    for i in range(start, stop):
        for j in range(texels.chart.shape[1]):
            variance[i, j] = _filter_texel(texels, step, i, j, value[i, j])


@part
def _filter_texel(texels, step, i, j, value):
    """Write the mean of the texels around one; return its variance."""
    n_rows, n_columns = texels.chart.shape
    own = _SPLINE[2] * _SPLINE[2]
    total, variance = own, own * own * texels.variance[i, j]
    for channel in range(len(value)):
        value[channel] = own * texels.value[i, j, channel]
    for row_of in range(5):
        for column_of in range(5):
            y, x = i + (row_of - 2) * step, j + (column_of - 2) * step
            if (row_of == 2 and column_of == 2) or not (0 <= y < n_rows and 0 <= x < n_columns):
                continue
            weight = _SPLINE[row_of] * _SPLINE[column_of] * _alike(texels, i, j, y, x)
            if weight > ZERO:
                total += weight
                variance += weight * weight * texels.variance[y, x]
                for channel in range(len(value)):
                    value[channel] += weight * texels.value[y, x, channel]
    for channel in range(len(value)):
        value[channel] /= total
    return variance / (total * total)


@part
def _alike(texels, i, j, y, x):
    """How much of a neighbour's value belongs to a texel: the weight w/h."""
    if texels.chart[i, j] < 0 or texels.chart[i, j] != texels.chart[y, x]:
        return ZERO
    normal, way = row(texels.normal[i], j), minus(row(texels.position[y], x), row(texels.position[i], j))
    facing = max(dot(normal, row(texels.normal[y], x)), ZERO)
    for _ in range(_SQUARINGS):
        facing *= facing
    if facing == ZERO:
        return ZERO
    off_plane = abs(dot(way, normal)) / (length(way) + _TINY)
    noise = np.sqrt(texels.variance[i, j] + texels.variance[y, x])
    apart = abs(mean(row(texels.value[i], j)) - mean(row(texels.value[y], x)))
    return facing * np.exp(-off_plane - apart / (_REACH * noise + _TINY))
