"""The light that a camera sees, from one photon solve: what is smooth over a grid, caustics over the pixels."""

from dataclasses import dataclass

import numpy as np
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.emitters import light_sources, region_of
from photon_bake.addon.gather import Cascade, glossy_radiance, screen_irradiance
from photon_bake.addon.photons import PathKind, trace_photons
from photon_bake.addon.receivers import Camera, diffuse_colors, seen_surface
from photon_bake.addon.scene import Scene
from photon_bake.addon.settings.bake import BakeSettings
from photon_bake.addon.tracing import EmbreeTracer, TransparencyTracer


@dataclass(frozen=True)
class CameraLight:
    """Pictures (height, width, 3) float32 of what lies behind each pixel, from the top; 0 where nothing does.

    Attributes
    ----------
    indirect : W/m²
        Irradiance by light that was scattered diffusely, read from the light volume.
    caustics : W/m²
        Irradiance by light that came over mirrors and glass alone, from the screen-space volume.
    glossy : W/(m² sr)
        What the surface's glossy lobe reflects of the volume's light to the camera.
    albedo : 1
        Of the surface's diffuse lobe, as far as gloss over it lets it be seen.
    """

    indirect: np.ndarray
    caustics: np.ndarray
    glossy: np.ndarray
    albedo: np.ndarray

    @property
    def radiance(self) -> np.ndarray:
        """Indirect light that the camera gets, (height, width, 3) float32, W/(m² sr)."""
        return self.albedo * (self.indirect + self.caustics) / np.float32(np.pi) + self.glossy


def bake_camera(
    scene: Scene, camera: Camera, settings: BakeSettings, tracer: EmbreeTracer, progress: Progress | None = None
) -> CameraLight:
    """Trace photons through `scene` and gather them at what `camera` sees (Fei and Wang, section 4).

    Raises
    ------
    Cancelled
        If `progress` was cancelled.
    """
    workers = Workers(settings.seed, settings.n_threads, progress or Progress(), settings.memory)
    light_tracer = TransparencyTracer(scene, tracer, workers.progress)
    seen = seen_surface(scene, light_tracer, camera)
    if len(seen) == 0:
        black = np.zeros((camera.height, camera.width, 3), np.float32)
        return CameraLight(black, black, black, black)
    home, bounces = region_of(seen.position), settings.max_bounces
    sources = light_sources(scene, home)
    photons = trace_photons(scene, light_tracer, sources, settings.n_photons, bounces, workers, region=home)

    smooth = photons.where(photons.kind == PathKind.INDIRECT)
    volumes = Cascade.of_photons(scene, light_tracer, smooth, seen.position, settings.n_grid_cells, workers)
    lifted = seen.position + scene.ray_offset(seen.hits.triangle, seen.position) * seen.normal
    indirect, _ = volumes.irradiance(lifted, seen.shading_normal, workers)
    focused = photons.where(photons.kind == PathKind.CAUSTIC)
    caustics, _ = screen_irradiance(camera, seen, focused, workers)
    glossy = glossy_radiance(scene, seen, volumes, workers)
    albedo, _ = diffuse_colors(scene, seen)

    def picture(values: np.ndarray) -> np.ndarray:
        pixels = np.zeros((camera.n_pixels, 3), np.float32)
        pixels[seen.pixel] = values
        return pixels.reshape(camera.height, camera.width, 3)

    return CameraLight(picture(indirect), picture(caustics), picture(glossy), picture(albedo))
