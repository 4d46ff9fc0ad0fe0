"""Bounce maps: where photons of each source first meet surfaces, as a picture in the source's own view.

McGuire and Luebke, section 4.2. A point lamp sees a cube, a spot its frustum, the sun a plane across its rays. What
has no single centre of projection (area lamps, emissive meshes, the world) is seen as its own hypercube is laid out:
for an area lamp, a picture of directions. Each pixel emits one photon through its middle. Its power follows from what
the pixel covers: with the picture's plane at distance 1, dω = dx dy / (1 + x² + y²)^(3/2), and I dω is emitted there.
"""

from dataclasses import dataclass

import numpy as np

from ..core.compiling import kernel_array
from ..core.sampling.streams import sobol_chunks
from ..core.sampling.warps import sample_uniform_cone, to_world
from ..emitters import Rays, Source, bounding_sphere
from ..emitters.emission import N_DIMENSIONS
from ..emitters.spot import leave_in_directions
from ..scene import LightKind, Scene
from ..tracing import Hits, TransparencyTracer

_WIDEST = 0.5  # cosine of half the cone of a spot that is seen as a frustum; a wider one is seen as a cube
_PLACES = 3  # stream of random numbers: what pixels do not decide

_FACES = np.array([np.roll(np.eye(3), k, axis=0)[[0, 1, 2]] * [[1], [1], [s]] for k in range(3) for s in (1, -1)])
"""The cube's faces: rows to the right, up and out of each, (6, 3, 3)."""


class View(Source):
    """A source whose photons are laid out as a picture: the first two numbers of the hypercube are its plane.

    Attributes
    ----------
    n_faces : int
        Squares of which the picture is made, side by side.
    """

    n_faces = 1

    def __init__(self, source: Source) -> None:
        self._source = source
        self._be_like(source)

    def emit(self, u: np.ndarray) -> Rays:
        """As the source does."""
        return self._source.emit(u)

    def side(self, n_photons: int) -> int:
        """Pixels along the sides of each face, so that there are at least so many of them."""
        return int(np.ceil(np.sqrt(n_photons / self.n_faces)))

    def points(self, n_photons: int, seed: int, key: int) -> np.ndarray:
        """Points of the hypercube through the pixels' middles, (n, 5) float32; n is rounded up to whole squares."""
        side = self.side(n_photons)
        row, column = np.divmod(np.arange(self.n_faces * side * side), side * self.n_faces)
        middles = np.stack([(column + 0.5) / (side * self.n_faces), (row + 0.5) / side], axis=1)
        (rest,) = sobol_chunks(N_DIMENSIONS - 2, len(row), len(row), seed, _PLACES, key)
        return np.concatenate([middles, rest], axis=1).astype(np.float32)


class LampView(View):
    """A point lamp's cube, or a spot's frustum."""

    def __init__(self, source: Source, half: float | None) -> None:
        """A view; `half` is half the frustum's side at distance 1, None for a cube."""
        super().__init__(source)
        self._half, self.n_faces = half or 1.0, 1 if half else 6
        lights, k = source.surroundings.scene.lights, source.lamp
        self._axes = np.stack([lights.axis_x[k], lights.axis_y[k], lights.direction[k]])[None] if half else _FACES

    def emit(self, u: np.ndarray) -> Rays:
        """Directions through the picture; flux I dω/du."""
        face = np.minimum((u[:, 0] * self.n_faces).astype(int), self.n_faces - 1)
        x, y = (2 * self._half * (v - 0.5) for v in (u[:, 0] * self.n_faces - face, u[:, 1]))
        length = np.sqrt(1 + x * x + y * y)
        local = np.stack([x, y, np.ones_like(x)], axis=1) / length[:, None]
        directions = np.einsum("ni,nij->nj", local, self._axes[face]).astype(np.float32)
        per_density = self.n_faces * (2 * self._half) ** 2 / length**3
        given = kernel_array(directions, np.float32), kernel_array(per_density, np.float32)
        origins, flux = np.empty((2, len(u), 3), np.float32)
        places, is_spot = kernel_array(u[:, 2:4], np.float32), self.kind == LightKind.SPOT
        leave_in_directions(self.surroundings.lamps, self.lamp, is_spot, *given, places, origins, flux)
        return Rays(origins, directions, flux, np.full(len(u), -1, np.int32))


class SunView(View):
    """The sun's plane: a square around the scene."""

    def __init__(self, source: Source, scene: Scene) -> None:
        super().__init__(source)
        self._whole = bounding_sphere(scene)

    def emit(self, u: np.ndarray) -> Rays:
        """Places in the plane, directions in the sun's disc; flux beam · area."""
        axis = np.broadcast_to(self.row.axis, (len(u), 3))
        directions = to_world(sample_uniform_cone(u[:, 2:4], 1 - self.row.versine), axis)
        radius = np.float32(self._whole.radius)
        place = np.concatenate([2 * u[:, :2] - 1, -np.ones((len(u), 1))], axis=1).astype(np.float32) * radius
        origins = self._whole.centre + to_world(place, directions)
        flux = self.surroundings.scene.lights.emission[self.lamp] * np.float32(8 / (2 - self.row.versine)) * radius**2
        return Rays(origins, directions, np.tile(flux, (len(u), 1)), np.full(len(u), -1, np.int32))


def view_of(source: Source, scene: Scene) -> View:
    """How a source sees the scene."""
    if source.kind == LightKind.SUN:
        return SunView(source, scene)
    if source.kind in (LightKind.POINT, LightKind.SPOT):
        return LampView(source, _frustum(source))
    return View(source)


def _frustum(source: Source) -> float | None:
    """Half the side, at distance 1, of the square around a spot's cone; None of one that is no spot or too wide."""
    lights, k = source.surroundings.scene.lights, source.lamp
    cosine = float(np.cos(lights.angle[k] / 2)) if source.kind == LightKind.SPOT else -1.0
    return float(lights.stretch[k].max()) * np.sqrt(1 / cosine**2 - 1) if cosine > _WIDEST else None


@dataclass(frozen=True)
class BounceMap:
    """First hits of a source's photons.

    Attributes
    ----------
    view : View
    side : int
        Pixels along each side of the view's faces, which lie side by side.
    rays : Rays
        Through the pixels' middles, (n, …), row by row; the mean of their flux is what the source emits, W.
    hits : Hits
    """

    view: View
    side: int
    rays: Rays
    hits: Hits


def bounce_map(scene: Scene, tracer: TransparencyTracer, source: Source, n_photons: int, seed: int = 0) -> BounceMap:
    """The bounce map of a source with at least so many pixels."""
    view = view_of(source, scene)
    rays = view.emit(view.points(n_photons, seed, 0))
    return BounceMap(view, view.side(n_photons), rays, tracer.closest_hit(rays.origins, rays.directions))
