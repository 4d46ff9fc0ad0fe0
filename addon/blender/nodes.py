"""What can be read from a node tree without evaluating it."""

import bpy
import numpy as np


def uses_nodes(block: "bpy.types.ID") -> bool:
    """Whether a material, world or light is made of nodes."""
    if block.node_tree is None:
        return False
    # From 5.0 materials and worlds, and from 5.2 lights, always use their tree, and reading the choice is deprecated.
    always_since = (5, 2, 0) if isinstance(block, bpy.types.Light) else (5, 0, 0)
    return bpy.app.version >= always_since or bool(block.use_nodes)


def surface_node(block: "bpy.types.ID") -> "bpy.types.Node | None":
    """The node that feeds the surface of the output that Cycles uses, or None."""
    output = block.node_tree.get_output_node("CYCLES")
    upstream = source(output.inputs["Surface"]) if output else None
    return upstream.node if upstream else None


def source(socket: "bpy.types.NodeSocket") -> "bpy.types.NodeSocket | None":
    """The output socket that `socket` is linked to, seen through reroutes, or None."""
    while True:
        links = [link for link in socket.links if link.is_valid and not link.is_muted]
        if not links:
            return None
        upstream = links[0].from_socket
        if upstream.node.type != "REROUTE":
            return upstream
        socket = upstream.node.inputs[0]


def number(socket: "bpy.types.NodeSocket") -> float | None:
    """The value of a socket, or None where nodes that cannot be read make it."""
    value = _value(socket)
    return float(value[:3].mean()) if isinstance(value, np.ndarray) else value


def vector(socket: "bpy.types.NodeSocket") -> np.ndarray | None:
    """The colour or vector of a socket, (3,) float64, or None where nodes that cannot be read make it."""
    value = _value(socket)
    return value if value is None or isinstance(value, np.ndarray) else np.full(3, value)


def _value(socket: "bpy.types.NodeSocket") -> np.ndarray | float | None:
    upstream = source(socket)
    if upstream is not None and upstream.node.type not in {"RGB", "VALUE"}:
        return None
    value = (upstream or socket).default_value
    return np.array(value[:3], np.float64) if hasattr(value, "__len__") else float(value)
