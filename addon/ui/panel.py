"""The Photon Bake tab of the 3D View's sidebar."""

from textwrap import wrap
from typing import Any

import bpy

from ..errors import kind_of
from ..inspector import VIEWS, View
from ..settings import Gather, TracerName
from .debug_views import debug_views
from .refine import draw_refine
from .state import bake_state, duration
from .texel_view import draw_texel_view

_GATHER_KNOBS: dict[Gather, list[str]] = {
    "final": ["n_gather_rays", "gather_share", "interpolate", "noise", "time", "n_cache_elements", "n_cache_rays"],
    "density": ["n_nearest", "max_radius"],
    "light_volume": ["n_grid_cells", "n_volume_rays"],
    "photon_volumes": ["subsample"],
}
_TRACER_KNOBS: dict[TracerName, list[str]] = {"embree": [], "multi_image": ["n_maps", "map_size"]}


class _Tab:
    """What the panels have in common."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Photon Bake"


class PHOTON_BAKE_PT_bake(_Tab, bpy.types.Panel):
    """Bake, follow it, and what came out."""

    bl_label = "Photon Bake"

    def draw(self, context: Any) -> None:
        properties = context.scene.photon_bake
        _draw_action(self.layout)
        column = _settings_column(self.layout)
        column.row().prop(properties, "targets")
        column.prop(properties, "quality")
        row = column.row()
        row.active = properties.targets != {"camera"}
        row.prop(properties, "selected_only")
        column.prop(properties, "strict")
        _draw_outcome(self.layout, context)


class PHOTON_BAKE_PT_sampling(_Tab, bpy.types.Panel):
    """How much work the bake puts in."""

    bl_label = "Sampling"
    bl_parent_id = "PHOTON_BAKE_PT_bake"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: Any) -> None:
        properties = context.scene.photon_bake
        column = _settings_column(self.layout)
        groups = (
            ["gather", "n_photons", "max_bounces", *_GATHER_KNOBS[properties.gather]],
            ["tracer", *_TRACER_KNOBS[properties.tracer]],
            ["seed", "n_threads", "memory"],
        )
        for i, names in enumerate(groups):
            if i:
                column.separator()
            for name in names:
                column.prop(properties, name)


class PHOTON_BAKE_PT_output(_Tab, bpy.types.Panel):
    """Which light is written, and where."""

    bl_label = "Output"
    bl_parent_id = "PHOTON_BAKE_PT_bake"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: Any) -> None:
        properties = context.scene.photon_bake
        column = _settings_column(self.layout)
        if "vertex" in properties.targets:
            column.prop(properties, "attribute")
            row = column.row(align=True)
            row.prop(properties, "bake_copies")
            row.operator("photon_bake.remove_copies", text="", icon="X")
        column.prop_search(properties, "light_group", context.view_layer, "lightgroups")
        column.prop(properties, "add_direct")
        column.prop(properties, "open_side")


class PHOTON_BAKE_PT_lightmaps(_Tab, bpy.types.Panel):
    """How lightmaps are laid out and written, and what to do with them."""

    bl_label = "Lightmaps"
    bl_parent_id = "PHOTON_BAKE_PT_bake"

    @classmethod
    def poll(cls, context: Any) -> bool:
        return "lightmap" in context.scene.photon_bake.targets

    def draw(self, context: Any) -> None:
        lightmap = context.scene.photon_bake.lightmap
        column = _settings_column(self.layout)
        column.prop(lightmap, "folder")
        column.prop(lightmap, "atlas")
        column.prop(lightmap, "size")
        if not lightmap.size:
            column.prop(lightmap, "density")
            column.prop(lightmap, "max_size")
        _draw_uv_map(column, lightmap, context.object)
        if not lightmap.uv_map:
            column.prop(lightmap, "padding")
        column.prop(lightmap, "file_format")
        if lightmap.file_format in {"rgbm", "rgbd"}:
            column.prop(lightmap, "value_range")
        column.prop(lightmap, "denoiser")
        column.prop(lightmap, "directional")
        row = self.layout.row(align=True)
        row.operator("photon_bake.show_lightmaps", icon="MATERIAL")
        row.operator("photon_bake.hide_lightmaps", icon="X", text="")
        self.layout.operator("photon_bake.export_gltf", icon="EXPORT")


def _draw_uv_map(column: Any, lightmap: Any, obj: "bpy.types.Object | None") -> None:
    """The name of a UV map, to be found among those of the active object."""
    if obj is not None and obj.type == "MESH":
        column.prop_search(lightmap, "uv_map", obj.data, "uv_layers")
    else:
        column.prop(lightmap, "uv_map")


class PHOTON_BAKE_PT_camera(_Tab, bpy.types.Panel):
    """How the camera's pass is sampled and written, and what to do with it."""

    bl_label = "Camera"
    bl_parent_id = "PHOTON_BAKE_PT_bake"

    @classmethod
    def poll(cls, context: Any) -> bool:
        return "camera" in context.scene.photon_bake.targets

    def draw(self, context: Any) -> None:
        camera = context.scene.photon_bake.camera
        column = _settings_column(self.layout)
        for name in ("folder", "file_name", "n_pixel_samples", "n_gloss_rays"):
            column.prop(camera, name)
        for name in ("pass_denoiser", "precision", "compression"):
            column.prop(camera, name)
        row = self.layout.row(align=True)
        row.operator("photon_bake.add_pass", icon="NODE_COMPOSITING")
        row.operator("photon_bake.remove_pass", icon="X")


