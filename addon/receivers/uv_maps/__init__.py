"""UV maps made for lightmaps: faces laid flat in charts, and charts packed into images.

All of it is NumPy in bounded steps, between which `Progress` is asked, so that a bake can be cancelled at any time.
"""

from .faces import Faces, areas
from .packing import BLOCK, Packed, Piece, PiecesAt, fill, pack, whole_blocks
from .unwrap import unwrapped

__all__ = [
    "BLOCK",
    "Faces",
    "Packed",
    "Piece",
    "PiecesAt",
    "areas",
    "fill",
    "pack",
    "unwrapped",
    "whole_blocks",
]
