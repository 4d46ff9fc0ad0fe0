"""Refine: meshes get the vertices that their light needs, from the panel and from scripts."""

from typing import Any

import bpy

from ..addon.blender.refinement import has_refined_copies, restore_meshes
from ..addon.pipeline.refinement import RefineOptions
from ..addon.settings.bake import BakeSettings, settings_for
from ..addon.ui.outcomes import Outcome
from ..addon.ui.state import bake_state, duration
from ..addon.ui.views.debug_views import debug_views
from .jobs.bake_job import BakeJob
from .jobs.solving import NotWhileBaking, Solver, Solving
from .targets.refine import RefineRequest

_DEFAULTS = RefineOptions()


class PhotonBakeObjectName(bpy.types.PropertyGroup):
    """The name of an object: its own property ``name`` is all it needs."""


class PHOTON_BAKE_OT_refine(Solving, bpy.types.Operator):
    """Split the edges of faces whose light is not linear between their vertices, as a draft bake finds it"""

    bl_idname = "photon_bake.refine"
    bl_label = "Refine Meshes"
    bl_options = {"UNDO"}

    __annotations__ = {
        "objects": bpy.props.CollectionProperty(
            name="Objects",
            description="Names of the objects; without any, the selected ones, or where none is selected all",
            type=PhotonBakeObjectName,
            options={"HIDDEN", "SKIP_SAVE"},
        ),
        "tolerance": bpy.props.FloatProperty(
            name="Tolerance",
            description="Mean error of light within a face that is left, as a share of the light",
            default=_DEFAULTS.tolerance,
            min=1e-4,
            max=1,
            precision=3,
        ),
        "budget": bpy.props.IntProperty(
            name="Budget",
            description="Vertices that are added at most, in all meshes together",
            default=_DEFAULTS.budget,
            min=1,
            max=10_000_000,
        ),
        "on_copy": bpy.props.BoolProperty(
            name="On a Copy",
            description="Give the objects refined copies of their meshes; Restore Meshes gives the meshes back",
            default=False,
        ),
    }

    def _prepare(self, context: Any) -> None:
        properties = context.scene.photon_bake
        progress = bake_state.start("final", ["refine"], context.scene.session_uid)
        names = [one.name for one in self.objects] or None
        if names is None:
            names = [obj.name for obj in context.selected_objects if obj.type == "MESH"] or None
        request = RefineRequest(RefineOptions(self.tolerance, self.budget), self.on_copy)
        self._job = BakeJob.prepare(context, [request], progress, names, properties.light_group)
        self._solver = Solver(self._job, draft_of(properties.settings()), progress, debug_views.start())

    def _finish(self) -> set[str]:
        job, solved = self._job, self._solver.solved()
        assert job is not None  # as it was solved
        job.write(solved, self._solver.progress)
        result = f"{said(solved.counts)} in {duration(bake_state.seconds)}"
        bake_state.stop(Outcome(result=f"{result}: bake anew.", warnings=job.warnings))
        for warning in job.warnings:
            self.report({"WARNING"}, warning)
        self.report({"INFO"}, f"{result}.")
        return {"FINISHED"}


def draft_of(settings: BakeSettings) -> BakeSettings:
    """A draft with what of other settings has to do with which light there is.

    Its rays are Medium's: light that is noisier misleads where edges are split.
    """
    kept = ("max_bounces", "memory", "add_direct", "open_side", "normal_maps", "seed", "n_threads")
    rays = {"n_gather_rays": BakeSettings.n_gather_rays, "gather_share": 1.0}
    return settings_for("draft", **rays, **{name: getattr(settings, name) for name in kept})


def said(counts: dict[str, int]) -> str:
    """What was refined, as people say it."""
    meshes, vertices = counts["refined_meshes"], counts["added_vertices"]
    if not meshes:
        return "All meshes are fine enough"
    return f"Refined {meshes} mesh{'es' if meshes != 1 else ''} by {vertices:,} vertices"


class PHOTON_BAKE_OT_restore_meshes(NotWhileBaking, bpy.types.Operator):
    """Give objects the meshes back that refined copies stand for"""

    bl_idname = "photon_bake.restore_meshes"
    bl_label = "Restore Meshes"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def _lacking(cls, context: Any) -> str:
        return "" if has_refined_copies() else "No object has a refined copy of its mesh"

    def execute(self, context: Any) -> set[str]:
        self.report({"INFO"}, f"Restored the meshes of {restore_meshes()} objects.")
        return {"FINISHED"}
