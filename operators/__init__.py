"""What people and scripts can do: one file an action."""

from typing import Any

import bpy

from ..addon.blender.read import render_graph
from ..addon.core.parallel import join_cancelled
from ..addon.ui.state import bake_state
from . import baked_light, export_gltf
from .bake_indirect import PHOTON_BAKE_OT_bake_indirect
from .cancel import PHOTON_BAKE_OT_cancel
from .command_line import command
from .compositor_pass import PHOTON_BAKE_OT_add_pass, PHOTON_BAKE_OT_remove_pass
from .export_gltf import PHOTON_BAKE_OT_export_gltf
from .guide import PHOTON_BAKE_OT_guide
from .jobs import kernels
from .jobs.folders import PHOTON_BAKE_OT_choose_folder
from .jobs.solving import stop_watched
from .live import PHOTON_BAKE_OT_live
from .refine import PHOTON_BAKE_OT_refine, PHOTON_BAKE_OT_restore_meshes, PhotonBakeObjectName
from .remedy import PHOTON_BAKE_OT_check, PHOTON_BAKE_OT_remedy, PHOTON_BAKE_OT_select_found
from .remove_copies import PHOTON_BAKE_OT_remove_copies
from .remove_playback import PHOTON_BAKE_OT_remove_playback
from .settings.add_preset import PHOTON_BAKE_OT_add_preset
from .settings.copy_object_settings import PHOTON_BAKE_OT_copy_object_settings
from .settings.reset_mixer import PHOTON_BAKE_OT_reset_mixer

CLASSES = (
    PHOTON_BAKE_OT_bake_indirect,
    PHOTON_BAKE_OT_cancel,
    PHOTON_BAKE_OT_choose_folder,
    *baked_light.CLASSES,
    PHOTON_BAKE_OT_export_gltf,
    PHOTON_BAKE_OT_add_pass,
    PHOTON_BAKE_OT_remove_pass,
    PHOTON_BAKE_OT_remove_copies,
    PHOTON_BAKE_OT_remove_playback,
    PhotonBakeObjectName,
    PHOTON_BAKE_OT_refine,
    PHOTON_BAKE_OT_restore_meshes,
    PHOTON_BAKE_OT_reset_mixer,
    PHOTON_BAKE_OT_check,
    PHOTON_BAKE_OT_select_found,
    PHOTON_BAKE_OT_remedy,
    PHOTON_BAKE_OT_add_preset,
    PHOTON_BAKE_OT_guide,
    PHOTON_BAKE_OT_live,
    PHOTON_BAKE_OT_copy_object_settings,
)


@bpy.app.handlers.persistent
def _before_load(*_: Any) -> None:
    join_cancelled()


def register() -> None:
    """Add the operators and the command."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.app.handlers.load_pre.append(_before_load)
    kernels.register()
    export_gltf.register()
    command.register()


def unregister() -> None:
    """Take them away again; a bake that runs is cancelled, and nothing of it is left."""
    kernels.unregister()
    bpy.app.handlers.load_pre.remove(_before_load)
    stop_watched()
    bake_state.cancel()  # one that a script runs
    bake_state.stop()
    join_cancelled()
    command.unregister()
    export_gltf.unregister()
    render_graph.unregister()
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
