"""Blender materials as albedo and emission."""

from dataclasses import dataclass, field, replace

import bpy
import numpy as np
from mathutils import Euler

from ..scene import Channel, Materials
from .images import ImageTable
from .nodes import number, source, surface_node, uses_nodes, vector
from .warn import Warnings

DEFAULT_GREY = 0.8
"""Cycles' albedo where there is no material; also taken for materials that cannot be read."""


@dataclass(frozen=True)
class Coordinates:
    """Where a material's image takes its texture coordinates from.

    Attributes
    ----------
    uv_map : str
        Name of a UV map; empty for the one that is active for rendering.
    matrix : (2, 2) float64
    offset : (2,) float64
        What a Mapping node makes of them: matrix @ uv + offset.
    """

    uv_map: str = ""
    matrix: np.ndarray = field(default_factory=lambda: np.eye(2))
    offset: np.ndarray = field(default_factory=lambda: np.zeros(2))


@dataclass(frozen=True)
class Surface:
    """One material, as `Materials` holds it in columns."""

    name: str
    albedo: np.ndarray
    emission: np.ndarray = field(default_factory=lambda: np.zeros(3))
    texture: int = -1
    coordinates: Coordinates = field(default_factory=Coordinates)
    roughness: float = 1.0
    metallic: float = 0.0
    transmission: float = 0.0
    ior: float = 1.5
    alpha: float = 1.0


class MaterialTable:
    """The materials that triangles use, each read once."""

    def __init__(self, warnings: Warnings) -> None:
        self._warnings = warnings
        self._images = ImageTable()
        self._index: dict[str, int] = {}
        self._surfaces: list[Surface] = []

    def add(self, material: "bpy.types.Material | None") -> int:
        """Index of a material; None is Cycles' default grey."""
        key = repr(material.original) if material else ""
        if key not in self._index:
            surface = _Reader(material, self._images, self._warnings).read() if material else _grey("Default")
            self._surfaces.append(surface)
            self._index[key] = len(self._surfaces) - 1
        return self._index[key]

    def coordinates(self, index: int) -> Coordinates | None:
        """Texture coordinates that a material reads, or None where it has no texture."""
        surface = self._surfaces[index]
        return surface.coordinates if surface.texture >= 0 else None

    def materials(self) -> Materials:
        """All materials, in columns."""
        rows = self._surfaces

        def column(name: str, dtype: type = np.float32) -> np.ndarray:
            return np.array([getattr(row, name) for row in rows], dtype)

        return Materials.of(
            len(rows),
            names=tuple(row.name for row in rows),
            diffuse=Channel(np.clip(column("albedo").reshape(-1, 3), 0, 1), column("texture", np.int32)),
            emission=Channel.constant(np.maximum(column("emission").reshape(-1, 3), 0)),
            textures=self._images.textures(),
        )


def _grey(name: str) -> Surface:
    return Surface(name, np.full(3, DEFAULT_GREY))


