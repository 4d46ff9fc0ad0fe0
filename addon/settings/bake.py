"""Every knob of a bake: unit, default, range and meaning, said once for the panel, the command line and the docs."""

from dataclasses import dataclass, replace
from typing import Any, Literal, get_args

import numpy as np

from ..core.errors import BakeError
from ..core.parameters import Zero, check_knobs, knob

Gather = Literal["final", "density", "light_volume", "photon_volumes"]
TracerName = Literal["embree", "multi_image"]
Quality = Literal["draft", "medium", "high"]

CHOICES: dict[str, tuple[str, ...]] = {"gather": get_args(Gather), "tracer": get_args(TracerName)}
"""The knobs that are one of several names."""


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
    n_photons: int = knob(1_000_000, "Photons emitted by all lights together", 1_000, 1_000_000_000)
    max_bounces: int = knob(32, "Surfaces a photon may hit before it is dropped", 1, 1024)
    n_gather_rays: int = knob(256, "Rays that a point sends out in a final gather, on the average", 4, 65_536)
    gather_share: float = knob(
        1.0,
        "Share of the vertices or texels that there are Gather Rays for, where many small things leave nothing to "
        "interpolate: below 1 they get fewer each",
        0.0,
        1.0,
        "%",
    )
    n_cache_elements: int = knob(60_000, "Surface elements of the radiance cache", 100, 10_000_000)
    n_cache_rays: int = knob(
        4,
        "Rays that an element of the radiance cache gathers with",
        0,
        4096,
        zero=Zero("Off", "trusts its photons", 4),
    )
    n_nearest: int = knob(200, "Photons that a density estimate looks for", 8, 4096)
    max_radius: float = knob(
        0.0,
        "Farthest that a density estimate looks, in meters",
        0.0,
        1e6,
        "m",
        Zero("Auto", "finds it from the photons' density", 0.5),
    )
    n_grid_cells: int = knob(48, "Cells of the light volume along its longest side", 4, 256)
    n_volume_rays: int = knob(
        32,
        "Rays that each cell of surface gathers the light volume's light with",
        0,
        4096,
        zero=Zero("Off", "fills it with photons", 32),
    )
    subsample: int = knob(
        4, "Photon volumes light the pixels of every so many-th row and column, between which others interpolate", 1, 64
    )
    n_maps: int = knob(27, "Cube maps that photons are traced through with Multi-Image", 1, 1000)
    map_size: int = knob(64, "Texels along a side of a cube map's faces, a power of two", 8, 1024, "px")
    interpolate: bool = knob(True, "Gather at few points where light changes slowly, and interpolate the rest")
    noise: float = knob(
        0.0,
        "Relative noise to reach: the final gather adds rays where they are needed",
        0.0,
        1.0,
        "%",
        Zero("Off", "sends Gather Rays and no more", 0.05),
    )
    time: float = knob(
        0.0,
        "Seconds a frame for a final gather to find the best light in; what each point needs at least may take longer",
        0.0,
        1e6,
        "s",
        Zero("Off", "takes as long as the other settings need", 60),
    )
    memory: int = knob(4000, "Megabytes that the bake's working arrays may take", 100, 10_000_000, "MB")
    motion_blur: int = knob(
        0,
        "Steps in which light is averaged over the time that the shutter is open, for what moves",
        0,
        256,
        zero=Zero("Off", "takes the scene as it stands", 8),
    )
    add_direct: bool = knob(False, "Add the light that comes straight from the lights")
    open_side: bool = knob(
        False,
        "Where a surface's front is shut by another one or sees none, take the light of its back if that is brighter",
    )
    normal_maps: bool = knob(
        False,
        "Light the normals of the surfaces' own normal maps and bumps, as Cycles' bake does, and not those of the mesh",
    )
    seed: int = knob(0, "The same seed gives the same light, whatever the number of threads", 0, 2**31 - 1)
    n_threads: int = knob(0, "Threads that work", 0, 1024, zero=Zero("Auto", "takes every core", 4))

    def __post_init__(self) -> None:
        check_knobs(self, CHOICES)
        if self.map_size & (self.map_size - 1):
            raise BakeError(f"map_size is {self.map_size}; choose a power of two.")

    @property
    def needs_cache(self) -> bool:
        """Whether rays gather from a radiance cache."""
        return self.gather == "final" or (self.gather == "light_volume" and self.n_volume_rays > 0)

    @property
    def smooth(self) -> bool:
        """Whether neighbouring receivers' noise is alike, as they share what was gathered."""
        if self.gather == "final":
            return self.interpolate
        return self.gather in {"light_volume", "photon_volumes"}


def part_of_shutter(settings: BakeSettings, step: int) -> BakeSettings:
    """What one step of the shutter's time gets: of photons, rays and time its share, and random numbers of its own.

    The mean over n steps has then about the error of one bake with all of it: errors fall with the root of the number.
    """
    n = max(settings.motion_blur, 1)
    of_settings = {name: getattr(settings, name) for name in _LEAST_SHARES}
    shares = {name: max(min(whole, _LEAST_SHARES[name]), -(-whole // n)) for name, whole in of_settings.items()}
    seed = (settings.seed + step * _STRIDE) % 2**31
    return replace(settings, **shares, seed=seed, time=settings.time / n, noise=min(1.0, settings.noise * n**0.5))


_LEAST_SHARES = {"n_photons": 1000, "n_gather_rays": 64, "n_cache_rays": 1, "n_volume_rays": 4, "n_nearest": 8}
"""What a step gets at least, if there is as much: of fewer gather rays too little is known of what is near."""

_STRIDE = 0x2545F491  # between the seeds of steps


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
        "gather_share": 0.25,
        "n_cache_elements": 20_000,
        "n_cache_rays": 0,
        "n_nearest": 100,
        "subsample": 8,
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
