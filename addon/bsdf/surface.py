"""Points on surfaces, as the scattering sees them."""

from dataclasses import dataclass, fields

import numpy as np

from ..core.sampling.vectors import rows
from ..scene import Channel, Scene


@dataclass(frozen=True)
class Surface:
    """What n points do to the light that comes to one side of them; the channels are those of `Materials`.

    Attributes
    ----------
    diffuse, translucent, f0, f90, glass_reflection, glass_transmission : (n, 3) float32
    roughness, fresnel_ior, layer_f0 : (n,) float32
    glass_ior : (n,) float32
        Index of refraction beyond the surface over that of the side the light came to.
    preserves_energy, glass_fresnel : (n,) bool
    """

    diffuse: np.ndarray
    translucent: np.ndarray
    f0: np.ndarray
    f90: np.ndarray
    glass_reflection: np.ndarray
    glass_transmission: np.ndarray
    roughness: np.ndarray
    fresnel_ior: np.ndarray
    layer_f0: np.ndarray
    glass_ior: np.ndarray
    preserves_energy: np.ndarray
    glass_fresnel: np.ndarray

    def __len__(self) -> int:
        return len(self.roughness)

    def where(self, chosen: np.ndarray | slice) -> "Surface":
        """The points that `chosen` (indices, a mask or a slice) selects."""
        if isinstance(chosen, slice):
            return Surface(**{field.name: getattr(self, field.name)[chosen] for field in fields(self)})
        return Surface(**{field.name: rows(getattr(self, field.name), chosen) for field in fields(self)})


def surface_at(scene: Scene, triangle: np.ndarray, u: np.ndarray, v: np.ndarray, back: np.ndarray) -> Surface:
    """The surface at barycentric coordinates (u, v) of triangles, (n,) each, seen from the back where `back` is."""
    materials = scene.materials
    material = scene.material_of_triangle[triangle]

    def color(channel: Channel) -> np.ndarray:
        if not channel.nonzero.any():  # most scenes lack most lobes
            return np.zeros((len(triangle), 3), np.float32)
        return scene.look_up(channel, triangle, u, v)

    glass_ior = materials.glass_ior[material]
    return Surface(
        diffuse=color(materials.diffuse),
        translucent=color(materials.translucent),
        f0=color(materials.f0),
        f90=color(materials.f90),
        glass_reflection=color(materials.glass_reflection),
        glass_transmission=color(materials.glass_transmission),
        roughness=color(materials.roughness)[:, 0],
        fresnel_ior=materials.fresnel_ior[material],
        layer_f0=materials.layer_f0[material],
        glass_ior=np.where(back, 1 / glass_ior, glass_ior),
        preserves_energy=materials.preserves_energy[material],
        glass_fresnel=materials.glass_fresnel[material],
    )
