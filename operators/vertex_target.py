"""Light at vertices, as a colour attribute."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import bpy

from ..addon.blender import bake_objects, check_color_attribute, receiver_meshes
from ..addon.blender.as_read import AsRead
from ..addon.blender.baked_copies import write_light
from ..addon.blender.color_attribute import light_takers
from ..addon.blender.light_layers import attribute_of
from ..addon.blender.shown_meshes import (
    CopyMesh,
    check_copied,
    copyable,
    read_copies,
    shown_meshes,
    warn_of_shared_light,
)
from ..addon.blender.vertex_meshes import check_target
from ..addon.blender.warn import Warnings
from ..addon.errors import Advice
from ..addon.findings import counted
from ..addon.parallel import Workers
from ..addon.progress import Progress
from ..addon.receivers import ReceiverMesh, Receivers, vertex_receivers
from ..addon.scene import Scene
from ..addon.tracers import Tracer
from .written import Written

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
    groups : tuple of str
        Light groups that may get attributes of their own; empty where all light is baked together.
    """

    attribute: str = "Indirect"
    copies: bool = False
    groups: tuple[str, ...] = ()

    def read(
        self, depsgraph: Any, scene: Any, names: list[str] | None, progress: Progress, warnings: list[str]
    ) -> "VertexTarget":
        """See `Wanted.read`."""
        read = self._with_copies if self.copies else self._without_copies
        return read(depsgraph, names, progress, warnings)

    def _check(self, objects: list[Any]) -> None:
        for name in (self.attribute, *(attribute_of(self.attribute, group) for group in self.groups)):
            check_color_attribute(objects, name)

    def _without_copies(
        self, depsgraph: Any, names: list[str] | None, progress: Progress, warnings: list[str]
    ) -> "VertexTarget":
        objects = bake_objects(depsgraph, names, warnings)
        self._check(objects)
        meshes = receiver_meshes(objects, depsgraph, warnings, names is not None, progress=progress)
        if names is None:
            warn_of_shared_light(shown_meshes(depsgraph), Warnings(warnings))
        return VertexTarget(meshes, [], self.attribute, _as_read(objects, meshes))

    def _with_copies(
        self, depsgraph: Any, names: list[str] | None, progress: Progress, warnings: list[str]
    ) -> "VertexTarget":
        shown = shown_meshes(depsgraph)
        copied = set(copyable(shown, names, Warnings(warnings)))

        def check(obj: Any, graph: Any) -> None:
            check_copied(obj, graph) if obj in copied else check_target(obj, graph)

        candidates = [obj for obj in shown if obj in copied or obj.type == "MESH"]
        objects = bake_objects(depsgraph, names, warnings, check, candidates)
        own = [obj for obj in objects if obj not in copied]
        self._check(own)
        replaceable = [obj for obj in own if obj in shown and shown[obj].all_meshes and obj.is_editable]
        others = [obj for obj in own if obj not in replaceable]
        flawed: list[Any] = []
        meshes = receiver_meshes(replaceable, depsgraph, warnings, names is not None, flawed, progress)
        meshes += receiver_meshes(others, depsgraph, warnings, names is not None, progress=progress)
        owners = [obj for obj in objects if obj in copied or obj in flawed]
        copies = read_copies(owners, depsgraph, Warnings(warnings), names is not None)
        return VertexTarget(meshes, copies, self.attribute, _as_read([*replaceable, *others], meshes))


def _as_read(objects: list[Any], meshes: list[ReceiverMesh]) -> list[AsRead]:
    """The objects of meshes, most of which are among `objects`."""
    by_name = {obj.name: obj for obj in objects}
    return [AsRead.of(by_name.get(mesh.object_name) or bpy.data.objects[mesh.object_name]) for mesh in meshes]


@dataclass(frozen=True)
class VertexTarget:
    """Meshes whose vertices or corners get light, those that get copies with it, the name of the attribute, and the
    objects of the meshes.
    """

    meshes: list[ReceiverMesh]
    copies: list[CopyMesh]
    attribute: str
    meanwhile: list[AsRead]

    @property
    def object_names(self) -> list[str]:
        return [*(mesh.object_name for mesh in self.meshes), *dict.fromkeys(copy.owner for copy in self.copies)]

    @property
    def sizes(self) -> dict[Path, int]:
        """See `Target.sizes`: none."""
        return {}

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
    """Light of vertices, and that of light groups apart."""

    receivers: Receivers
    irradiance: "Irradiance"
    target: VertexTarget
    apart: "Mapping[str, VertexLight]" = field(default_factory=dict)

    @staticmethod
    def together(apart: "Mapping[str, VertexLight]") -> "VertexLight":
        """See `Product.together`."""
        from ..addon.gather import Irradiance

        parts = list(apart.values())
        return replace(parts[0], irradiance=Irradiance.together([one.irradiance for one in parts]), apart=apart)

    @property
    def files(self) -> list[Path]:
        return []

    @property
    def counts(self) -> dict[str, int]:
        return {"baked_copies": len(self.target.copies)} if self.target.copies else {}

    def concerns(self) -> list[str]:
        """See `Product.concerns`."""
        own = replace(self.receivers, targets=self.receivers.targets[: len(self.target.meshes)])
        return light_takers(own, self.target.attribute, self.target.meanwhile)[1]

    def write(self) -> Written:
        """See `Product.write`."""
        target = self.target
        at = self.receivers, target.copies, target.attribute, target.meanwhile
        apart = {attribute_of(target.attribute, name): light.irradiance.value for name, light in self.apart.items()}
        warnings = write_light(self.irradiance.value, *at, apart)
        return Written(
            places=[f"{target.attribute} on {counted(len(target.object_names), 'object')}"], warnings=warnings
        )


def too_coarse(receivers: Receivers) -> list[str]:
    """Warnings of objects with faces wider than all the rest: light within such a face is not seen by its vertices."""
    from ..addon.photons import region_of

    if len(receivers) == 0:
        return []
    widest = region_of(receivers.position).radius
    return [
        Advice(f"Object '{target.object_name}' has too few vertices for its size to show light: subdivide it.")
        for target in receivers.targets
        if (receivers.footprint[target.receiver_of_element[target.receiver_of_element >= 0]] > widest).any()
    ]
