"""How cameras map directions to a plane, in the camera's own frame: x to the right, y up, z forward.

A lens has a plane of its own, of which a camera's picture is a window. `Perspective`: tangents (points at distance 1).
`Orthographic`: metres. `Equirectangular`: longitude and latitude, radians. `Fisheye`: radians from the middle, or
millimetres of the sensor where the lens keeps solid angles equal.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

_TINY = np.float32(1e-20)


class Lens(Protocol):
    """A map between rays and a plane; all arrays are float32, in the camera's frame."""

    def rays(self, plane: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Origins and unit directions of the rays through points of the plane (n, 2), (n, 3) each; NaN for none."""
        ...

    def project(self, points: np.ndarray) -> np.ndarray:
        """Where points (n, 3) appear in the plane, (n, 2); NaN where they do not."""
        ...

    def depth(self, points: np.ndarray) -> np.ndarray:
        """Depth of points (n, 3) as Cycles' pass has it and as clipping takes it, (n,), m."""
        ...

    def facing_area(self, points: np.ndarray) -> np.ndarray:
        """What a unit of the plane's area covers of surfaces that face the camera at points (n, 3), (n,), m²."""
        ...


@dataclass(frozen=True)
class Perspective:
    """A pinhole: x/z and y/z."""

    def rays(self, plane: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See `Lens`."""
        ahead = np.concatenate([plane, np.ones((len(plane), 1), plane.dtype)], axis=1)
        return np.zeros_like(ahead), ahead / _length(ahead)[:, None]

    def project(self, points: np.ndarray) -> np.ndarray:
        """See `Lens`."""
        forward = points[:, 2:]
        return np.where(forward > 0, points[:, :2] / np.maximum(forward, _TINY), np.nan)

    def depth(self, points: np.ndarray) -> np.ndarray:
        """See `Lens`."""
        return points[:, 2]

    def facing_area(self, points: np.ndarray) -> np.ndarray:
        """z³/d, since a unit of the plane is a solid angle of (z/d)³ (Fei and Wang, section 4.3)."""
        return points[:, 2] ** 3 / np.maximum(_length(points), _TINY)


@dataclass(frozen=True)
class Orthographic:
    """Parallel rays: x and y."""

    def rays(self, plane: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See `Lens`."""
        nothing = np.zeros((len(plane), 1), plane.dtype)
        origins = np.concatenate([plane, nothing], axis=1)
        return origins, np.broadcast_to(np.array([0, 0, 1], plane.dtype), origins.shape)

    def project(self, points: np.ndarray) -> np.ndarray:
        """See `Lens`."""
        return np.where(points[:, 2:] > 0, points[:, :2], np.nan)

    def depth(self, points: np.ndarray) -> np.ndarray:
        """See `Lens`."""
        return points[:, 2]

    def facing_area(self, points: np.ndarray) -> np.ndarray:
        """1."""
        return np.ones(len(points), points.dtype)


@dataclass(frozen=True)
class Equirectangular:
    """Longitude λ, to the right of forward, and latitude φ, up.

    Attributes
    ----------
    middle : float
        Longitude that points appear within half a turn of, radians.
    """

    middle: float = 0.0

    def rays(self, plane: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See `Lens`."""
        longitude, latitude = plane.T
        level = np.cos(latitude)
        directions = np.stack([level * np.sin(longitude), np.sin(latitude), level * np.cos(longitude)], axis=1)
        return np.zeros_like(directions), directions

    def project(self, points: np.ndarray) -> np.ndarray:
        """See `Lens`."""
        right, up, forward = points.T
        middle, turn = np.float32(self.middle), np.float32(2 * np.pi)
        longitude = np.arctan2(right, forward) - middle
        longitude -= turn * np.round(longitude / turn)
        return np.stack([longitude + middle, np.arctan2(up, np.hypot(right, forward))], axis=1)

    def depth(self, points: np.ndarray) -> np.ndarray:
        """See `Lens`."""
        return _length(points)

    def facing_area(self, points: np.ndarray) -> np.ndarray:
        """d² cos φ."""
        return _length(points) * np.hypot(points[:, 0], points[:, 2])


@dataclass(frozen=True)
class Fisheye:
    """Distance r from the middle by the angle θ to forward: equidistant, r = θ, or equisolid, r = 2f sin(θ/2).

    Attributes
    ----------
    angle : float
        Field of view, radians; nothing beyond half of it is seen.
    focal_length : float
        f, mm; 0 for an equidistant lens.
    """

    angle: float
    focal_length: float = 0.0

    def rays(self, plane: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See `Lens`."""
        r = _length(plane)
        theta = 2 * np.arcsin(np.minimum(r / (2 * self.focal_length), 1)) if self.focal_length else r
        sine = np.where(theta <= self.angle / 2, np.sin(theta), np.nan)
        directions = np.concatenate([plane * (sine / np.maximum(r, _TINY))[:, None], np.cos(theta)[:, None]], axis=1)
        return np.zeros_like(directions), directions.astype(plane.dtype)

    def project(self, points: np.ndarray) -> np.ndarray:
        """See `Lens`."""
        across = np.hypot(points[:, 0], points[:, 1])
        theta = np.arctan2(across, points[:, 2])
        r = 2 * self.focal_length * np.sin(theta / 2) if self.focal_length else theta
        r = np.where(theta <= self.angle / 2, r, np.nan)
        return points[:, :2] * (r / np.maximum(across, _TINY))[:, None]

    def depth(self, points: np.ndarray) -> np.ndarray:
        """See `Lens`."""
        return _length(points)

    def facing_area(self, points: np.ndarray) -> np.ndarray:
        """d² sin θ/θ, or d²/f²."""
        if self.focal_length:
            return _length(points) ** 2 / np.float32(self.focal_length**2)
        across = np.hypot(points[:, 0], points[:, 1])
        return _length(points) * across / np.maximum(np.arctan2(across, points[:, 2]), _TINY)


def _length(vectors: np.ndarray) -> np.ndarray:
    return np.sqrt(np.einsum("ni,ni->n", vectors, vectors))
