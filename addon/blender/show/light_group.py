"""The node group that computes baked light: Σ strength × color × light over layers, times the strength of all."""

from collections.abc import Sequence
from typing import Any

import bpy

from ..lightmap.images import ENCODING, RANGE, play_back
from ..lightmap.writing import SCALE_OFFSET
from ..read.materials.nodes import SHOWN
from .layers import Layer
from .sheets import SHEET, TILE, Sheet
from .tree_builder import TreeBuilder

NAME = "Photon Bake Light"
_STRENGTH = "Strength"


def light_group() -> "bpy.types.NodeTree | None":
    """The group, where light is shown."""
    return next((group for group in bpy.data.node_groups if group.get(SHOWN) == NAME), None)


def make_light_group(layers: Sequence[Layer], sheets: Sequence[Sheet]) -> "bpy.types.NodeTree":
    """A new group whose output, Light, is the light of whatever object it is on; black where there is none.

    Parameters
    ----------
    layers : sequence of Layer
    sheets : sequence of Sheet
        Their images, one a layer.
    """
    group = bpy.data.node_groups.new(NAME, "ShaderNodeTree")
    group[SHOWN] = NAME
    group.interface.new_socket("Light", socket_type="NodeSocketColor", in_out="OUTPUT")
    tree = TreeBuilder(group)
    number = tree.of_object(SHEET)["Fac"] if sheets else 0.0
    own = [tree.math("COMPARE", number, float(i + 1), 0.5) for i in range(len(sheets))]
    places = [_where(tree, sheet) for sheet in sheets]
    total: Any = (0.0, 0.0, 0.0)
    for i, layer in enumerate(layers):
        light = tree.add("ShaderNodeAttribute", {"attribute_name": layer.attribute}).outputs["Color"]
        if sheets:
            light = tree.vector("SCALE", light, scale=tree.math("COMPARE", number, 0.0, 0.5))
        for sheet, is_own, place in zip(sheets, own, places, strict=True):
            image = sheet.images[i]
            if image is not None:
                light = tree.vector("ADD", light, tree.vector("SCALE", _texel(tree, image, place), scale=is_own))
        strength = tree.add("ShaderNodeValue", {"name": _name(i, "Strength"), "label": layer.name})
        color = tree.add("ShaderNodeRGB", {"name": _name(i, "Color"), "label": layer.name})
        light = tree.vector("MULTIPLY", light, color.outputs[0])
        total = tree.vector("ADD", total, tree.vector("SCALE", light, scale=strength.outputs[0]))
    strength = tree.add("ShaderNodeValue", {"name": _STRENGTH, "label": _STRENGTH})
    tree.add("NodeGroupOutput", Light=tree.vector("SCALE", total, scale=strength.outputs[0]))
    return group


def set_group_levels(group: "bpy.types.NodeTree", layers: Sequence[Layer], strength: float) -> None:
    """Give the layers of a group their strengths and colors, which is seen at once."""
    group.nodes[_STRENGTH].outputs[0].default_value = strength
    for i, layer in enumerate(layers):
        if _name(i, "Strength") in group.nodes:  # a layer may be newer than the group
            group.nodes[_name(i, "Strength")].outputs[0].default_value = layer.strength
            group.nodes[_name(i, "Color")].outputs[0].default_value = (*layer.color, 1.0)


def _name(layer: int, level: str) -> str:
    return f"Layer {layer + 1} {level}"


def _where(tree: TreeBuilder, sheet: Sheet) -> Any:
    """Where in a sheet the object's light is: scale and offset in its image; in a tiled one, the image's tile too."""
    uv = tree.add("ShaderNodeUVMap", {"uv_map": sheet.uv_map}).outputs[0]
    place = tree.of_object(SCALE_OFFSET)
    x, y, z = tree.add("ShaderNodeSeparateXYZ", Vector=place["Vector"]).outputs
    scale = tree.add("ShaderNodeCombineXYZ", X=x, Y=y).outputs[0]
    offset = tree.add("ShaderNodeCombineXYZ", X=z, Y=place["Alpha"]).outputs[0]
    where = tree.vector("MULTIPLY_ADD", uv, scale, offset)
    if not sheet.tiled:
        return where
    tile = tree.of_object(TILE)
    x, y, half_width = tree.add("ShaderNodeSeparateXYZ", Vector=tile["Vector"]).outputs
    half = tree.add("ShaderNodeCombineXYZ", X=half_width, Y=tile["Alpha"]).outputs[0]
    inside = tree.vector("MAXIMUM", where, half)  # a look-up must not reach for the neighbor's texels
    inside = tree.vector("MINIMUM", inside, tree.vector("SUBTRACT", (1.0, 1.0, 1.0), half))
    return tree.vector("ADD", inside, tree.add("ShaderNodeCombineXYZ", X=x, Y=y).outputs[0])


def _texel(tree: TreeBuilder, image: "bpy.types.Image", where: Any) -> Any:
    """Light at a place in an image, see addon/output/lightmap/shared_scale.py."""
    node = tree.add("ShaderNodeTexImage", {"image": image, "extension": "EXTEND"}, Vector=where)
    play_back(node.image_user, image)
    texel = node.outputs
    if image.get(ENCODING) not in {"rgbm", "rgbd"}:
        return texel["Color"]
    if image[ENCODING] == "rgbm":
        factor = tree.math("MULTIPLY", texel["Alpha"], image[RANGE])
    else:
        factor = tree.math("DIVIDE", image[RANGE] / 255, texel["Alpha"])
    return tree.vector("SCALE", texel["Color"], scale=factor)
