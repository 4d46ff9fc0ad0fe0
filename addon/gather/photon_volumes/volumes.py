"""The light of photons in the pixels of a camera."""

import numpy as np

from ...parallel import Workers
from ...photons import Photons
from ...photons.scattering import shading_ratio
from ...receivers import Camera, SeenSurface
from ...sampling.octahedral import decode_octahedral
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
    """Radii of photon volumes, (p,) float32, m: by the photons' density, at least so that a pixel's area is covered."""
    footprint = np.zeros(camera.n_pixels + 1, np.float32)
    footprint[seen.pixel] = np.sqrt(seen.area / np.float32(np.pi))
    least = footprint[camera.pixels(photons.position)]
    n, area = int(np.count_nonzero(least)), np.pi * float(np.sum(footprint**2, dtype=np.float64))
    largest = path_density_radius(photons, area, n)
    return np.maximum(neighbour_radius(photons, largest, workers), least)


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
