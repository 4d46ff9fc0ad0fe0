"""The patterns of a scene's lamps as kernels take them: tables of one size, one for all lamps that share a pattern."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...core.compiling import by_reference
from ...core.sampling.pixel_tables import PixelTables, no_tables, pixel_tables
from ...scene import AREA_LAMPS, LightPattern, Lights, PatternDomain

_MOST_PIXELS = 1 << 23
"""Of all tables together, which are 28 bytes each."""


@by_reference
class PatternArrays(NamedTuple):
    """What the nodes of l lamps do to their light.

    Attributes
    ----------
    differs : (l,) bool
        Lamps that have a pattern, or fall off otherwise than by the square of the distance.
    table : (l,) int32
        Of the lamp's pattern; −1 without one.
    domain : (l,) int32
        `PatternDomain`.
    distance_power : (l,) int32
    smoothing : (l,) float32, m²
    tables : PixelTables
    """

    differs: np.ndarray
    table: np.ndarray
    domain: np.ndarray
    distance_power: np.ndarray
    smoothing: np.ndarray
    tables: PixelTables


@dataclass(frozen=True)
class _Use:
    """A pattern, and whether its light leaves a surface: less of it to the side."""

    pattern: LightPattern
    by_cosine: bool


def pattern_arrays(lights: Lights) -> PatternArrays:
    """The arrays of a scene's lamps."""
    of_use: dict[_Use, int] = {}
    flat = np.isin(lights.kind, AREA_LAMPS)
    uses = [None if one is None else _Use(one, bool(flat[k])) for k, one in enumerate(lights.patterns)]
    table = [-1 if use is None else of_use.setdefault(use, len(of_use)) for use in uses]
    domain = [0 if use is None else int(use.pattern.domain) for use in uses]
    differs = (np.array(table, np.int32) >= 0) | (lights.distance_power > 0) | (lights.smoothing > 0)
    return PatternArrays(
        np.array(differs, np.bool_),
        np.array(table, np.int32),
        np.array(domain, np.int32),
        lights.distance_power.astype(np.int32),
        lights.smoothing.astype(np.float32),
        _tables(list(of_use)),
    )


def _tables(uses: list[_Use]) -> PixelTables:
    if not uses:
        return no_tables()
    height, width = np.max([use.pattern.values.shape[:2] for use in uses], axis=0)
    while height * width * len(uses) > _MOST_PIXELS:
        height, width = max(height // 2, 1), max(width // 2, 1)
    values = np.stack([resampled(use.pattern.values, int(height), int(width)) for use in uses])
    angles = np.array([_angle(use.pattern) for use in uses])
    weights = np.abs(values).mean(axis=3, dtype=np.float64)
    by_cosine = np.array([use.by_cosine and use.pattern.domain == PatternDomain.DIRECTIONS for use in uses])
    middles = np.cos(angles[:, None] * (np.arange(height) + 0.5) / height)
    weights *= np.where(by_cosine[:, None], np.maximum(middles, 0), 1)[..., None]
    return pixel_tables(values, weights, angles)


def _angle(pattern: LightPattern) -> float:
    return 0.0 if pattern.domain == PatternDomain.PLACES else pattern.angle


def resampled(values: np.ndarray, height: int, width: int) -> np.ndarray:
    """Pixels (h, w, 3) on a grid of another size: the mean of those that fall together, or repeated."""
    for axis, n in enumerate((height, width)):
        old = values.shape[axis]
        if n < old:
            starts = np.arange(n) * old // n
            sums = np.add.reduceat(values, starts, axis=axis, dtype=np.float64)
            counts = np.diff(np.append(starts, old)).reshape((-1, 1, 1) if axis == 0 else (1, -1, 1))
            values = (sums / counts).astype(np.float32)
        elif n > old:
            values = values.take(np.arange(n) * old // n, axis=axis)
    return values
