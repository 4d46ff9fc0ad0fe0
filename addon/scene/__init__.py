"""What is lit: meshes, materials, lights and world as NumPy arrays in world space (metres, scene-linear Rec.709)."""

from .lights import LightKind, Lights
from .materials import Materials, Textures
from .scene import Scene, SceneObjects

__all__ = ["LightKind", "Lights", "Materials", "Scene", "SceneObjects", "Textures"]
