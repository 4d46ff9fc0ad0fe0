"""Normals that shader nodes are given: Normal Map nodes, heights of Bump nodes, and all others, which Cycles bakes."""

from collections.abc import Callable
from dataclasses import dataclass

import bpy
import numpy as np

from ....scene import NormalSpace
from .expressions import UnreadableError, constant
from .node_math import lerp, saturate
from .nodes import Place, Value


@dataclass(frozen=True)
class OwnNormal:
    """A normal of a closure's own.

    Attributes
    ----------
    space : NormalSpace
    vector : (h, w, 3) float32
        h = w = 1 where constant.
    """

    space: NormalSpace
    vector: np.ndarray


NormalOf = Callable[[Place], OwnNormal | None]
"""Evaluates a socket of normals; None where it is the interpolated normal."""


def interpolated(_: Place) -> OwnNormal | None:
    """A `NormalOf` for those who take no others."""
    return None


def node_of(place: Place) -> "bpy.types.Node | None":
    """The node that a socket takes its normals from; None where they are the interpolated ones, unread."""
    origin = place.origin
    node = origin.socket.node
    if not origin.socket.is_output or (node.type == "NEW_GEOMETRY" and origin.socket.identifier == "Normal"):
        return None
    if node.type in {"NORMAL_MAP", "BUMP"}:
        strength = constant(origin.input("Strength"))
        if strength is not None and strength[0] <= 0 and not _chained(origin):
            return None
    return node


def _chained(origin: Place) -> bool:
    """Whether a Bump node bends other normals than the interpolated ones."""
    return origin.socket.node.type == "BUMP" and node_of(origin.input("Normal")) is not None


def uv_map_of(place: Place) -> str | None:
    """The UV map whose tangents a socket's normals are given by, empty for the active one; None where by none."""
    node = node_of(place)
    return node.uv_map if node is not None and node.type == "NORMAL_MAP" and node.space == "TANGENT" else None


def read_normal(place: Place, value: Value, extends: bool) -> OwnNormal | None:
    """The normals of a socket by the values that its node takes.

    Parameters
    ----------
    place : Place
    value : Value
    extends : bool
        Whether pictures go on with the texels of their edges.

    Raises
    ------
    UnreadableError
        If only Cycles knows them.
    """
    node = node_of(place)
    if node is None:
        return None
    if node.type == "NORMAL_MAP":
        return _of_map(place.origin, value)
    if node.type == "BUMP" and not _chained(place.origin):
        return _of_height(place.origin, value, extends)
    raise UnreadableError(node)


def _of_map(origin: Place, value: Value) -> OwnNormal:
    """Normals of a Normal Map node; strength moves tangent ones by their parts, others along the straight line."""
    node = origin.socket.node
    vector: np.ndarray = 2 * value(origin.input("Color")) - 1
    strength = value(origin.input("Strength"))
    signs = np.ones(3, np.float32)
    if getattr(node, "convention", "OPENGL") == "DIRECTX":
        signs[1] = -1
    if node.space.startswith("BLENDER"):
        signs[1:] *= -1
    vector = vector * signs
    if node.space == "TANGENT":
        x, y, z = (vector[..., i : i + 1] for i in range(3))
        parts = np.broadcast_arrays(x * strength, y * strength, lerp(np.ones_like(z), z, saturate(strength)))
        return OwnNormal(NormalSpace.TANGENT, np.concatenate(parts, axis=-1).astype(np.float32))
    space = NormalSpace.OBJECT if node.space.endswith("OBJECT") else NormalSpace.WORLD
    return OwnNormal(space, _unit(vector) * np.maximum(strength, 0))


def _of_height(origin: Place, value: Value, extends: bool) -> OwnNormal | None:
    """Normals of a Bump node on the interpolated ones: the slopes of its heights over the texture coordinates.

    The slope from one texel to the next is what linear interpolation has between their middles.
    """
    node = origin.socket.node
    height = value(origin.input("Height")) * value(origin.input("Distance")) * np.float32(-1 if node.invert else 1)
    if max(height.shape[:2]) == 1:
        return None
    strength = np.maximum(value(origin.input("Strength")), 0)
    across, up = (_differences(height, axis, extends) * height.shape[axis] for axis in (1, 0))
    return OwnNormal(NormalSpace.HEIGHT, np.concatenate(np.broadcast_arrays(across, up, strength), axis=-1))


def _differences(values: np.ndarray, axis: int, extends: bool) -> np.ndarray:
    """Differences to the next texels along an axis."""
    found = np.roll(values, -1, axis) - values
    if extends:
        last = [slice(None)] * 3
        last[axis] = slice(-1, None)
        found[tuple(last)] = 0
    return found


def baked_normal(world: np.ndarray, matrix: np.ndarray) -> OwnNormal:
    """Normals in the world, (h, w, 3), as Cycles bakes them on an object with a matrix (4, 4), as the object's own.

    Normals go to the world by the inverse transpose of the linear part, and so come back by its transpose.
    """
    return OwnNormal(NormalSpace.OBJECT, _unit(world @ matrix[:3, :3].astype(np.float32)))


def _unit(vectors: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.where(length > 0, length, 1), np.float32)
