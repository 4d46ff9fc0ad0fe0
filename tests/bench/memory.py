"""Memory that a call takes at its most, on Linux."""

import sys
from pathlib import Path

from photon_bake.addon.output.report import peak_memory_mb


def extra_memory(function):
    """What a function returns, and the most memory that it took on top of what there was, MB; None if unknown."""
    if sys.platform != "linux":
        return function(), None
    Path("/proc/self/clear_refs").write_text("5")  # the peak starts again from what is held now
    before = peak_memory_mb()
    result = function()
    return result, peak_memory_mb() - before
