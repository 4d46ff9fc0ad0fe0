"""What can be read from a node tree without evaluating it, and the factors of Mix Shaders."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import bpy
import numpy as np

from ....scene import RayKind
from .node_math import saturate

SHOWN = "photon_bake_preview"
"""Custom property of what shows baked light: of group nodes, node groups, materials and images. For light they are not
there: who follows shaders passes such a node from its output Shader to its input Shader."""


@dataclass(frozen=True)
class Place:
    """A socket of a node tree.

    Attributes
    ----------
    socket : bpy.types.NodeSocket
    groups : tuple of bpy.types.Node
        The group nodes that it stands in, outermost first.
    """

    socket: "bpy.types.NodeSocket"
    groups: "tuple[bpy.types.Node, ...]" = ()

    def input(self, identifier: str) -> "Place":
        """An input of the same node."""
        return Place(socket(self.socket.node.inputs, identifier), self.groups)

    @property
    def upstream(self) -> "Place | None":
        """One step closer to where the value comes from; None at an output that its node computes, or without a link.

        Steps lead through links, into groups and out of them, and past muted nodes.
        """
        node = self.socket.node
        if not self.socket.is_output:
            end = source(self.socket)
            return Place(end, self.groups) if end and not _leads_nowhere(end) else None
        if SHOWN in node:
            shader = Place(node.inputs["Shader"], self.groups)
            return shader.upstream or shader
        if node.mute:
            passed = next(link.from_socket for link in node.internal_links if link.to_socket == self.socket)
            return Place(passed, self.groups).upstream or Place(passed, self.groups)
        if node.type == "GROUP":
            end = _group_output(node, self.socket.identifier)
            return Place(end, (*self.groups, node)) if end else None
        if node.type == "GROUP_INPUT" and self.groups:
            return Place(socket(self.groups[-1].inputs, self.socket.identifier), self.groups[:-1])
        return None

    @property
    def origin(self) -> "Place":
        """The output that computes the value, or the input without a link that holds it."""
        place, before = self, self.upstream
        while before is not None:
            place, before = before, before.upstream
        return place


def socket(sockets: "bpy.types.NodeInputs", identifier: str) -> "bpy.types.NodeSocket":
    """A socket by its identifier, which unlike its name is unique and the same in all versions."""
    return next(one for one in sockets if one.identifier == identifier)


def _leads_nowhere(output: "bpy.types.NodeSocket") -> bool:
    """Whether an output is of a muted node that passes nothing on to it."""
    return output.node.mute and all(link.to_socket != output for link in output.node.internal_links)


def _group_output(group: "bpy.types.Node", identifier: str) -> "bpy.types.NodeSocket | None":
    """The socket inside a group that one of its outputs takes its value from."""
    nodes = group.node_tree.nodes if group.node_tree else ()
    for node in nodes:
        if node.type == "GROUP_OUTPUT" and node.is_active_output:
            return next((one for one in node.inputs if one.identifier == identifier), None)
    return None


def uses_nodes(block: "bpy.types.ID") -> bool:
    """Whether a material, world or light is made of nodes."""
    if block.node_tree is None:
        return False
    # From 5.0 materials and worlds, and from 5.2 lights, always use their tree, and reading the choice is deprecated.
    always_since = (5, 2, 0) if isinstance(block, bpy.types.Light) else (5, 0, 0)
    return bpy.app.version >= always_since or bool(block.use_nodes)


def output_node(block: "bpy.types.ID") -> "bpy.types.Node | None":
    """The output node that Cycles uses."""
    return block.node_tree.get_output_node("CYCLES")


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


def all_nodes(tree: "bpy.types.NodeTree") -> "Iterator[bpy.types.Node]":
    """The nodes of a tree and of the groups in it, each group once; without those that show baked light."""
    trees = [tree]
    for one in trees:  # grows as groups are found
        for node in one.nodes:
            if SHOWN in node:
                continue
            yield node
            if node.type == "GROUP" and node.node_tree and node.node_tree not in trees:
                trees.append(node.node_tree)


def is_used(tree: "bpy.types.NodeTree", kind: str, output: str) -> bool:
    """Whether an output of a kind of node is linked to anything, groups included."""
    return any(node.type == kind and node.outputs[output].is_linked for node in all_nodes(tree))


def reached_nodes(block: "bpy.types.ID") -> "Iterator[bpy.types.Node]":
    """The nodes that what a material, world or light shows may depend on, groups included, each once."""
    output = output_node(block)
    todo, seen = [output] if output else [], set()
    while todo:
        node = todo.pop()
        if node in seen:
            continue
        seen.add(node)
        if SHOWN not in node:
            yield node
        links = (link for one in node.inputs if one.is_linked for link in one.links)
        todo += [link.from_node for link in links if link.is_valid and not link.is_muted]
        if node.type == "GROUP" and node.node_tree and SHOWN not in node:
            todo += [one for one in node.node_tree.nodes if one.type == "GROUP_OUTPUT" and one.is_active_output]


Value = Callable[[Place], np.ndarray]
"""Evaluates a socket, (h, w, 1 or 3) float32; h = w = 1 where it is constant."""


@dataclass(frozen=True)
class Factor:
    """What one Mix Shader multiplies a closure by.

    Attributes
    ----------
    place : Place
        The factor's socket.
    inverted : bool
        Whether 1 − factor counts: for the first of the two shaders.
    """

    place: Place
    inverted: bool

    @property
    def fresnel(self) -> Place | None:
        """The index of refraction, or a Layer Weight's blend, where the factor is Fresnel's curve."""
        origin = self.place.origin
        node = origin.socket.node
        if node.type == "FRESNEL":
            return origin.input("IOR")
        if node.type == "LAYER_WEIGHT" and origin.socket.identifier == "Fresnel":
            return origin.input("Blend")
        return None

    def ior(self, value: Value) -> float:
        """The index of refraction of a Fresnel factor, averaged over the surface."""
        place = self.fresnel
        assert place is not None
        of_node = float(value(place).mean())
        is_blend = place.socket.node.type == "LAYER_WEIGHT"
        return 1 / max(1 - of_node, 1e-5) if is_blend else max(of_node, 1e-5)

    def weight(self, value: Value) -> np.ndarray:
        """The factor in [0, 1], (h, w, 1)."""
        factor = saturate(value(self.place))
        return 1 - factor if self.inverted else factor


LIGHT_PATH: dict[str, dict[RayKind, int]] = {
    "Is Camera Ray": {RayKind.CAMERA: 1},
    "Is Shadow Ray": {RayKind.SHADOW: 1},
    "Is Diffuse Ray": {RayKind.DIFFUSE: 1, RayKind.GATHER: 1},
    "Is Glossy Ray": {RayKind.GLOSSY: 1, RayKind.TRANSMITTED: 1},
    "Is Singular Ray": {},
    "Is Reflection Ray": {RayKind.DIFFUSE: 1, RayKind.GLOSSY: 1, RayKind.GATHER: 1},
    "Is Transmission Ray": {RayKind.TRANSMITTED: 1},
    "Is Volume Scatter Ray": {},
    "Ray Length": dict.fromkeys(RayKind, 1),
    "Ray Depth": {kind: 1 if kind == RayKind.GATHER else 2 for kind in RayKind if kind != RayKind.CAMERA},
    "Diffuse Depth": {kind: 2 if kind == RayKind.DIFFUSE else 1 for kind in RayKind if kind != RayKind.CAMERA},
    "Glossy Depth": {RayKind.GLOSSY: 1},
    "Transparent Depth": {},
    "Transmission Depth": {RayKind.TRANSMITTED: 1},
    "Portal Depth": {},
}
"""What outputs of Light Path are for rays of each kind, 0 where it does not say, as Cycles counts: a gather ray has
left a receiver, and all other rays are taken to have left one surface more. Rays that glass reflects count as
transmitted."""

TAKEN_FOR_ONE = ("Ray Length", "Ray Depth", "Diffuse Depth", "Glossy Depth", "Transparent Depth", "Transmission Depth")
"""Those whose values differ among rays of a kind."""


@dataclass(frozen=True)
class View:
    """How a surface is seen.

    Attributes
    ----------
    kind : RayKind
        By which rays.
    back : bool
        From its back.
    cosine : float, optional
        Of the angle to the normal; without it values are means over directions by their cosine.
    """

    kind: RayKind = RayKind.DIFFUSE
    back: bool = False
    cosine: float | None = None

    @property
    def walks(self) -> bool:
        """Whether these rays see light that walked through bodies, as diffuse ones do from Blender 5.0 on."""
        return self.kind == RayKind.CAMERA or bpy.app.version >= (5, 0, 0)

    def value(self, output: "bpy.types.NodeSocket") -> float | None:
        """The value of a node's output that differs from ray to ray; None of others."""
        if output.node.type == "NEW_GEOMETRY" and output.identifier == "Backfacing":
            return float(self.back)
        if output.node.type == "LIGHT_PATH" and output.identifier in LIGHT_PATH:
            return float(LIGHT_PATH[output.identifier].get(self.kind, 0))
        return None


