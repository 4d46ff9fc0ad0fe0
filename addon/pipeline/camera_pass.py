"""The pass of a camera: what a compositor adds to a render of direct light, from a solve of the light in the scene."""

from dataclasses import dataclass

import numpy as np

from ..core.parallel import Workers
from ..gather import (
    Irradiance,
    camera_gloss,
    caustic_points,
    reflected_direct,
    reflected_highlights,
    scattered_in_media,
    scattered_in_mirrors,
    splat_gloss,
    splat_irradiance,
    volume_caustics,
)
from ..output.camera import CameraPass
from ..output.camera.passes import LEAST_ALBEDO
from ..photons import PathKind
from ..receivers import CameraPoints
from ..scene import Scene
from .solution import Solution

_OF_GLOSS, _OF_CAUSTICS = (0.0, 0.3), (0.3, 0.4)
"""Parts of the stages in which photons are splatted; what is gathered by them has the rest."""


@dataclass(frozen=True)
class LightBeside:
    """What a pass has beside IndirectDiffuse.

    Attributes
    ----------
    caustics, glossy : (height, width, 3) float32, W/(m² sr)
    volume : (height, width, 3) float32 or None, W/(m² sr)
        None in a scene without media.
    error : (height, width) float32, W/(m² sr)
        Standard error of all together, its mean over colours.
    """

    caustics: np.ndarray
    glossy: np.ndarray
    volume: np.ndarray | None
    error: np.ndarray


def light_beside(
    scene: Scene, points: CameraPoints, solution: Solution, n_gloss_rays: int, n_media_rays: int, workers: Workers
) -> LightBeside:
    """What the points' pixels show beside the light that is gathered for them.

    Parameters
    ----------
    n_gloss_rays : int
        Of a point that reflects all light in its glossy lobe.
    n_media_rays : int
        Of a pixel before which there are media.
    """
    gloss, of_gloss = _gloss(scene, points, solution, n_gloss_rays, workers)
    caustics, of_caustics = _caustics(points, solution, workers.part(*_OF_CAUSTICS))
    direct = reflected_direct(scene, points, solution.direct, workers)
    highlights, of_highlights = reflected_highlights(
        scene, points, solution.direct, solution.tracer, n_gloss_rays, workers
    )
    glossy = points.beyond + points.picture(gloss + highlights) + _picture(points, direct)
    errors, volume = [of_caustics, of_gloss, _root_of_squares(points, of_highlights)], None
    if points.transmittance is not None:
        volume, of_volume = _volume(scene, points, solution, n_media_rays, workers)
        mirrored, of_mirrored = scattered_in_mirrors(scene, points, solution.rays, n_media_rays, workers)
        glossy, errors = glossy + mirrored, [*errors, of_volume, of_mirrored]
    return LightBeside(caustics, glossy, volume, np.sqrt(np.sum([one**2 for one in errors], axis=0)))


def camera_pass(points: CameraPoints, light: Irradiance, beside: LightBeside | None) -> CameraPass:
    """The pass of a camera's points.

    Parameters
    ----------
    light : Irradiance
        Of the points' receivers.
    beside : LightBeside or None
        None where the camera sees nothing.
    """
    colour = np.concatenate([points.front, points.back[points.through]])
    diffuse, albedo = _diffuse(points, colour, light)
    of_light = colour.mean(axis=1) * light.stderr / np.float32(np.pi)
    error = _picture(points, of_light[:, None])[..., 0]  # added up: those of a pixel's points are alike
    return CameraPass(
        indirect_diffuse=diffuse,
        caustics=beside.caustics if beside else np.zeros_like(diffuse),
        glossy=beside.glossy if beside else points.beyond,
        albedo=albedo,
        normal=points.normal,
        depth=points.depth,
        error=np.hypot(error, beside.error) if beside else error,
        volume=None if points.transmittance is None else beside.volume if beside else np.zeros_like(diffuse),
        transmittance=points.transmittance,
    )


