"""Where light is wanted: points with a normal, and where each one's value goes."""

from .receivers import AttributeTarget, Receivers
from .vertices import ReceiverMesh, vertex_receivers

__all__ = ["AttributeTarget", "ReceiverMesh", "Receivers", "vertex_receivers"]
