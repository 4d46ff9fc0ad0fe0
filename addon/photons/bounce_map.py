"""Bounce maps: where photons of each source first meet surfaces, as a picture in the source's own view.

McGuire and Luebke, section 4.2. A point lamp sees a cube, a spot its frustum, the sun a plane across its rays. What
has no single centre of projection (area lamps, emissive meshes, the world) is seen as its own hypercube is laid out:
for an area lamp, a picture of directions. Each pixel emits one photon through its middle. Its power follows from what
the pixel covers: with the picture's plane at distance 1, dω = dx dy / (1 + x² + y²)^(3/2), and I dω is emitted there.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..core.sampling.sobol import sobol_points, sobol_seeds
from ..core.sampling.warps import sample_uniform_cone, to_world
from ..emitters import Rays, Source, bounding_sphere
from ..emitters.spot import leave_in_directions
from ..scene import LightKind
from ..tracing import Hits, TransparencyTracer

_WIDEST = 0.5  # cosine of half the cone of a spot that is seen as a frustum; a wider one is seen as a cube
_PLACES = 3  # stream of random numbers: what pixels do not decide

_FACES = np.array([np.roll(np.eye(3), k, axis=0)[[0, 1, 2]] * [[1], [1], [s]] for k in range(3) for s in (1, -1)])
"""The cube's faces: rows to the right, up and out of each, (6, 3, 3)."""


class View:
    """A source whose photons are laid out as a picture: the first two numbers of the hypercube are its plane.

    Attributes
    ----------
    n_faces : int
        Squares of which the picture is made, side by side.
    """

    n_faces = 1

    def __init__(self, source: Source) -> None:
        self._source = source

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
        points = sobol_points(sobol_seeds(1, seed, _PLACES, key), 0, 0, len(row))
        points[:, :2] = np.stack([(column + 0.5) / (side * self.n_faces), (row + 0.5) / side], axis=1)
        return points


class LampView(View):
    """A point lamp's cube, or a spot's frustum; `half` is half the frustum's side at distance 1, None for a cube."""

    def __init__(self, source: Source, half: float | None) -> None:
        super().__init__(source)
        lights, k = source.surroundings.scene.lights, source.lamp
        axes = np.stack([lights.axis_x[k], lights.axis_y[k], lights.direction[k]])
        self._half, self.n_faces = half or 1.0, 1 if half else 6
        self._axes = axes[None] if half else _FACES

    def emit(self, u: np.ndarray) -> Rays:
        """Directions through the picture; flux I dω/du."""
        face = np.minimum((u[:, 0] * self.n_faces).astype(int), self.n_faces - 1)
        x, y = (2 * self._half * (v - 0.5) for v in (u[:, 0] * self.n_faces - face, u[:, 1]))
        length = np.sqrt(1 + x * x + y * y)
        local = np.stack([x, y, np.ones_like(x)], axis=1) / length[:, None]
        directions = np.einsum("ni,nij->nj", local, self._axes[face]).astype(np.float32)
        per_density = (self.n_faces * (2 * self._half) ** 2 / length**3).astype(np.float32)
        rays = Rays(np.empty_like(directions), directions, np.empty_like(directions), np.full(len(u), -1, np.int32))
        source = self._source
        how = source.surroundings.lamps, source.lamp, source.kind == LightKind.SPOT
        leave_in_directions(*how, directions, per_density, u[:, 2:4].copy(), rays.origins, rays.flux)
        return rays


class SunView(View):
    """The sun's plane: a square around the scene."""

    def emit(self, u: np.ndarray) -> Rays:
        """Places in the plane, directions in the sun's disc; flux beam · area, with the beam E · 2/(1 + cos(α/2))."""
        scene, lamp = self._source.surroundings.scene, self._source.lamp
        lights, whole = scene.lights, bounding_sphere(scene)
        axis, cos_max = np.broadcast_to(lights.direction[lamp], (len(u), 3)), float(np.cos(lights.angle[lamp] / 2))
        directions = to_world(sample_uniform_cone(u[:, 2:4], cos_max), axis)
        radius = np.float32(whole.radius)
        place = np.concatenate([2 * u[:, :2] - 1, -np.ones((len(u), 1))], axis=1).astype(np.float32) * radius
        flux = np.tile(lights.emission[lamp] * np.float32(2 / (1 + cos_max)) * 4 * radius**2, (len(u), 1))
        return Rays(whole.centre + to_world(place, directions), directions, flux, np.full(len(u), -1, np.int32))


def view_of(source: Source) -> View:
    """How a source sees the scene."""
    if source.kind == LightKind.SUN:
        return SunView(source)
    if source.kind in (LightKind.POINT, LightKind.SPOT):
        return LampView(source, _frustum(source) if source.kind == LightKind.SPOT else None)
    return View(source)


def _frustum(spot: Source) -> float | None:
    """Half the side, at distance 1, of the square around a spot's cone; None if it is too wide for one."""
    lights, k = spot.surroundings.scene.lights, spot.lamp
    cosine = float(np.cos(lights.angle[k] / 2))
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


def bounce_map(tracer: TransparencyTracer, source: Source, n_photons: int, seed: int = 0) -> BounceMap:
    """The bounce map of a source with at least so many pixels."""
    view = view_of(source)
    rays = view.emit(view.points(n_photons, seed, 0))
    hits = tracer.closest_hit(rays.origins, rays.directions, photons_to=np.zeros(len(rays.origins), np.uint8))
    return BounceMap(view, view.side(n_photons), rays, hits)


def picture_rays(sources: Sequence[Source], counts: list[int], seed: int) -> list[Rays]:
    """The rays of the bounce maps of sources, with at least so many pixels each."""
    views = [view_of(source) for source in sources]
    return [view.emit(view.points(n, seed, k)) for k, (view, n) in enumerate(zip(views, counts, strict=True))]
