"""Where materials take texture coordinates from, and their pictures on one grid of texels."""

from dataclasses import dataclass, field, replace

import bpy
import numpy as np
from mathutils import Euler

from ....lightmap.atlas import Atlas
from ...meshes.meshes import CornerUVs
from ..expressions import UnreadableError, constant
from ..nodes import Place
from .images import is_readable
from .texels import SMALL_SIDE


@dataclass(frozen=True)
class Coordinates:
    """Where a material's textures take their coordinates from: matrix @ uv + offset, or an atlas.

    Attributes
    ----------
    uv_map : str
        Name of a UV map; empty for the one that is active for rendering.
    matrix : (2, 2) float64
    offset : (2,) float64
    atlas : Atlas or None
        Takes the UV map's place.
    """

    uv_map: str = ""
    matrix: np.ndarray = field(default_factory=lambda: np.eye(2))
    offset: np.ndarray = field(default_factory=lambda: np.zeros(2))
    atlas: Atlas | None = None

    def of_corners(self, uv_maps: CornerUVs) -> np.ndarray:
        """Texture coordinates of a mesh's corners, (c, 2) float32."""
        if self.atlas is not None:
            return self.atlas.uvs
        return (uv_maps.corners(self.uv_map) @ self.matrix.T + self.offset).astype(np.float32)

    def then(self, scale: np.ndarray, offset: np.ndarray) -> "Coordinates":
        """These coordinates scaled and moved, (2,) each."""
        return Coordinates(self.uv_map, scale[:, None] * self.matrix, scale * self.offset + offset)

    def same(self, other: "Coordinates") -> bool:
        """Whether both are the same up to rounding."""
        return (
            self.uv_map == other.uv_map
            and np.allclose(self.matrix, other.matrix, atol=1e-6)
            and np.allclose(self.offset, other.offset, atol=1e-6)
        )


@dataclass(frozen=True)
class _Affine:
    """Coordinates matrix @ uv + offset, (3, 3) and (3,); UV maps lie in the plane z = 0."""

    uv_map: str = ""
    matrix: np.ndarray = field(default_factory=lambda: np.eye(3))
    offset: np.ndarray = field(default_factory=lambda: np.zeros(3))

    def then(self, matrix: np.ndarray, offset: np.ndarray) -> "_Affine":
        return _Affine(self.uv_map, matrix @ self.matrix, matrix @ self.offset + offset)

    def mapped(self, kind: str, location: np.ndarray, rotation: np.ndarray, scale: np.ndarray) -> "_Affine":
        """Through a mapping of a kind: POINT, TEXTURE (the inverse) or VECTOR (without location)."""
        turn = np.array(Euler(rotation).to_matrix(), np.float64)
        if kind == "TEXTURE":
            inverse = (1 / np.where(scale == 0, np.inf, scale))[:, None] * turn.T
            return self.then(inverse, -inverse @ location)
        return self.then(turn * scale, location if kind == "POINT" else np.zeros(3))


def coordinates_of(image: Place) -> Coordinates:
    """Texture coordinates of an image node, by one of its outputs.

    Raises
    ------
    UnreadableError
        If they are no UV map's, through Mapping nodes of constants at most and the node's own Texture Mapping.
    """
    node = image.socket.node
    is_picture = node.image.source not in {"TILED", "SEQUENCE", "MOVIE"} and is_readable(node.image)
    if node.projection != "FLAT" or not is_picture or _fades_out(node):
        raise UnreadableError(node)
    place = image.input("Vector").origin
    affine = _own_mapping(node, _affine(place) if place.socket.is_output else _Affine())
    return Coordinates(affine.uv_map, affine.matrix[:2, :2], affine.offset[:2])


def _fades_out(node: "bpy.types.Node") -> bool:
    """Whether a clipped picture is seen outside of itself: interpolation fades it out over half of its large texels."""
    return node.extension == "CLIP" and node.interpolation != "Closest" and max(node.image.size) < SMALL_SIDE


def _own_mapping(node: "bpy.types.Node", affine: _Affine) -> _Affine:
    """Coordinates through a texture node's own Texture Mapping: its axes, and then as a Mapping node."""
    mapping = node.texture_mapping
    if mapping.vector_type == "NORMAL" or mapping.use_min or mapping.use_max:
        raise UnreadableError(node)
    axes = [mapping.mapping_x, mapping.mapping_y, mapping.mapping_z]
    chosen = np.array([[axis == one for one in "XYZ"] for axis in axes], float)
    parts = (np.array(one, np.float64) for one in (mapping.translation, mapping.rotation, mapping.scale))
    return affine.then(chosen, np.zeros(3)).mapped(mapping.vector_type, *parts)


