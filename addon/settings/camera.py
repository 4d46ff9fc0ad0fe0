"""Every knob of a camera's pass, said once for the panel, the command line and the docs."""

from dataclasses import dataclass
from typing import Literal, get_args

from ..core.errors import BakeError
from ..core.parameters import check_knobs, knob

PassDenoiser = Literal["auto", "oidn", "none"]
Precision = Literal["half", "float"]
Compression = Literal["none", "rle", "zips", "zip", "piz", "dwaa", "dwab"]

PASS_CHOICES: dict[str, tuple[str, ...]] = {
    "pass_denoiser": get_args(PassDenoiser),
    "precision": get_args(Precision),
    "compression": get_args(Compression),
}
"""The knobs that are one of several names."""

PASS_FOLDER = "passes"
"""Where files go that nobody gave a folder for: beside the .blend file."""


@dataclass(frozen=True)
class CameraSettings:
    """How a camera's pass is sampled and written.

    Raises
    ------
    BakeError
        If a value is out of its range, naming the knob and the range.
    """

    n_pixel_samples: int = knob(8, "Rays through a pixel with an edge in it; half as many go through others", 1, 1024)
    n_gloss_rays: int = knob(32, "Rays of a pixel that is all gloss; others send fewer in proportion", 2, 4096)
    n_media_rays: int = knob(16, "Rays of a pixel before which there are volumes, for what these scatter", 2, 4096)
    pass_denoiser: PassDenoiser = "auto"
    file_name: str = knob(
        "{file}_{scene}_indirect_####",
        "Name of the files, # standing for the digits of the frame, {file} for the .blend file's name and {scene} for "
        "the scene's",
    )
    precision: Precision = "half"
    compression: Compression = "zip"

    def __post_init__(self) -> None:
        check_knobs(self, PASS_CHOICES)
        if not self.file_name.strip("#") and "#" not in self.file_name:
            raise BakeError("The files of the camera's pass have no name: give one, such as indirect_####.")
        if any(sign in self.file_name for sign in '/\\:*?"<>|'):
            raise BakeError(f"The file name {self.file_name!r} holds a sign that no file name may hold.")
