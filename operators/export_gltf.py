"""Export glTF: the scene with its baked light where engines look for it."""

from pathlib import Path
from typing import Any

import bpy

from ..addon.blender.gltf import Exported, export_gltf
from ..addon.core.errors import BakeError
from .baked_light import baked_light_left


class PHOTON_BAKE_OT_export_gltf(bpy.types.Operator):
    """Export the scene as glTF, with lightmaps by TEXCOORD_1 and vertices' light as a custom attribute"""

    bl_idname = "photon_bake.export_gltf"
    bl_label = "Export glTF with Baked Light"

    filepath: bpy.props.StringProperty(name="File Path", subtype="FILE_PATH")
    filter_glob: bpy.props.StringProperty(default="*.glb;*.gltf", options={"HIDDEN"})
    selected_only: bpy.props.BoolProperty(name="Selected Only", description="Export the selected objects only")
    lights: bpy.props.BoolProperty(
        name="Lights", description="Export point, spot and sun lamps, for direct light in the engine", default=True
    )
    cameras: bpy.props.BoolProperty(name="Cameras", description="Export cameras", default=False)

    def invoke(self, context: Any, event: Any) -> set[str]:
        if not self.filepath:
            self.filepath = str(Path(bpy.data.filepath).with_suffix(".glb")) if bpy.data.filepath else "baked.glb"
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: Any) -> set[str]:
        path, attribute = Path(bpy.path.abspath(self.filepath)), context.scene.photon_bake.attribute
        try:
            with baked_light_left(bpy.data.scenes):  # the exporter knows plain materials alone
                exported = export_gltf(path, attribute, self.selected_only, self.lights, self.cameras)
        except (BakeError, OSError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        self._tell(exported)
        return {"FINISHED"}

    def _tell(self, exported: Exported) -> None:
        if exported.missing:
            names = ", ".join(exported.missing)
            self.report({"WARNING"}, f"Lightmaps are missing, so they do not lie beside the file: {names}.")
        n_maps, n_vertices = len(exported.lightmaps), len(exported.vertices)
        self.report({"INFO"}, f"Exported {n_maps} objects with lightmaps, {n_vertices} with light on vertices.")


def _draw_in_menu(menu: Any, context: Any) -> None:
    menu.layout.operator(PHOTON_BAKE_OT_export_gltf.bl_idname, text="glTF with Baked Light (.glb/.gltf)")


def register() -> None:
    """Add the export to File > Export."""
    bpy.types.TOPBAR_MT_file_export.append(_draw_in_menu)


def unregister() -> None:
    """Take it away again."""
    bpy.types.TOPBAR_MT_file_export.remove(_draw_in_menu)
