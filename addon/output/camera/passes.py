"""What a camera's pass holds."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

LEAST_ALBEDO = np.float32(1e-3)
"""Below which light that falls on a surface is not to be had by division from what it reflects."""


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
        Of diffuse and translucent lobes, times what mirrors, glass and media before them leave.
    normal : 1
        Unit shading normals in the world, their mean over a pixel.
    depth : (height, width) float32, m
    error : (height, width) float32, W/(m² sr)
        Estimated standard error of `indirect`, its mean over colours.
    volume : W/(m² sr), or None
        Radiance that media scatter to the camera, before its rays come to a surface, of indirect light.
    transmittance : 1, or None
        What media leave of light between the camera and the first surfaces. Both None in a scene without media.
    apart : dict of str to (height, width, 3) float32, W/(m² sr)
        The parts of `indirect` that are the light of light groups, by their names.
    """

    indirect_diffuse: np.ndarray
    caustics: np.ndarray
    glossy: np.ndarray
    albedo: np.ndarray
    normal: np.ndarray
    depth: np.ndarray
    error: np.ndarray
    volume: np.ndarray | None = None
    transmittance: np.ndarray | None = None
    apart: Mapping[str, np.ndarray] = field(default_factory=dict)

    @staticmethod
    def together(parts: "Mapping[str, CameraPass]") -> "CameraPass":
        """The pass of all light groups, from those of each, whose errors are independent."""
        first = next(iter(parts.values()))
        sums = {
            name: np.sum([getattr(one, name) for one in parts.values()], axis=0)
            for name in ("indirect_diffuse", "caustics", "glossy", *(() if first.volume is None else ("volume",)))
        }
        error = np.sqrt(np.sum([one.error**2 for one in parts.values()], axis=0))
        return replace(first, **sums, error=error, apart={name: one.indirect for name, one in parts.items()})

    @staticmethod
    def mean(parts: "Sequence[CameraPass]") -> "CameraPass":
        """What a shutter shows that was open at several times, whose errors are independent; depth is the middle's.

        Radiances are averaged, and what falls on surfaces by how much of it these reflect.
        """
        albedo = np.mean([one.albedo for one in parts], axis=0)
        reflected = np.mean([one.indirect_diffuse * one.albedo for one in parts], axis=0)
        plain = np.mean([one.indirect_diffuse for one in parts], axis=0)
        return CameraPass(
            indirect_diffuse=np.where(albedo > LEAST_ALBEDO, reflected / np.maximum(albedo, LEAST_ALBEDO), plain),
            caustics=np.mean([one.caustics for one in parts], axis=0),
            glossy=np.mean([one.glossy for one in parts], axis=0),
            albedo=albedo,
            normal=np.mean([one.normal for one in parts], axis=0),
            depth=parts[len(parts) // 2].depth,
            error=np.sqrt(np.mean([one.error**2 for one in parts], axis=0) / np.float32(len(parts))),
            volume=_mean_where_any([one.volume for one in parts], 0),
            transmittance=_mean_where_any([one.transmittance for one in parts], 1),
        )

    @property
    def indirect(self) -> np.ndarray:
        """Indirect radiance, W/(m² sr): IndirectDiffuse × Albedo + Caustics + Glossy, and Volume where there is one."""
        of_surfaces = self.indirect_diffuse * self.albedo + self.caustics + self.glossy
        return of_surfaces if self.volume is None else of_surfaces + self.volume


def _mean_where_any(pictures: "Sequence[np.ndarray | None]", without: float) -> np.ndarray | None:
    """The mean of pictures, of which those that are None have one value all over; None if all are."""
    first = next((one for one in pictures if one is not None), None)
    if first is None:
        return None
    return np.mean([np.full_like(first, without) if one is None else one for one in pictures], axis=0)
