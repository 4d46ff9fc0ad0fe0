"""What is lit: meshes, materials, lights and world as NumPy arrays in world space (metres, scene-linear Rec.709)."""

from .closures import (
    N_ANGLES,
    AngleCurves,
    Closures,
    Distribution,
    FibreModel,
    FresnelCurve,
    Lobe,
    NormalSpace,
    angle_cosines,
)
from .light_groups import OTHER, LightGroups
from .lights import ALL_BOUNCES, AREA_LAMPS, LightKind, LightPattern, Lights, PatternDomain
from .materials import N_VIEWS, Channel, Materials
from .media import Media, Medium, VoxelGrid
from .ray_kinds import RayKind, seen_by
from .scene import EmitterLinks, Scene, SceneObjects, ShadingFrames
from .textures import Textures
from .world import World

__all__ = [
    "ALL_BOUNCES",
    "AREA_LAMPS",
    "N_ANGLES",
    "N_VIEWS",
    "OTHER",
    "AngleCurves",
    "Channel",
    "Closures",
    "Distribution",
    "EmitterLinks",
    "FibreModel",
    "FresnelCurve",
    "LightGroups",
    "LightKind",
    "LightPattern",
    "Lights",
    "Lobe",
    "Materials",
    "Media",
    "Medium",
    "NormalSpace",
    "PatternDomain",
    "RayKind",
    "Scene",
    "SceneObjects",
    "ShadingFrames",
    "Textures",
    "VoxelGrid",
    "World",
    "angle_cosines",
    "seen_by",
]
