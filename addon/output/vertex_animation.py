"""Light at vertices over time, as one image: a vertex animation texture.

An object's elements (vertices or corners, in the mesh's order) of one frame fill `rows` rows of `width` pixels from
left to right and top to bottom; the frames follow each other from the top. Element i of frame f is at column i mod
width, row f · rows + ⌊i / width⌋; what is left of a frame's last row is black.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..core.errors import BakeError
from .exr import write_exr

_WIDEST = 4096
_HIGHEST = 65_000
"""Rows of an image that Blender opens."""

LAYOUT = "PhotonBakeLayout"


@dataclass(frozen=True)
class AnimationLayout:
    """Where in the image the light of elements is.

    Attributes
    ----------
    n_elements, n_frames : int
    width : int
        Pixels; a power of 2 where a frame has several rows.
    rows : int
        Of a frame.
    """

    n_elements: int
    n_frames: int

    @property
    def width(self) -> int:
        return max(min(self.n_elements, _WIDEST), 1)

    @property
    def rows(self) -> int:
        return max(-(-self.n_elements // self.width), 1)

    @property
    def height(self) -> int:
        return self.rows * self.n_frames

    def check(self, name: str) -> None:
        """See that Blender opens the image of an object of this name.

        Raises
        ------
        BakeError
            If it is too high.
        """
        if self.height > _HIGHEST:
            raise BakeError(
                f"The image with the light of object '{name}' would have {self.height:,} rows, of which Blender opens "
                f"{_HIGHEST:,}: bake at most {_HIGHEST // self.rows:,} frames at a time."
            )

    def image(self, frames: np.ndarray) -> np.ndarray:
        """The pixels (height, width, 3) of values (n_frames, n_elements, 3) float32."""
        image = np.zeros((self.n_frames, self.rows * self.width, 3), np.float32)
        image[:, : self.n_elements] = frames
        return image.reshape(self.height, self.width, 3)


def write_vertex_animation(path: Path, frames: np.ndarray, first: float, step: float, domain: str) -> None:
    """Write light (f, e, 3) float32 of an object's elements at f frames as an OpenEXR file of 32-bit channels.

    Raises
    ------
    BakeError
        If the file cannot be written.
    """
    layout = AnimationLayout(frames.shape[1], frames.shape[0])
    image = layout.image(frames)
    metadata: dict[str, str | int | float] = {
        LAYOUT: "elements x frames, from the top left",
        "Elements": layout.n_elements,
        "Domain": domain,
        "RowsOfFrame": layout.rows,
        "FirstFrame": float(first),
        "FrameStep": float(step),
    }
    write_exr(path, {name: image[..., i] for i, name in enumerate("RGB")}, metadata, half=False)
