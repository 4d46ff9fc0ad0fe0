"""What materials look like in even light: a base colour, emission and opacity, each with an image where it varies."""

from dataclasses import dataclass

import numpy as np

from ...scene import Lobe, Materials, RayKind

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
    """

    materials: np.ndarray
    images: np.ndarray
    pixels: np.ndarray
    see_through: bool

    @staticmethod
    def of(materials: Materials) -> "Looks":
        """Those of materials as a camera sees them from the front."""
        pictures = _Pictures(materials)
        seen = materials.seen_as[:, 2 * RayKind.CAMERA]
        rows = np.zeros((len(materials), 3, 4), np.float32)
        for k, row in enumerate(seen.tolist()):
            rows[k, 0] = pictures.sum_of(_reflected(materials, row))
            rows[k, 1] = pictures.sum_of([(materials.emission.value[row], int(materials.emission.texture[row]))])
            coverage = materials.coverage.value[row] * _opaque(materials, row)
            rows[k, 2] = pictures.sum_of([(coverage, int(materials.coverage.texture[row]))])
        see_through = bool(((rows[:, 2, 0] < 1) | (rows[:, 2, 3] >= 0)).any())
        return Looks(rows.reshape(-1, 4), *pictures.packed(), see_through)


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
    """The images that materials show, each held once."""

    def __init__(self, materials: Materials) -> None:
        self._textures = materials.textures
        self._index: dict[tuple[bytes, ...], int] = {}
        self._pictures: list[np.ndarray] = []
        self._extends: list[bool] = []

    def sum_of(self, parts: list[Part]) -> np.ndarray:
        """Colour and number of the image of a sum, (4,)."""
        plain = sum((value for value, texture in parts if texture < 0), np.zeros(3))
        textured = [(value, texture) for value, texture in parts if texture >= 0]
        if not textured:
            return np.array([*plain, -1.0])
        largest = max(textured, key=lambda part: part[0].sum())[1]
        height, width = self._shape(largest)
        key = (plain.tobytes(), *(value.tobytes() + str(texture).encode() for value, texture in textured))
        if key not in self._index:
            picture = np.broadcast_to(plain, (height, width, 3)).astype(np.float32)
            for value, texture in textured:
                one = self._picture(texture)
                same = one.shape[:2] == (height, width)
                picture += value.astype(np.float32) * (one if same else one.mean(axis=(0, 1)))
            self._index[key] = len(self._pictures)
            self._pictures.append(picture)
            self._extends.append(bool(self._textures.extends[largest]))
        return np.array([1.0, 1.0, 1.0, self._index[key]])

    def _shape(self, texture: int) -> tuple[int, int]:
        return int(self._textures.height[texture]), int(self._textures.width[texture])

    def _picture(self, texture: int) -> np.ndarray:
        height, width = self._shape(texture)
        first = int(self._textures.offset[texture])
        return self._textures.pixels[first : first + height * width].reshape(height, width, 3)

    def packed(self) -> tuple[np.ndarray, np.ndarray]:
        """The tables `images` and `pixels`."""
        pictures = list(self._pictures)
        while sum(picture.shape[0] * picture.shape[1] for picture in pictures) * 4 / 3 > _MOST_TEXELS:
            k = int(np.argmax([picture.size for picture in pictures]))
            pictures[k] = _halved(pictures[k])
        levels = [_levels(picture) for picture in pictures]
        counts = [sum(len(level) for level in of_one) for of_one in levels]
        first = np.cumsum([0, *counts])[:-1]
        images = np.array(
            [
                (start, picture.shape[1], picture.shape[0], extends)
                for start, picture, extends in zip(first, pictures, self._extends, strict=True)
            ],
            np.float32,
        ).reshape(-1, 4)
        pixels = np.ones((sum(counts), 4), np.float32)
        if levels:
            pixels[:, :3] = np.concatenate([level for of_one in levels for level in of_one])
        return images, pixels


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
