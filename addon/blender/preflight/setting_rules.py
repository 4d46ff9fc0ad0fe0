"""What settings keep a bake from beginning."""

from collections.abc import Callable

from ...core.zips import missing_library
from ...pipeline.warm_up import compiler
from .asked import Asked
from .found import Found, of_bake


def _libraries(asked: Asked) -> list[Found]:
    complaint = missing_library() or compiler.complaint
    return of_bake("A library is missing", complaint) if complaint else []


def _targets(asked: Asked) -> list[Found]:
    if asked.targets:
        return []
    return of_bake("Nothing to bake to", "Choose above what to bake to.")


def _selection(asked: Asked) -> list[Found]:
    if not asked.selected_only or not asked.targets & {"vertex", "lightmap"} or asked.meshes:
        return []
    if asked.copies and asked.chosen:
        return []
    return of_bake("No mesh is selected", "Select some, or turn Selected Only off.", "selected_off")


def _meshes(asked: Asked) -> list[Found]:
    if asked.selected_only or asked.meshes or (asked.copies and asked.chosen) or not asked.targets:
        return []
    if not asked.targets & {"vertex", "lightmap"}:
        return of_bake("No mesh is there", "There is no surface that light could bounce off.", blocks=False)
    return of_bake("No mesh is there", "The scene has no mesh object that renders show.")


def _camera(asked: Asked) -> list[Found]:
    if "camera" not in asked.targets or asked.scene.camera is not None:
        return []
    return of_bake("No camera", "The scene has no camera whose picture could be lit.", "add_camera")


def _gather(asked: Asked) -> list[Found]:
    if asked.settings.gather != "photon_volumes" or asked.targets <= {"camera"}:
        return []
    why = "Photon volumes light a camera's pixels, and neither vertices nor texels."
    return of_bake("Gather is for Camera alone", why, "final_gather")


def _light_group(asked: Asked) -> list[Found]:
    if not asked.light_group or asked.light_group in asked.view_layer.lightgroups:
        return []
    why = f"The view layer has no light group '{asked.light_group}', whose light is to be baked."
    return of_bake("No such light group", why, "all_lights")


RULES: tuple[Callable[[Asked], list[Found]], ...] = (
    _libraries,
    _targets,
    _selection,
    _meshes,
    _camera,
    _gather,
    _light_group,
)
