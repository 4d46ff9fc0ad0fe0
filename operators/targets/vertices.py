"""Light at vertices, as a colour attribute."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import bpy
import numpy as np

from ...addon.blender import bake_objects, check_color_attribute, receiver_meshes
from ...addon.blender.read.as_read import AsRead
from ...addon.blender.read.lamps.light_layers import attribute_of
from ...addon.blender.read.meshes.shown_meshes import (
    CopyMesh,
    check_copied,
    copyable,
    read_copies,
    shown_meshes,
    warn_of_shared_light,
)
from ...addon.blender.read.meshes.vertex_meshes import check_target
from ...addon.blender.refinement import WideFaces
from ...addon.blender.warn import Warnings
from ...addon.blender.write.baked_copies import write_light
from ...addon.blender.write.color_attribute import light_takers
from ...addon.core.errors import TooCoarse
from ...addon.core.findings import counted
from ...addon.core.parallel import Workers
from ...addon.core.progress import Progress
from ...addon.receivers import ReceiverMesh, Receivers, Ride, ShownFaces, face_samples, vertex_receivers
from ...addon.scene import Scene
from ...addon.tracing import EmbreeTracer
from ..jobs.written import Written

if TYPE_CHECKING:
    from ...addon.gather import Irradiance
    from ...addon.output.vertex_light import VertexSamples
    from ...addon.pipeline.refinement import WidePoints
    from ...addon.pipeline.solution import Solution

_LEAST_EXTENT = 1e-3  # m, of the vertices: those that lie very far away, or in one place, have none


@dataclass(frozen=True)
class VertexRequest:
    """Light is wanted in a colour attribute.

    Attributes
    ----------
    attribute : str
    copies : bool
        Whether objects whose mesh cannot hold their light get copies with meshes of their own.
    groups : tuple of str
        Light groups that may get attributes of their own; empty where all light is baked together.
    fit : bool
        Whether values are those that show the light over the faces best, or the light at the vertices themselves.
    denoise : bool
        Whether noise is taken out.
    """

    attribute: str = "Indirect"
    copies: bool = False
    groups: tuple[str, ...] = ()
    fit: bool = True
    denoise: bool = True

    def read(
        self, depsgraph: Any, scene: Any, names: list[str] | None, progress: Progress, warnings: list[str]
    ) -> "VertexTarget":
        """See `Request.read`."""
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
        read, wide = _as_read(objects, meshes), WideFaces.of(objects, meshes, depsgraph)
        return VertexTarget(meshes, [], self.attribute, read, wide, self.fit, self.denoise)

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
        wide, meanwhile = WideFaces.of(own, meshes, depsgraph), _as_read([*replaceable, *others], meshes)
        return VertexTarget(meshes, copies, self.attribute, meanwhile, wide, self.fit, self.denoise)


def _as_read(objects: list[Any], meshes: list[ReceiverMesh]) -> list[AsRead]:
    """The objects of meshes, most of which are among `objects`."""
    by_name = {obj.name: obj for obj in objects}
    return [AsRead.of(by_name.get(mesh.object_name) or bpy.data.objects[mesh.object_name]) for mesh in meshes]


@dataclass(frozen=True)
class VertexTarget:
    """Meshes whose vertices or corners get light, those that get copies with it, the name of the attribute, the objects
    of the meshes, the widest faces of them, and whether light is fitted to faces and denoised.
    """

    meshes: list[ReceiverMesh]
    copies: list[CopyMesh]
    attribute: str
    meanwhile: list[AsRead]
    wide: WideFaces
    fit: bool = True
    denoise: bool = True

    @property
    def object_names(self) -> list[str]:
        return [*(mesh.object_name for mesh in self.meshes), *dict.fromkeys(copy.owner for copy in self.copies)]

    @property
    def sizes(self) -> dict[Path, int]:
        """See `Target.sizes`: none."""
        return {}

    def samples(self, scene: Scene, tracer: EmbreeTracer, workers: Workers, warnings: list[str]) -> "AttributeSamples":
        """See `Target.samples`."""
        meshes = [*self.meshes, *(copy.mesh for copy in self.copies)]
        vertices = vertex_receivers(meshes, all_shown=self.fit)
        faces = ShownFaces.of(meshes, vertices.targets)
        if not self.fit or not len(faces):
            return AttributeSamples(vertices, vertices, None, self, tracer, warnings)
        return AttributeSamples.fitted(vertices, faces, self, tracer, workers, warnings)

    def without_noise(
        self, light: "Irradiance", receivers: Receivers, tracer: EmbreeTracer, workers: Workers
    ) -> "Irradiance":
        """Light of vertices that are not fitted, denoised if that is asked for."""
        from ...addon.emitters import region_of
        from ...addon.output.vertex_light import denoised

        if not self.denoise or len(receivers) == 0:
            return light
        extent = max(2 * region_of(receivers.position).radius, _LEAST_EXTENT)
        return denoised(light, receivers, np.ones(len(receivers), bool), extent, tracer, workers)


@dataclass(frozen=True)
class AttributeSamples:
    """Receivers at vertices, and of light that is fitted to faces, samples of these after them.

    Attributes
    ----------
    receivers, vertices : Receivers
        All, and those at vertices.
    samples : VertexSamples or None
    target : VertexTarget
    tracer : EmbreeTracer
    """

    receivers: Receivers
    vertices: Receivers
    samples: "VertexSamples | None"
    target: VertexTarget
    tracer: EmbreeTracer
    warnings: list[str]
    beside: "WidePoints | None" = None

    @staticmethod
    def fitted(
        vertices: Receivers,
        faces: ShownFaces,
        target: VertexTarget,
        tracer: EmbreeTracer,
        workers: Workers,
        warnings: list[str],
    ) -> "AttributeSamples":
        """Of vertices, with samples of the faces between them."""
        from ...addon.emitters import region_of
        from ...addon.output.vertex_light import VertexSamples

        extent = max(2 * region_of(vertices.position).radius, _LEAST_EXTENT)
        samples, hidden = face_samples(faces, vertices, extent, tracer, workers)
        receivers = Receivers.join([vertices, samples.receivers(faces, vertices.targets)])
        names = [one.object_name for one in vertices.targets]
        sampled = VertexSamples(faces, samples, hidden, names, receivers, extent)
        return AttributeSamples(receivers, vertices, sampled, target, tracer, warnings)

    def riding(self, ride: Ride) -> "AttributeSamples":
        """The same at another time."""
        return replace(self, receivers=ride.receivers)

    def lit_by(self, solution: "Solution", workers: Workers) -> "AttributeSamples":
        """See `Samples.lit_by`: by points between vertices, unless samples of the faces tell of these."""
        return self if self.samples else replace(self, beside=self.target.wide.lit_by(solution, workers.seed))

    @staticmethod
    def over_time(
        shots: "Sequence[tuple[AttributeSamples, Irradiance]]",
    ) -> "tuple[AttributeSamples, Irradiance]":
        """See `Samples.over_time`: the mean light of each receiver."""
        from ...addon.gather import Irradiance

        return shots[0][0], Irradiance.mean([light for _, light in shots])

    def finish(self, irradiance: "Irradiance", workers: Workers) -> "VertexLight":
        """See `Samples.finish`."""
        from ...addon.output.vertex_light import finish_vertices

        tracer = self.tracer if self.target.denoise else None
        if self.samples is None:
            light = self.target.without_noise(irradiance, self.vertices, self.tracer, workers)
            names = self.target.wide.coarse(self.beside, self.vertices, light)
            made = VertexLight(self.vertices, light, self.target)
        else:
            finished = finish_vertices(irradiance, self.samples, workers, tracer)
            names, n_samples = too_coarse(finished.residuals), len(self.samples.samples)
            made = VertexLight(self.vertices, finished.irradiance, self.target, finished.residuals, n_samples)
        if names:
            self.warnings.append(TooCoarse(names))
        return made


@dataclass(frozen=True)
class VertexLight:
    """Light of vertices, and that of light groups apart.

    Attributes
    ----------
    face_residuals : dict of str to float
        Of each object that light was fitted to: how far it is from linear between the vertices, root mean square over
        the faces as a share of its mean. Where that is much, the mesh is too coarse to show its light.
    n_samples : int
        Of faces.
    apart : dict of str to VertexLight
        Of each light group.
    """

    receivers: Receivers
    irradiance: "Irradiance"
    target: VertexTarget
    face_residuals: dict[str, float] = field(default_factory=dict)
    n_samples: int = 0
    apart: "Mapping[str, VertexLight]" = field(default_factory=dict)

    def of_target(self, target: VertexTarget) -> "VertexLight":
        """See `Output.of_target`."""
        return replace(self, target=target)

    @staticmethod
    def together(apart: "Mapping[str, VertexLight]") -> "VertexLight":
        """See `Output.together`."""
        from ...addon.gather import Irradiance

        parts = list(apart.values())
        return replace(parts[0], irradiance=Irradiance.together([one.irradiance for one in parts]), apart=apart)

    @property
    def files(self) -> list[Path]:
        return []

    @property
    def counts(self) -> dict[str, int]:
        counts = {"baked_copies": len(self.target.copies), "face_samples": self.n_samples}
        return {name: n for name, n in counts.items() if n}

    def concerns(self) -> list[str]:
        """See `Output.concerns`."""
        own = replace(self.receivers, targets=self.receivers.targets[: len(self.target.meshes)])
        return light_takers(own, self.target.attribute, self.target.meanwhile)[1]

    def write(self) -> Written:
        """See `Output.write`."""
        target = self.target
        at = self.receivers, target.copies, target.attribute, target.meanwhile
        apart = {attribute_of(target.attribute, name): light.irradiance.value for name, light in self.apart.items()}
        warnings = write_light(self.irradiance.value, *at, apart)
        places = [f"{target.attribute} on {counted(len(target.object_names), 'object')}"]
        return Written(places=places, warnings=warnings)


def too_coarse(residuals: "Mapping[str, float]") -> list[str]:
    """Names of objects whose light is not linear between their vertices, those of the largest residuals first."""
    from ...addon.pipeline.refinement import COARSE

    return sorted(
        (name for name, residual in residuals.items() if residual > COARSE), key=lambda name: -residuals[name]
    )
