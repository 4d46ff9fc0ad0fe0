"""The node group that looks elements up in a vertex animation texture, see addon/output/vertex_animation.py."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import bpy

from ...output.vertex_animation import AnimationLayout
from ...settings.frames import Frames


@dataclass(frozen=True)
class Track:
    """An attribute of an object over time.

    Attributes
    ----------
    attribute : str
    image : bpy.types.Image
    layout : AnimationLayout
    """

    attribute: str
    image: "bpy.types.Image"
    layout: AnimationLayout


def playback_group(name: str, tracks: Sequence[Track], frames: Frames, domain: str) -> "bpy.types.NodeTree":
    """A node group that gives a mesh the tracks' attributes at the scene's frame, between two frames their mixture."""
    group = bpy.data.node_groups.new(name, "GeometryNodeTree")
    group.is_modifier = True
    for in_out in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", socket_type="NodeSocketGeometry", in_out=in_out)
    build = _Builder(group)
    geometry = group.nodes.new("NodeGroupInput").outputs[0]

    # t counts frames from the first: its whole part is the frame before, its fraction what the next one adds
    now = group.nodes.new("GeometryNodeInputSceneTime").outputs["Frame"]
    t = build.math("DIVIDE", build.math("SUBTRACT", now, float(frames.first)), float(frames.step))
    t = build.math("MINIMUM", build.math("MAXIMUM", t, 0.0), float(len(frames) - 1))
    before = build.math("FLOOR", build.math("ADD", t, 1e-4))
    share = build.math("MAXIMUM", build.math("SUBTRACT", t, before), 0.0)
    after = build.math("MINIMUM", build.math("ADD", before, 1.0), float(len(frames) - 1))
    for track in tracks:
        texels = [build.texel(track, frame) for frame in (before, after)]
        mixed = build.mixed(texels[0], texels[1], share)
        settings = {"data_type": "FLOAT_COLOR", "domain": domain}
        store = build.node("GeometryNodeStoreNamedAttribute", settings)
        group.links.new(geometry, store.inputs["Geometry"])
        store.inputs["Name"].default_value = track.attribute
        group.links.new(mixed, next(one for one in store.inputs if one.name == "Value" and one.enabled))
        geometry = store.outputs["Geometry"]
    group.links.new(geometry, group.nodes.new("NodeGroupOutput").inputs[0])
    return group


class _Builder:
    """Adds nodes to a group."""

    def __init__(self, group: "bpy.types.NodeTree") -> None:
        self._group = group

    def node(self, kind: str, settings: dict[str, Any]) -> Any:
        """A node with some settings."""
        node = self._group.nodes.new(kind)
        for name, value in settings.items():
            setattr(node, name, value)
        return node

    def link(self, value: Any, socket: Any) -> None:
        """Let an input have a number, or what an output gives."""
        if isinstance(value, bpy.types.NodeSocket):
            self._group.links.new(value, socket)
        else:
            socket.default_value = value

    def math(self, operation: str, *operands: Any) -> Any:
        """The output of a Math node."""
        node = self.node("ShaderNodeMath", {"operation": operation})
        for value, socket in zip(operands, node.inputs, strict=False):
            self.link(value, socket)
        return node.outputs[0]

    def texel(self, track: Track, frame: Any) -> Any:
        """The color of each element at a frame that is counted from the first: u and v are those of texels' middles."""
        layout = track.layout
        index = self.node("GeometryNodeInputIndex", {}).outputs[0]
        line = self.math("FLOOR", self.math("DIVIDE", self.math("ADD", index, 0.5), float(layout.width)))
        column = self.math("SUBTRACT", index, self.math("MULTIPLY", line, float(layout.width)))
        row = self.math("ADD", self.math("MULTIPLY", frame, float(layout.rows)), line)
        u = self.math("DIVIDE", self.math("ADD", column, 0.5), float(layout.width))
        v = self.math("DIVIDE", self.math("SUBTRACT", layout.height - 0.5, row), float(layout.height))
        at = self.node("ShaderNodeCombineXYZ", {})
        self.link(u, at.inputs["X"])
        self.link(v, at.inputs["Y"])
        image = self.node("GeometryNodeImageTexture", {"interpolation": "Closest", "extension": "EXTEND"})
        image.inputs["Image"].default_value = track.image
        self.link(at.outputs[0], image.inputs["Vector"])
        return image.outputs["Color"]

    def mixed(self, before: Any, after: Any, share: Any) -> Any:
        """A mixture of two colors."""
        node = self.node("ShaderNodeMix", {"data_type": "RGBA", "clamp_factor": False})
        sockets = [one for one in node.inputs if one.enabled]
        for value, socket in zip((share, before, after), sockets, strict=True):
            self.link(value, socket)
        return next(one for one in node.outputs if one.enabled)
