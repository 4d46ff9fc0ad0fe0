"""Normals that shader nodes are given: Normal Map nodes, heights of Bump nodes, and all others, which Cycles bakes."""

from collections.abc import Callable
from dataclasses import dataclass

import bpy
import numpy as np

from ....scene import NormalSpace
from .expressions import UnreadableError, constant
from .node_math import lerp, saturate
from .nodes import Place, Value, output_node


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


class Normals:
    """Where the normals of one material's closures come from.

    Attributes
    ----------
    to_bake : dict of Place to None
        Sockets whose normals Cycles has to tell, if it bakes the material.
    tangents : str or None
        The UV map of the tangents that normals are given by; None where none are.
    """

    def __init__(self, material: "bpy.types.Material | None") -> None:
        self.to_bake: dict[Place, None] = {}
        self.tangents: str | None = None
        self._heights = _displacement(material) if material else None

    def probe(self, place: Place, value: Value, noted: Value) -> OwnNormal | None:
        """A stand-in for the normals of a socket, having taken note of where they come from.

        If the material is baked, those of Normal Map nodes are read by the colours that these take, all others whole.

        Parameters
        ----------
        place : Place
        value, noted : Value
            The second only takes note of images, the first of the sockets that a bake has to give, too.

        Raises
        ------
        UnreadableError
            If only Cycles knows them.
        """
        node, uv_map = _node_of(place), _uv_map_of(place)
        if node is None:
            if self._heights is not None:
                self.to_bake[self._heights] = None
                raise UnreadableError(self._heights.socket.node)
            return None
        if node.type == "NORMAL_MAP" and (uv_map is None or self.tangents in (None, uv_map)):
            self.tangents = self.tangents if uv_map is None else uv_map
            return _read(place, value, False)
        self.to_bake[place] = None
        if node.type == "NORMAL_MAP":  # there are tangents of one UV map alone
            raise UnreadableError(node)
        return _read(place, noted, False)

    def read(self, place: Place, value: Value, extends: bool) -> OwnNormal | None:
        """The normals of a socket by values without a bake; the interpolated ones where only that would tell.

        Parameters
        ----------
        place : Place
        value : Value
        extends : bool
            Whether pictures go on with the texels of their edges.
        """
        if place in self.to_bake and _uv_map_of(place) is not None:
            return None
        try:
            return _read(place, value, extends)
        except UnreadableError:
            return None

    def baked(
        self, place: Place, values: dict[Place, np.ndarray], value: Value, matrix: np.ndarray
    ) -> OwnNormal | None:
        """The normals of a socket by those in the world (h, w, 3) that Cycles baked on an object with a matrix (4, 4).

        Normals go to the world by the inverse transpose of the linear part, and so come back by its transpose.
        """
        found = place if _node_of(place) is not None else self._heights
        if found in values:
            return OwnNormal(NormalSpace.OBJECT, _unit(values[found] @ matrix[:3, :3].astype(np.float32)))
        return _read(place, value, True)


def _displacement(material: "bpy.types.Material") -> Place | None:
    """The socket of what a material's output bends normals by, instead of moving the surface."""
    output = output_node(material)
    place = Place(output.inputs["Displacement"]) if output else None
    return place if place and place.origin.socket.is_output and material.displacement_method == "BUMP" else None


def _node_of(place: Place) -> "bpy.types.Node | None":
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
    return origin.socket.node.type == "BUMP" and _node_of(origin.input("Normal")) is not None


def _uv_map_of(place: Place) -> str | None:
    """The UV map whose tangents a socket's normals are given by, empty for the active one; None where by none."""
    node = _node_of(place)
    return node.uv_map if node is not None and node.type == "NORMAL_MAP" and node.space == "TANGENT" else None


def _read(place: Place, value: Value, extends: bool) -> OwnNormal | None:
    """The normals of a socket by the values that its node takes, see `Normals.read`."""
    node = _node_of(place)
    if node is None:
        return None
    if node.type == "NORMAL_MAP":
        return _of_map(place.origin, value)
    if node.type == "BUMP" and not _chained(place.origin):
        return _of_height(place.origin, value, extends)
    return OwnNormal(NormalSpace.WORLD, _unit(value(place)))


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


def _unit(vectors: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.where(length > 0, length, 1), np.float32)
