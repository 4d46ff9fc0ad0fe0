"""Meshes that are refined until a draft's light is linear between their vertices, as a target of a bake."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import bpy
import numpy as np

from ...addon.blender import bake_objects, receiver_meshes
from ...addon.blender.overrides import keeps_its_mesh
from ...addon.blender.read.as_read import AsRead, still_there
from ...addon.blender.refinement import REFINES_OTHERWISE, check_refinable, placed, split_meshes
from ...addon.core.errors import BakeError
from ...addon.core.parallel import Workers
from ...addon.core.progress import Progress
from ...addon.pipeline.refinement import Placed, Refinement, RefineOptions, refine
from ...addon.receivers import Receivers, vertex_receivers
from ...addon.scene import Scene
from ...addon.tracing import EmbreeTracer
from ..jobs.written import Written

if TYPE_CHECKING:
    from ...addon.gather import Irradiance
    from ...addon.pipeline.solution import Solution


@dataclass(frozen=True)
class RefineRequest:
    """Meshes are to be refined.

    Attributes
    ----------
    options : RefineOptions
    on_copy : bool
        Whether copies take the meshes' places in their objects.
    """

    options: RefineOptions
    on_copy: bool = False

    def read(
        self, depsgraph: Any, scene: Any, names: list[str] | None, progress: Progress, warnings: list[str]
    ) -> "RefineTarget":
        """See `Request.read`."""
        kept = {obj.data for obj in bpy.data.objects if obj.type == "MESH" and keeps_its_mesh(obj)}

        def check(obj: Any, graph: Any) -> None:
            if obj.data in kept:
                raise BakeError(f"Object '{obj.name}' keeps its mesh by its own setting: Object > Refine: As Asked.")
            check_refinable(obj, graph)

        objects = bake_objects(depsgraph, names, warnings, check)
        meshes = {mesh.object_name: mesh for mesh in receiver_meshes(objects, depsgraph, None, False, None, progress)}
        ready, read = [], []
        for obj in objects:
            mesh = meshes.get(obj.name)
            if mesh is not None and mesh.map is None:
                ready.append(obj)
                read.append(placed(obj, mesh)[0])
            elif names is not None:
                raise BakeError(
                    f"Object '{obj.name}': its modifiers make another mesh of its own: {REFINES_OTHERWISE}."
                )
        if not read:
            raise BakeError("Nothing to refine: the modifiers of all objects make other meshes of their own.")
        vertices = vertex_receivers([meshes[obj.name] for obj in ready])
        return RefineTarget(read, vertices, [AsRead.of(obj) for obj in ready], self)


@dataclass(frozen=True)
class RefineTarget:
    """Meshes to refine, the receivers at their vertices, and their objects."""

    meshes: list[Placed]
    vertices: Receivers
    meanwhile: list[AsRead]
    request: RefineRequest

    @property
    def object_names(self) -> list[str]:
        return [mesh.object_name for mesh in self.meshes]

    @property
    def sizes(self) -> dict[Path, int]:
        """See `Target.sizes`: none."""
        return {}

    def samples(self, scene: Scene, tracer: EmbreeTracer, workers: Workers, warnings: list[str]) -> "RefineSamples":
        """See `Target.samples`."""
        return RefineSamples(self.vertices, self)


@dataclass(frozen=True)
class RefineSamples:
    """Receivers at the vertices of meshes as they are."""

    receivers: Receivers
    target: RefineTarget
    solution: "Solution | None" = None

    def lit_by(self, solution: "Solution", workers: Workers) -> "RefineSamples":
        """See `Samples.lit_by`: keeps the solution, to gather more of it."""
        return RefineSamples(self.receivers, self.target, solution)

    def kept(self) -> Any:
        """See `Samples.kept`: meshes are refined at once."""
        raise NotImplementedError

    def with_kept(self, kept: Any) -> "RefineSamples":
        """See `Samples.with_kept`."""
        raise NotImplementedError

    @staticmethod
    def over_time(shots: "Sequence[tuple[RefineSamples, Irradiance]]") -> "tuple[RefineSamples, Irradiance]":
        """See `Samples.over_time`: meshes are refined for one time."""
        raise NotImplementedError

    def finish(self, irradiance: "Irradiance", workers: Workers) -> "Refined":
        """See `Samples.finish`."""
        solution, target = self.solution, self.target
        assert solution is not None  # there are objects

        def light(receivers: Receivers) -> tuple[np.ndarray, np.ndarray]:
            found = solution.gather(receivers)
            return found.value, found.stderr

        options = target.request.options
        return Refined(refine(target.meshes, light, options, workers.seed, workers.progress), target, workers.progress)


@dataclass(frozen=True)
class Refined:
    """Splits of meshes, ready to be carried out."""

    refinement: Refinement
    target: RefineTarget
    progress: Progress

    def of_target(self, target: RefineTarget) -> "Refined":
        """See `Output.of_target`."""
        return replace(self, target=target)

    @staticmethod
    def together(apart: "Mapping[str, Refined]") -> "Refined":
        """See `Output.together`: meshes are refined for all light."""
        raise NotImplementedError

    @property
    def files(self) -> list[Path]:
        return []

    @property
    def counts(self) -> dict[str, int]:
        meshes = sum(len(ends) > 0 for ends in self.refinement.ends.values())
        return {"refined_meshes": meshes, "added_vertices": self.refinement.n_vertices}

    def concerns(self) -> list[str]:
        """See `Output.concerns`."""
        return still_there(self.target.meanwhile)[1]

    def write(self) -> Written:
        """See `Output.write`."""
        objects, warnings = still_there(self.target.meanwhile)
        meshes: dict[str, bpy.types.Mesh] = {}
        for mesh, obj in zip(self.target.meshes, objects, strict=True):
            if obj is not None:
                meshes.setdefault(mesh.mesh_name, obj.data)
        if not meshes:
            raise BakeError(warnings[0])
        split_meshes(meshes, self.refinement, self.target.request.on_copy, self.progress)
        return Written(warnings=warnings)
