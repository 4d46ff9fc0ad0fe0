"""A scene of a few triangles with every kind of light, and surfaces that take kernels every way; and points in it that
want light.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from ...receivers import LightmapMesh, ReceiverMesh
from ...scene import (
    AREA_LAMPS,
    N_VIEWS,
    Channel,
    Closures,
    LightKind,
    Lights,
    Lobe,
    Materials,
    Media,
    Medium,
    RayKind,
    Scene,
    SceneObjects,
    World,
)

_QUADS = [(1, 5, 7, 3), (0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6)]
"""Of a room without a ceiling, by its corners; they face out."""

_CORNERS = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (1, -1)], np.float32)
_PANE = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], np.float32)
_PANES = np.array(
    [(0.4, 0.3, -0.9), (-0.4, 0.3, -0.5), (0.3, -0.4, -0.4), (-0.3, -0.4, 0.3), (0.0, 0.0, 0.6)], np.float32
)
"""Where a pane of each material hangs in the room."""


def tiny_scene() -> Scene:
    """A hazy room with panes of emission, gloss, glass, translucency, coverage, and all kinds of lamps."""
    vertices = np.concatenate([_CORNERS, *(0.3 * _PANE + place for place in _PANES)])
    quads = np.concatenate([_QUADS, 8 + 4 * np.arange(len(_PANES))[:, None] + np.arange(4)]).astype(np.int32)
    triangles = np.concatenate([quads[:, [0, 2, 1]], quads[:, [0, 3, 2]]])
    of_quad = np.concatenate([np.zeros(len(_QUADS), np.int32), np.arange(1, 1 + len(_PANES), dtype=np.int32)])
    material = np.tile(of_quad, 2)
    corners = vertices[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    n = 1 + len(_PANES)
    yes, no = np.ones(n, bool), np.zeros(n, bool)
    return Scene(
        vertices=vertices,
        triangles=triangles,
        corner_normals=np.repeat(normals[:, None], 3, axis=1).astype(np.float32),
        corner_uvs=corners[:, :, :2].copy(),
        material_of_triangle=material,
        object_of_triangle=material.copy(),
        materials=_materials(),
        objects=SceneObjects(tuple(f"Object {i}" for i in range(n)), yes, yes, yes, yes, yes, yes, no),
        lights=_lamps(),
        world=World(np.ones(3, np.float32), np.linspace(0.1, 1, 96, dtype=np.float32).reshape(4, 8, 3)),
        media=Media(of_world=Medium(*np.full((2, 3), 0.05, np.float32))),
    )


def _materials() -> Materials:
    """Matte, emissive, glossy, glass, translucent and see-through but for shadow rays, to whom it is matte.

    The last is a body.
    """
    half = Channel.constant(np.array([0.5, 0.5, 0.2, 0, 0, 0.5]))
    seen_as = np.repeat(np.arange(6, dtype=np.int32)[:, None], N_VIEWS, axis=1)
    seen_as[5, 2 * RayKind.SHADOW : 2 * RayKind.SHADOW + 2] = 0
    materials = Materials.of(
        6,
        diffuse=half,
        emission=Channel.constant(np.array([0, 1.0, 0, 0, 0, 0])),
        f0=Channel.constant(np.array([0, 0, 0.3, 0, 0, 0])),
        f90=Channel.constant(np.array([0, 0, 1.0, 0, 0, 0])),
        roughness=Channel.constant(np.array([1, 1, 0.2, 0.1, 1, 1])),
        glass_reflection=Channel.constant(np.array([0, 0, 0, 1.0, 0, 0])),
        glass_transmission=Channel.constant(np.array([0, 0, 0, 1.0, 0, 0])),
        translucent=Channel.constant(np.array([0, 0, 0, 0, 0.5, 0])),
        coverage=Channel.constant(np.array([1, 1, 1, 1, 1, 0.5])),
        seen_as=seen_as,
    )
    return replace(materials, closures=_with_body(materials.closures))


def _with_body(closures: Closures) -> Closures:
    """The closures, of which light walks by the last."""
    kind, ior = closures.kind.copy(), closures.ior.copy()
    channels: dict[str, Any] = {}
    kind[-1], ior[-1] = Lobe.SUBSURFACE, 1.5
    for name, of_body in {"f0": 0.5, "f90": 0.1, "edge": 0.0}.items():
        channel = getattr(closures, name)
        channels[name] = Channel(channel.value.copy(), channel.texture)
        channels[name].value[-1] = of_body
    return replace(closures, kind=kind, ior=ior, **channels)


def _lamps() -> Lights:
    """One of each kind over the room."""
    kinds = list(LightKind)
    n = len(kinds)
    place = np.zeros((n, 3), np.float32)
    place[:, 0], place[:, 2] = np.linspace(-0.6, 0.6, n), 0.9
    return Lights.of(
        tuple(kind.name for kind in kinds),
        np.array(kinds),
        emission=np.ones((n, 3)),
        position=place,
        size=np.array([(0.2, 0.2) if kind in AREA_LAMPS else (0, 0) for kind in kinds]),
        radius=np.array([0.1 if kind in (LightKind.POINT, LightKind.SPOT) else 0 for kind in kinds]),
        angle=np.array([{LightKind.SPOT: 1.0, LightKind.SUN: 0.01}.get(kind, 0.0) for kind in kinds]),
    )


def floor_mesh(n: int = 12) -> ReceiverMesh:
    """A grid of n × n vertices over the room's floor, in faces of two triangles each."""
    x, y = np.meshgrid(np.linspace(-0.9, 0.9, n), np.linspace(-0.9, 0.9, n))
    positions = np.stack([x.ravel(), y.ravel(), np.full(n * n, -0.99)], axis=1).astype(np.float32)
    first = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    corner_vertex = (first[:, None] + np.array([0, 1, n + 1, n])).ravel().astype(np.int32)
    corner = 4 * np.arange(len(first))[:, None, None] + np.array([[0, 1, 2], [0, 2, 3]])
    normals = np.tile(np.array([0, 0, 1], np.float32), (n * n, 1))
    faces = np.repeat(np.arange(len(first), dtype=np.int32), 4)
    triangles = corner.reshape(-1, 3).astype(np.int32)
    return ReceiverMesh("Floor", "Floor", "POINT", positions, normals, corner_vertex, faces, triangles=triangles)


def floor_chart() -> LightmapMesh:
    """The room's floor with a place in a lightmap."""
    corners = (_PANE * 0.9 + np.array([0, 0, -0.99], np.float32))[[[0, 1, 2], [0, 2, 3]]].astype(np.float32)
    normals = np.broadcast_to(np.array([0, 0, 1], np.float32), corners.shape).copy()
    return LightmapMesh("Floor", 0, corners, normals, (corners[..., :2] * 0.5 + 0.5).copy())
