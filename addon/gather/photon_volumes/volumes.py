"""The light of photons in the pixels of a camera."""

import numpy as np

from ...parallel import Workers
from ...photons import Photons
from ...photons.scattering import shading_ratio
from ...receivers import Camera, SeenSurface
from ...receivers.camera import LEAST_COSINE
from ...sampling.octahedral import decode_octahedral
from ...sampling.vectors import dot
from ...tracers import Tracer
from ..upsampling import upsampled
from .edges import share_of_volumes
from .radius import neighbour_radius, path_density_radius
from .scatter import Points, Response, scatter_light


def photon_volume_irradiance(
    camera: Camera,
    seen: SeenSurface,
    photons: Photons,
    workers: Workers,
    step: int = 1,
    tracer: Tracer | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Irradiance of the surfaces that a camera sees, from the photons around them.

    With more photons volumes shrink to the size of pixels, and the noise vanishes: it converges to what pixels show.

    Parameters
    ----------
    step : int
        Photons light one of `step`² pixels, and the others take their light from those (`upsampled`).
    tracer : Tracer, optional
        Tells where surfaces end; without it, it is too dark there (`share_of_volumes`).

    Returns
    -------
    irradiance : (p, 3) float32, W/m²
    stderr : (p,) float32, W/m²
        Of its mean over colours.
    """
    radius = volume_radius(camera, seen, photons, workers)

    def light(part: SeenSurface) -> np.ndarray:
        points = Points(part.position, part.normal)
        found = scatter_light(points, photons, radius, workers, _smooth_shading(part, photons))
        values = np.column_stack([found.light, found.stderr])
        return values / share_of_volumes(tracer, camera, part, found.radius, workers)[:, None] if tracer else values

    found = upsampled(camera, seen, step, light)
    return found[:, :3], found[:, 3]


def volume_radius(camera: Camera, seen: SeenSurface, photons: Photons, workers: Workers) -> np.ndarray:
    """Radii of photon volumes, (p,) float32, m: by the photons' density, and no smaller than pixels.

    A pixel of side a covers a by a/cos θ of a surface, the area A = a²/cos θ. Volumes hold the middle of one if they
    are as large as half its diagonal; 1/√2 of it, √(A (cos θ + 1/cos θ)/2), makes what they bring more even.
    """
    footprint = np.zeros(camera.n_pixels + 1, np.float32)
    cosine = np.maximum(np.abs(dot(seen.normal, seen.direction)), LEAST_COSINE)
    footprint[seen.pixel] = np.sqrt(seen.area * (cosine + 1 / cosine) / 2)
    least = footprint[camera.pixels(photons.position)]
    of_pixel = np.zeros(camera.n_pixels, np.float32)
    of_pixel[seen.pixel] = seen.area
    n, area = int(np.count_nonzero(least)), float(of_pixel.sum(dtype=np.float64))
    largest = path_density_radius(photons, area, n)
    smallest = footprint[seen.pixel].min(initial=np.inf)  # also of photons out of sight, which may lie in one place
    return np.maximum(neighbour_radius(photons, largest, workers), np.maximum(least, smallest))


def _smooth_shading(seen: SeenSurface, photons: Photons) -> Response | None:
    """What photons are worth where the shading normal is another than the surface's (`shading_ratio`)."""
    smooth = (seen.shading_normal != seen.normal).any(axis=1)
    if not smooth.any():
        return None

    def response(at: np.ndarray, of: np.ndarray) -> np.ndarray:
        ratio = np.ones((len(at), 1), np.float32)
        k = np.flatnonzero(smooth[at])
        directions = photons.packed_direction[of[k]]
        ratio[k, 0] = shading_ratio(seen.shading_normal[at[k]], seen.normal[at[k]], decode_octahedral(directions))
        return ratio

    return response
