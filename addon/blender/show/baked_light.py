"""Baked light into materials of the whole file and out of them again."""

from collections.abc import Iterable, Sequence

import bpy

from ...core.errors import BakeError
from ..lightmap.writing import SCALE_OFFSET
from ..read.materials.nodes import SHOWN, all_nodes
from .eevee_world import dim_world, restore_worlds, set_worlds_dim
from .insertion import follow, insert, take_out
from .layers import Layer, LightSource
from .light_group import light_group, make_light_group, set_group_levels
from .scene_settings import restore_settings, show_direct_light
from .shader_group import make_shader_group
from .sheets import SHEET, drop_sheets, make_sheets
from .solid_view import restore_solid_views, show_attributes
from .stand_ins import add_stand_ins, drop_stand_ins

_SHOWN_SCENE = "photon_bake_shown"
"""Custom property of scenes whose baked light is shown."""

_GLASS = {"BSDF_GLASS", "BSDF_REFRACTION"}


def is_shown(scene: "bpy.types.Scene") -> bool:
    """Whether a scene's materials show its baked light."""
    return _SHOWN_SCENE in scene


def has_layers(scene: "bpy.types.Scene", layers: Sequence[Layer]) -> bool:
    """Whether some mesh object of a scene has light in one of the layers."""
    meshes = (obj for obj in scene.objects if obj.type == "MESH")
    return any(_has_attribute(obj, layers) or _has_lightmap(obj, layers) for obj in meshes)


def use_baked_light(
    scene: "bpy.types.Scene",
    layers: Sequence[Layer] = (Layer(),),
    strength: float = 1.0,
    shows: bool = True,
    preferred: LightSource = "lightmap",
) -> list[str]:
    """Show the baked light of a scene, and of those whose light is shown already.

    Parameters
    ----------
    scene : bpy.types.Scene
    layers : sequence of Layer
    strength, shows
        See `set_levels`.
    preferred : LightSource
        What objects show that have light in both.

    Returns
    -------
    list of str
        Warnings of objects that cannot show their light.

    Raises
    ------
    BakeError
        If no object has baked light. Everything is as it was then.
    """
    scenes = [scene, *(one for one in bpy.data.scenes if is_shown(one) and one != scene)]
    objects = list(dict.fromkeys(obj for one in scenes for obj in one.objects if obj.type == "MESH"))
    lit = [obj for obj in objects if _has_attribute(obj, layers) or _has_lightmap(obj, layers)]
    if not any(obj in lit for obj in scene.objects):
        raise BakeError(f"No object of scene '{scene.name}' has baked light to show: bake Vertices or Lightmaps first.")
    leave_baked_light()
    warnings: list[str] = []
    by_image = [obj for obj in lit if preferred == "lightmap" or not _has_attribute(obj, layers)]
    sheets = make_sheets(by_image, layers, warnings)
    materials = add_stand_ins([obj for obj in lit if SHEET in obj or _has_attribute(obj, layers)], warnings)
    kinds = {node.type for material in materials for node in all_nodes(material.node_tree)}
    light = make_light_group(layers, sheets)
    has_glass = bool(kinds & _GLASS) or any(_transmits(material) for material in materials)
    # through translucent surfaces Cycles finds one bounce itself, unless there is no glass to keep its rays for
    insert(materials, make_shader_group(light), {"BSDF_TRANSLUCENT"} if has_glass else set())
    for one in scenes:
        one[_SHOWN_SCENE] = "BSDF_TRANSLUCENT" in kinds and not has_glass
        dim_world(one, [obj for obj in lit if obj.name in one.objects])
    set_levels(scene, layers, strength, shows)
    if any(_has_attribute(obj, layers) for obj in lit):
        show_attributes()
    return list(dict.fromkeys(warnings))


def set_levels(scene: "bpy.types.Scene", layers: Sequence[Layer], strength: float = 1.0, shows: bool = True) -> None:
    """Change how strong light is that is shown, without a new look at materials.

    Parameters
    ----------
    scene : bpy.types.Scene
    layers : sequence of Layer
        As they were shown, with other strengths and colors.
    strength : float
        Of all light.
    shows : bool
        False: the scene is seen as it was before, with its own bounces.
    """
    group = light_group()
    if group is None or not is_shown(scene):
        return
    set_group_levels(group, layers, strength if shows else 0.0)
    for one in filter(is_shown, bpy.data.scenes):
        if shows:
            show_direct_light(one, bool(one[_SHOWN_SCENE]))
        else:
            restore_settings(one)
    set_worlds_dim(shows)


def leave_baked_light() -> None:
    """Take all that shows baked light out of the file; everything is as it was."""
    take_out()
    drop_stand_ins()
    drop_sheets()
    restore_worlds()
    restore_solid_views()
    for scene in filter(is_shown, bpy.data.scenes):
        restore_settings(scene)
        del scene[_SHOWN_SCENE]


def follow_changes(updated: "Iterable[bpy.types.ID]") -> None:
    """Let baked light follow materials and node groups that were changed while it is shown."""
    if light_group() is None:
        return
    for block in updated:
        tree = block.node_tree if isinstance(block, bpy.types.Material) else block
        if isinstance(tree, bpy.types.ShaderNodeTree) and tree.is_editable and SHOWN not in tree:
            follow(tree)


def follow_undo() -> None:
    """Set viewports back after an undo that has taken light out of the file: Blender does not undo those."""
    if not any(map(is_shown, bpy.data.scenes)):
        restore_solid_views()


def _has_attribute(obj: "bpy.types.Object", layers: Sequence[Layer]) -> bool:
    return any(layer.attribute in obj.data.attributes for layer in layers)


def _has_lightmap(obj: "bpy.types.Object", layers: Sequence[Layer]) -> bool:
    return SCALE_OFFSET in obj and any(layer.image_property in obj for layer in layers)


def _transmits(material: "bpy.types.Material") -> bool:
    """Whether a Principled of a material lets light through."""
    sockets = [node.inputs.get("Transmission Weight") for node in all_nodes(material.node_tree)]
    return any(one is not None and (one.is_linked or one.default_value > 0) for one in sockets)
