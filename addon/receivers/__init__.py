"""Where light is wanted: points with a normal, and where each one's value goes."""

from .attribute_map import AttributeMap, unreached_share
from .camera.camera import Camera, SeenSurface, seen_surface
from .camera.lenses import Equirectangular, Fisheye, Lens, Orthographic, Perspective
from .camera.pixel_filter import PixelFilter
from .camera.points import CameraPoints, camera_points, diffuse_colors
from .face_samples import FaceSamples, ShownFaces, face_samples
from .lightmap.charts import Charts, LightmapMesh
from .lightmap.seams import Seams
from .lightmap.texels import Texels, texel_receivers
from .normal_maps import on_normal_maps
from .probes import ProbeGrid, ProbePlaces, grid_in_box, without_surroundings
from .receivers import AttributeTarget, Receivers
from .riding import Ride, Riding
from .vertices import IN_PLACE, ReceiverMesh, joined, vertex_receivers

__all__ = [
    "IN_PLACE",
    "AttributeMap",
    "AttributeTarget",
    "Camera",
    "CameraPoints",
    "Charts",
    "Equirectangular",
    "FaceSamples",
    "Fisheye",
    "Lens",
    "LightmapMesh",
    "Orthographic",
    "Perspective",
    "PixelFilter",
    "ProbeGrid",
    "ProbePlaces",
    "ReceiverMesh",
    "Receivers",
    "Ride",
    "Riding",
    "Seams",
    "SeenSurface",
    "ShownFaces",
    "Texels",
    "camera_points",
    "diffuse_colors",
    "face_samples",
    "grid_in_box",
    "joined",
    "on_normal_maps",
    "seen_surface",
    "texel_receivers",
    "unreached_share",
    "vertex_receivers",
    "without_surroundings",
]
