"""Light at vertices, as a colour attribute."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..addon.blender import bake_objects, check_color_attribute, receiver_meshes, write_color_attribute
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
    """Light is wanted in a colour attribute."""

    attribute: str = "Indirect"

    def read(self, depsgraph: Any, names: list[str] | None, progress: Progress, warnings: list[str]) -> "VertexTarget":
        """See `Wanted.read`."""
        objects = bake_objects(depsgraph, names, warnings)
        check_color_attribute(objects, self.attribute)
        return VertexTarget(receiver_meshes(objects, depsgraph, warnings, names is not None), self.attribute)


@dataclass(frozen=True)
class VertexTarget:
    """Meshes whose vertices or corners get light, and the name of their attribute."""

    meshes: list[ReceiverMesh]
    attribute: str

    @property
    def object_names(self) -> list[str]:
        return [mesh.object_name for mesh in self.meshes]

    def points(self, scene: Scene, tracer: Tracer, workers: Workers, warnings: list[str]) -> "VertexPoints":
        """See `Target.points`."""
        receivers = vertex_receivers(self.meshes)
        warnings += too_coarse(receivers)
        return VertexPoints(receivers, self.attribute)


@dataclass(frozen=True)
class VertexPoints:
    """Receivers at vertices."""

    receivers: Receivers
    attribute: str

    def lit_by(self, solution: "Solution", workers: Workers) -> "VertexPoints":
        """See `Points.lit_by`: nothing is."""
        return self

    def finish(self, irradiance: "Irradiance", workers: Workers) -> "VertexLight":
        """See `Points.finish`."""
        return VertexLight(self.receivers, irradiance, self.attribute)


@dataclass(frozen=True)
class VertexLight:
    """Light of vertices."""

    receivers: Receivers
    irradiance: "Irradiance"
    attribute: str

    @property
    def files(self) -> list[Path]:
        return []

    @property
    def counts(self) -> dict[str, int]:
        return {}

    def write(self) -> list[str]:
        """See `Product.write`."""
        return write_color_attribute(self.irradiance.value, self.receivers, self.attribute)


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
