"""Every knob of a bake: unit, default, range and meaning, said once for the panel, the command line and the docs."""

from dataclasses import dataclass, field, fields, replace
from typing import Any, Literal, get_args

import numpy as np

from .errors import BakeError

Gather = Literal["final", "density", "light_volume"]
TracerName = Literal["embree", "multi_image"]
Quality = Literal["draft", "medium", "high"]

CHOICES: dict[str, tuple[str, ...]] = {"gather": get_args(Gather), "tracer": get_args(TracerName)}
"""The knobs that are one of several names."""


def _knob(default: Any, low: float, high: float, meaning: str) -> Any:
    return field(default=default, metadata={"low": low, "high": high, "meaning": meaning})


@dataclass(frozen=True)
class BakeSettings:
    """How a bake is done; the defaults are quality Medium.

    Raises
    ------
    BakeError
        If a value is out of its range, naming the knob and the range.
    """

    gather: Gather = "final"
    tracer: TracerName = "embree"
    n_photons: int = _knob(1_000_000, 1_000, 1_000_000_000, "Photons emitted by all lights together")
    max_bounces: int = _knob(32, 1, 1024, "Surfaces a photon may hit before it is dropped")
    n_gather_rays: int = _knob(256, 4, 65_536, "Rays that a point sends out in a final gather, on the average")
    n_cache_elements: int = _knob(60_000, 100, 10_000_000, "Surface elements of the radiance cache")
    n_cache_rays: int = _knob(
        4, 0, 4096, "Rays that an element of the radiance cache gathers with; 0 trusts its photons"
    )
    n_nearest: int = _knob(200, 8, 4096, "Photons that a density estimate looks for")
    max_radius: float = _knob(
        0.0, 0.0, 1e6, "Farthest that a density estimate looks, in metres; 0 finds it from the photons' density"
    )
    n_grid_cells: int = _knob(48, 4, 256, "Cells of the light volume along its longest side")
    n_volume_rays: int = _knob(
        32, 0, 4096, "Rays that each cell of surface gathers the light volume's light with; 0 fills it with photons"
    )
    n_maps: int = _knob(27, 1, 1000, "Cube maps that photons are traced through with Multi-Image")
    map_size: int = _knob(64, 8, 1024, "Texels along a side of a cube map's faces, a power of two")
    interpolate: bool = field(
        default=True, metadata={"meaning": "Gather at few points where light changes slowly, and interpolate the rest"}
    )
    noise: float = _knob(
        0.0,
        0.0,
        1.0,
        "Relative noise to reach: the final gather adds rays where they are needed; 0 sends Gather Rays and no more",
    )
    time: float = _knob(
        0.0,
        0.0,
        1e6,
        "Seconds that a final gather may take, photons and all, for the best light in that time; 0: no limit",
    )
    memory: int = _knob(4000, 100, 10_000_000, "Megabytes that the bake's working arrays may take")
    add_direct: bool = field(default=False, metadata={"meaning": "Add the light that comes straight from the lights"})
    seed: int = _knob(0, 0, 2**31 - 1, "The same seed gives the same light, whatever the number of threads")
    n_threads: int = _knob(0, 0, 1024, "Threads; 0 takes every core")

    def __post_init__(self) -> None:
        for name, choices in CHOICES.items():
            if getattr(self, name) not in choices:
                raise BakeError(f"{name} is {getattr(self, name)!r}; choose one of {', '.join(choices)}.")
        if self.map_size & (self.map_size - 1):
            raise BakeError(f"map_size is {self.map_size}; choose a power of two.")
        for knob in fields(self):
            value = getattr(self, knob.name)
            if "low" in knob.metadata and not knob.metadata["low"] <= value <= knob.metadata["high"]:
                low, high = knob.metadata["low"], knob.metadata["high"]
                raise BakeError(f"{knob.name} is {value}; choose a value from {low:g} to {high:g}.")

    @property
    def needs_cache(self) -> bool:
        """Whether rays gather from a radiance cache."""
        return self.gather == "final" or (self.gather == "light_volume" and self.n_volume_rays > 0)


_PHOTON_TIME = 0.15  # of the time there is


def affordable(settings: BakeSettings, photons_a_second: float) -> BakeSettings:
    """The settings with as many photons and elements as suit their `time`, half the gather rays coming in turns.

    The elements' noise falls with their number of photons, and what they blur with their size: both follow √n.
    """
    low, high = settings_for("draft"), settings_for("high")
    n_photons = int(np.clip(_PHOTON_TIME * settings.time * photons_a_second, 1_000, high.n_photons))
    n_elements = int(high.n_cache_elements * (n_photons / high.n_photons) ** 0.5)
    return replace(settings, n_photons=n_photons, n_cache_elements=n_elements, n_gather_rays=low.n_gather_rays)


_QUALITIES: dict[str, dict[str, Any]] = {
    "draft": {
        "n_photons": 300_000,
        "n_gather_rays": 64,
        "n_cache_elements": 20_000,
        "n_cache_rays": 0,
        "n_nearest": 100,
    },
    "medium": {},
    "high": {
        "n_photons": 4_000_000,
        "n_gather_rays": 2048,
        "n_cache_elements": 240_000,
        "n_cache_rays": 16,
        "n_nearest": 400,
    },
}


def settings_for(quality: Quality, **changes: Any) -> BakeSettings:
    """The settings of a quality preset, with `changes` on top.

    Raises
    ------
    BakeError
        If there is no such quality, or a change is out of its range.
    """
    if quality not in _QUALITIES:
        raise BakeError(f"quality is {quality!r}; choose one of {', '.join(_QUALITIES)}.")
    return replace(BakeSettings(), **{**_QUALITIES[quality], **changes})
