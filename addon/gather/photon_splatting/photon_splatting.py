"""The light of photons in the pixels of a camera."""

from collections.abc import Callable

import numpy as np

from ...bsdf.scatter import shading_normal_correction
from ...core.compiling import kernel
from ...core.parallel import Workers
from ...core.sampling.octahedral import octahedral_vector
from ...core.sampling.vectors import dot
from ...core.vec3 import ONE, row
from ...photons import Photons
from ...receivers import Camera, SeenSurface
from ...receivers.camera.camera import LEAST_COSINE
from ...tracing import Tracer
from .edges import distance_to_edge, share_of_splats
from .radius import OF_CAUSTICS, neighbour_radius, path_density_radius
from .splat import LitPoints, Response, splat_photons
from .upsampling import upsampled


def splat_irradiance(
    camera: Camera,
    seen: SeenSurface,
    photons: Photons,
    workers: Workers,
    step: int = 1,
    tracer: Tracer | None = None,
    fineness: float = OF_CAUSTICS,
) -> tuple[np.ndarray, np.ndarray]:
    """Irradiance of the surfaces that a camera sees, from the photons around them.

    With more photons splats shrink to the size of pixels, and the noise vanishes: it converges to what pixels show.

    Parameters
    ----------
    step : int
        Photons light one of `step`² pixels, and the others take their light from those (`upsampled`).
    tracer : Tracer, optional
        Tells where surfaces end; without it, it is too dark there (`share_of_splats`).
    fineness : float
        Of the light, for the radii (`n_in_splat`).

    Returns
    -------
    irradiance : (p, 3) float32, W/m²
    stderr : (p,) float32, W/m²
        Of its mean over colours.
    """

    def smooth_shading(k: np.ndarray) -> Response | None:
        return _smooth_shading(seen.where(k), photons)

    found = splat_light(camera, seen, photons, smooth_shading, workers, step, tracer, fineness)
    return found[:, :3], found[:, 3]


def splat_light(
    camera: Camera,
    seen: SeenSurface,
    photons: Photons,
    response: Callable[[np.ndarray], Response | None],
    workers: Workers,
    step: int,
    tracer: Tracer | None,
    fineness: float,
) -> np.ndarray:
    """What surfaces that a camera sees make of the photons around them, and its standard error, (p, 4) float32.

    Parameters
    ----------
    response : callable
        From indices of points to what these points make of photons.
    step, tracer, fineness
        As for `splat_irradiance`.
    """
    if len(seen) == 0 or len(photons) == 0:
        return np.zeros((len(seen), 4), np.float32)
    radius = splat_radius(camera, seen, photons, workers, fineness)
    to_edge = distance_to_edge(camera, seen) if tracer else None

    def light(k: np.ndarray) -> np.ndarray:
        part = seen.where(k)
        found = splat_photons(LitPoints(part.position, part.normal), photons, radius, workers, response(k))
        values = np.column_stack([found.light, found.stderr])
        if tracer is not None and to_edge is not None:
            values /= share_of_splats(tracer, part, to_edge[k], found.radius, workers)[:, None]
        return values

    return upsampled(camera, seen, step, light, workers)


def splat_radius(camera: Camera, seen: SeenSurface, photons: Photons, workers: Workers, fineness: float) -> np.ndarray:
    """Radii of splats, (p,) float32, m: by the photons' density, and no smaller than pixels.

    A pixel of side a covers a by a/cos θ of a surface, the area A = a²/cos θ. Splats hold the middle of one if they
    are as large as half its diagonal; 1/√2 of it, √(A (cos θ + 1/cos θ)/2), makes what they bring more even.
    """
    footprint = np.zeros(camera.n_pixels + 1, np.float32)
    cosine = np.maximum(np.abs(dot(seen.normal, seen.direction)), LEAST_COSINE)
    footprint[seen.pixel] = np.sqrt(seen.area * (cosine + 1 / cosine) / 2)
    least = footprint[camera.pixels(photons.position)]
    of_pixel = np.zeros(camera.n_pixels, np.float32)
    of_pixel[seen.pixel] = seen.area
    n, area = int(np.count_nonzero(least)), float(of_pixel.sum(dtype=np.float64))
    largest = path_density_radius(photons, area, n, fineness)
    smallest = footprint[seen.pixel].min(initial=np.inf)  # also of photons out of sight, which may lie in one place
    return np.maximum(neighbour_radius(photons, largest, workers, fineness), np.maximum(least, smallest))


def _smooth_shading(seen: SeenSurface, photons: Photons) -> Response | None:
    """What photons are worth where the shading normal is another than the surface's."""
    if np.array_equal(seen.shading_normal, seen.normal):
        return None

    def response(at: np.ndarray, of: np.ndarray) -> np.ndarray:
        correction = np.empty((len(at), 1), np.float32)
        _correct(seen.shading_normal, seen.normal, photons.packed_direction, at, of, correction)
        return correction

    return response


@kernel
def _correct(shading, normals, packed, at, of, out):
    """`shading_normal_correction` of pairs of a point and a photon."""
    for i in range(len(at)):
        smooth, normal, code = row(shading, at[i]), row(normals, at[i]), packed[of[i]]
        out[i, 0] = ONE
        if smooth != normal:
            out[i, 0] = shading_normal_correction(smooth, normal, octahedral_vector(code[0], code[1]))
