"""What a bake leaves outside Blender: files, and what is printed."""

from .files import atomic_path, check_place, check_space, check_writable
from .hush import hushed
from .report import Report, peak_memory_mb

__all__ = ["Report", "atomic_path", "check_place", "check_space", "check_writable", "hushed", "peak_memory_mb"]
