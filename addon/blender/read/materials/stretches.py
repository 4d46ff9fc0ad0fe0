"""Anisotropy: how far facets are stretched along a tangent, which way that turns, and where it comes from."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from .expressions import constant
from .node_math import saturate
from .nodes import Place
from .sums import white

SOCKETS = {
    "BSDF_PRINCIPLED": ("Anisotropic", "Anisotropic Rotation"),
    "BSDF_METALLIC": ("Anisotropy", "Rotation"),
    "BSDF_GLOSSY": ("Anisotropy", "Rotation"),
}
"""Of each shader that has any: how much, and by how much of a turn the tangent is turned."""

_ROUND, _MOST = 1e-4, 0.99


@dataclass(frozen=True)
class TangentSource:
    """Where tangents come from: along a UV map, or around an axis of the generated coordinates.

    Attributes
    ----------
    uv_map : str or None
        Its name, empty for the active one; None where they go around an axis.
    axis : "X", "Y" or "Z"
    """

    uv_map: str | None = None
    axis: str = "Z"


@dataclass(frozen=True)
class Tangents:
    """Tangents that a material needs.

    Attributes
    ----------
    normals : str or None
        The UV map whose tangents give its normals, empty for the active one; None where none do.
    stretched : TangentSource or None
        Where those come from along which facets are stretched; None where none are.
    """

    normals: str | None
    stretched: TangentSource | None


def stretch_of(kind: str, value: Callable[[str], np.ndarray]) -> np.ndarray:
    """The stretch of a shader's facets as `Closures` has it, (h, w, 3), by the values of its sockets."""
    if kind not in SOCKETS:
        return white()
    amount, turn = SOCKETS[kind]
    found = value(amount)
    if kind == "BSDF_GLOSSY":
        found = np.clip(found, -_MOST, _MOST)
        along = np.where(found < 0, 1 / (1 + np.minimum(found, 0)), 1 - found)
        along = np.where(np.abs(found) <= _ROUND, 1, along)
    else:
        along = 1 / np.sqrt(1 - np.float32(0.9) * saturate(found))
    if (along == 1).all():
        return white()
    turns = value(turn)
    return np.concatenate(np.broadcast_arrays(along, turns, turns), axis=-1).astype(np.float32)


def tangent_sources(shaders: Iterable[Place]) -> list[TangentSource | None]:
    """Where the tangents of a material's anisotropic shaders come from, each once; None for one that is not known."""
    found: dict[TangentSource | None, None] = {}
    for shader in shaders:
        names = SOCKETS.get(shader.socket.node.type)
        if names is None:
            continue
        amount = constant(shader.input(names[0]))
        if amount is None or np.abs(amount).max() > _ROUND:
            found[_source(shader.input("Tangent").origin)] = None
    return list(found)


def _source(origin: Place) -> TangentSource | None:
    node = origin.socket.node
    if not origin.socket.is_output or (node.type == "NEW_GEOMETRY" and origin.socket.identifier == "Tangent"):
        return TangentSource()
    if node.type != "TANGENT":
        return None
    return TangentSource(uv_map=node.uv_map) if node.direction_type == "UV_MAP" else TangentSource(axis=node.axis)
