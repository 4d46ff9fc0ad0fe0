"""What a camera's pass holds."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class CameraPass:
    """Pictures (height, width, 3) float32, from the top; 0 where nothing is seen.

    Attributes
    ----------
    indirect_diffuse : W/(m² sr)
        E/π by indirect light, that of Cycles' pass Diffuse Indirect.
    caustics : W/(m² sr)
        Radiance that diffuse surfaces reflect of what lamps send over mirrors and glass.
    glossy : W/(m² sr)
        Radiance that glossy surfaces reflect of other surfaces, and what is seen in mirrors and through glass beyond
        the indirect light of it.
    albedo : 1
        Of diffuse and translucent lobes, times what mirrors and glass before them leave.
    normal : 1
        Unit shading normals in the world, their mean over a pixel.
    depth : (height, width) float32, m
    error : (height, width) float32, W/(m² sr)
        Estimated standard error of `indirect`, its mean over colours.
    """

    indirect_diffuse: np.ndarray
    caustics: np.ndarray
    glossy: np.ndarray
    albedo: np.ndarray
    normal: np.ndarray
    depth: np.ndarray
    error: np.ndarray

    @property
    def indirect(self) -> np.ndarray:
        """Indirect radiance, W/(m² sr): IndirectDiffuse × Albedo + Caustics + Glossy."""
        return self.indirect_diffuse * self.albedo + self.caustics + self.glossy
