"""The node group that shows lightmaps: shader + base colour × lightmap, as the camera sees it."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import bpy

from .lightmap.images import ENCODING, RANGE
from .lightmap.writing import SCALE_OFFSET


@dataclass(frozen=True)
class Lit:
    """A lightmap, and the UV map that looks it up."""

    image: "bpy.types.Image"
    uv_map: str


def preview_group(lightmaps: Mapping[int, Lit], number_property: str) -> "bpy.types.NodeTree":
    """A group for materials of objects whose property says by a number which of the lightmaps is theirs.

    An object without the property gets nothing added. The group's inputs are Shader, Base Color, Metallic and
    Transmission, its output is Shader.
    """
    group = bpy.data.node_groups.new("Photon Bake Lightmap", "ShaderNodeTree")
    for name, kind, in_out in _SOCKETS:
        group.interface.new_socket(name, socket_type=kind, in_out=in_out)
    tree = _Tree(group)
    given = tree.add("NodeGroupInput").outputs
    light = _light(tree, lightmaps, number_property)
    for name in ("Metallic", "Transmission"):
        rest = tree.math("SUBTRACT", 1.0, given[name])
        light = tree.vector("SCALE", light, scale=rest)
    colour = tree.vector("MULTIPLY", light, given["Base Color"])
    seen = tree.add("ShaderNodeLightPath").outputs["Is Camera Ray"]
    glow = tree.add("ShaderNodeEmission", Color=colour, Strength=seen).outputs[0]
    both = tree.add("ShaderNodeAddShader")
    tree.link(given["Shader"], both.inputs[0])
    tree.link(glow, both.inputs[1])
    tree.add("NodeGroupOutput", Shader=both.outputs[0])
    return group


_SOCKETS = (
    ("Shader", "NodeSocketShader", "INPUT"),
    ("Base Color", "NodeSocketColor", "INPUT"),
    ("Metallic", "NodeSocketFloat", "INPUT"),
    ("Transmission", "NodeSocketFloat", "INPUT"),
    ("Shader", "NodeSocketShader", "OUTPUT"),
)


class _Tree:
    """A node tree that grows by nodes whose inputs are numbers or other nodes' outputs."""

    def __init__(self, group: "bpy.types.NodeTree") -> None:
        self._group = group

    def add(self, kind: str, settings: Mapping[str, Any] | None = None, **inputs: Any) -> Any:
        """A node with some settings, and inputs by their names (a space is an underscore)."""
        node = self._group.nodes.new(kind)
        for name, value in (settings or {}).items():
            setattr(node, name, value)
        for name, value in inputs.items():
            self.link(value, node.inputs[name.replace("_", " ")])
        return node

    def link(self, value: Any, socket: Any) -> None:
        """Let an input have a number or what an output gives."""
        if isinstance(value, bpy.types.NodeSocket):
            self._group.links.new(value, socket)
        else:
            socket.default_value = value

    def math(self, operation: str, *operands: Any) -> Any:
        """The output of a Math node."""
        return self._of("ShaderNodeMath", operation, operands)

    def vector(self, operation: str, *operands: Any, scale: Any = None) -> Any:
        """The output of a Vector Math node."""
        output = self._of("ShaderNodeVectorMath", operation, operands)
        if scale is not None:
            self.link(scale, output.node.inputs["Scale"])
        return output

    def _of(self, kind: str, operation: str, operands: tuple) -> Any:
        node = self.add(kind, {"operation": operation})
        for value, socket in zip(operands, node.inputs, strict=False):
            self.link(value, socket)
        return node.outputs[0]


def _light(tree: _Tree, lightmaps: Mapping[int, Lit], number_property: str) -> Any:
    """The light of the object's own lightmap: a sum over all of them, less those that are not its."""

    def of_object(name: str) -> Any:
        return tree.add("ShaderNodeAttribute", {"attribute_type": "OBJECT", "attribute_name": name}).outputs

    number, place = of_object(number_property)["Fac"], of_object(SCALE_OFFSET)
    x, y, z = tree.add("ShaderNodeSeparateXYZ", Vector=place["Vector"]).outputs
    scale = tree.add("ShaderNodeCombineXYZ", X=x, Y=y).outputs[0]
    offset = tree.add("ShaderNodeCombineXYZ", X=z, Y=place["Alpha"]).outputs[0]
    total: Any = (0.0, 0.0, 0.0)
    for own, lit in lightmaps.items():
        uv = tree.add("ShaderNodeUVMap", {"uv_map": lit.uv_map}).outputs[0]
        where = tree.vector("MULTIPLY_ADD", uv, scale, offset)
        texel = tree.add("ShaderNodeTexImage", {"image": lit.image, "extension": "EXTEND"}, Vector=where).outputs
        is_own = tree.math("COMPARE", number, float(own), 0.5)
        total = tree.vector("ADD", total, tree.vector("SCALE", _decoded(tree, texel, lit.image), scale=is_own))
    return total


def _decoded(tree: _Tree, texel: Any, image: "bpy.types.Image") -> Any:
    """Light of a texel, see addon/output/lightmap/shared_scale.py."""
    if image.get(ENCODING) not in {"rgbm", "rgbd"}:
        return texel["Color"]
    if image[ENCODING] == "rgbm":
        factor = tree.math("MULTIPLY", texel["Alpha"], image[RANGE])
    else:
        factor = tree.math("DIVIDE", image[RANGE] / 255, texel["Alpha"])
    return tree.vector("SCALE", texel["Color"], scale=factor)
