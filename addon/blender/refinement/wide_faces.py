"""Whether meshes are too coarse for the light that a bake finds, by points in their widest faces."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...core.errors import BakeError
from ...pipeline.refinement import WIDEST, Placed, WidePoints
from ...receivers import ReceiverMesh, Receivers
from ..overrides import keeps_its_mesh
from .reading import check_refinable, placed

if TYPE_CHECKING:
    import bpy

    from ...gather import Irradiance
    from ...pipeline.solution import Solution


_MOST_OBJECTS = 256


@dataclass(frozen=True)
class WideFaces:
    """The widest triangles of the objects whose meshes can be refined.

    Attributes
    ----------
    meshes : list of Placed
        With those triangles alone.
    corners : list of (t, 3) int
        Elements of the meshes' light at the triangles' corners: vertices, or corners.
    target : list of int
        Which of the receivers' targets is each mesh's.
    """

    meshes: list[Placed]
    corners: list[np.ndarray]
    target: list[int]

    @staticmethod
    def of(
        objects: "list[bpy.types.Object]", meshes: list[ReceiverMesh], depsgraph: "bpy.types.Depsgraph"
    ) -> "WideFaces":
        """Those of objects with meshes that receivers are at, in these meshes' order."""
        by_name, wide = {obj.name: obj for obj in objects}, WideFaces([], [], [])
        order = np.argsort([-_face_size(mesh) for mesh in meshes], kind="stable")
        for i in sorted(order[:_MOST_OBJECTS].tolist()):
            mesh = meshes[i]
            obj = by_name.get(mesh.object_name)
            if obj is None or mesh.map is not None or keeps_its_mesh(obj):
                continue
            try:
                check_refinable(obj, depsgraph)
            except BakeError:
                continue
            at, loops = placed(obj, mesh, WIDEST)
            wide.meshes.append(at)
            wide.corners.append(at.corner if mesh.domain == "POINT" else loops)
            wide.target.append(i)
        return wide

    def lit_by(self, solution: "Solution", seed: int) -> WidePoints | None:
        """Points in these triangles, with the light of a solution; None without any."""
        samples = WidePoints.of(self.meshes, seed)
        if samples is None:
            return None
        found = solution.gather(samples.receivers)
        return samples.lit(found.value, found.stderr)

    def coarse(self, samples: WidePoints | None, receivers: Receivers, light: "Irradiance") -> list[str]:
        """Names of the objects whose light at receivers does not tell the light of points between them."""
        if samples is None or not len(light.value):
            return []
        of_targets = [receivers.targets[i].receiver_of_element for i in self.target]
        at = np.concatenate([of[corner] for of, corner in zip(of_targets, self.corners, strict=True)])
        mean = float(light.value.mean(dtype=np.float64))
        return samples.coarse(light.value[at], light.stderr[at], mean, light.relative_noise)


def _face_size(mesh: ReceiverMesh) -> float:
    """About the area of a mesh's faces, m²: which meshes are worth a look, among many."""
    if not len(mesh.corner_face):
        return 0.0
    extent = np.ptp(mesh.positions, axis=0).astype(np.float64)
    return float((extent**2).sum()) / (int(mesh.corner_face[-1]) + 1)
