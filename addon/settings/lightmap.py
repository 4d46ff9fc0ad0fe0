"""Every knob of lightmaps, said once for the panel, the command line and the docs."""

from dataclasses import dataclass
from typing import Literal, get_args

from ..core.parameters import Zero, check_knobs, knob

AtlasKind = Literal["auto", "per_object", "shared"]
LightmapFormat = Literal["exr_half", "exr_float", "hdr", "rgbm", "rgbd"]
DenoiserName = Literal["auto", "oidn", "own", "none"]

LIGHTMAP_CHOICES: dict[str, tuple[str, ...]] = {
    "atlas": get_args(AtlasKind),
    "file_format": get_args(LightmapFormat),
    "denoiser": get_args(DenoiserName),
}
"""The knobs that are one of several names."""

LARGEST_SIZE = 16_384

LIGHTMAP_FOLDER = "lightmaps"
"""Where files go that nobody gave a folder for: beside the .blend file."""

MADE_UV_MAP = "Photon Bake"
"""Name of the UV map that is made where none is chosen; one of that name is made anew in each bake."""


@dataclass(frozen=True)
class LightmapSettings:
    """How lightmaps are laid out and written.

    Raises
    ------
    BakeError
        If a value is out of its range, naming the knob and the range.
    """

    atlas: AtlasKind = "auto"
    uv_map: str = knob("", f"UV map that is used as it lies; empty: one is made, named {MADE_UV_MAP}")
    density: float = knob(16.0, "Texels per meter, where no Size is given", 0.01, 4096.0, "texels/m")
    size: int = knob(
        0,
        "Texels along a side of every image, filled",
        0,
        LARGEST_SIZE,
        "px",
        Zero("Auto", "takes as many as Density asks for", 1024),
    )
    max_size: int = knob(2048, "Most texels along a side that Density may ask for", 16, LARGEST_SIZE, "px")
    padding: int = knob(0, "Mip level down to which charts stay apart: 2^level texels lie around each", 0, 6)
    file_format: LightmapFormat = "exr_half"
    value_range: float = knob(8.0, "Brightest light that RGBM and RGBD can store", 0.01, 1e6)
    denoiser: DenoiserName = "auto"
    directional: bool = knob(False, "Four more images each, that shaders with normal maps read the light from")

    def __post_init__(self) -> None:
        check_knobs(self, LIGHTMAP_CHOICES)

    @property
    def ring(self) -> int:
        """Texels around each chart that belong to no other: what a bilinear look-up at the padding's level reaches."""
        return 1 << self.padding