FROM_FRONT = View()
VIEWS = [View(kind, back) for kind in RayKind for back in (False, True)]
"""All of them, in the order of `Materials.seen_as`."""


def differing_views(
    tree: "bpy.types.NodeTree", for_camera: bool, has_bodies: bool
) -> tuple[list[View], tuple[int, ...]]:
    """Views in which a tree may differ, that of diffuse rays from the front first; and which one each of `VIEWS` is.

    Unless it is `for_camera`, cameras' rays are taken to see what gather rays do, but that light walks through bodies.
    """
    linked = [output for node in all_nodes(tree) for output in node.outputs if output.is_linked]
    used = [output for output in linked if FROM_FRONT.value(output) is not None]
    by_fresnel = any(output.node.type == "FRESNEL" or output.identifier == "Fresnel" for output in linked)
    found: dict[tuple, int] = {}
    views: list[View] = []
    which: list[int] = []
    for view in VIEWS:
        by = RayKind.GATHER if view.kind == RayKind.CAMERA and not for_camera else view.kind
        seen = *(View(by, view.back).value(output) for output in used), by_fresnel and view.back
        seen += (has_bodies and view.walks,)
        if seen not in found:
            found[seen] = len(views)
            views.append(view)
        which.append(found[seen])
    return views, tuple(which)