def _affine(place: Place) -> _Affine:
    node = place.socket.node
    if place.socket.is_output and node.type == "MAPPING":
        return _mapped(place)
    reads_uv = (node.type == "TEX_COORD" and place.socket.identifier == "UV") or node.type == "UVMAP"
    if not place.socket.is_output or not reads_uv or node.from_instancer:
        raise UnreadableError(node)
    return _Affine(getattr(node, "uv_map", ""))


def _mapped(place: Place) -> _Affine:
    """Coordinates through a Mapping node."""
    node = place.socket.node
    location, rotation, scale = (constant(place.input(name)) for name in ("Location", "Rotation", "Scale"))
    if node.vector_type == "NORMAL" or location is None or rotation is None or scale is None:
        raise UnreadableError(node)
    return _affine(place.input("Vector").origin).mapped(node.vector_type, location, rotation, scale)


@dataclass(frozen=True)
class Picture:
    """An image as one node reads it.

    Attributes
    ----------
    pixels : (h, w, 4) float32
    extension : str
        Blender's: REPEAT, EXTEND, CLIP or MIRROR.
    coordinates : Coordinates
    """

    pixels: np.ndarray
    extension: str
    coordinates: Coordinates

    @property
    def mean(self) -> "Picture":
        """One texel in its place."""
        return replace(self, pixels=self.pixels.mean(axis=(0, 1), keepdims=True))


@dataclass(frozen=True)
class Grid:
    """The texels on which all pictures of a material are looked up.

    Attributes
    ----------
    width, height : int
    low, size : (2,) float64
        The part of texture space that it covers.
    extends : bool
        Whether outside of it the edges go on; otherwise it repeats.
    """

    width: int
    height: int
    low: np.ndarray
    size: np.ndarray
    extends: bool

    @staticmethod
    def of(pictures: list[Picture]) -> "Grid | None":
        """The grid of some pictures; None where no one grid can hold them."""
        extensions = {one.extension for one in pictures}
        extends = bool(extensions & {"EXTEND", "CLIP"})
        if extends and extensions & {"REPEAT", "MIRROR"}:
            return None
        if not all(one.coordinates.same(pictures[0].coordinates) for one in pictures):
            return None
        height, width = np.max([one.pixels.shape[:2] for one in pictures], axis=0).tolist()
        if "CLIP" in extensions:  # a border of one texel holds what is outside
            border = 1 / np.array([width, height])
            return Grid(width + 2, height + 2, -border, 1 + 2 * border, True)
        periods = 2 if "MIRROR" in extensions else 1
        return Grid(width * periods, height * periods, np.zeros(2), np.full(2, float(periods)), extends)

    def place(self, coordinates: Coordinates) -> Coordinates:
        """The coordinates in which this grid is the unit square."""
        return coordinates.then(1 / self.size, -self.low / self.size)

    def look_up(self, picture: Picture) -> np.ndarray:
        """Nearest texels of a picture at the grid's texels, (height, width, 4) float32."""
        height, width = picture.pixels.shape[:2]
        if (height, width) == (self.height, self.width):
            return picture.pixels
        columns, inside_x = self._texels(0, self.width, width, picture.extension)
        rows, inside_y = self._texels(1, self.height, height, picture.extension)
        looked_up = picture.pixels[rows[:, None], columns]
        if picture.extension == "CLIP":
            looked_up = looked_up * (inside_y[:, None] & inside_x)[..., None]
        return looked_up

    def _texels(self, axis: int, n: int, n_texels: int, extension: str) -> tuple[np.ndarray, np.ndarray]:
        """Index of a picture's texel at each of the grid's n, and whether it is inside the picture, (n,) each."""
        at = self.low[axis] + self.size[axis] * (np.arange(n) + 0.5) / n
        if extension == "MIRROR":
            at = 1 - np.abs(at % 2 - 1)
        elif extension == "REPEAT":
            at = at % 1
        return np.clip((at * n_texels).astype(int), 0, n_texels - 1), (at >= 0) & (at <= 1)
