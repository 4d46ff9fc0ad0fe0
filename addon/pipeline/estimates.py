"""How long a bake takes and how much memory, from counts that are known before it.

The terms were fitted to bakes of `tests/bench/estimates.py`, in seconds of one core; the last bakes on this machine say
how much faster or slower it is, and its scenes.
"""

from dataclasses import dataclass
from math import log

from ..settings.bake import BakeSettings, part_of_shutter


@dataclass(frozen=True)
class Work:
    """Counts of a bake.

    Attributes
    ----------
    n_triangles, n_receivers, n_texels, n_pixels : int
    """

    n_triangles: int
    n_receivers: int = 0
    n_texels: int = 0
    n_pixels: int = 0

    @property
    def n_points(self) -> int:
        """All that want light."""
        return self.n_receivers + self.n_texels + self.n_pixels


@dataclass(frozen=True)
class Estimate:
    """Seconds and megabytes."""

    seconds: float
    megabytes: float

    @property
    def line(self) -> str:
        """As far as it can be trusted: ``about 20 s, 0.8 GB``."""
        return f"about {rounded_time(self.seconds)}, {self.megabytes / 1000:.1f} GB"


TERMS: dict[str, float] = {
    "start": 1.1,
    "triangles": 1e-05,
    "photons": 3.7e-06,
    "elements": 2e-05,
    "element rays": 8.7e-06,
    "gather rays": 1.6e-06,
    "texels": 1.3e-05,
    "pixels": 1e-05,
    "nearest photons": 3.1e-07,
    "cell rays": 0.0001,
}
"""Seconds of one core that one of each takes."""

_MEGABYTES = {"start": 100.0, "photons": 250e-6, "points": 500e-6, "triangles": 1e-3, "elements": 1e-3}
"""Megabytes that one of each takes."""

_GATHERING, _GATHERING_PIXELS = 28.0, 5.0
"""Of n vertices or texels 28 √n gather, where that is fewer, and of n pixels 5 √n: light is interpolated between."""


def terms_of(work: Work, settings: BakeSettings) -> list[float]:
    """How many of each of `TERMS` a bake has."""
    final, volume = settings.gather == "final", settings.gather == "light_volume"
    n_elements = settings.n_cache_elements if settings.needs_cache else 0
    n_gathering = float(work.n_points)
    if settings.interpolate:
        on_objects = work.n_receivers + work.n_texels
        n_gathering = min(on_objects, _GATHERING * on_objects**0.5) + _GATHERING_PIXELS * work.n_pixels**0.5
    counts = {
        "start": 1,
        "triangles": work.n_triangles,
        "photons": settings.n_photons,
        "elements": n_elements,
        "element rays": n_elements * settings.n_cache_rays,
        "gather rays": n_gathering * settings.n_gather_rays * final,
        "texels": work.n_texels,
        "pixels": work.n_pixels,
        "nearest photons": work.n_points * settings.n_nearest * (settings.gather == "density"),
        "cell rays": settings.n_grid_cells**2 * settings.n_volume_rays * volume,
    }
    return [float(counts[name]) for name in TERMS]


def estimate(work: Work, settings: BakeSettings, n_cores: int, pace: float = 1.0) -> Estimate:
    """What a bake takes.

    Parameters
    ----------
    work : Work
    settings : BakeSettings
    n_cores : int
    pace : float
        How many times as long the last bakes took as was foretold.
    """
    n_steps, of_step = max(1, settings.motion_blur), part_of_shutter(settings, 0)
    core_seconds = sum(n_steps * n * each for n, each in zip(terms_of(work, of_step), TERMS.values(), strict=True))
    seconds = pace * core_seconds / min(settings.n_threads or n_cores, n_cores)
    if settings.gather == "final" and settings.time:
        seconds = max(settings.time, seconds / 4)
    counts = {"start": 1, "photons": settings.n_photons, "points": work.n_points, "triangles": work.n_triangles}
    counts["elements"] = settings.n_cache_elements if settings.needs_cache else 0
    return Estimate(seconds, sum(n * _MEGABYTES[name] for name, n in counts.items()))


_LADDER = (1, 2, 3, 5, 7, 10, 15, 20, 30, 45)
"""Numbers that a guess is rounded to."""


def rounded_time(seconds: float) -> str:
    """A time that is only guessed: ``5 s``, ``20 s``, ``3 min``, ``2 h``."""
    unit, name = (1, "s") if seconds < 53 else (60, "min") if seconds < 3200 else (3600, "h")
    n = max(seconds / unit, 1.0)
    return f"{min(_LADDER, key=lambda step: abs(log(step / n))) if n < 53 else round(n)} {name}"
