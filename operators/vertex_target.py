"""Light at vertices, as a colour attribute."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..addon.blender import bake_objects, check_color_attribute, receiver_meshes
from ..addon.blender.baked_copies import (
    CopyMesh,
    check_copied,
    copyable,
    read_copies,
    shown_meshes,
    warn_of_shared_light,
    write_light,
)
from ..addon.blender.vertex_meshes import check_target
from ..addon.blender.warn import Warnings
from ..addon.parallel import Workers
from ..addon.progress import Progress
from ..addon.receivers import ReceiverMesh, Receivers, vertex_receivers
from ..addon.scene import Scene
from ..addon.tracers import Tracer

if TYPE_CHECKING:
    from ..addon.bake import Solution
    from ..addon.gather import Irradiance


@dataclass(frozen=True)
class WantedVertices:
    """Light is wanted in a colour attribute.

    Attributes
    ----------
    attribute : str
    copies : bool
        Whether objects whose mesh cannot hold their light get copies with meshes of their own.
    """

    attribute: str = "Indirect"
    copies: bool = False

    def read(self, depsgraph: Any, names: list[str] | None, progress: Progress, warnings: list[str]) -> "VertexTarget":
        """See `Wanted.read`."""
        read = self._with_copies if self.copies else self._without_copies
        return read(depsgraph, names, warnings)

    def _without_copies(self, depsgraph: Any, names: list[str] | None, warnings: list[str]) -> "VertexTarget":
        objects = bake_objects(depsgraph, names, warnings)
        check_color_attribute(objects, self.attribute)
        meshes = receiver_meshes(objects, depsgraph, warnings, names is not None)
        if names is None:
            warn_of_shared_light(shown_meshes(depsgraph), Warnings(warnings))
        return VertexTarget(meshes, [], self.attribute)

    def _with_copies(self, depsgraph: Any, names: list[str] | None, warnings: list[str]) -> "VertexTarget":
        shown = shown_meshes(depsgraph)
        copied = set(copyable(shown, names, Warnings(warnings)))

        def check(obj: Any, graph: Any) -> None:
            check_copied(obj, graph) if obj in copied else check_target(obj, graph)

        candidates = [obj for obj in shown if obj in copied or obj.type == "MESH"]
        objects = bake_objects(depsgraph, names, warnings, check, candidates)
        own = [obj for obj in objects if obj not in copied]
        check_color_attribute(own, self.attribute)
        replaceable = [obj for obj in own if obj in shown and shown[obj].all_meshes and obj.is_editable]
        others = [obj for obj in own if obj not in replaceable]
        flawed: list[Any] = []
        meshes = receiver_meshes(replaceable, depsgraph, warnings, names is not None, flawed)
        meshes += receiver_meshes(others, depsgraph, warnings, names is not None)
        copies = read_copies([obj for obj in objects if obj in copied or obj in flawed], depsgraph)
        return VertexTarget(meshes, copies, self.attribute)


@dataclass(frozen=True)
class VertexTarget:
    """Meshes whose vertices or corners get light, those that get copies with it, and the name of the attribute."""

    meshes: list[ReceiverMesh]
    copies: list[CopyMesh]
    attribute: str

    @property
    def object_names(self) -> list[str]:
        return [*(mesh.object_name for mesh in self.meshes), *dict.fromkeys(copy.owner for copy in self.copies)]

    def points(self, scene: Scene, tracer: Tracer, workers: Workers, warnings: list[str]) -> "VertexPoints":
        """See `Target.points`."""
        receivers = vertex_receivers([*self.meshes, *(copy.mesh for copy in self.copies)])
        warnings += too_coarse(receivers)
        return VertexPoints(receivers, self)


@dataclass(frozen=True)
class VertexPoints:
    """Receivers at vertices."""

    receivers: Receivers
    target: VertexTarget

    def lit_by(self, solution: "Solution", workers: Workers) -> "VertexPoints":
        """See `Points.lit_by`: nothing is."""
        return self

    def finish(self, irradiance: "Irradiance", workers: Workers) -> "VertexLight":
        """See `Points.finish`."""
        return VertexLight(self.receivers, irradiance, self.target)


@dataclass(frozen=True)
class VertexLight:
    """Light of vertices."""

    receivers: Receivers
    irradiance: "Irradiance"
    target: VertexTarget

    @property
    def files(self) -> list[Path]:
        return []

    @property
    def counts(self) -> dict[str, int]:
        return {"baked_copies": len(self.target.copies)} if self.target.copies else {}

    def write(self) -> list[str]:
        """See `Product.write`."""
        return write_light(self.irradiance.value, self.receivers, self.target.copies, self.target.attribute)


def too_coarse(receivers: Receivers) -> list[str]:
    """Warnings of objects with faces wider than all the rest: light within such a face is not seen by its vertices."""
    from ..addon.photons import region_of

    if len(receivers) == 0:
        return []
    widest = region_of(receivers.position).radius
    return [
        f"Object '{target.object_name}' has too few vertices for its size to show light: subdivide it."
        for target in receivers.targets
        if (receivers.footprint[target.receiver_of_element[target.receiver_of_element >= 0]] > widest).any()
    ]
