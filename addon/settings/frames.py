"""Which frames of an animation are baked."""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal, get_args

from ..core.errors import BakeError

Keeping = Literal["texture", "attributes"]
"""How vertices keep the light of several frames: in an image that a modifier plays back, or an attribute each."""

KEEPINGS: tuple[Keeping, ...] = get_args(Keeping)

PLAYBACK_FOLDER = "playback"
"""Where images of vertices' light go that nobody gave a folder for: beside the .blend file."""

_MOST = 1_000_000
_SLACK = 1e-6  # of a step, by which the last frame may be missed


@dataclass(frozen=True)
class Frames:
    """Frames from `first` on, a step apart, up to `last`.

    Raises
    ------
    BakeError
        If there are none, or more than a million.
    """

    first: int
    last: int
    step: float = 1.0

    def __post_init__(self) -> None:
        if self.last < self.first or not self.step > 0:
            raise BakeError(f"{self} holds no frames: give the first, the last, and a step above 0.")
        if (self.last - self.first) / self.step >= _MOST:
            raise BakeError(f"{self} holds more than {_MOST:,} frames: give fewer, or a longer step.")

    @cached_property
    def times(self) -> list[float]:
        """The frames, in order; with a fraction where they are subframes."""
        n = int((self.last - self.first) / self.step + _SLACK) + 1
        return [round(self.first + i * self.step, 6) for i in range(n)]

    def __len__(self) -> int:
        return len(self.times)

    @property
    def whole(self) -> bool:
        """Whether there are no subframes."""
        return self.step == int(self.step)

    @property
    def gap(self) -> int:
        """Whole frames from one to the next."""
        return int(self.step)

    def nearest(self, frame: float) -> int:
        """Which of them is shown at a frame: the last one before it, or the first."""
        return min(max(int((frame - self.first) / self.step + _SLACK), 0), len(self) - 1)

    def __str__(self) -> str:
        return f"{self.first}-{self.last}" + (f":{self.step:g}" if self.step != 1 else "")


def parse_frames(text: str) -> Frames:
    """``A``, ``A-B`` or ``A-B:STEP`` as frames; frames may be negative.

    Raises
    ------
    BakeError
        If it is something else.
    """
    span, _, step = text.partition(":")
    first, _, last = span[1:].partition("-")
    first = span[:1] + first
    try:
        return Frames(int(first), int(last or first), float(step or 1))
    except ValueError as error:
        raise BakeError(f"{text!r} are no frames; give A-B or A-B:STEP, such as 1-24 or 1-24:2") from error


def frame_label(time: float) -> str:
    """A frame in names: ``0007``, and of subframes ``0007.25``."""
    whole = int(time // 1)
    fraction = f"{time - whole:.6f}".rstrip("0")[1:]
    return f"{whole:04d}" + ("" if fraction == "." else fraction)
