"""What a bake leaves outside Blender: files."""

from .files import atomic_path, check_place, check_space, check_writable
from .report import Report, peak_memory_mb

__all__ = ["Report", "atomic_path", "check_place", "check_space", "check_writable", "peak_memory_mb"]