class _Reader:
    """Reads one material."""

    def __init__(self, material: "bpy.types.Material", images: ImageTable, warnings: Warnings) -> None:
        self.material = material
        self.images = images
        self.warnings = warnings

    def warn(self, what: str) -> None:
        self.warnings.add(f"Material '{self.material.name}': {what}.")

    def read(self) -> Surface:
        name = self.material.name
        if not uses_nodes(self.material):
            # What Cycles makes of a material without nodes is matte in the viewport colour.
            return Surface(name, np.array(self.material.diffuse_color[:3]))
        node = surface_node(self.material)
        if node is None:
            return Surface(name, np.zeros(3))
        if node.type == "BSDF_PRINCIPLED":
            return self.principled(node)
        if node.type == "BSDF_DIFFUSE":
            return self.colored(_grey(name), node.inputs["Color"])
        if node.type == "EMISSION":
            return Surface(name, np.zeros(3), self.emission(node.inputs["Color"], node.inputs["Strength"]))
        self.warn(f"a surface made by {node.bl_label} cannot be read yet and is baked as {DEFAULT_GREY:g} grey")
        return _grey(name)

    def principled(self, node: "bpy.types.Node") -> Surface:
        def value(socket: str, default: float) -> float:
            read = number(node.inputs[socket])
            return default if read is None else read

        surface = Surface(
            self.material.name,
            np.full(3, DEFAULT_GREY),
            self.emission(node.inputs["Emission Color"], node.inputs["Emission Strength"]),
            roughness=value("Roughness", 0.5),
            metallic=value("Metallic", 0.0),
            transmission=value("Transmission Weight", 0.0),
            ior=value("IOR", 1.5),
            alpha=value("Alpha", 1.0),
        )
        if surface.transmission > 0 or surface.alpha < 1 or source(node.inputs["Alpha"]):
            self.warn("it lets light through, but is baked as opaque in this version")
        if surface.metallic > 0 or source(node.inputs["Metallic"]):
            self.warn("it is metal, but is baked as diffuse in this version")
        return self.colored(surface, node.inputs["Base Color"])

    def emission(self, color: "bpy.types.NodeSocket", strength: "bpy.types.NodeSocket") -> np.ndarray:
        """Emitted radiance, (3,) W/(m² sr): colour × strength."""
        scale, tint = number(strength), vector(color)
        if scale is None:
            self.warn("its emission strength comes from nodes that cannot be read yet, so it emits nothing")
            return np.zeros(3)
        if scale == 0:
            return np.zeros(3)
        upstream = source(color)
        if tint is None and upstream and upstream.node.type == "TEX_IMAGE" and upstream.node.image:
            self.warn("its emission texture is baked as the picture's mean colour")
            tint = self.images.mean(self.image(upstream.node))
        if tint is None:
            self.warn("its emission colour comes from nodes that cannot be read yet and is taken as white")
            tint = np.ones(3)
        return tint * scale

    def colored(self, surface: Surface, socket: "bpy.types.NodeSocket") -> Surface:
        """`surface` with the base colour that `socket` gives."""
        color = vector(socket)
        if color is not None:
            return replace(surface, albedo=color)
        upstream = source(socket)
        assert upstream is not None  # an unlinked socket has a colour
        node = upstream.node
        if node.type != "TEX_IMAGE" or upstream.name != "Color":
            self.warn(
                f"its base colour, from {node.bl_label}, cannot be read yet and is baked as {DEFAULT_GREY:g} grey"
            )
            return surface
        if node.image is None:
            return replace(surface, albedo=np.zeros(3))
        image, coordinates = self.image(node), self.coordinates(node)
        if coordinates is None:
            self.warn("its image is placed by nodes that cannot be read yet and is baked as the picture's mean colour")
            return replace(surface, albedo=self.images.mean(image))
        return replace(surface, albedo=np.ones(3), texture=image, coordinates=coordinates)

    def image(self, node: "bpy.types.Node") -> int:
        if node.image.source in {"TILED", "SEQUENCE", "MOVIE"}:
            self.warn(f"of image '{node.image.name}' only the first tile or frame is baked")
        return self.images.add(node.image, self.material.name, cut_by_alpha=not node.outputs["Alpha"].is_linked)

    def coordinates(self, node: "bpy.types.Node") -> Coordinates | None:
        """Texture coordinates of an image node, or None where they are no UV map's."""
        if node.projection != "FLAT":
            return None
        if node.extension != "REPEAT":
            self.warn("its image is repeated, although the node clips or extends it")
        upstream = source(node.inputs["Vector"])
        if upstream and upstream.node.type == "MAPPING":
            return _mapped(upstream.node)
        return _uv_map(upstream)


def _uv_map(upstream: "bpy.types.NodeSocket | None") -> Coordinates | None:
    if upstream is None or (upstream.node.type == "TEX_COORD" and upstream.name == "UV"):
        return Coordinates()
    if upstream.node.type == "UVMAP":
        return Coordinates(upstream.node.uv_map)
    return None


def _mapped(node: "bpy.types.Node") -> Coordinates | None:
    """Coordinates through a Mapping node of constants; the texture lies in the plane z = 0."""
    upstream = source(node.inputs["Vector"])
    coordinates = _uv_map(upstream) if upstream else None
    if coordinates is None or node.vector_type != "POINT":
        return None
    location, rotation, scale = (vector(node.inputs[name]) for name in ("Location", "Rotation", "Scale"))
    if location is None or rotation is None or scale is None:
        return None
    matrix = np.array(Euler(rotation).to_matrix()) * scale
    return replace(coordinates, matrix=matrix[:2, :2], offset=location[:2])
