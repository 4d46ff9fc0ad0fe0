"""What surfaces do to light: albedo and emission, as constants or image textures."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np


@dataclass(frozen=True)
class Textures:
    """Images one after the other in one array of pixels, so that any texel is one look-up.

    Attributes
    ----------
    pixels : (p, 3) float32
        Scene-linear colours, images row by row from the bottom left.
    offset, width, height : (i,) int32
        Where each image starts in `pixels`, and its size.
    """

    pixels: np.ndarray
    offset: np.ndarray
    width: np.ndarray
    height: np.ndarray

    @staticmethod
    def pack(images: list[np.ndarray]) -> "Textures":
        """Textures of (height, width, 3) images."""
        sizes = np.array([image.shape[:2] for image in images], np.int32).reshape(-1, 2)
        offset = np.concatenate([[0], np.cumsum(sizes[:, 0] * sizes[:, 1])])[:-1].astype(np.int32)
        pixels = [image.reshape(-1, 3).astype(np.float32) for image in images] or [np.zeros((0, 3), np.float32)]
        return Textures(np.concatenate(pixels), offset, sizes[:, 1], sizes[:, 0])

    def look_up(self, image: np.ndarray, uv: np.ndarray) -> np.ndarray:
        """The nearest texel of each image at texture coordinates `uv`, repeating, (n, 3) float32."""
        width, height = self.width[image], self.height[image]
        uv = uv - np.floor(uv)
        x = np.minimum((uv[:, 0] * width).astype(np.int32), width - 1)
        y = np.minimum((uv[:, 1] * height).astype(np.int32), height - 1)
        return self.pixels[self.offset[image] + y * width + x]


@dataclass(frozen=True)
class Materials:
    """The m materials of a scene; all surfaces are two-sided.

    Attributes
    ----------
    names : tuple of str
        Names for messages.
    albedo : (m, 3) float32
        Base colour in [0, 1]; white where a texture gives it.
    texture : (m,) int32
        Image in `textures` that the albedo is multiplied by, or −1.
    emission : (m, 3) float32, W/(m² sr)
        Emitted radiance, the same in every direction on both sides.
    roughness, metallic, transmission, ior, alpha : (m,) float32
        As the Principled BSDF defines them. Scattering is Lambertian in this version, whatever they say.
    textures : Textures
    """

    names: tuple[str, ...]
    albedo: np.ndarray
    texture: np.ndarray
    emission: np.ndarray
    roughness: np.ndarray
    metallic: np.ndarray
    transmission: np.ndarray
    ior: np.ndarray
    alpha: np.ndarray
    textures: Textures

    @cached_property
    def textured(self) -> bool:
        return bool((self.texture >= 0).any())

    @staticmethod
    def diffuse(albedo: np.ndarray, emission: np.ndarray | None = None) -> "Materials":
        """Untextured Lambertian materials of (m, 3) albedos and, where given, (m, 3) emitted radiances."""
        albedo = np.asarray(albedo, np.float32).reshape(-1, 3)
        m = len(albedo)
        return Materials(
            names=tuple(f"Material {i}" for i in range(m)),
            albedo=albedo,
            texture=np.full(m, -1, np.int32),
            emission=np.zeros((m, 3), np.float32) if emission is None else np.asarray(emission, np.float32),
            roughness=np.ones(m, np.float32),
            metallic=np.zeros(m, np.float32),
            transmission=np.zeros(m, np.float32),
            ior=np.full(m, 1.5, np.float32),
            alpha=np.ones(m, np.float32),
            textures=Textures.pack([]),
        )