def _diffuse(points: CameraPoints, colour: np.ndarray, light: Irradiance) -> tuple[np.ndarray, np.ndarray]:
    """E/π of pixels, the mean by what each point reflects of it, and albedo; (height, width, 3) each.

    Where next to nothing is reflected it is the mean over the points.
    """
    radiosity = light.passes["indirect"] / np.float32(np.pi)
    reflected, albedo = _picture(points, colour * radiosity), _picture(points, colour)
    plain = points.picture(radiosity[: len(points)] * points.share[:, None])
    share = points.picture(points.share[:, None])
    mean = plain / np.maximum(share, np.float32(1e-6))
    return np.where(albedo > LEAST_ALBEDO, reflected / np.maximum(albedo, LEAST_ALBEDO), mean), albedo


def _caustics(points: CameraPoints, solution: Solution, workers: Workers) -> tuple[np.ndarray, np.ndarray]:
    """Radiance (height, width, 3) by caustics on what the camera itself sees, and its standard error in pixels."""
    stderr = np.zeros(len(points), np.float32)
    k = np.flatnonzero(points.n_followed == 0)
    focused = solution.photons.where(solution.photons.kind == PathKind.CAUSTIC)
    radiance = np.zeros((len(points), 3), np.float32)
    if len(focused) and len(k):
        seen, tracer = points.seen.where(k), solution.tracer.surfaces
        irradiance, of_irradiance = splat_irradiance(points.camera, seen, focused, workers, tracer=tracer)
        radiance[k] = points.front[k] * irradiance / np.float32(np.pi)
        stderr[k] = points.front[k].mean(axis=1) * of_irradiance / np.float32(np.pi)
    return points.picture(radiance), points.picture(stderr[:, None])[..., 0]


def _volume(
    scene: Scene, points: CameraPoints, solution: Solution, n_rays: int, workers: Workers
) -> tuple[np.ndarray, np.ndarray]:
    """Radiance (height, width, 3) that media scatter before the first surfaces, and its standard error in pixels."""
    scattered, of_scattered = scattered_in_media(points, solution.rays, n_rays, workers)
    settings, setup = solution.settings, solution.setup
    photons = caustic_points(
        scene, setup.photon_tracer, solution.sources, settings.n_photons, settings.max_bounces, workers
    )
    caustics, of_caustics = volume_caustics(points, photons, solution.tracer, workers)
    return scattered + caustics, np.hypot(of_scattered, of_caustics)


def _gloss(
    scene: Scene, points: CameraPoints, solution: Solution, n_rays: int, workers: Workers
) -> tuple[np.ndarray, np.ndarray]:
    """Radiance (n, 3) that lobes of the points send to pixels, and its standard error in pixels (height, width)."""
    settings = solution.settings
    if settings.gather != "photon_volumes":
        radiance, stderr = camera_gloss(scene, points, solution.rays, n_rays, workers)
        return radiance, _root_of_squares(points, stderr)
    photons = solution.photons.where(solution.photons.kind != PathKind.DIRECT)
    camera, seen, surfaces = points.camera, points.seen, solution.tracer.surfaces
    step, part = settings.subsample, workers.part(*_OF_GLOSS)
    radiance, stderr = splat_gloss(scene, camera, seen, photons, part, step, surfaces)
    return points.tint * radiance, points.picture((points.tint.mean(axis=1) * stderr)[:, None])[..., 0]


def _picture(points: CameraPoints, rows: np.ndarray) -> np.ndarray:
    """Values (r, 3) of the points' receivers summed in each pixel."""
    values = rows[: len(points)].copy()
    values[points.through] += rows[len(points) :]
    return points.picture(values)


def _root_of_squares(points: CameraPoints, stderr: np.ndarray) -> np.ndarray:
    """Standard errors (n,) of points that are independent of each other, in pixels."""
    return np.sqrt(points.picture((stderr**2)[:, None])[..., 0])
