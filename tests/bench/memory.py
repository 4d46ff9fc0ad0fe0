"""Memory that a call takes at its most, on Linux."""

import ctypes
import gc
import sys
from pathlib import Path

from photon_bake.addon.output import peak_memory_mb


def extra_memory(function):
    """What a function returns, and the most memory that it took on top of what there was, MB; None if unknown."""
    if sys.platform != "linux":
        return function(), None
    gc.collect()
    ctypes.CDLL(None).malloc_trim(0)  # what earlier calls freed would count as there
    Path("/proc/self/clear_refs").write_text("5")  # the peak starts again from what is held now
    before = peak_memory_mb()
    result = function()
    return result, peak_memory_mb() - before
