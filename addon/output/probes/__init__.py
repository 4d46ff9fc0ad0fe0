"""Probes as files: a JSON file with all that is known of them, and three OpenEXR volumes of each grid."""

from .axes import LitProbes, in_axes
from .filling import filled
from .json_file import write_probe_file
from .volumes import VOLUME_COLORS, volume_channels, write_volume

__all__ = [
    "VOLUME_COLORS",
    "LitProbes",
    "filled",
    "in_axes",
    "volume_channels",
    "write_probe_file",
    "write_volume",
]
