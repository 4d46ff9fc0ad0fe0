"""Our own filter against noise, which knows where texels lie and which way they face.

The edge-avoiding à-trous wavelet transform (Dammertz et al. 2010) with the variance of the values in its weights, as
in spatiotemporal variance-guided filtering (Schied et al. 2017): 5 × 5 texels that lie farther apart from step to step
are averaged with the weights

    w = h · max(0, n·n')^128 · exp(−|n·(p' − p)| / d) · exp(−|l − l'| / (3 √(σ² + σ'²)))

h is the B3 spline, d the distance between the texels along the surface, l the mean over the colours and σ its
standard error. Where there is no noise, only texels alike are averaged.
"""

from dataclasses import dataclass

import numpy as np

from ...core.parallel import Workers, slices
from .texel_images import TexelImage

_SPLINE = np.array([1, 4, 6, 4, 1], np.float32) / 16
_LEVELS = 4
_REACH = 3  # standard errors
_SQUARINGS = 7  # 128 is 2⁷
_ROWS = 64  # in a strip of work


def denoised_by_joint_filter(image: TexelImage, workers: Workers, stage: str) -> np.ndarray:
    """The image's values without most of their noise, (h, w, c) float32."""
    value, variance = image.value, image.smooth_variance()
    surface = _Surface.of(image)
    for level in range(_LEVELS):
        workers.progress.update(stage, level / _LEVELS)
        step = _Level(surface, value, variance, 1 << level)
        strips = list(workers.map(step.strip, slices(len(value), _ROWS)))
        value = np.concatenate([strip[0] for strip in strips])
        variance = np.concatenate([strip[1] for strip in strips])
    return value


@dataclass(frozen=True)
class _Surface:
    """Where texels lie: chart (h, w), −1 for none, and position and normal as planes (3, h, w)."""

    chart: np.ndarray
    position: np.ndarray
    normal: np.ndarray

    @staticmethod
    def of(image: TexelImage) -> "_Surface":
        position, normal = (np.ascontiguousarray(np.moveaxis(a, 2, 0)) for a in (image.position, image.normal))
        return _Surface(image.chart, position, normal)

    def likeness(self, here: tuple[slice, slice], there: tuple[slice, slice]) -> np.ndarray:
        """How much texels are of one plane with their neighbours, 0 to 1."""
        at, beside = (slice(None), *here), (slice(None), *there)
        normal, way = self.normal[at], self.position[beside] - self.position[at]
        height = np.abs((way * normal).sum(axis=0))
        length = np.sqrt((way * way).sum(axis=0)) + np.float32(1e-20)
        facing = np.maximum((normal * self.normal[beside]).sum(axis=0), 0)
        for _ in range(_SQUARINGS):
            facing *= facing
        facing[(self.chart[here] != self.chart[there]) | (self.chart[here] < 0)] = 0
        return facing * np.exp(-height / length)


class _Level:
    """One level of the transform: texels `step` apart are averaged."""

    def __init__(self, surface: _Surface, value: np.ndarray, variance: np.ndarray, step: int) -> None:
        self._surface, self._value, self._variance, self._step = surface, value, variance, step
        self._mean = value[..., :3].mean(axis=2)

    def strip(self, rows: slice) -> tuple[np.ndarray, np.ndarray]:
        """Values and variances of some rows."""
        own = np.float32(_SPLINE[2] ** 2)
        total = np.full(self._mean[rows].shape, own)
        value, variance = own * self._value[rows], own**2 * self._variance[rows]
        for row in range(-2, 3):
            for column in range(-2, 3):
                if row or column:
                    here, there = self._places(rows, row * self._step, column * self._step)
                    weight = _SPLINE[row + 2] * _SPLINE[column + 2] * self._alike(here, there)
                    at = (slice(here[0].start - rows.start, here[0].stop - rows.start), here[1])
                    total[at] += weight
                    value[at] += weight[..., None] * self._value[there]
                    variance[at] += weight**2 * self._variance[there]
        return value / total[..., None], variance / total**2

    def _places(self, rows: slice, down: int, right: int) -> tuple[tuple[slice, slice], tuple[slice, slice]]:
        """Texels of the rows whose neighbour so far away is on the image, and those neighbours."""
        height, width = self._mean.shape
        top, left = max(rows.start, -down), max(0, -right)
        bottom, end = max(min(rows.stop, height - down), top), max(min(width, width - right), left)
        there = slice(top + down, bottom + down), slice(left + right, end + right)
        return (slice(top, bottom), slice(left, end)), there

    def _alike(self, here: tuple[slice, slice], there: tuple[slice, slice]) -> np.ndarray:
        """How much of neighbours' values belongs to texels: the weights w/h."""
        noise = np.sqrt(self._variance[here] + self._variance[there])
        apart = np.abs(self._mean[here] - self._mean[there])
        return self._surface.likeness(here, there) * np.exp(-apart / (_REACH * noise + np.float32(1e-20)))
