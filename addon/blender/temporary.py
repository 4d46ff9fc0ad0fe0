"""What Cycles works on for a moment: data-blocks of our own, which are removed again."""

from typing import Any

import bpy
import numpy as np

from .read.materials.expressions import constant
from .read.materials.nodes import FROM_FRONT, SHOWN, Place, View
from .read.meshes.object_values import Values, of_scene


class CyclesError(Exception):
    """Cycles could not bake or render; says why."""


class Temporary:
    """Data-blocks that are removed at the end of a ``with`` statement, the last first."""

    def __init__(self) -> None:
        self._blocks: list[Any] = []

    def __enter__(self) -> "Temporary":
        return self

    def __exit__(self, *_: object) -> None:
        bpy.data.batch_remove(self._blocks[::-1])

    def add(self, block: Any) -> Any:
        """Take a data-block, and give it back to work on."""
        self._blocks.append(block)
        return block

    def copy(self, block: Any) -> Any:
        """Take a copy of a data-block; of a mesh without its shape keys, so that an evaluated one keeps its shape."""
        known = {key.session_uid for key in bpy.data.shape_keys}
        copy = self.add(block.copy())
        if getattr(copy, "shape_keys", None):
            self.add(bpy.data.objects.new(copy.name, copy)).shape_key_clear()
        # The keys that Blender copies with a mesh it does not remove with it
        self._blocks += [key for key in bpy.data.shape_keys if key.session_uid not in known]
        return copy


def cycles_scene(like: "bpy.types.Scene", temporary: Temporary) -> "bpy.types.Scene":
    """An empty scene at the frame of another one, for Cycles on the CPU with as many threads.

    Raises
    ------
    CyclesError
        If Cycles is not enabled.
    """
    if not hasattr(bpy.types.Scene, "cycles"):
        raise CyclesError("Cycles is not enabled")
    scene = temporary.add(bpy.data.scenes.new("Photon Bake"))
    scene.frame_current, scene.frame_subframe = like.frame_current, like.frame_subframe
    scene.render.engine = "CYCLES"
    scene.render.threads_mode, scene.render.threads = like.render.threads_mode, like.render.threads
    scene.cycles.device, scene.cycles.use_adaptive_sampling = "CPU", False
    return scene


READ_VALUES = {"ATTRIBUTE", "OBJECT_INFO"}
"""Types of nodes that may read what the scene of our own does not have."""


def frozen_copy(
    block: "bpy.types.ID", kinds: set[str], temporary: Temporary, values: Values = of_scene, view: View = FROM_FRONT
) -> "bpy.types.ID":
    """A copy of a material or world with groups of its own, in which some nodes' outputs are constants.

    Parameters
    ----------
    block : bpy.types.Material or bpy.types.World
    kinds : set of str
        Types of the nodes, besides `READ_VALUES`, whose outputs become constants where light sees them as such.
    temporary : Temporary
    values : Values
        What is known of the object and its scene.
    view : View
    """
    copy = temporary.copy(block)
    _freeze_tree(copy.node_tree, (), kinds | READ_VALUES, temporary, (values, view))
    return copy


def _freeze_tree(
    tree: "bpy.types.NodeTree", groups: tuple, kinds: set[str], temporary: Temporary, known: tuple[Values, View]
) -> None:
    for node in list(tree.nodes):
        if SHOWN in node:
            continue
        if node.type == "GROUP" and node.node_tree:
            node.node_tree = temporary.copy(node.node_tree)
            _freeze_tree(node.node_tree, (*groups, node), kinds, temporary, known)
        elif node.type in kinds:
            _freeze_node(tree, node, groups, known)


def _freeze_node(tree: "bpy.types.NodeTree", node: "bpy.types.Node", groups: tuple, known: tuple[Values, View]) -> None:
    for output in node.outputs:
        fixed = constant(Place(output, groups), *known) if output.is_linked else None
        if fixed is not None:
            value = _constant_output(tree, output.type, fixed)
            for link in list(output.links):
                tree.links.new(value, link.to_socket)


def _constant_output(tree: "bpy.types.NodeTree", kind: str, fixed: np.ndarray) -> "bpy.types.NodeSocket":
    """An output of a type with a value, of which a Value node takes any number."""
    numbers = []
    for number in fixed.tolist():
        numbers.append(tree.nodes.new("ShaderNodeValue").outputs[0])
        numbers[-1].default_value = number
    if len(numbers) == 1:
        return numbers[0]
    combined = tree.nodes.new("ShaderNodeCombineColor" if kind == "RGBA" else "ShaderNodeCombineXYZ")
    for number, end in zip(numbers, combined.inputs, strict=True):
        tree.links.new(number, end)
    return combined.outputs[0]
