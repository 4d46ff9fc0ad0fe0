"""Lightmaps' texels on their objects, in the 3D viewport: a checker, in the colour of texels a metre. Never saved."""

from functools import cached_property
from pathlib import Path
from typing import Any

import bpy
import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader

from ...blender.lightmap.images import lightmaps_by_file
from ...blender.lightmap.texel_density import texel_surface
from ...blender.overrides import density_factor
from ..redraw import redraw_view3d

_SHADERS = Path(__file__).parents[3] / "shaders"


class TexelView:
    """The view, which costs nothing while it is off.

    Attributes
    ----------
    shown : bool
    """

    def __init__(self) -> None:
        self.shown = False
        self._draw_handler: Any = None
        self._batches: dict[int, Any] = {}

    def show(self, on: bool) -> None:
        """Show it, or no longer; Blender calls us only while it is shown."""
        if on == self.shown:
            return
        self.shown = on
        self._batches.clear()
        if on:
            bpy.app.handlers.depsgraph_update_post.append(self._changed)
            if not bpy.app.background:
                self._draw_handler = bpy.types.SpaceView3D.draw_handler_add(self.draw, (), "WINDOW", "POST_VIEW")
        else:
            bpy.app.handlers.depsgraph_update_post.remove(self._changed)
            if self._draw_handler is not None:
                bpy.types.SpaceView3D.draw_handler_remove(self._draw_handler, "WINDOW")
                self._draw_handler = None
        redraw_view3d(bpy.context, "WINDOW")

    def forget(self) -> None:
        """Read all objects anew when they are drawn next."""
        self._batches.clear()

    def draw(self) -> None:
        """Draw the objects that have texels, as the view looks at them."""
        context = bpy.context
        depsgraph = context.evaluated_depsgraph_get()
        gpu.state.depth_test_set("LESS_EQUAL")
        gpu.state.blend_set("ALPHA")
        self._shader.bind()
        looked = gpu.matrix.get_projection_matrix() @ gpu.matrix.get_model_view_matrix()
        images: dict[str, bpy.types.Image] | None = None
        for obj in context.view_layer.objects:
            if obj is None or obj.type != "MESH" or obj.mode == "EDIT" or not obj.visible_get():
                continue
            if obj.session_uid not in self._batches:
                images = lightmaps_by_file() if images is None else images
                self._batches[obj.session_uid] = self._batch(obj, depsgraph, context.scene, images)
            batch = self._batches[obj.session_uid]
            if batch is not None:
                self._shader.uniform_float("model_view_projection", looked @ obj.matrix_world)
                batch.draw(self._shader)
        gpu.state.blend_set("NONE")
        gpu.state.depth_test_set("NONE")

    def _changed(self, scene: Any, depsgraph: Any) -> None:
        """Read again what has changed."""
        for update in depsgraph.updates:
            if isinstance(update.id, bpy.types.Object):
                self._batches.pop(update.id.session_uid, None)
            elif isinstance(update.id, bpy.types.Mesh | bpy.types.Scene):
                self._batches.clear()

    def _batch(self, obj: "bpy.types.Object", depsgraph: Any, scene: Any, images: dict[str, Any]) -> Any:
        """An object's surface on the graphics card; None where it has no texels."""
        settings = scene.photon_bake.lightmap.settings()
        surface = texel_surface(obj, depsgraph, settings, images)
        if surface is None:
            return None
        asked = settings.density * density_factor(obj)
        if settings.size:  # all that images hold is asked for: what differs is one part from another
            asked = float(np.median(surface.density))
        ratio = surface.density / np.float32(max(asked, 1e-6))
        return batch_for_shader(
            self._shader, "TRIS", {"position": surface.position, "texel": surface.texel, "ratio": ratio}
        )

    @cached_property
    def _shader(self) -> Any:
        info, between = gpu.types.GPUShaderCreateInfo(), gpu.types.GPUStageInterfaceInfo("texel_density")
        between.smooth("VEC2", "texel_at")
        between.smooth("FLOAT", "ratio_at")
        info.push_constant("MAT4", "model_view_projection")
        info.vertex_in(0, "VEC3", "position")
        info.vertex_in(1, "VEC2", "texel")
        info.vertex_in(2, "FLOAT", "ratio")
        info.vertex_out(between)
        info.fragment_out(0, "VEC4", "color")
        info.vertex_source((_SHADERS / "texel_density.vert.glsl").read_text(encoding="utf-8"))
        info.fragment_source((_SHADERS / "texel_density.frag.glsl").read_text(encoding="utf-8"))
        return gpu.shader.create_from_info(info)


texel_view = TexelView()
"""There is one for all views."""


def _is_shown(_: Any) -> bool:
    return texel_view.shown


def _show(_: Any, on: bool) -> None:
    texel_view.show(on)


def draw_texel_view(layout: Any, context: Any) -> None:
    """Its toggle, and what the colours mean."""
    column = layout.column()
    column.prop(context.window_manager, "photon_bake_texels")
    if texel_view.shown:
        column.label(text="Blue few, green as asked, red many", icon="BLANK1")


@bpy.app.handlers.persistent
def _on_load(*_: Any) -> None:
    texel_view.show(False)


def register() -> None:
    """Give the window manager the toggle."""
    bpy.types.WindowManager.photon_bake_texels = bpy.props.BoolProperty(
        name="Texels",
        description="Texels of lightmaps on their objects, in the color of how many there are a meter",
        get=_is_shown,
        set=_show,
        options={"SKIP_SAVE"},
    )
    bpy.app.handlers.load_pre.append(_on_load)


def unregister() -> None:
    """Take it away again, with what is shown."""
    texel_view.show(False)
    bpy.app.handlers.load_pre.remove(_on_load)
    del bpy.types.WindowManager.photon_bake_texels
