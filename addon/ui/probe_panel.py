"""The panel's part on probes."""

from typing import Any


def draw_probes(column: Any, properties: Any) -> None:
    """Where probes lie, and how they are lit and written."""
    probes = properties.probes
    column.prop(probes, "folder")
    column.prop(probes, "place")
    for name in ("spacing", "max_probes", "n_probe_rays", "harmonics", "axes"):
        column.prop(probes, name)
