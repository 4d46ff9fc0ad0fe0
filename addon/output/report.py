"""What a bake did, for scripts and for comparing bakes: a JSON file."""

import json
import sys
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

from ..core.errors import WarningKind, kind_of
from .files import atomic_path

Status = Literal["done", "failed", "cancelled"]


@dataclass
class Report:
    """What is known of a bake; fields that it did not come to keep their defaults.

    Attributes
    ----------
    status : 'done', 'failed' or 'cancelled'
    message : str
        One sentence; for a failure what was wrong and the remedy.
    scene : str
        Path of the .blend file, empty if it was never saved.
    saved : str
        Path of the .blend file that the light was saved to, empty if it was not.
    attribute : str
        Name of the colour attribute; empty where none was asked for.
    light_group : str
        Whose light alone was baked; empty for all light.
    light_groups : bool
        Whether light groups were baked apart too.
    objects : list of str
        Objects that got light.
    files : list of str
        Paths of the images that were written.
    settings : dict
        Every parameter of `BakeSettings`.
    lightmap_settings : dict
        Every parameter of `LightmapSettings`; empty where no lightmaps were asked for.
    camera_settings : dict
        Every parameter of `CameraSettings`; empty where no camera's pass was asked for.
    probe_settings : dict
        Every parameter of `ProbeSettings`; empty where no probes were asked for.
    stage_seconds : dict of str to float, s
        In the stages' order.
    total_seconds : float, s
    compile_seconds : float, s
        Of them, those in which kernels were compiled.
    counts : dict of str to int
        Triangles, receivers, photons, rays, as far as the bake counted them.
    relative_noise : float or None
        `Irradiance.relative_noise`.
    peak_memory_mb : float or None, MB
        Most memory the process held, Blender's own included; None where the system does not tell.
    versions : dict of str to str
    warnings : list of str
    warning_kinds : list of str
        What each of them is about: 'difference' of light from Cycles', 'missing' file, or 'advice'.
    """

    status: Status = "failed"
    message: str = ""
    scene: str = ""
    saved: str = ""
    attribute: str = ""
    light_group: str = ""
    light_groups: bool = False
    objects: list[str] = field(default_factory=list)
    files: list[str] = field(default_factory=list)
    settings: dict[str, Any] = field(default_factory=dict)
    lightmap_settings: dict[str, Any] = field(default_factory=dict)
    camera_settings: dict[str, Any] = field(default_factory=dict)
    probe_settings: dict[str, Any] = field(default_factory=dict)
    stage_seconds: dict[str, float] = field(default_factory=dict)
    total_seconds: float = 0.0
    compile_seconds: float = 0.0
    counts: dict[str, int] = field(default_factory=dict)
    relative_noise: float | None = None
    peak_memory_mb: float | None = None
    versions: dict[str, str] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)

    @property
    def warning_kinds(self) -> list[WarningKind]:
        return [kind_of(warning) for warning in self.warnings]

    def write(self, path: Path) -> None:
        """Write the report to `path` as JSON, whole or not at all.

        Raises
        ------
        OSError
            If the file cannot be written.
        """
        with atomic_path(path) as temporary:
            fields = {**asdict(self), "warning_kinds": self.warning_kinds}
            text = json.dumps(fields, indent=2, default=_plain, allow_nan=False)
            temporary.write_text(text + "\n", encoding="utf-8")


def _plain(number: Any) -> Any:
    """NumPy's numbers as Python's, which is all that JSON knows."""
    return number.item()


def peak_memory_mb() -> float | None:
    """Most memory that this process has held so far, MB (10⁶ bytes); None where the system does not tell."""
    if sys.platform == "linux":  # getrusage would also count the process that started this one
        for line in Path("/proc/self/status").read_text().splitlines():
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) * 1024 / 1e6
        return None
    if sys.platform == "win32":
        return _windows_peak_bytes() / 1e6
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6


def _windows_peak_bytes() -> int:
    """PROCESS_MEMORY_COUNTERS.PeakWorkingSetSize of this process."""
    import ctypes
    from ctypes import wintypes

    class Counters(ctypes.Structure):
        _fields_ = [("cb", wintypes.DWORD), ("faults", wintypes.DWORD)] + [
            (name, ctypes.c_size_t) for name in ("peak", "now", "a", "b", "c", "d", "e", "f")
        ]

    counters = Counters(cb=ctypes.sizeof(Counters))
    kernel32 = ctypes.WinDLL("kernel32")  # type: ignore[attr-defined]
    kernel32.GetCurrentProcess.restype = wintypes.HANDLE
    query = kernel32.K32GetProcessMemoryInfo
    query.argtypes = [wintypes.HANDLE, ctypes.POINTER(Counters), wintypes.DWORD]
    query(kernel32.GetCurrentProcess(), ctypes.byref(counters), counters.cb)
    return int(counters.peak)
