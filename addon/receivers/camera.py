"""What a camera sees: a point of a surface for each pixel."""

from dataclasses import dataclass

import numpy as np

from ..sampling.vectors import dot
from ..scene import Scene
from ..tracers import Hits, LightTracer


@dataclass(frozen=True)
class Camera:
    """A perspective camera.

    Attributes
    ----------
    position : (3,) float32, m
    axes : (3, 3) float32
        Rows: unit vectors to the right, up and forward.
    angle : float
        Field of view across the width, radians.
    width, height : int
        Pixels; they are square.
    """

    position: np.ndarray
    axes: np.ndarray
    angle: float
    width: int
    height: int

    @property
    def n_pixels(self) -> int:
        return self.width * self.height

    @property
    def pixel_size(self) -> float:
        """Side of a pixel at distance 1."""
        return 2 * float(np.tan(self.angle / 2)) / self.width

    def directions(self) -> np.ndarray:
        """Unit directions through the pixels' middles, row by row from the top left, (pixels, 3) float32."""
        y, x = np.divmod(np.arange(self.n_pixels), self.width)
        right = (x + 0.5 - self.width / 2) * self.pixel_size
        up = (self.height / 2 - y - 0.5) * self.pixel_size
        directions = np.stack([right, up, np.ones(self.n_pixels)], axis=1) @ self.axes
        return (directions / np.linalg.norm(directions, axis=1, keepdims=True)).astype(np.float32)

    def pixels(self, points: np.ndarray) -> np.ndarray:
        """The pixel that each point (n, 3) falls into, hidden or not: (n,) int64, −1 outside the picture."""
        right, up, forward = self.axes @ (points - self.position).T
        scale = 1 / (np.maximum(forward, np.float32(1e-20)) * np.float32(self.pixel_size))
        x = np.floor(self.width / 2 + right * scale)
        y = np.floor(self.height / 2 - up * scale)
        inside = (forward > 0) & (x >= 0) & (x < self.width) & (y >= 0) & (y < self.height)
        return np.where(inside, np.where(inside, y, 0) * self.width + np.where(inside, x, 0), -1).astype(np.int64)


@dataclass(frozen=True)
class SeenSurface:
    """The p pixels of a camera in which there is a surface.

    Attributes
    ----------
    pixel : (p,) int64
        Counted row by row from the top left.
    hits : Hits
        Of the rays from the camera.
    direction : (p, 3) float32
        Unit directions of those rays.
    position, normal, shading_normal : (p, 3) float32
        Of the side that is seen; positions lie on the surface, m.
    area : (p,) float32, m²
        What a pixel covers of the surface.
    """

    pixel: np.ndarray
    hits: Hits
    direction: np.ndarray
    position: np.ndarray
    normal: np.ndarray
    shading_normal: np.ndarray
    area: np.ndarray

    def __len__(self) -> int:
        return len(self.pixel)


def seen_surface(scene: Scene, tracer: LightTracer, camera: Camera) -> SeenSurface:
    """What the camera sees of what diffuse rays see, by a ray through the middle of each pixel.

    A pixel covers, of a surface at the depth z = (x − v)·r, A = s² z³ / |(x − v)·n| with its side s at distance 1
    (Fei and Wang, section 4.3, where s = 2 tan(α/2)/N).
    """
    directions = camera.directions()
    hits = tracer.closest_hit(np.repeat(camera.position[None], len(directions), axis=0), directions)
    pixel = np.flatnonzero(hits.hit)
    hits, directions = hits.where(pixel), directions[pixel]
    position, normal = hits.points(camera.position, directions)
    shading = scene.shading_normals(hits.triangle, hits.u, hits.v, normal)
    away = position - camera.position
    depth = away @ camera.axes[2]
    area = camera.pixel_size**2 * depth**3 / np.maximum(np.abs(dot(away, normal)), np.float32(1e-6) * depth)
    return SeenSurface(pixel, hits, directions, position, normal, shading, area.astype(np.float32))
