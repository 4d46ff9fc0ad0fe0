"""glTF files that have baked light where engines look for it: lightmaps by TEXCOORD_1, vertices' light by _INDIRECT."""

from .export import Exported, export_gltf

__all__ = ["Exported", "export_gltf"]
