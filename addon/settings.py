"""Every knob of a bake: unit, default, range and meaning, said once for the panel, the command line and the docs."""

from dataclasses import dataclass, field, fields, replace
from typing import Any, Literal, get_args

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
    n_gather_rays: int = _knob(512, 4, 65_536, "Rays that a receiver sends out in a final gather")
    n_cache_elements: int = _knob(
        120_000, 100, 10_000_000, "Most surface elements of the radiance cache; small gathers take fewer"
    )
    n_cache_rays: int = _knob(
        16, 0, 4096, "Rays that an element of the radiance cache gathers with; 0 trusts its photons"
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
    noise: float = _knob(
        0.0, 0.0, 1.0, "Relative noise at which the final gather stops adding rays; 0 sends Gather Rays and no more"
    )
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


_QUALITIES: dict[str, dict[str, Any]] = {
    "draft": {
        "gather": "light_volume",
        "n_photons": 600_000,
        "n_gather_rays": 128,
        "n_cache_elements": 30_000,
        "n_cache_rays": 4,
        "n_nearest": 100,
    },
    "medium": {},
    "high": {
        "n_photons": 4_000_000,
        "n_gather_rays": 4096,
        "n_cache_elements": 300_000,
        "n_cache_rays": 32,
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
