"""Where light is wanted: points with a normal, and where each one's value goes."""

from .camera import Camera, SeenSurface, seen_surface
from .lightmap import LightmapMesh, Texels, texel_receivers
from .receivers import AttributeTarget, Receivers
from .vertices import ReceiverMesh, vertex_receivers

__all__ = [
    "AttributeTarget",
    "Camera",
    "LightmapMesh",
    "ReceiverMesh",
    "Receivers",
    "SeenSurface",
    "Texels",
    "seen_surface",
    "texel_receivers",
    "vertex_receivers",
]
