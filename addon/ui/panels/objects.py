"""The active object's own settings, in the tab and in Object Properties."""

from typing import Any

import bpy

from .tab import settings_column


class _ObjectPanel:
    """What both panels have in common."""

    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: Any) -> bool:
        return context.object is not None and context.object.type not in {"LIGHT", "CAMERA", "LIGHT_PROBE", "SPEAKER"}

    def draw(self, context: Any) -> None:
        draw_object_settings(self.layout, context)  # type: ignore[attr-defined]


class PHOTON_BAKE_PT_object(_ObjectPanel, bpy.types.Panel):
    """Settings of the active object, in the tab."""

    bl_space_type, bl_region_type, bl_category = "VIEW_3D", "UI", "Photon Bake"
    bl_parent_id = "PHOTON_BAKE_PT_bake"
    bl_label = "Object"
    bl_order = 90


class PHOTON_BAKE_PT_object_properties(_ObjectPanel, bpy.types.Panel):
    """The same, in Object Properties."""

    bl_space_type, bl_region_type, bl_context = "PROPERTIES", "WINDOW", "object"
    bl_label = "Photon Bake"


def draw_object_settings(layout: Any, context: Any) -> None:
    """Draw the settings of the active object; those of linked objects cannot be changed, as everywhere in Blender."""
    obj = context.object
    column = settings_column(layout)
    column.prop(obj.photon_bake, "exclude")
    rest = column.column()
    rest.active = not obj.photon_bake.exclude
    rest.prop(obj.photon_bake, "density")
    rest.row().prop(obj.photon_bake, "refine", expand=True)
    layout.operator("photon_bake.copy_object_settings", icon="PASTEDOWN")


CLASSES = (PHOTON_BAKE_PT_object, PHOTON_BAKE_PT_object_properties)


def register() -> None:
    """Add the panels."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister() -> None:
    """Take them away again."""
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
