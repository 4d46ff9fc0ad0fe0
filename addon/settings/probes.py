"""Every knob of probes, said once for the panel, the command line and the docs."""

from dataclasses import dataclass
from typing import Literal, get_args

from ..core.parameters import check_knobs, knob

Harmonics = Literal["l1", "l2"]
Axes = Literal["blender", "gltf"]

PROBE_CHOICES: dict[str, tuple[str, ...]] = {"harmonics": get_args(Harmonics), "axes": get_args(Axes)}
"""The knobs that are one of several names."""

PROBE_FOLDER = "probes"
"""Where files go that nobody gave a folder for: beside the .blend file."""


@dataclass(frozen=True)
class ProbeSettings:
    """Where probes lie, how they are lit and written.

    Raises
    ------
    BakeError
        If a value is out of its range, naming the knob and the range.
    """

    place: str = knob(
        "",
        "Object or collection that says where probes lie: a light probe volume, an empty, or anything whose bounds "
        "they fill; empty: the scene's light probe volumes, or else the bounds of all that is baked",
    )
    spacing: float = knob(
        1.0, "Meters between probes that fill bounds; light probe volumes have a resolution of their own", 0.01, 1e4
    )
    max_probes: int = knob(4096, "Probes that fill bounds at most: more of them lie further apart", 1, 1_000_000)
    n_probe_rays: int = knob(1024, "Rays that each probe looks around with", 64, 65_536)
    harmonics: Harmonics = "l1"
    axes: Axes = "blender"

    def __post_init__(self) -> None:
        check_knobs(self, PROBE_CHOICES)