class PHOTON_BAKE_PT_debug_views(_Tab, bpy.types.Panel):
    """What of the last bake the viewport shows."""

    bl_label = "Debug Views"
    bl_parent_id = "PHOTON_BAKE_PT_bake"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: Any) -> None:
        column = self.layout.column()
        for view in VIEWS:
            column.prop(context.window_manager.photon_bake_views, view)
            if view in debug_views.shown:
                column.label(text=_what_is_seen(view), icon="BLANK1")
        draw_texel_view(column, context)


def _what_is_seen(view: View) -> str:
    points = debug_views.inspector.seen.get(view)
    if points is None:
        return "Nothing yet: bake to see it"
    n = len(points.position)
    return f"{n:,}" if n == points.n_all else f"{n:,} of {points.n_all:,}"


def _settings_column(layout: Any) -> Any:
    """A column in the look of Blender's own settings, greyed while a bake runs: it has its settings already."""
    column = layout.column()
    column.use_property_split = True
    column.use_property_decorate = False
    column.enabled = not bake_state.running
    return column


def _draw_action(layout: Any) -> None:
    column = layout.column()
    if not bake_state.running:
        column.scale_y = 1.6
        column.operator("photon_bake.bake_indirect", icon="LIGHT_SUN")
        return
    left = bake_state.seconds_left
    text = bake_state.stage if left is None else f"{bake_state.stage}: {duration(left)} left"
    column.progress(factor=bake_state.fraction, text=text)
    column.operator("photon_bake.cancel", text="Cancel (Esc)", icon="X")


def _draw_outcome(layout: Any, context: Any) -> None:
    """How the last bake ended, and what it wants known."""
    width = characters_in(context)
    column = layout.column(align=True)
    if bake_state.error:
        _draw_sentence(column, bake_state.error, "ERROR", width)
    if bake_state.result:
        _draw_sentence(column, bake_state.result, "CHECKMARK", width)
    missing = [warning for warning in bake_state.warnings if kind_of(warning) == "missing"]
    if missing:
        _draw_missing(layout, missing, width)
        column = layout.column(align=True)
    for warning in bake_state.warnings:
        if kind_of(warning) != "missing":
            _draw_sentence(column, warning, "INFO", width)
    draw_refine(layout, context)


def _draw_missing(layout: Any, sentences: list[str], width: int) -> None:
    """One line that opens to a list."""
    header, body = layout.panel("photon_bake_missing", default_closed=True)
    n = len(sentences)
    header.label(text="1 file is missing" if n == 1 else f"{n} files are missing", icon="LIBRARY_DATA_BROKEN")
    if body is not None:
        column = body.column(align=True)
        for sentence in sentences:
            _draw_sentence(column, sentence, "DOT", width)


def _draw_sentence(column: Any, sentence: str, icon: str, width: int) -> None:
    """A label holds one line, so a long sentence takes several."""
    for i, line in enumerate(wrap(sentence, width)):
        column.label(text=line, icon=icon if i == 0 else "BLANK1")


def characters_in(context: Any) -> int:
    """How many characters about fit into a label with an icon, in the sidebar as wide as it is."""
    return max(16, int(context.region.width / context.preferences.system.ui_scale / 6.5) - 8)


CLASSES = (
    PHOTON_BAKE_PT_bake,
    PHOTON_BAKE_PT_lightmaps,
    PHOTON_BAKE_PT_camera,
    PHOTON_BAKE_PT_sampling,
    PHOTON_BAKE_PT_output,
    PHOTON_BAKE_PT_debug_views,
)


def register() -> None:
    """Add the panels."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister() -> None:
    """Take them away again."""
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
