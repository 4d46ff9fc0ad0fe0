"""Where materials take texture coordinates from, and their pictures on one grid of texels."""

from dataclasses import dataclass, field, replace

import numpy as np
from mathutils import Euler

from .atlas import Atlas
from .expressions import UnreadableError, constant
from .meshes import UVMaps
from .nodes import Place


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

    def of_corners(self, uv_maps: UVMaps) -> np.ndarray:
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


def coordinates_of(image: Place) -> Coordinates:
    """Texture coordinates of an image node, by one of its outputs.

    Raises
    ------
    UnreadableError
        If they are no UV map's, through Mapping nodes of constants at most.
    """
    node = image.socket.node
    if node.projection != "FLAT" or node.image.source in {"TILED", "SEQUENCE", "MOVIE"}:
        raise UnreadableError(node)
    place = image.input("Vector").origin
    if not place.socket.is_output:
        return Coordinates()
    uv_map, matrix, offset = _affine(place)
    return Coordinates(uv_map, matrix[:2, :2], offset[:2])


def _affine(place: Place) -> tuple[str, np.ndarray, np.ndarray]:
    """UV map, (3, 3) and (3,) of coordinates; UV maps lie in the plane z = 0."""
    node = place.socket.node
    if place.socket.is_output and node.type == "MAPPING":
        return _mapped(place)
    reads_uv = (node.type == "TEX_COORD" and place.socket.identifier == "UV") or node.type == "UVMAP"
    if not place.socket.is_output or not reads_uv or node.from_instancer:
        raise UnreadableError(node)
    return getattr(node, "uv_map", ""), np.eye(3), np.zeros(3)


def _mapped(place: Place) -> tuple[str, np.ndarray, np.ndarray]:
    """Coordinates through a Mapping node."""
    node = place.socket.node
    location, rotation, scale = (constant(place.input(name)) for name in ("Location", "Rotation", "Scale"))
    if node.vector_type == "NORMAL" or location is None or rotation is None or scale is None:
        raise UnreadableError(node)
    uv_map, matrix, offset = _affine(place.input("Vector").origin)
    turn = np.array(Euler(rotation).to_matrix(), np.float64)
    if node.vector_type == "TEXTURE":  # the inverse of Point
        inverse = (1 / np.where(scale == 0, np.inf, scale))[:, None] * turn.T
        return uv_map, inverse @ matrix, inverse @ (offset - location)
    linear = turn * scale
    return uv_map, linear @ matrix, linear @ offset + (location if node.vector_type == "POINT" else 0)


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


SMALL_SIDE = 128
"""Pictures that are smaller get texels in between, by the node's interpolation; in others texels hardly show."""


def interpolated(pixels: np.ndarray, interpolation: str, extension: str) -> np.ndarray:
    """A small picture (h, w, 4) with more texels, as its node interpolates between them."""
    repeats = SMALL_SIDE // max(pixels.shape[:2])
    if repeats < 2 or interpolation == "Closest":
        return pixels
    for axis in (0, 1):
        pixels = _more_texels(pixels, axis, repeats, interpolation == "Cubic", extension)
    return pixels


def _more_texels(pixels: np.ndarray, axis: int, repeats: int, cubic: bool, extension: str) -> np.ndarray:
    n = pixels.shape[axis]
    at = (np.arange(n * repeats) + 0.5) / repeats - 0.5
    first, t = np.floor(at).astype(int), at - np.floor(at)
    # Uniform cubic B-splines, as in Cycles, or the straight line between two texels.
    splines = ((1 - t) ** 3, 3 * t**3 - 6 * t**2 + 4, 1 + 3 * t + 3 * t**2 - 3 * t**3, t**3)
    taps = list(zip(range(-1, 3), [one / 6 for one in splines], strict=True)) if cubic else [(0, 1 - t), (1, t)]
    result = np.zeros((*pixels.shape[:axis], n * repeats, *pixels.shape[axis + 1 :]), np.float32)
    for offset, weight in taps:
        texel, inside = _extended(first + offset, n, extension)
        weight = (weight * inside).astype(np.float32).reshape((-1, *[1] * (2 - axis)))
        result += weight * pixels.take(texel, axis)
    return result


def _extended(texel: np.ndarray, n: int, extension: str) -> tuple[np.ndarray, np.ndarray]:
    """Texels that stand for those outside of n, and whether they count."""
    inside = ((texel >= 0) & (texel < n)) | (extension != "CLIP")
    if extension == "REPEAT":
        return texel % n, inside
    if extension == "MIRROR":
        return np.minimum(texel % (2 * n), 2 * n - 1 - texel % (2 * n)), inside
    return np.clip(texel, 0, n - 1), inside


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
