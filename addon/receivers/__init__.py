"""Where light is wanted: points with a normal, and where each one's value goes."""

from .camera import Camera, SeenSurface, seen_surface
from .receivers import AttributeTarget, Receivers
from .vertices import ReceiverMesh, vertex_receivers

__all__ = [
    "AttributeTarget",
    "Camera",
    "ReceiverMesh",
    "Receivers",
    "SeenSurface",
    "seen_surface",
    "vertex_receivers",
]
