"""Surfaces of live light on the graphics card. Only while Blender draws: what is made then may be used then."""

from typing import TYPE_CHECKING, Any

import gpu
import numpy as np

from .looks import Looks
from .tables import table

if TYPE_CHECKING:
    from ...pipeline.live import LiveLight, LiveSurfaces


class DrawnSurfaces:
    """The surfaces, what they look like, and the newest light on them.

    Parameters
    ----------
    surfaces : LiveSurfaces
    """

    def __init__(self, surfaces: "LiveSurfaces") -> None:
        self.surfaces = surfaces
        self._batch = _batch(surfaces)
        self._tables: dict[str, Any] = {}
        self._made_of: dict[str, Any] = {}

    def light(self, light: "LiveLight") -> None:
        """Take light over that is newer."""
        if self._is_new("lights", light):
            self._tables["lights"] = table(np.stack([light.direct, light.indirect], axis=1).reshape(-1, 3), half=True)

    def looks(self, looks: Looks) -> None:
        """Take over what materials look like."""
        if self._is_new("materials", looks.materials):
            self._tables["materials"] = table(looks.materials)
        if self._is_new("pixels", looks.pixels):
            self._tables["images"], self._tables["pixels"] = table(looks.images), table(looks.pixels, half=True)

    def _is_new(self, name: str, value: Any) -> bool:
        new = self._made_of.get(name) is not value
        self._made_of[name] = value
        return new

    def textures(self, transforms: np.ndarray, shown: np.ndarray) -> dict[str, Any]:
        """What shaders look up.

        Parameters
        ----------
        transforms : (o, 4, 4) float32
            From where the surfaces have each object to where it is.
        shown : (o,) bool
            Which objects the view shows.
        """
        rows = np.zeros((len(transforms), 4, 4), np.float32)
        rows[:, :3], rows[:, 3, 0] = transforms[:, :3], shown
        key = rows.tobytes()
        if self._made_of.get("objects") != key:
            self._made_of["objects"], self._tables["objects"] = key, table(rows.reshape(-1, 4))
        return self._tables

    def draw(self, shader: Any) -> None:
        """Draw all triangles with a shader that is bound."""
        if self._batch is not None:
            self._batch.draw(shader)


def _batch(surfaces: "LiveSurfaces") -> Any:
    """All triangles, corner by corner; None where there are none."""
    if not surfaces.meshes:
        return None
    position = np.concatenate([mesh.position[mesh.triangles].reshape(-1, 3) for mesh in surfaces.meshes])
    uv = np.concatenate([mesh.uv[mesh.triangles].reshape(-1, 2) for mesh in surfaces.meshes])
    whole = np.empty((len(position), 3), np.float32)  # exact to 2²⁴
    start = 0
    for mesh in surfaces.meshes:
        own = slice(start, start + mesh.triangles.size)
        whole[own, 0] = mesh.triangles.ravel() + mesh.vertices.start
        whole[own, 1], whole[own, 2] = mesh.object, np.repeat(mesh.material, 3)
        start = own.stop
    arrays = {"position": position, "uv": uv, "whole": whole}
    form = gpu.types.GPUVertFormat()
    for name, values in arrays.items():
        form.attr_add(id=name, comp_type="F32", len=values.shape[1], fetch_mode="FLOAT")
    vertices = gpu.types.GPUVertBuf(form, len(position))
    for name, values in arrays.items():
        vertices.attr_fill(name, np.ascontiguousarray(values, np.float32))
    return gpu.types.GPUBatch(type="TRIS", buf=vertices)
