"""Charts packed into images: by xatlas, which knows texels, or without its wheel by Blender's Pack Islands."""

import importlib.util
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import ceil, sqrt

import bpy
import numpy as np

from ..temporary import Temporary
from .charts import EditMode, areas

BLOCK = 4
"""Sides of images are multiples of it, texels: graphics cards compress blocks of 4 × 4."""

_TRIES = 8  # of a density that fills an image


@dataclass(frozen=True)
class Piece:
    """What gets a place in an image: k charts that are moved and turned each on its own; v vertices, t triangles.

    Attributes
    ----------
    vertices : (v, 2) float32, m
        Each in one chart only.
    triangles : (t, 3) int32
    chart : (t,) int32
    vertex_of_corner : (c,) int32
        For each corner of the mesh that the piece is of.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    chart: np.ndarray
    vertex_of_corner: np.ndarray

    @staticmethod
    def of(uv: np.ndarray, triangles: np.ndarray, chart: np.ndarray) -> "Piece":
        """A piece of triangles (t, 3) of corners with texture coordinates (c, 2), and their charts (t,)."""
        chart_of_corner = np.zeros(len(uv), np.float32)
        chart_of_corner[triangles] = chart[:, None]
        rows = np.ascontiguousarray(np.column_stack([chart_of_corner, uv]), np.float32).view([("", np.float32)] * 3)
        _, first, vertex = np.unique(rows, return_index=True, return_inverse=True)
        vertex = vertex.reshape(-1).astype(np.int32)
        return Piece(np.ascontiguousarray(uv[first]), vertex[triangles], chart, vertex)

    @staticmethod
    def rectangle(width: float, height: float) -> "Piece":
        """A rectangle, m; its corners are 0 0, 1 0, 1 1 and 0 1."""
        uv = np.array([(0, 0), (width, 0), (width, height), (0, height)], np.float32)
        return Piece.of(uv, np.array([(0, 1, 2), (0, 2, 3)], np.int32), np.zeros(2, np.int32))

    @property
    def area(self) -> float:
        """Of all triangles, m²."""
        return float(areas(self.vertices[self.triangles]).sum())


@dataclass(frozen=True)
class Packed:
    """An image with pieces.

    Attributes
    ----------
    width, height : int
        Texels, multiples of `BLOCK`.
    uv : list of (c, 2) float32
        Of each piece's corners, in [0, 1].
    density : float
        Texels a metre.
    """

    width: int
    height: int
    uv: list[np.ndarray]
    density: float


PiecesAt = Callable[[float], Sequence[Piece]]
"""The pieces that there are at a density, texels a metre; at 0, such as have the right area."""


def pack(pieces: Sequence[Piece], density: float, ring: int, size: int = 0, turns: bool = True) -> Packed | None:
    """Lay pieces into one image; charts grow a little where that makes them end with a texel.

    Parameters
    ----------
    density : float
        Texels a metre.
    ring : int
        Texels around each chart that no other has.
    size : int
        Sides of the image, texels; 0: as few as needed.
    turns : bool
        Whether charts may be turned by quarters.

    Returns
    -------
    Packed or None
        None if the pieces do not fit into `size`.
    """
    return (_by_xatlas if has_xatlas() else _by_blender)(pieces, density, ring, size, turns)


def has_xatlas() -> bool:
    """Whether the xatlas wheel is there."""
    return importlib.util.find_spec("xatlas") is not None


def fill(pieces_at: PiecesAt, size: int, ring: int, turns: bool = True) -> Packed | None:
    """Lay the pieces that there are at a density into an image of `size` texels a side, at the largest that fits."""
    area = sum(piece.area for piece in pieces_at(0.0))
    highest = size / sqrt(area) if area > 0 else 1.0
    density, lowest, best = 0.9 * highest, 0.0, None
    for _ in range(_TRIES):
        packed = pack(pieces_at(density), density, ring, size, turns)
        if packed is not None:
            best, lowest = packed, density
        else:
            highest = density
        if highest < 1.02 * lowest:
            break
        density = sqrt(lowest * highest) if best is not None else density / 1.5
    return best


def _by_xatlas(pieces: Sequence[Piece], density: float, ring: int, size: int, turns: bool) -> Packed | None:
    import xatlas

    atlas, options = xatlas.Atlas(), xatlas.PackOptions()
    for piece in pieces:
        atlas.add_uv_mesh(piece.vertices, piece.triangles.astype(np.uint32), piece.chart[:, None].astype(np.uint32))
    options.padding, options.resolution, options.texels_per_unit = ring, size, density
    options.bilinear = options.blockAlign = True
    options.bruteForce = False
    options.rotate_charts = options.rotate_charts_to_axis = turns
    atlas.generate(pack_options=options)
    if size and atlas.atlas_count > 1:
        return None
    used = np.array([atlas.width, atlas.height], np.float64)
    width, height = (size, size) if size else (whole_blocks(side) for side in used)
    scale = (used / (width, height)).astype(np.float32)
    uv, covered = [], 0.0
    for i, piece in enumerate(pieces):
        vertex, _, of_vertex = atlas.get_mesh(i)
        moved = np.zeros_like(piece.vertices)
        moved[vertex] = of_vertex * scale
        uv.append(moved[piece.vertex_of_corner])
        covered += float(areas(moved[piece.triangles]).sum()) * width * height
    wanted = sum(piece.area for piece in pieces) * density**2
    if size and covered < 0.95 * wanted:  # xatlas makes a chart smaller that is larger than the image
        return None
    return Packed(width, height, uv, density)


def _by_blender(pieces: Sequence[Piece], density: float, ring: int, size: int, turns: bool) -> Packed | None:
    """Pack Islands fills a square and knows no texels: the smallest image in which it has the density is sought."""
    area = sum(piece.area for piece in pieces)
    side = size or whole_blocks(density * sqrt(area / 0.7))
    too_small, best = 0, None
    for _ in range(1 if size else _TRIES):
        uv = _islands_packed(pieces, (2 * ring + 1) / side, turns)
        covered = sum(areas(u[piece.triangles]).sum() for piece, u in zip(pieces, uv, strict=True))
        found = side * sqrt(covered / area) if area > 0 else density
        if found >= density:
            best = Packed(side, side, [u[p.vertex_of_corner] for p, u in zip(pieces, uv, strict=True)], found)
        else:
            too_small = side
        side = whole_blocks((too_small + best.width) / 2 if best else 1.5 * side)
        if best and (side >= best.width or best.density < 1.1 * density):
            break
    return best


def _islands_packed(pieces: Sequence[Piece], margin: float, turns: bool) -> list[np.ndarray]:
    """Texture coordinates of each piece's vertices, (v, 2) float32, at a margin between charts in parts of the side."""
    first = np.cumsum([0, *(len(piece.vertices) for piece in pieces)])
    vertices = np.concatenate([piece.vertices for piece in pieces])
    triangles = np.concatenate([piece.triangles + start for piece, start in zip(pieces, first[:-1], strict=True)])
    with Temporary() as temporary:
        mesh = temporary.add(bpy.data.meshes.new("Photon Bake"))
        flat = np.column_stack([vertices, np.zeros(len(vertices), np.float32)])
        mesh.from_pydata(flat, [], triangles)
        layer = mesh.uv_layers.new(name=mesh.name)
        layer.uv.foreach_set("vector", np.ascontiguousarray(vertices[triangles], np.float32).reshape(-1))
        with EditMode(mesh, temporary):
            bpy.ops.uv.select_all(action="SELECT")
            bpy.ops.uv.pack_islands(
                margin_method="FRACTION", margin=margin, rotate=turns, rotate_method="CARDINAL", shape_method="AABB"
            )
        of_corner = np.empty((triangles.size, 2), np.float32)
        mesh.uv_layers[0].uv.foreach_get("vector", of_corner.reshape(-1))
    packed = np.zeros_like(vertices)
    packed[triangles.reshape(-1)] = of_corner
    return np.split(packed, first[1:-1])


def whole_blocks(side: float) -> int:
    """The least multiple of `BLOCK` that is not below `side`, texels."""
    return max(BLOCK, BLOCK * ceil(side / BLOCK))
