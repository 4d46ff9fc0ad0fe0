"""Where light is wanted: points with a normal, and where each one's value goes."""

from .camera import Camera, SeenSurface, seen_surface
from .charts import Charts, LightmapMesh
from .lightmap import Texels, texel_receivers
from .receivers import AttributeTarget, Receivers
from .seams import Seams
from .vertices import ReceiverMesh, vertex_receivers

__all__ = [
    "AttributeTarget",
    "Camera",
    "Charts",
    "LightmapMesh",
    "ReceiverMesh",
    "Receivers",
    "Seams",
    "SeenSurface",
    "Texels",
    "seen_surface",
    "texel_receivers",
    "vertex_receivers",
]
