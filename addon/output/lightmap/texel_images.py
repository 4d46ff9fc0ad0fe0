"""Values of receivers as images."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter

from ...core.progress import Progress
from ...receivers import Receivers, Texels


@dataclass(frozen=True)
class TexelImage:
    """What is known of the texels of one image of height h and width w; row 0 is at v = 0.

    Attributes
    ----------
    value : (h, w, c) float32
        Mean of the values of the texel's receivers, by weight.
    stderr : (h, w) float32
        Its standard error.
    covered : (h, w) bool
        Whether the texel has receivers; where it has none, all else is 0.
    chart : (h, w) int32
        The chart that covers most of the texel, −1 where it has no receivers.
    place : (h, w, 2) float32
        Mean place of the receivers, in texels from the image's corner, along u and v.
    position, normal : (h, w, 3) float32
        Their mean, m, world space; the normals have unit length.
    """

    value: np.ndarray
    stderr: np.ndarray
    covered: np.ndarray
    chart: np.ndarray
    place: np.ndarray
    position: np.ndarray
    normal: np.ndarray

    def smooth_variance(self) -> np.ndarray:
        """Variance of the values, (h, w) float32, for errors that a few samples each have told.

        It is the mean over the 5 × 5 texels around each, but no more than nine times its own: in the dark beside
        bright, noisy texels there is no noise.
        """
        own = np.where(self.covered, self.stderr**2, np.float32(0))
        total, share = uniform_filter(own, 5), uniform_filter(self.covered.astype(np.float32), 5)
        return np.clip(total / np.maximum(share, np.float32(0.04)), 0, 9 * own)


def texel_images(
    values: np.ndarray, stderr: np.ndarray, receivers: Receivers, texels: Texels, progress: Progress | None = None
) -> list[TexelImage]:
    """The images of receivers' values.

    Parameters
    ----------
    values : (n, c) float32
    stderr : (n,) float32
        Independent from receiver to receiver.
    """
    images = []
    for image, size in enumerate(texels.sizes):
        if progress is not None:
            progress.check()
        k = np.flatnonzero(texels.image == image)
        weight, chart = texels.weight[k].astype(np.float64), texels.chart[k]
        texel = texels.row[k].astype(np.int64) * size[1] + texels.column[k]
        means = _Means(texel, weight, size)
        place = texels.uv[k] * np.array(size[::-1], np.float32)
        variance = means.of((weight * stderr[k].astype(np.float64) ** 2)[:, None])[..., 0]
        normal = means.of(receivers.normal[k])
        normal /= np.maximum(np.linalg.norm(normal, axis=2, keepdims=True), np.float32(1e-20))
        images.append(
            TexelImage(
                value=means.of(values[k]),
                stderr=np.sqrt(variance / np.maximum(means.total, 1e-30)).astype(np.float32),
                covered=means.total > 0,
                chart=_largest(texel, weight, chart, size),
                place=means.of(place),
                position=means.of(receivers.position[k]),
                normal=normal,
            )
        )
    return images


class _Means:
    """Means by weight of what belongs to the texels of an image."""

    def __init__(self, texel: np.ndarray, weight: np.ndarray, size: tuple[int, int]) -> None:
        self._texel, self._weight, self._size = texel, weight, size
        self.total = np.bincount(texel, weight, size[0] * size[1]).reshape(size)

    def of(self, values: np.ndarray) -> np.ndarray:
        """Means (h, w, c) float32 of values (n, c)."""
        means = np.empty((*self._size, values.shape[1]), np.float32)
        divisor = np.where(self.total > 0, self.total, 1)
        for channel in range(values.shape[1]):
            sums = np.bincount(self._texel, self._weight * values[:, channel], divisor.size)
            means[..., channel] = sums.reshape(self._size) / divisor
        return means


def _largest(texel: np.ndarray, weight: np.ndarray, chart: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """The chart with the largest weight in each texel, (h, w) int32, −1 without any."""
    found = np.full(size[0] * size[1], -1, np.int32)
    order = np.argsort(weight, kind="stable")
    found[texel[order]] = chart[order]  # the last one stays
    return found.reshape(size)
