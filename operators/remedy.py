"""Check, Select, and the remedies: what the panel's findings can be asked for."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import bmesh
import bpy

from ..addon.core.findings import Finding, grouped
from ..addon.ui.checks import checks
from ..addon.ui.remedies import REMEDIES
from ..addon.ui.state import bake_state

_SOURCE = bpy.props.EnumProperty(
    items=[("check", "Check", "What the check found"), ("outcome", "Outcome", "What the last bake warned of")],
    options={"HIDDEN", "SKIP_SAVE"},
)
_INDEX = bpy.props.IntProperty(options={"HIDDEN", "SKIP_SAVE"})


class PHOTON_BAKE_OT_check(bpy.types.Operator):
    """Find out which objects will get light, which will not and why, and how long it may take"""

    bl_idname = "photon_bake.check"
    bl_label = "Check the Scene"

    def execute(self, context: Any) -> set[str]:
        made = checks.make(context.scene, context.view_layer)
        self.report({"INFO"}, f"{made.preflight.line or 'Checked'}: {made.estimate.line}.")
        return {"FINISHED"}


class PHOTON_BAKE_OT_select_found(bpy.types.Operator):
    """Select these objects alone"""

    bl_idname = "photon_bake.select_found"
    bl_label = "Select"
    bl_options = {"INTERNAL", "UNDO"}

    __annotations__ = {"source": _SOURCE, "index": _INDEX}

    def execute(self, context: Any) -> set[str]:
        _select(context, _objects(context, _finding(context, self.source, self.index)))
        return {"FINISHED"}


class PHOTON_BAKE_OT_remedy(bpy.types.Operator):
    """Do something about it"""

    bl_idname = "photon_bake.remedy"
    bl_label = "Remedy"
    bl_options = {"INTERNAL", "UNDO"}

    __annotations__ = {
        "remedy": bpy.props.StringProperty(options={"HIDDEN", "SKIP_SAVE"}),
        "source": _SOURCE,
        "index": bpy.props.IntProperty(default=-1, options={"HIDDEN", "SKIP_SAVE"}),
    }

    @classmethod
    def description(cls, context: Any, properties: Any) -> str:
        return REMEDIES[properties.remedy][1]

    @classmethod
    def poll(cls, context: Any) -> bool:
        return not bake_state.running

    def execute(self, context: Any) -> set[str]:
        finding = _finding(context, self.source, self.index) if self.index >= 0 else None
        objects = _objects(context, finding) if finding else []
        _DO[self.remedy](context, objects)
        checks.changed(context.scene)
        return {"FINISHED"}


def _finding(context: Any, source: str, index: int) -> Finding | None:
    """A finding by its number, as the panel drew them; None where there are others now."""
    found: list[Finding] = []
    if source == "check":
        last = checks.of(context.scene)
        found = list(last.preflight.findings) if last else []
    else:
        outcome = bake_state.outcome_of(context.scene.session_uid)
        found = grouped(outcome.warnings) if outcome else []
    return found[index] if index < len(found) else None


def _objects(context: Any, finding: Finding | None) -> "list[bpy.types.Object]":
    """The objects of a finding; a name may be that of a mesh, and means its objects."""
    if finding is None:
        return []
    names = set(finding.names)
    return [
        obj
        for obj in context.view_layer.objects
        if obj is not None and (obj.name in names or (obj.type == "MESH" and obj.data.name in names))
    ]


def _select(context: Any, objects: "list[bpy.types.Object]") -> None:
    for obj in context.view_layer.objects:
        obj.select_set(obj in objects)
    if objects:
        context.view_layer.objects.active = objects[0]


@contextmanager
def _selected(context: Any, objects: "list[bpy.types.Object]") -> Iterator[None]:
    """Objects as operators want them that work on what is selected."""
    if context.object is not None and context.object.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")
    before, active = list(context.selected_objects), context.view_layer.objects.active
    _select(context, objects)
    try:
        yield
    finally:
        _select(context, before)
        context.view_layer.objects.active = active


def _set(**values: Any) -> Callable[[Any, Any], None]:
    """Sets the panel's own settings."""

    def do(context: Any, objects: Any) -> None:
        for name, value in values.items():
            setattr(context.scene.photon_bake, name, value)

    return do


