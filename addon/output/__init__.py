"""What a bake leaves outside Blender: files, and what is printed."""

from .files import atomic_path, check_place, check_space, check_writable, file_name
from .hush import hushed
from .report import Report, peak_memory_mb

__all__ = [
    "Report",
    "atomic_path",
    "check_place",
    "check_space",
    "check_writable",
    "file_name",
    "hushed",
    "peak_memory_mb",
]
