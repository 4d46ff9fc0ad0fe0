"""What a camera sees: a point of a surface for each pixel."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ...bsdf import lambertian_normals
from ...core.sampling.vectors import dot, rows
from ...scene import RayKind, Scene
from ...tracing import Hits, TransparencyTracer
from .lenses import Lens, Perspective

LEAST_COSINE = np.float32(1e-6)
"""At which a surface is seen at the least, for what a pixel covers of it."""


@dataclass(frozen=True)
class CameraRays:
    """n rays through a picture.

    Attributes
    ----------
    origins, directions : (n, 3) float32
        World space; where the clipping starts, m, and unit directions. NaN where the lens shows nothing.
    length : (n,) float32, m
        To where the clipping ends.
    """

    origins: np.ndarray
    directions: np.ndarray
    length: np.ndarray


@dataclass(frozen=True)
class Camera:
    """A camera, and the part of its plane that is its picture.

    Attributes
    ----------
    position : (3,) float32, m
    axes : (3, 3) float32
        Rows: unit vectors to the right, up and forward.
    lens : Lens
    window : (left, right, bottom, top)
        Of the lens's plane.
    width, height : int
        Pixels.
    clip : (near, far)
        Depths between which surfaces are seen, m.
    """

    position: np.ndarray
    axes: np.ndarray
    lens: Lens
    window: tuple[float, float, float, float]
    width: int
    height: int
    clip: tuple[float, float] = (0.0, np.inf)

    @staticmethod
    def perspective(position: np.ndarray, axes: np.ndarray, angle: float, width: int, height: int) -> "Camera":
        """A perspective camera with square pixels and a field of view across the width, radians."""
        x = float(np.tan(angle / 2))
        y = x * height / width
        return Camera(position, axes, Perspective(), (-x, x, -y, y), width, height)

    @property
    def n_pixels(self) -> int:
        return self.width * self.height

    @cached_property
    def middles(self) -> np.ndarray:
        """The middle of each pixel, row by row from the top left, (pixels, 2) float64: columns and rows from there."""
        row, column = np.divmod(np.arange(self.n_pixels), self.width)
        return np.stack([column, row], axis=1) + 0.5

    def rays(self, place: np.ndarray) -> CameraRays:
        """The rays through places (n, 2) of the picture, in columns and rows from its top left corner."""
        left, right, bottom, top = self.window
        x = left + place[:, 0] * ((right - left) / self.width)
        y = top - place[:, 1] * ((top - bottom) / self.height)
        origins, directions = self.lens.rays(np.stack([x, y], axis=1).astype(np.float32))
        rate = self.lens.depth(directions)
        near, far = self.clip
        origins = origins + (np.float32(near) / rate)[:, None] * directions
        origins, directions = (np.einsum("nj,ji->ni", vectors, self.axes) for vectors in (origins, directions))
        return CameraRays(self.position + origins, directions, np.float32(far - near) / rate)

    def pixels(self, points: np.ndarray) -> np.ndarray:
        """The pixel that each point (n, 3) falls into, hidden or not: (n,) int64, −1 outside the picture."""
        x, y = np.floor(self.places(points)).T
        inside = (x >= 0) & (x < self.width) & (y >= 0) & (y < self.height)
        return np.where(inside, np.where(inside, y, 0) * self.width + np.where(inside, x, 0), -1).astype(np.int64)

    def places(self, points: np.ndarray) -> np.ndarray:
        """Where points (n, 3) appear, hidden or not, in columns and rows as for `rays`, (n, 2); NaN for none."""
        left, right, bottom, top = self.window
        plane = self.lens.project(self.local(points))
        x = (plane[:, 0] - np.float32(left)) * np.float32(self.width / (right - left))
        y = (np.float32(top) - plane[:, 1]) * np.float32(self.height / (top - bottom))
        return np.stack([x, y], axis=1)

    def local(self, points: np.ndarray) -> np.ndarray:
        """Points (n, 3) in the camera's frame."""
        return np.einsum("ni,ji->nj", points - self.position, self.axes)

    def depth(self, points: np.ndarray) -> np.ndarray:
        """Depth of points (n, 3), (n,) float32, m: along the axis, or of panoramic cameras the distance."""
        return self.lens.depth(self.local(points))

    def pixel_area(self, points: np.ndarray) -> np.ndarray:
        """What a pixel covers of surfaces that face the camera at points (n, 3), (n,) float32, m²."""
        left, right, bottom, top = self.window
        of_plane = abs((right - left) * (top - bottom)) / self.n_pixels
        return self.lens.facing_area(self.local(points)) * np.float32(of_plane)


@dataclass(frozen=True)
class SeenSurface:
    """The p points of surfaces that a camera sees, one a pixel or several.

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

    def where(self, chosen: np.ndarray) -> "SeenSurface":
        """The points that a mask or an index array chooses."""
        columns = {name: rows(getattr(self, name), chosen) for name in _COLUMNS}
        return SeenSurface(hits=self.hits.where(chosen), **columns)

    def turned(self) -> "SeenSurface":
        """The other side of the surface in the same places."""
        return replace(self, normal=-self.normal, shading_normal=-self.shading_normal)

    @staticmethod
    def join(parts: "list[SeenSurface]") -> "SeenSurface":
        """All points of several `SeenSurface`, in order."""
        arrays = {name: np.concatenate([getattr(part, name) for part in parts]) for name in _COLUMNS}
        return SeenSurface(hits=Hits.join([part.hits for part in parts]), **arrays)


_COLUMNS = ("pixel", "direction", "position", "normal", "shading_normal", "area")


def seen_surface(scene: Scene, tracer: TransparencyTracer, camera: Camera) -> SeenSurface:
    """What the camera sees, by a ray through the middle of each pixel."""
    rays = camera.rays(camera.middles)
    hits = first_hits(tracer, rays)
    k = np.flatnonzero(hits.hit)
    hits, directions = hits.where(k), rows(rays.directions, k)
    facing_area = camera.pixel_area(hits.points(scene, directions)[0])
    return surface_seen(scene, k, hits, directions, facing_area)


def first_hits(tracer: TransparencyTracer, rays: CameraRays) -> Hits:
    """Where a camera's rays are stopped, within its clipping."""
    hits = Hits.none(len(rays.length))
    if len(hits.triangle) == 0:
        return hits
    k = np.flatnonzero(np.isfinite(rays.directions[:, 0]))
    met = tracer.closest_hit(rows(rays.origins, k), rows(rays.directions, k), RayKind.CAMERA)
    if met.tint is not None:
        hits = hits.with_tint()
    near = np.flatnonzero(met.distance <= rays.length[k])
    hits.put(k[near], met.where(near))
    return hits


def surface_seen(
    scene: Scene,
    pixel: np.ndarray,
    hits: Hits,
    directions: np.ndarray,
    facing_area: np.ndarray,
) -> SeenSurface:
    """The surface that rays from a camera hit.

    Parameters
    ----------
    pixel : (n,) int64
    hits : Hits
        All hit.
    directions : (n, 3) float32
        Of the rays.
    facing_area : (n,) float32, m²
        What the pixels would cover if the surface faced them.
    """
    position, normal = hits.points(scene, directions)
    shading = lambertian_normals(scene, hits.triangle, hits.u, hits.v, normal)
    cosine = np.maximum(np.abs(dot(directions, normal)), LEAST_COSINE)
    return SeenSurface(pixel, hits, directions, position, normal, shading, facing_area / cosine)