def _make_single_user(context: Any, objects: "list[bpy.types.Object]") -> None:
    with _selected(context, objects):
        bpy.ops.object.make_single_user(object=False, obdata=True)


def _convert(context: Any, objects: "list[bpy.types.Object]") -> None:
    with _selected(context, objects):
        bpy.ops.object.convert(target="MESH")


def _make_local(context: Any, objects: "list[bpy.types.Object]") -> None:
    with _selected(context, objects):
        bpy.ops.object.make_local(type="SELECT_OBDATA")


def _flip_normals(context: Any, objects: "list[bpy.types.Object]") -> None:
    for mesh in {obj.data for obj in objects if obj.type == "MESH"}:
        mesh.flip_normals()
        mesh.update()


def _recalculate_outside(context: Any, objects: "list[bpy.types.Object]") -> None:
    for mesh in {obj.data for obj in objects if obj.type == "MESH"}:
        faces = bmesh.new()
        faces.from_mesh(mesh)
        bmesh.ops.recalc_face_normals(faces, faces=list(faces.faces))
        faces.to_mesh(mesh)
        faces.free()
        mesh.update()


def _refine(context: Any, objects: "list[bpy.types.Object]") -> None:
    bpy.ops.photon_bake.refine("INVOKE_DEFAULT", objects=[{"name": obj.name} for obj in objects])


def _make_uv_map(context: Any, objects: Any) -> None:
    context.scene.photon_bake.lightmap.uv_map = ""


def _double_max_size(context: Any, objects: Any) -> None:
    context.scene.photon_bake.lightmap.max_size *= 2


def _show_in_renders(context: Any, objects: "list[bpy.types.Object]") -> None:
    for obj in objects:
        obj.hide_render = False
        for collection in obj.users_collection:
            collection.hide_render = False


def _add_light(context: Any, objects: Any) -> None:
    light = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    light.location, light.rotation_euler, light.data.energy = (0, 0, 5), (0.6, 0.2, 0.0), 3.0
    context.collection.objects.link(light)


def _add_camera(context: Any, objects: Any) -> None:
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    view = getattr(context, "region_data", None)
    if view is not None:
        camera.matrix_world = view.view_matrix.inverted()
    context.collection.objects.link(camera)
    context.scene.camera = camera


def _add_material(context: Any, objects: "list[bpy.types.Object]") -> None:
    material = bpy.data.materials.new("White")
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True
    for obj in objects:
        if obj.material_slots:
            obj.material_slots[0].material = material
        else:
            obj.data.materials.append(material)


def _find_missing(context: Any, objects: Any) -> None:
    bpy.ops.file.find_missing_files("INVOKE_DEFAULT")


def _bake(context: Any, objects: Any) -> None:
    bpy.ops.photon_bake.bake_indirect("INVOKE_DEFAULT")


def _raise_quality(context: Any, objects: Any) -> None:
    properties = context.scene.photon_bake
    properties.quality = {"draft": "medium"}.get(properties.quality, "high")


_DO: dict[str, Callable[[Any, Any], None]] = {
    "bake_copies": _set(bake_copies=True),
    "single_user": _make_single_user,
    "convert": _convert,
    "make_local": _make_local,
    "flip_normals": _flip_normals,
    "recalculate_outside": _recalculate_outside,
    "open_side": _set(open_side=True),
    "refine": _refine,
    "to_lightmaps": _set(targets={"lightmap"}),
    "make_uv_map": _make_uv_map,
    "max_size": _double_max_size,
    "show_in_renders": _show_in_renders,
    "selected_off": _set(selected_only=False),
    "final_gather": _set(gather="final"),
    "all_lights": _set(light_group=""),
    "add_light": _add_light,
    "add_camera": _add_camera,
    "add_material": _add_material,
    "find_missing": _find_missing,
    "bake": _bake,
    "quality": _raise_quality,
    "noise": _set(gather="final", noise=0.05),
}
"""What each of `REMEDIES` does."""
