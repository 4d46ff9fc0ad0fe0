"""OpenImageDenoise on lightmaps, chart by chart."""

import numpy as np
from scipy.ndimage import distance_transform_edt

from ...core.parallel import Workers
from ..oidn import filtered
from .directional import directional_light, shares_of
from .texel_images import TexelImage

_APART = 16  # texels: at least so far apart are the charts of one pass
_REACH = 4  # standard errors that a value may be changed by
_LEAST_OF_L0 = np.float32(0.1)  # as much of it is the light of the texel's own normal


def denoised_by_oidn(image: TexelImage, workers: Workers, stage: str) -> np.ndarray:
    """The image's values through OpenImageDenoise's filter for lightmaps, (h, w, c) float32.

    The channels are those of `finish_lightmaps`. So that no light bleeds from chart to chart, charts that lie close to
    each other go through the filter in separate passes, in which everything around a chart has the value of its nearest
    texel. No value is changed by more than its noise accounts for.

    Raises
    ------
    RuntimeError
        If OpenImageDenoise fails.
    """
    pass_of_chart = _passes(image.chart)
    pass_of_texel = np.full(image.chart.shape, -1)
    pass_of_texel[image.covered] = pass_of_chart[image.chart[image.covered]]
    n_passes = int(pass_of_chart.max(initial=-1)) + 1
    result = image.value.copy()
    for number in range(n_passes):
        workers.progress.update(stage, number / n_passes)
        own = pass_of_texel == number
        row, column = distance_transform_edt(~own, return_distances=False, return_indices=True)
        result[own] = _all_filtered(image.value[row, column], image.normal[row, column], workers.memory)[own]
    reach = _REACH * np.sqrt(image.smooth_variance())[..., None]
    return np.clip(result, image.value - reach, image.value + reach)


def _all_filtered(values: np.ndarray, normals: np.ndarray, memory: int) -> np.ndarray:
    """Light, and its slope if there is one, through the filter, which expects L1 as shares of L0.

    With a share S = L1/(2 L0), light is L0 (1 + 2 S·n), which gives L0 and the slope, L1, of what was filtered.
    """
    light = _filtered(values[..., :3], False, memory)
    if values.shape[2] == 3:
        return light
    slope = values[..., 3:].reshape(*normals.shape, 3)
    shares = shares_of(*directional_light(values[..., :3], slope, normals))
    shares = np.stack([_filtered(shares[..., axis, :], True, memory) for axis in range(3)], axis=2)
    constant = light / np.maximum(1 + 2 * (normals[..., None] * shares).sum(axis=2), _LEAST_OF_L0)
    slope = 2 * constant[..., None, :] * shares
    return np.concatenate([light, slope.reshape(*light.shape[:2], 9)], axis=2)


def _filtered(values: np.ndarray, directional: bool, memory: int) -> np.ndarray:
    """Three channels (h, w, 3) through the filter."""
    return filtered("RTLightmap", values, {"directional": directional}, memory=memory)


def _passes(chart: np.ndarray) -> np.ndarray:
    """Pass of each chart, such that no two charts of a pass are closer than `_APART`, (charts,) int32.

    Passes are independent sets of the graph of close charts, each found by Luby's algorithm (1986).
    """
    a, b = _close_charts(chart)
    n = int(chart.max(initial=-1)) + 1
    rank = np.random.default_rng(0).permutation(n)
    pass_of_chart = np.full(n, -1, np.int32)
    used = np.zeros(n, bool)
    used[chart[chart >= 0]] = True
    number = 0
    while (used & (pass_of_chart < 0)).any():
        free = used & (pass_of_chart < 0)
        while free.any():
            best_beside = np.full(n, -1)
            np.maximum.at(best_beside, a, np.where(free[b], rank[b], -1))
            chosen = free & (rank > best_beside)
            pass_of_chart[chosen] = number
            free[chosen] = False
            free[a[chosen[b]]] = False
        number += 1
    return pass_of_chart


def _close_charts(chart: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of charts of a chart image (h, w) that are closer than `_APART`, each in both orders."""
    distance, (row, column) = distance_transform_edt(chart < 0, return_indices=True)
    nearest = np.where(distance <= _APART / 2, chart[row, column], -1).astype(np.int64)
    sides = (nearest[:, :-1], nearest[:, 1:]), (nearest[:-1], nearest[1:])
    a, b = (np.concatenate([side[i].reshape(-1) for side in sides]) for i in range(2))
    meet = (a != b) & (a >= 0) & (b >= 0)
    n = nearest.max(initial=0) + 1
    low, high = np.divmod(np.unique(np.minimum(a, b)[meet] * n + np.maximum(a, b)[meet]), n)
    return np.concatenate([low, high]), np.concatenate([high, low])
