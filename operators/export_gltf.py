"""Export glTF: the scene with its lightmaps' UV maps where engines look for them."""

from pathlib import Path
from typing import Any

import bpy

from ..addon.blender.lightmap_gltf import export_gltf
from ..addon.errors import BakeError
from .baked_light import baked_light_left


class PHOTON_BAKE_OT_export_gltf(bpy.types.Operator):
    """Export the scene as glTF, with the lightmaps' texture coordinates as TEXCOORD_1"""

    bl_idname = "photon_bake.export_gltf"
    bl_label = "Export glTF with Lightmap UVs"

    filepath: bpy.props.StringProperty(name="File Path", subtype="FILE_PATH")
    filter_glob: bpy.props.StringProperty(default="*.glb;*.gltf", options={"HIDDEN"})
    selected_only: bpy.props.BoolProperty(name="Selected Only", description="Export the selected objects only")

    def invoke(self, context: Any, event: Any) -> set[str]:
        if not self.filepath:
            self.filepath = str(Path(bpy.data.filepath).with_suffix(".glb")) if bpy.data.filepath else "lightmaps.glb"
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: Any) -> set[str]:
        try:
            with baked_light_left(bpy.data.scenes):  # the exporter knows plain materials alone
                names = export_gltf(Path(bpy.path.abspath(self.filepath)), self.selected_only)
        except (BakeError, OSError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        self.report({"INFO"}, f"Exported {len(names)} objects with lightmaps.")
        return {"FINISHED"}
