"""Add Pass, Remove Pass: the camera's indirect light in the compositor, and out of it again."""

from typing import Any

import bpy

from ..addon.blender.compositing.direct_only import light_probes
from ..addon.blender.compositing.files import has_pass, pass_files
from ..addon.blender.compositing.nodes import add_pass, remove_pass
from ..addon.blender.show import is_shown
from ..addon.core.errors import BakeError
from ..addon.ui.properties.mixer import mix_of
from ..addon.ui.staleness import own_changes
from .jobs.folders import nowhere, path_of

_PROBE = "Light probe '{}' brings indirect light into EEVEE's renders, on top of the pass: hide it in renders."


_SHOWN = (
    "The scene's materials show baked light, which the pass would add a second time: take it out of them first (× "
    "beside Baked Light)."
)


class PHOTON_BAKE_OT_add_pass(bpy.types.Operator):
    """Compose the camera's pass with renders, and have Cycles and EEVEE render direct light alone"""

    bl_idname = "photon_bake.add_pass"
    bl_label = "Add to Compositor"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: Any) -> set[str]:
        scene = context.scene
        settings = scene.photon_bake.camera
        try:
            if is_shown(scene):
                raise BakeError(_SHOWN)
            without = nowhere(settings.folder) and has_pass(scene)
            folder = None if without else path_of(settings.folder, "the camera's pass has")
            with own_changes():
                add_pass(scene, pass_files(scene, folder, settings.file_name), mix_of(scene))
            for name in light_probes(scene):
                self.report({"WARNING"}, _PROBE.format(name))
        except BakeError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}

    def invoke(self, context: Any, event: Any) -> set[str]:
        """Ask where the pass is, if neither the panel nor the scene's last bake says it."""
        if nowhere(context.scene.photon_bake.camera.folder) and not has_pass(context.scene):
            bpy.ops.photon_bake.choose_folder("INVOKE_DEFAULT", for_pass=True)
            return {"CANCELLED"}
        return self.execute(context)


class PHOTON_BAKE_OT_remove_pass(bpy.types.Operator):
    """Take the camera's pass out of the compositor, and set Cycles and EEVEE back"""

    bl_idname = "photon_bake.remove_pass"
    bl_label = "Remove from Compositor"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: Any) -> set[str]:
        with own_changes():
            removed = remove_pass(context.scene)
        if not removed:
            self.report({"INFO"}, "The compositor has no pass of Photon Bake's.")
        return {"FINISHED"}
