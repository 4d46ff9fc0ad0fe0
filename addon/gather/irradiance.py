"""The light that arrives at receivers."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

_OF_ALL = ("receivers", "gather_points", "gather_rays")
"""Counts of what several kinds of light have in common."""

_OF_RECEIVERS = ("receivers", "gather_points")
"""Counts of what there is once, at however many times it is lit."""


@dataclass(frozen=True)
class OwnRays:
    """What n receivers' own rays found; what they took in the end is from the rays of all around.

    Attributes
    ----------
    off : (n, 3) float32, W/m²
        Irradiance by their own rays, less what they took; 0 where they sent none.
    stderr : (n,) float32, W/m²
        Of the mean over colours by their own rays: independent of all others'.
    taken : (n,) float32, W/m²
        Standard error of the mean over colours of what they took.
    """

    off: np.ndarray
    stderr: np.ndarray
    taken: np.ndarray

    def where(self, rows: np.ndarray | slice) -> "OwnRays":
        """Those of some receivers."""
        return OwnRays(self.off[rows], self.stderr[rows], self.taken[rows])


@dataclass(frozen=True)
class Estimate:
    """What one way of gathering says of n receivers.

    Attributes
    ----------
    irradiance : (n, 3) float32, W/m²
    stderr : (n,) float32, W/m²
        Standard error of the irradiance's mean over colours.
    slope : (n, 3, 3) float32 or None, W/m²
    gathered : (n,) bool or None
        As in `Irradiance`.
    caustics : (n, 3) float32 or None, W/m²
        As in `Irradiance`.
    own_rays : OwnRays or None
    """

    irradiance: np.ndarray
    stderr: np.ndarray
    slope: np.ndarray | None = None
    gathered: np.ndarray | None = None
    caustics: np.ndarray | None = None
    own_rays: OwnRays | None = None

    @staticmethod
    def dark(n: int, directional: bool) -> "Estimate":
        """No light at n receivers."""
        slope = np.zeros((n, 3, 3), np.float32) if directional else None
        return Estimate(np.zeros((n, 3), np.float32), np.zeros(n, np.float32), slope)

    def plus(self, other: "Estimate") -> "Estimate":
        """The sum of two kinds of light, whose errors are independent."""
        slope = None if self.slope is None or other.slope is None else self.slope + other.slope
        stderr = np.hypot(self.stderr, other.stderr)
        return Estimate(self.irradiance + other.irradiance, stderr, slope, self.gathered, None, self.own_rays)

    def with_noise(self, noise: float) -> "Estimate":
        """The same light, whose mean over the receivers has an error besides, W/m²: of each in proportion to its light.

        Where there is no light but might be, the error is the same everywhere.
        """
        light = np.abs(self.irradiance).mean(axis=1)
        mean = float(light.mean(dtype=np.float64))
        share = light / np.float32(mean) if mean > 0 else np.float32(1)
        return replace(self, stderr=np.hypot(self.stderr, np.float32(noise) * share))

    def put(self, rows: np.ndarray | slice, other: "Estimate") -> None:
        """Take those of some receivers from another estimate."""
        self.irradiance[rows], self.stderr[rows] = other.irradiance, other.stderr
        if self.slope is not None:
            self.slope[rows] = other.slope


@dataclass(frozen=True)
class Irradiance:
    """What n receivers receive.

    Attributes
    ----------
    value : (n, 3) float32, W/m²
        Sum of the passes.
    stderr : (n,) float32, W/m²
        Estimated standard error of the indirect light's mean over colours; the radiance cache's own noise is not in it.
    passes : dict of str to (n, 3) float32, W/m²
        ``indirect`` and, where asked for, ``direct``.
    counts : dict of str to int
        What the bake did, for its report: photons, rays, elements.
    slope : (n, 3, 3) float32 or None, W/m²
        How the value changes with the normal, for each axis and colour: E(n') ≈ E + slope·(n' − n), by
        `normal_gradient`. None unless the receivers ask for it.
    gathered : (n,) bool or None
        Which receivers gathered by themselves; the others took their light from those. None: all did.
    caustics : (n, 3) float32 or None, W/m²
        The part of the indirect light that lamps send over mirrors and glass, where photons told it apart.
    own_rays : OwnRays or None
        Of those who gathered; None where light came in other ways, or to the pixels of a camera.
    """

    value: np.ndarray
    stderr: np.ndarray
    passes: dict[str, np.ndarray]
    counts: dict[str, int]
    slope: np.ndarray | None = None
    gathered: np.ndarray | None = None
    caustics: np.ndarray | None = None
    own_rays: OwnRays | None = None

    def where(self, rows: np.ndarray | slice) -> "Irradiance":
        """The light of some receivers, with the counts of all."""
        passes = {name: values[rows] for name, values in self.passes.items()}
        slope = None if self.slope is None else self.slope[rows]
        gathered = None if self.gathered is None else self.gathered[rows]
        caustics = None if self.caustics is None else self.caustics[rows]
        own = None if self.own_rays is None else self.own_rays.where(rows)
        return Irradiance(self.value[rows], self.stderr[rows], passes, self.counts, slope, gathered, caustics, own)

    @staticmethod
    def together(lights: "Sequence[Irradiance]") -> "Irradiance":
        """The light of several kinds of lights at the same receivers, whose errors are independent.

        Noise is taken out of each by itself, which alone asks for `caustics` and `own_rays`: they are left out.
        """
        first = lights[0]
        if len(lights) == 1:
            return first
        sums = {name: np.sum([light.passes[name] for light in lights], axis=0) for name in first.passes}
        counts = {name: sum(light.counts.get(name, 0) for light in lights) for name in first.counts}
        counts |= {name: first.counts[name] for name in _OF_ALL if name in first.counts}
        slopes = [light.slope for light in lights if light.slope is not None]
        return Irradiance(
            value=np.sum([light.value for light in lights], axis=0),
            stderr=np.sqrt(np.sum([light.stderr**2 for light in lights], axis=0)),
            passes=sums,
            counts=counts,
            slope=np.sum(slopes, axis=0) if slopes else None,
            gathered=first.gathered,
        )

    @staticmethod
    def mean(lights: "Sequence[Irradiance]") -> "Irradiance":
        """The mean light of the same receivers at several times, whose errors are independent.

        Only those who gathered at all times count as having gathered, and where they are few, none tell of own rays.
        """
        first, n = lights[0], np.float32(len(lights))
        if len(lights) == 1:
            return first

        def mean(values: "list[np.ndarray | None]") -> np.ndarray | None:
            found = [one for one in values if one is not None]
            return np.sum(found, axis=0, dtype=np.float32) / n if len(found) == len(lights) else None

        def error(values: list[np.ndarray]) -> np.ndarray:
            return np.sqrt(np.sum([one**2 for one in values], axis=0)) / n

        of_times = [light.gathered for light in lights if light.gathered is not None]
        gathered = np.logical_and.reduce(of_times) if len(of_times) == len(lights) else None
        own = [light.own_rays for light in lights if light.own_rays is not None]
        own_rays = None
        if gathered is not None and len(own) == len(lights) and 2 * gathered.sum() >= np.mean(np.sum(of_times, axis=1)):
            off = np.sum([one.off for one in own], axis=0) / n
            own_rays = OwnRays(off, error([one.stderr for one in own]), error([one.taken for one in own]))
        return Irradiance(
            value=np.sum([light.value for light in lights], axis=0) / n,
            stderr=error([light.stderr for light in lights]),
            passes={name: np.sum([light.passes[name] for light in lights], axis=0) / n for name in first.passes},
            counts=Irradiance.counted(lights),
            slope=mean([light.slope for light in lights]),
            gathered=gathered,
            caustics=mean([light.caustics for light in lights]),
            own_rays=own_rays,
        )

    @staticmethod
    def counted(lights: "Sequence[Irradiance]") -> dict[str, int]:
        """Counts of the light of the same receivers at several times."""
        first = lights[0].counts
        counts = {name: sum(light.counts.get(name, 0) for light in lights) for name in first}
        return counts | {name: first[name] for name in _OF_RECEIVERS if name in first}

    @staticmethod
    def join(parts: "list[Irradiance]", counts: dict[str, int]) -> "Irradiance":
        """The light of all receivers of several parts, in order, with the counts of all; without slopes."""
        value, stderr = (np.concatenate([getattr(part, name) for part in parts]) for name in ("value", "stderr"))
        passes = {name: np.concatenate([part.passes[name] for part in parts]) for name in parts[0].passes}
        gathered = None
        if any(part.gathered is not None for part in parts):
            gathered = np.concatenate(
                [np.ones(len(p.value), bool) if p.gathered is None else p.gathered for p in parts]
            )
        return Irradiance(value, stderr, passes, {**counts, "receivers": len(value)}, gathered=gathered)

    @property
    def interpolated(self) -> bool:
        """Whether most receivers took their light from others, so that noise is no finer than what light shows."""
        return self.gathered is not None and 2 * int(self.gathered.sum()) < len(self.gathered)

    @property
    def relative_noise(self) -> float:
        """Root mean square of the standard errors over the mean indirect irradiance; 0 where all is dark."""
        indirect = self.passes["indirect"]
        mean = float(indirect.mean(dtype=np.float64)) if indirect.size else 0.0
        return float(np.sqrt(np.mean(self.stderr.astype(np.float64) ** 2))) / mean if mean > 0 else 0.0
