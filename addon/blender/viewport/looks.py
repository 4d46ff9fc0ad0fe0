"""What materials look like in even light: a base colour, emission and opacity, each with an image where it varies."""

from dataclasses import dataclass

import numpy as np

from ...scene import Lobe, Materials, RayKind, Textures

_MOST_TEXELS = 1 << 24
"""Of all images together: larger ones are halved until there are no more."""

_THROUGH = 0.85
"""How much of what a transmissive closure lets through is drawn as if it were not there."""

_BY_F0 = {Lobe.GLOSSY, Lobe.GLOSSY_TOON, Lobe.SHEEN}
_TRANSMISSIVE = {Lobe.GLASS, Lobe.PANE}
_NOT_DRAWN = {Lobe.ABSORBING}


@dataclass(frozen=True)
class Looks:
    """m materials, as `shaders/live/material.glsl` has them.

    Attributes
    ----------
    materials : (3 m, 4) float32
    images : (i, 4) float32
    pixels : (p, 4) float32
        Scene-linear.
    see_through : bool
        Whether light passes any of them.
    textures : Textures
    sums : tuple of tuple of bytes
        What the images were made of.
    """

    materials: np.ndarray
    images: np.ndarray
    pixels: np.ndarray
    see_through: bool
    textures: Textures
    sums: tuple[tuple[bytes, ...], ...]

    @staticmethod
    def of(materials: Materials, last: "Looks | None" = None) -> "Looks":
        """Those of materials as a camera sees them from the front, with images of the last ones if they are equal."""
        pictures = _Pictures(materials.textures)
        seen = materials.seen_as[:, 2 * RayKind.CAMERA]
        rows = np.zeros((len(materials), 3, 4), np.float32)
        for k, row in enumerate(seen.tolist()):
            rows[k, 0] = pictures.sum_of(_reflected(materials, row))
            rows[k, 1] = pictures.sum_of([(materials.emission.value[row], int(materials.emission.texture[row]))])
            coverage = materials.coverage.value[row] * _opaque(materials, row)
            rows[k, 2] = pictures.sum_of([(coverage, int(materials.coverage.texture[row]))])
        see_through = bool(((rows[:, 2, 0] < 1) | (rows[:, 2, 3] >= 0)).any())
        textures, sums = materials.textures, tuple(pictures.index)
        same = last is not None and last.textures is textures and last.sums == sums
        images, pixels = (last.images, last.pixels) if last is not None and same else pictures.packed()
        return Looks(rows.reshape(-1, 4), images, pixels, see_through, textures, sums)


Part = tuple[np.ndarray, int]
"""A value (3,), and the number of the texture that it is multiplied by, −1 for none."""


def _reflected(materials: Materials, row: int) -> list[Part]:
    """What a row's closures reflect of even light, about: summands of its base colour."""
    closures = materials.closures
    parts = []
    for c in range(closures.start[row], closures.start[row + 1]):
        kind = Lobe(closures.kind[c])
        value, texture = closures.weight.value[c], int(closures.weight.texture[c])
        if kind in _BY_F0:
            value = value * closures.f0.value[c]
            texture = texture if texture >= 0 else int(closures.f0.texture[c])
        if kind not in _NOT_DRAWN and value.any():
            parts.append((value, texture))
    return parts


def _opaque(materials: Materials, row: int) -> float:
    """Which share of a row's light is not drawn as passing through it."""
    closures = materials.closures
    own = slice(closures.start[row], closures.start[row + 1])
    weights = np.abs(closures.weight.value[own]).mean(axis=1)
    through = np.isin(closures.kind[own], list(_TRANSMISSIVE))
    return 1 - _THROUGH * float(weights[through].sum() / max(weights.sum(), 1e-9))


class _Pictures:
    """The images that materials show, each held once: sums of textures.

    Attributes
    ----------
    index : dict of tuple to int
        Number of each by what it is a sum of.
    """

    def __init__(self, textures: Textures) -> None:
        self._textures = textures
        self._sums: list[tuple[np.ndarray, list[Part]]] = []
        self.index: dict[tuple[bytes, ...], int] = {}

    def sum_of(self, parts: list[Part]) -> np.ndarray:
        """Colour and number of the image of a sum, (4,)."""
        plain = sum((value for value, texture in parts if texture < 0), np.zeros(3))
        textured = [(value, texture) for value, texture in parts if texture >= 0]
        if not textured:
            return np.array([*plain, -1.0])
        if len(textured) == 1 and not plain.any():  # a colour in front of the image, which may change without it
            color, textured = textured[0][0], [(np.ones(3), textured[0][1])]
        else:
            color = np.ones(3)
        key = (plain.tobytes(), *(value.tobytes() + str(texture).encode() for value, texture in textured))
        if key not in self.index:
            self.index[key] = len(self._sums)
            self._sums.append((plain, textured))
        return np.array([*color, self.index[key]])

    def _made(self, plain: np.ndarray, textured: list[Part]) -> np.ndarray:
        """The picture of a sum, of the size of the texture that counts most."""
        shape = self._shape(_main(textured))
        picture = np.broadcast_to(plain, (*shape, 3)).astype(np.float32)
        for value, texture in textured:
            one = self._picture(texture)
            picture += value.astype(np.float32) * (one if one.shape[:2] == shape else one.mean(axis=(0, 1)))
        return picture

    def _shape(self, texture: int) -> tuple[int, int]:
        return int(self._textures.height[texture]), int(self._textures.width[texture])

    def _picture(self, texture: int) -> np.ndarray:
        height, width = self._shape(texture)
        first = int(self._textures.offset[texture])
        return self._textures.pixels[first : first + height * width].reshape(height, width, 3)

    def packed(self) -> tuple[np.ndarray, np.ndarray]:
        """The tables `images` and `pixels`."""
        pictures = [self._made(*one) for one in self._sums]
        extends = [self._textures.extends[_main(textured)] for _, textured in self._sums]
        while sum(picture.shape[0] * picture.shape[1] for picture in pictures) * 4 / 3 > _MOST_TEXELS:
            k = int(np.argmax([picture.size for picture in pictures]))
            pictures[k] = _halved(pictures[k])
        levels = [_levels(picture) for picture in pictures]
        counts = [sum(len(level) for level in of_one) for of_one in levels]
        first = np.cumsum([0, *counts])[:-1]
        images = np.array(
            [
                (start, picture.shape[1], picture.shape[0], one)
                for start, picture, one in zip(first, pictures, extends, strict=True)
            ],
            np.float32,
        ).reshape(-1, 4)
        pixels = np.ones((sum(counts), 4), np.float32)
        if levels:
            pixels[:, :3] = np.concatenate([level for of_one in levels for level in of_one])
        return images, pixels


def _main(textured: list[Part]) -> int:
    """The texture of a sum that counts most."""
    return max(textured, key=lambda part: float(np.sum(part[0])))[1]


def _levels(picture: np.ndarray) -> list[np.ndarray]:
    """A picture and its halved copies down to one texel, (texels, 3) each."""
    levels = [picture.reshape(-1, 3)]
    while picture.shape[0] > 1 or picture.shape[1] > 1:
        picture = _halved(picture)
        levels.append(picture.reshape(-1, 3))
    return levels


def _halved(picture: np.ndarray) -> np.ndarray:
    """A picture of half the size, rounded down, at least 1."""
    for axis in (0, 1):
        n = picture.shape[axis]
        if n > 1:
            even = np.take(picture, range(0, n - n % 2, 2), axis)
            odd = np.take(picture, range(1, n, 2), axis)
            picture = (even + odd) / 2
    return picture
