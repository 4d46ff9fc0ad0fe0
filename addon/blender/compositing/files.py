"""Which files are a scene's own pass: another project may write to the same folder."""

from pathlib import Path
from typing import Any

import bpy

from ...core.errors import BakeError
from ...output import file_name
from ...output.camera import frame_path, origin_of
from ..paths import from_blend_file

_BAKED = "photon_bake_pass"
"""Custom property of a scene: where its last pass went to, and which file and scene that says it is of."""

_UNSAVED = "(unsaved)"


def blend_name() -> str:
    """The name of the open file, for a header; in parentheses that it was never saved."""
    return Path(bpy.data.filepath).name or _UNSAVED


def own_name(pattern: str, scene: Any) -> str:
    """The name that files of a scene's pass get, ``{file}`` and ``{scene}`` in it replaced; # is a frame's digit."""
    names = {"{file}": Path(bpy.data.filepath).stem or "untitled", "{scene}": scene.name}
    for placeholder, name in names.items():
        pattern = pattern.replace(placeholder, file_name(name).replace("#", "_"))
    return pattern


def remember_pass(scene: Any, folder: Path, name: str) -> None:
    """Keep in a scene where its pass was written."""
    scene[_BAKED] = {"folder": from_blend_file(folder), "name": name, "file": blend_name(), "scene": scene.name}


def has_pass(scene: Any) -> bool:
    """Whether a scene knows where its pass was written."""
    return _BAKED in scene


def pass_files(scene: Any, folder: Path | None, pattern: str) -> list[Path]:
    """The files of a scene's own pass: those of its frames from the first on, or the current one's.

    They are looked for where the panel says, and else where the last bake wrote them.

    Parameters
    ----------
    folder : Path or None
        None: the panel's is beside a file that was never saved.

    Raises
    ------
    BakeError
        If there are none, or they are of another scene or file.
    """
    places = [] if folder is None else [(folder, own_name(pattern, scene))]
    if _BAKED in scene:
        places.append((Path(bpy.path.abspath(scene[_BAKED]["folder"])), scene[_BAKED]["name"]))
    complaints = []
    for place in places:
        paths = _of_frames(*place, scene)
        complaint = next(filter(None, (_complaint(path, scene) for path in paths)), "")
        if not complaint:
            return paths
        complaints.append(complaint)
    raise BakeError(complaints[0] if complaints else "This scene has no camera's pass yet: bake it first.")


def _of_frames(folder: Path, name: str, scene: Any) -> list[Path]:
    paths = [frame_path(folder, name, frame) for frame in range(scene.frame_start, scene.frame_end + 1)]
    there = [path for path in paths if path.is_file()]
    return there if len(there) > 1 else [frame_path(folder, name, scene.frame_current)]


def _complaint(path: Path, scene: Any) -> str:
    """Why a file is not the scene's own pass; empty where it is."""
    if not path.is_file():
        return f"{path} is not there: bake the camera's pass first."
    origin = origin_of(path)
    if origin is None:
        return f"{path} is no camera's pass that says which file it is of: bake the camera's pass again."
    own = [(blend_name(), scene.name)] if bpy.data.filepath else []
    if _BAKED in scene:
        own.append((scene[_BAKED]["file"], scene[_BAKED]["scene"]))
    if origin in own:
        return ""
    file, of_scene = origin
    return (
        f"{path} is the pass of scene '{of_scene}' of {'a file that was never saved' if file == _UNSAVED else file}: "
        "bake this scene's own, or choose the Folder that has it."
    )
