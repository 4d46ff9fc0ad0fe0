"""How much work the bake puts in."""

from typing import Any

import bpy

from ...settings.bake import Gather, TracerName
from .tab import Section, draw_knobs, settings_column

_GATHER_KNOBS: dict[Gather, list[str]] = {
    "final": ["n_gather_rays", "gather_share", "interpolate", "noise", "time", "n_cache_elements", "n_cache_rays"],
    "density": ["n_nearest", "max_radius"],
    "light_volume": ["n_grid_cells", "n_volume_rays"],
    "photon_volumes": ["subsample"],
}
_TRACER_KNOBS: dict[TracerName, list[str]] = {"embree": [], "multi_image": ["n_maps", "map_size"]}


class PHOTON_BAKE_PT_sampling(Section, bpy.types.Panel):
    """How much work the bake puts in."""

    bl_label = "Sampling"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: Any) -> None:
        properties = context.scene.photon_bake
        column = settings_column(self.layout)
        groups = (
            ["gather", "n_photons", "max_bounces", *_GATHER_KNOBS[properties.gather]],
            ["tracer", *_TRACER_KNOBS[properties.tracer]],
            ["seed", "n_threads", "memory"],
        )
        for i, names in enumerate(groups):
            if i:
                column.separator()
            draw_knobs(column, properties, *names)
