"""A node tree that grows by nodes whose inputs are numbers or other nodes' outputs."""

from collections.abc import Mapping
from typing import Any

import bpy


class TreeBuilder:
    """Adds nodes to a node group."""

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

    def of_object(self, name: str) -> Any:
        """The outputs of an Attribute node that reads a custom property of the object."""
        return self.add("ShaderNodeAttribute", {"attribute_type": "OBJECT", "attribute_name": name}).outputs

    def _of(self, kind: str, operation: str, operands: tuple) -> Any:
        node = self.add(kind, {"operation": operation})
        for value, socket in zip(operands, node.inputs, strict=False):
            self.link(value, socket)
        return node.outputs[0] if operation != "DOT_PRODUCT" else node.outputs["Value"]
