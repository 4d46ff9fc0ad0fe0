"""Baked light in materials and in the compositor, as the panel draws it."""

from typing import Any

from ....blender.compositing.nodes import has_pass_nodes
from ....blender.show import is_shown


def draw_baked_light(layout: Any, context: Any) -> None:
    """The button that shows baked light; while it is shown, its switch and strength and the way out."""
    scene = context.scene
    shown = scene.photon_bake.shown
    column = layout.column()
    if not is_shown(scene) and not scene.photon_bake.targets & {"vertex", "lightmap"}:
        return
    if not is_shown(scene):
        column.operator("photon_bake.use_baked_light", icon="SHADING_RENDERED")
        column.prop(shown, "after_bake")
        return
    row = column.row(align=True)
    row.prop(shown, "use", text="Baked Light", toggle=True, icon="HIDE_OFF" if shown.use else "HIDE_ON")
    row.operator("photon_bake.use_baked_light", text="", icon="FILE_REFRESH")
    row.operator("photon_bake.leave_baked_light", text="", icon="X")
    row = column.row()
    row.active = shown.use
    row.prop(shown, "strength", slider=True)
    column.prop(shown, "after_bake")


def draw_pass(layout: Any, context: Any) -> None:
    """The button that adds the camera's pass to the compositor, and the way out."""
    added = has_pass_nodes(context.scene)
    if not added and "camera" not in context.scene.photon_bake.targets:
        return
    row = layout.row(align=True)
    row.operator("photon_bake.add_pass", icon="NODE_COMPOSITING")
    if added:
        row.operator("photon_bake.remove_pass", text="", icon="X")


def draw_remove_lightmaps(layout: Any, context: Any) -> None:
    """The button that takes lightmaps out of the file."""
    layout.operator("photon_bake.remove_lightmaps", icon="TRASH")
