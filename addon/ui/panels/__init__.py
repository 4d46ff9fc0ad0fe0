"""The Photon Bake tab of the 3D View's sidebar, one file a panel."""

import bpy

from . import entries
from .bake import PHOTON_BAKE_PT_bake
from .light import PHOTON_BAKE_PT_light
from .live import PHOTON_BAKE_PT_live
from .outputs.camera import PHOTON_BAKE_PT_camera
from .outputs.lightmaps import PHOTON_BAKE_PT_lightmaps
from .outputs.probes import PHOTON_BAKE_PT_probes
from .outputs.vertices import PHOTON_BAKE_PT_vertices
from .presets import PHOTON_BAKE_PT_presets
from .sampling import PHOTON_BAKE_PT_sampling
from .views import PHOTON_BAKE_PT_debug_views

CLASSES = (
    PHOTON_BAKE_PT_presets,
    PHOTON_BAKE_PT_bake,
    PHOTON_BAKE_PT_vertices,
    PHOTON_BAKE_PT_lightmaps,
    PHOTON_BAKE_PT_camera,
    PHOTON_BAKE_PT_probes,
    PHOTON_BAKE_PT_sampling,
    PHOTON_BAKE_PT_light,
    PHOTON_BAKE_PT_live,
    PHOTON_BAKE_PT_debug_views,
)
"""In the order in which the tab shows them."""


def register() -> None:
    """Add the panels."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    entries.register()


def unregister() -> None:
    """Take them away again."""
    entries.unregister()
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
